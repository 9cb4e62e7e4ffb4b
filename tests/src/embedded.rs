//! Surfaces that a volume moves: volumes, motions of their nodes, and their stretch in f64.

use dibs_build::{Mesh, Volume};
use dibs_nostd::format::Link;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Tree, TriangleRow, VertexTable};
use fastrand::Rng;
use glam::{DMat3, DVec3, Mat3, Quat, Vec3};

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

/// The triangles below a node of a tree.
#[derive(Debug)]
pub struct Section {
    /// The node's pin.
    pub pin: u32,
    /// Its radius (mm).
    pub radius: f64,
    /// The rows of the section's vertices.
    pub covered: Vec<u32>,
}

/// All sections of a tree.
#[must_use]
pub fn sections(tree: &Tree<'_, u16>) -> Vec<Section> {
    let section = |row: u32| {
        let (pin, radius, _) = tree.node(row).expect("in the tree");
        let (mut below, mut covered) = (vec![row], Vec::new());
        while let Some(row) = below.pop() {
            match tree.node(row).expect("in the tree").2 {
                Link::Leaf { first, count } => covered.extend(
                    (first..first + count)
                        .filter_map(|row| tree.corners(TriangleRow(row)))
                        .flatten(),
                ),
                Link::Children { first, count } => below.extend(first..first + count),
            }
        }
        covered.sort_unstable();
        covered.dedup();
        Section { pin, radius: f64::from(radius), covered }
    };
    (0..tree.node_count()).map(section).collect()
}

/// Climbs, over the positions of the nodes that move a section, towards a vertex outside its sphere. Returns the
/// distance of the farthest vertex from the pin, relative to the radius.
///
/// # Panics
/// If a vertex is outside.
#[must_use]
pub fn climb(nodes: &Nodes<'_>, section: &Section, rest: &[Vec3], rng: &mut Rng) -> f64 {
    let Section { pin, radius, covered } = section;
    let of = |row: &u32| nodes.weights(*row).expect("in the table").map(|(node, _)| node);
    let carriers: Vec<u32> = covered.iter().flat_map(of).collect();
    let part = |frame: &[Vec3]| {
        let sigma = f64::from(nodes.measure(frame).ok()?.sigma());
        let at = |row| exact(nodes, frame, row);
        let away = covered.iter().map(|&row| at(row).distance(at(*pin)));
        Some(away.fold(0.0, f64::max) / (sigma * radius + 1e-9))
    };
    let (mut frame, mut best) = (rest.to_vec(), part(rest).expect("at rest"));
    for _ in 0..300 {
        let mut next = frame.clone();
        let by = Vec3::from([(); 3].map(|()| rng.f32() - 0.5));
        next[carriers[rng.usize(..carriers.len())] as usize] +=
            by * 30.0 * 10.0_f32.powf(-2.0 * rng.f32());
        if let Some(part) = part(&next).filter(|part| *part > best) {
            assert!(part <= 1.0, "{part} {radius}");
            (frame, best) = (next, part);
        }
    }
    best
}

/// A motion of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeMotion {
    /// Stretched along one axis up to the limit.
    Pulled,
    /// Long waves.
    Waves,
    /// Each node moved independently.
    Noise,
    /// Bent around an axis, until its ends may overlap.
    Bent,
    /// Only one node moved.
    Needle,
    /// Pressed nearly flat.
    Pressed,
}

impl NodeMotion {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Pulled, Self::Waves, Self::Noise, Self::Bent, Self::Needle, Self::Pressed];

    /// Nodes after a random motion of this kind, weakened until their stretch is within the limit, and a rigid motion.
    #[must_use]
    pub fn apply(self, nodes: &Nodes<'_>, rng: &mut Rng) -> Vec<Vec3> {
        let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
        let middle = rest.iter().sum::<Vec3>() / rest.len() as f32;
        let size = rest.iter().map(|at| at.distance(middle)).fold(0.0, f32::max);
        let turn = turn(rng);
        let by = Vec3::from([(); 3].map(|()| size * (rng.f32() - 0.5)));
        let strain = nodes.stretch_limit() - 1.0;
        let waves = [(); 3].map(|()| [(); 4].map(|()| 6.0 * (rng.f32() - 0.5)));
        let noise: Vec<Vec3> =
            rest.iter().map(|_| Vec3::from([(); 3].map(|()| rng.f32() - 0.5))).collect();
        let (one, along) = (rng.usize(..rest.len()), turn * Vec3::X);
        let mut strength = 1.0_f32;
        loop {
            let at = |(node, at): (usize, &Vec3)| {
                let from = *at - middle;
                let moved = match self {
                    Self::Pulled => from + along * along.dot(from) * strain * strength * 0.99999,
                    Self::Waves => {
                        let wave = waves.map(|[x, y, z, phase]| {
                            (Vec3::new(x, y, z).dot(from) / size + phase).sin()
                        });
                        from + Vec3::from(wave) * size * 0.3 * strength
                    }
                    Self::Noise => from + noise[node] * size * 0.2 * strength,
                    Self::Bent => {
                        let angle = 4.0 * strength * from.x / size;
                        Quat::from_rotation_z(angle) * (from + Vec3::Y * size) - Vec3::Y * size
                    }
                    Self::Needle if node == one => from + along * size * strength,
                    Self::Needle => from,
                    Self::Pressed => from - along * along.dot(from) * (1.0 - 1e-3) * strength,
                };
                turn * moved + middle + by
            };
            let moved: Vec<Vec3> = rest.iter().enumerate().map(at).collect();
            if nodes.measure(moved.as_slice()).is_ok() {
                return moved;
            }
            strength = if strength > 1e-3 { strength * 0.8 } else { 0.0 };
        }
    }
}

fn turn(rng: &mut Rng) -> Quat {
    let axis = Vec3::from([(); 3].map(|()| rng.f32() - 0.5)).normalize_or(Vec3::X);
    Quat::from_axis_angle(axis, std::f32::consts::TAU * rng.f32())
}

/// The positions of all vertices, as a query reads them.
#[must_use]
pub fn rows(surface: &(impl VertexTable + ?Sized)) -> Vec<Vec3> {
    (0..surface.len() as u32).filter_map(|row| surface.position(row)).collect()
}

/// A vertex computed in f64.
#[must_use]
pub fn exact(nodes: &Nodes<'_>, table: &[Vec3], vertex: u32) -> DVec3 {
    let weights = nodes.weights(vertex).expect("in the table");
    let term = |(node, weight): (u32, i32)| table[node as usize].as_dvec3() * f64::from(weight);
    weights.map(term).into_iter().sum::<DVec3>() / 65_536.0
}

/// The largest singular value of an element's deformation gradient, and its determinant.
#[must_use]
pub fn stretch_of(rest: [Vec3; 4], now: [Vec3; 4]) -> (f64, f64) {
    let edges = |corners: [Vec3; 4]| {
        let [a, b, c, d] = corners.map(Vec3::as_dvec3);
        DMat3::from_cols(b - a, c - a, d - a)
    };
    let gradient = edges(now) * edges(rest).inverse();
    (largest_eigenvalue(gradient.transpose() * gradient).sqrt(), gradient.determinant())
}

/// The largest singular value over all elements.
#[must_use]
pub fn largest_stretch(nodes: &Nodes<'_>, table: &[Vec3]) -> f64 {
    let rest = |node| nodes.rest_position(node).expect("in the table");
    let of = |element| {
        let corners = nodes.element(element).expect("in the table");
        stretch_of(corners.map(rest), corners.map(|node| table[node as usize])).0
    };
    (0..nodes.element_count()).map(of).fold(0.0, f64::max)
}

/// By Jacobi rotations.
fn largest_eigenvalue(mut matrix: DMat3) -> f64 {
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            let (app, aqq, apq) = (matrix.col(p)[p], matrix.col(q)[q], matrix.col(q)[p]);
            if apq == 0.0 {
                continue;
            }
            let theta = (aqq - app) / (2.0 * apq);
            let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
            let cosine = 1.0 / t.hypot(1.0);
            let mut rotation = DMat3::IDENTITY;
            rotation.col_mut(p)[p] = cosine;
            rotation.col_mut(q)[q] = cosine;
            rotation.col_mut(q)[p] = t * cosine;
            rotation.col_mut(p)[q] = -t * cosine;
            matrix = rotation.transpose() * matrix * rotation;
        }
    }
    (0..3).map(|at| matrix.col(at)[at]).fold(0.0, f64::max)
}

/// A random deformation gradient near a rotation.
#[must_use]
pub fn gradient(rng: &mut Rng, strain: f32) -> Mat3 {
    let mut random = || Vec3::from([(); 3].map(|()| strain * (rng.f32() - 0.5)));
    let shear = Mat3::from_cols(Vec3::X + random(), Vec3::Y + random(), Vec3::Z + random());
    Mat3::from_quat(turn(rng)) * shear
}
