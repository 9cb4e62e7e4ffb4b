//! Surfaces in volumes: the shapes that are searched for failures.

use dibs_build::{Builder, BuiltTree, Mesh, Volume, generate};
use fastrand::Rng;
use glam::{DMat3, DVec3, Vec3};

use crate::surfaces::{ball, cuboid, joined, moved, sheet, slivers};

/// A surface in a volume, and its tree.
pub struct Carried {
    /// Its name.
    pub name: &'static str,
    /// The mesh at rest.
    pub mesh: Mesh,
    /// The volume.
    pub volume: Volume,
    /// Its tree.
    pub built: BuiltTree,
    /// The limit on the stretch of each of the volume's tetrahedra.
    pub limits: Vec<f32>,
}

impl Carried {
    /// With one limit for all tetrahedra.
    fn new(name: &'static str, mesh: Mesh, volume: Volume, stretch: f32) -> Self {
        let built = Builder::new().stretch(stretch).nodes(&volume).build(&mesh);
        let built = built.unwrap_or_else(|error| panic!("{name}: {error}"));
        let limit = built.tree::<u16>().expect("16-bit indices").stretch();
        let limits = vec![limit; volume.tetrahedra().len()];
        Self { name, mesh, volume, built, limits }
    }

    /// With a random limit for each tetrahedron.
    fn with_limits(name: &'static str, mesh: Mesh, volume: Volume, rng: &mut Rng) -> Self {
        let limit = |_| 1.05 + rng.f32() * rng.f32();
        let limits: Vec<f32> = (0..volume.tetrahedra().len()).map(limit).collect();
        let built = Builder::new().limits(limits.clone()).nodes(&volume).build(&mesh);
        let built = built.unwrap_or_else(|error| panic!("{name}: {error}"));
        Self { name, mesh, volume, built, limits }
    }
}

/// Hearts and brains in lattices, in volumes that are not boxes, and partly outside; needles, flat elements, a rolled
/// sheet, several surfaces, a surface on a volume's border, and vertices on faces, edges and nodes of tetrahedra.
///
/// # Panics
/// Never: the sizes are valid.
#[must_use]
pub fn all(rng: &mut Rng) -> Vec<Carried> {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let brain = generate::brain(500).expect("a valid size");
    let lattice = |mesh: &Mesh, cells| Volume::lattice(mesh, cells).expect("a lattice");
    let several = joined(&[
        ball(2),
        moved(&scaled(&ball(1), 0.3), Vec3::new(50.0, 10.0, -5.0)),
        moved(&heart, Vec3::new(-20.0, 95.0, 0.0)),
    ]);
    let sheets =
        [-3.0, 0.0, 4.0].map(|z| moved(&sheet(8, 60.0, |x, y| 0.002 * x * y), Vec3::Z * z));
    let (of_heart, of_brain) = (hull(&heart, [7, 6, 5], rng), hull(&brain, [9, 8, 7], rng));
    let of_several = hull(&several, [7, 9, 5], rng);
    let needles = slivers(16);
    let flat = flattened(&lattice(&ball(2), [2, 2, 5]));
    let (rolled, roll) = rolled();
    let (cube, tight) = cube();
    let on_cells = snapped(&heart, &lattice(&heart, [4, 4, 4]), 0.0, rng);
    let on_border = snapped(&heart, &of_heart, 1.0, rng);
    let beyond = lattice(&scaled(&brain, 0.95), [4, 4, 3]).bind_within(10.0);
    vec![
        Carried::new("heart in a lattice", heart.clone(), lattice(&heart, [3, 4, 5]), 1.3),
        Carried::new("heart outside", heart.clone(), shrunk(&of_heart, 0.9, 20.0), 1.3),
        Carried::new("heart in a hull", heart.clone(), of_heart.clone(), 1.3),
        Carried::new("brain in a cell", brain.clone(), lattice(&brain, [1, 1, 1]), 1.6),
        Carried::new("brain in a hull", brain.clone(), of_brain.clone(), 1.6),
        Carried::new("brain beyond a lattice", brain.clone(), beyond, 1.4),
        Carried::with_limits("limits in a hull", brain, of_brain, rng),
        Carried::with_limits("limits in a lattice", heart.clone(), lattice(&heart, [4, 3, 3]), rng),
        Carried::new("needles", needles.clone(), lattice(&needles, [2, 8, 1]), 1.5),
        Carried::new("flat elements", ball(2), flat, 1.3),
        Carried::new("rolled sheet", rolled, roll, 1.4),
        Carried::new("several in a lattice", several.clone(), lattice(&several, [4, 5, 3]), 1.4),
        Carried::with_limits("several in a hull", several, of_several, rng),
        Carried::new(
            "sheets in one cell",
            joined(&sheets),
            lattice(&joined(&sheets), [2, 2, 1]),
            2.0,
        ),
        Carried::new("cube on the border", cube, tight, 1.3),
        Carried::new("on faces, edges and nodes", on_cells, lattice(&heart, [4, 4, 4]), 1.3),
        Carried::new("beside the border", on_border, of_heart.bind_within(1.0), 1.3),
    ]
}

fn scaled(mesh: &Mesh, by: f32) -> Mesh {
    let positions = mesh.positions.iter().map(|&at| at * by).collect();
    Mesh { positions, ..mesh.clone() }
}

/// A lattice with one layer of nodes almost on the next: its tetrahedra are flat.
fn flattened(lattice: &Volume) -> Volume {
    let mut heights: Vec<f64> = lattice.nodes().iter().map(|at| at.z).collect();
    heights.sort_by(f64::total_cmp);
    heights.dedup();
    let (low, high) = (heights[2], heights[3]);
    let press = |&at: &DVec3| {
        let z = if at.z == high { low + (high - low) * 2e-3 } else { at.z };
        DVec3::new(at.x, at.y, z)
    };
    let nodes = lattice.nodes().iter().map(press).collect();
    Volume::new(nodes, lattice.tetrahedra().to_vec()).expect("flat, but not inverted")
}

/// A strip rolled up until its ends almost meet, with a volume that leaves the gap free.
fn rolled() -> (Mesh, Volume) {
    let strip = Mesh { origin: DVec3::ZERO, ..sheet(12, 120.0, |x, _| (0.2 * x).sin()) };
    let lattice = Volume::lattice(&strip, [14, 2, 1]).expect("a lattice");
    let roll = |at: DVec3| {
        let (angle, radius) = (at.x / 22.0, 22.0 + at.z);
        DVec3::new(radius * angle.sin(), at.y * 0.3, radius * angle.cos())
    };
    let nodes = lattice.nodes().iter().map(|&at| roll(at)).collect();
    let volume = Volume::new(nodes, lattice.tetrahedra().to_vec()).expect("not inverted");
    let carried = |at: &Vec3| {
        let (tetrahedron, weights) = place(&lattice, at.as_dvec3());
        blend(&volume, tetrahedron, weights).as_vec3()
    };
    let positions = strip.positions.iter().map(carried).collect();
    (Mesh { positions, ..strip }, volume)
}

/// A box, and a volume of exactly its size.
fn cube() -> (Mesh, Volume) {
    let [low, high] = [Vec3::splat(-24.0), Vec3::new(40.0, 24.0, 8.0)];
    let (positions, triangles) = cuboid(low, high);
    let mesh = Mesh { positions: positions.into(), triangles: triangles.into(), ..Mesh::default() };
    let lattice = Volume::lattice(&mesh, [4, 3, 2]).expect("a lattice");
    let [from, to] = [lattice.nodes()[0], lattice.nodes()[lattice.nodes().len() - 1]];
    let (low, high) = (low.as_dvec3(), high.as_dvec3());
    let fit = |&at: &DVec3| low + (at - from) / (to - from) * (high - low);
    let nodes: Vec<DVec3> = lattice.nodes().iter().map(fit).collect();
    // The volume's outer faces are the surface, cut where cells meet.
    (
        border(&nodes, lattice.tetrahedra()),
        Volume::new(nodes, lattice.tetrahedra().to_vec()).expect("a box"),
    )
}

/// The outer faces of tetrahedra.
fn border(nodes: &[DVec3], tetrahedra: &[[u32; 4]]) -> Mesh {
    let mut faces = std::collections::BTreeMap::new();
    for &[a, b, c, d] in tetrahedra {
        for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
            let mut key = face;
            key.sort_unstable();
            faces.entry(key).and_modify(|face| *face = None).or_insert(Some(face));
        }
    }
    let outer: Vec<[u32; 3]> = faces.into_values().flatten().collect();
    let mut used: Vec<u32> = outer.iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let row = |node: u32| used.binary_search(&node).expect("used") as u32;
    Mesh {
        positions: used.iter().map(|&node| nodes[node as usize].as_vec3()).collect(),
        triangles: outer.iter().map(|face| face.map(row)).collect(),
        ..Mesh::default()
    }
}

/// A mesh whose vertices are drawn to the faces, edges and nodes of the tetrahedra around them. Half of them stay
/// beside these by a few units of a stored weight; if they may be `outside`, by more.
fn snapped(mesh: &Mesh, volume: &Volume, outside: f64, rng: &mut Rng) -> Mesh {
    let mut snap = |at: &Vec3| {
        let (tetrahedron, weights) = place(volume, at.as_dvec3());
        // One of four weights is a quarter or more.
        let near = 0.25 * rng.f64();
        let kept = weights.map(|weight| if weight < near { 0.0 } else { weight });
        let sum: f64 = kept.iter().sum();
        let mut kept = kept.map(|weight| weight / sum);
        if rng.bool() {
            let unit = f64::from(rng.u32(1..9)) / 2.0 / 65_536.0 * (1.0 + 50.0 * outside);
            let [from, to] = [(); 2].map(|()| rng.usize(..4));
            kept[from] -= unit;
            kept[to] += unit;
        }
        let drawn = blend(volume, tetrahedron, kept);
        // Outside of a volume that must hold it, a vertex stays where it was.
        let is_held = outside > 0.0 || place(volume, drawn).1.iter().all(|&weight| weight >= 0.0);
        if is_held { drawn.as_vec3() } else { *at }
    };
    let positions = mesh.positions.iter().map(&mut snap).collect();
    let mut drawn = Mesh { positions, ..mesh.clone() };
    // Where two vertices meet, their triangles have no area: they move apart again.
    for _ in 0..8 {
        for corners in drawn.triangles.clone() {
            let [a, b, c] = corners.map(|vertex| drawn.positions[vertex as usize]);
            if (b - a).cross(c - a).length() < 1e-2 {
                for vertex in corners {
                    drawn.positions[vertex as usize] = mesh.positions[vertex as usize];
                }
            }
        }
    }
    drawn
}

/// The tetrahedron around a position, and the position's barycentric coordinates there.
fn place(volume: &Volume, at: DVec3) -> (usize, [f64; 4]) {
    let least = |weights: [f64; 4]| weights.into_iter().fold(f64::INFINITY, f64::min);
    let all = volume
        .tetrahedra()
        .iter()
        .map(|corners| barycentric(corners.map(|node| volume.nodes()[node as usize]), at));
    let inner = all.enumerate().max_by(|a, b| least(a.1).total_cmp(&least(b.1)));
    inner.expect("not empty")
}

fn blend(volume: &Volume, tetrahedron: usize, weights: [f64; 4]) -> DVec3 {
    let corners = volume.tetrahedra()[tetrahedron].into_iter().zip(weights);
    corners.map(|(node, weight)| volume.nodes()[node as usize] * weight).sum()
}

/// The barycentric coordinates of a position in a tetrahedron.
#[must_use]
pub fn barycentric([a, b, c, d]: [DVec3; 4], at: DVec3) -> [f64; 4] {
    let DVec3 { x, y, z } = DMat3::from_cols(b - a, c - a, d - a).inverse() * (at - a);
    [1.0 - x - y - z, x, y, z]
}

/// A volume around a mesh that is not a box: the lattice cells with vertices in or beside them, with displaced nodes.
#[must_use]
pub fn hull(mesh: &Mesh, cells: [u32; 3], rng: &mut Rng) -> Volume {
    let lattice = Volume::lattice(mesh, cells).expect("a lattice");
    let [low, high] = [lattice.nodes()[0], lattice.nodes()[lattice.nodes().len() - 1]];
    let size = (high - low) / DVec3::from(cells.map(f64::from));
    let cell_of = |at: DVec3| ((at - low) / size).floor().as_ivec3();
    let near: Vec<_> = mesh.positions.iter().map(|&at| cell_of(at.as_dvec3())).collect();
    let mut is_kept = vec![false; lattice.tetrahedra().len() / 6];
    for (number, kept) in is_kept.iter_mut().enumerate() {
        let corners = lattice.tetrahedra()[6 * number..][..6].iter().flatten();
        let middle = corners.map(|&node| lattice.nodes()[node as usize]).sum::<DVec3>() / 24.0;
        let here = cell_of(middle);
        *kept = near.iter().any(|&cell| (cell - here).abs().max_element() <= 1);
    }
    let mut row = vec![u32::MAX; lattice.nodes().len()];
    let mut nodes = Vec::new();
    let mut tetrahedra = Vec::new();
    for (number, corners) in lattice.tetrahedra().iter().enumerate() {
        if is_kept[number / 6] {
            tetrahedra.push(corners.map(|node| {
                let row = &mut row[node as usize];
                if *row == u32::MAX {
                    *row = nodes.len() as u32;
                    let at = lattice.nodes()[node as usize];
                    // The outermost nodes stay, so that the hull contains the mesh.
                    let is_inner = at.cmpgt(low) & at.cmplt(high);
                    let shift = [(); 3].map(|()| 0.1 * (rng.f64() - 0.5));
                    let shift = DVec3::from(shift) * size;
                    nodes.push(at + DVec3::select(is_inner, shift, DVec3::ZERO));
                }
                *row
            }));
        }
    }
    Volume::new(nodes, tetrahedra).expect("cells that touch")
}

/// A volume scaled down around its middle, so that vertices are outside: bound within this distance (mm).
#[must_use]
pub fn shrunk(volume: &Volume, part: f64, within: f64) -> Volume {
    let nodes = volume.nodes();
    let middle = nodes.iter().sum::<DVec3>() / nodes.len() as f64;
    let nodes = nodes.iter().map(|&at| middle + (at - middle) * part).collect();
    let smaller = Volume::new(nodes, volume.tetrahedra().to_vec()).expect("as before");
    smaller.bind_within(within)
}
