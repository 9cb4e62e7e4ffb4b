//! Coverage: in every frame that the stretch check admits, each vertex of every section lies within its sphere, whose
//! radius is the tree's radius times the measured stretch.
//!
//! Hill climbing searches for frames that violate this: it moves a vertex of a section away from its pin as long as the
//! check admits the frame. It finds spheres that are too small by so little that random poses would miss them.
//! Comparisons are in f64 with the stored numbers, with a tolerance of 1e-9. `COVERAGE=20 cargo test ...` tries twenty
//! times as many trees.

// Requirement: A-02

use dibs_build::{Builder, BuiltTree, Construction, Mesh, Paths};
use dibs_nostd::format::NodeLink;
use dibs_nostd::{Tree, TriangleRow, measure_stretch};
use fastrand::Rng;
use glam::Vec3;

/// A node's sphere, and the vertex rows of the section that it must cover.
struct Sphere {
    pin: usize,
    radius: f64,
    covered: Vec<usize>,
}

fn spheres(tree: &Tree<'_, u16>) -> Vec<Sphere> {
    let sphere = |row: u32| {
        let (pin, radius, _) = tree.node(row).expect("in the tree");
        let (mut below, mut covered) = (vec![row], Vec::new());
        while let Some(row) = below.pop() {
            match tree.node(row).expect("in the tree").2 {
                NodeLink::Leaf { first, count } => {
                    let corners =
                        (first..first + count).filter_map(|row| tree.corners(TriangleRow(row)));
                    covered.extend(corners.flatten().map(|vertex| vertex as usize));
                }
                NodeLink::Children { first, count } => below.extend(first..first + count),
            }
        }
        covered.sort_unstable();
        covered.dedup();
        Sphere { pin: pin as usize, radius: f64::from(radius), covered }
    };
    (0..tree.node_count()).map(sphere).collect()
}

impl Sphere {
    /// The distance of a vertex from the pin, in radii.
    fn share(&self, frame: &[Vec3], vertex: usize) -> f64 {
        let away = frame[vertex].as_dvec3().distance(frame[self.pin].as_dvec3());
        // A radius of 0 covers only vertices at the pin.
        if away == 0.0 { 0.0 } else { away / self.radius }
    }

    /// The vertex farthest from the pin, and its distance in radii.
    fn farthest(&self, frame: &[Vec3]) -> (usize, f64) {
        let shares = self.covered.iter().map(|&vertex| (vertex, self.share(frame, vertex)));
        shares.max_by(|a, b| a.1.total_cmp(&b.1)).expect("a section has vertices")
    }
}

/// The largest copy of the rest shape that the check admits: all triangles have the same stretch.
fn scaled(tree: &Tree<'_, u16>, rest: &[Vec3]) -> Option<Vec<Vec3>> {
    let at = |scale: f32| rest.iter().map(|&p| p * scale).collect::<Vec<_>>();
    let admits = |scale: &f32| measure_stretch(tree, at(*scale).as_slice()).is_ok();
    let (mut low, mut high) = (0.3, tree.stretch());
    if !admits(&low) {
        return None;
    }
    for _ in 0..24 {
        let middle = (low + high) / 2.0;
        if admits(&middle) { low = middle } else { high = middle }
    }
    Some(at(low))
}

/// Moves a vertex away from the pin of a sphere through frames that the check admits.
fn climb(
    tree: &Tree<'_, u16>,
    sphere: &Sphere,
    target: usize,
    frame: &mut Vec<Vec3>,
    rng: &mut Rng,
) {
    const STEPS: usize = 400;
    let size = frame.iter().map(|p| p.distance(frame[0])).fold(0.0, f32::max);
    let (mut best, mut step) = (sphere.share(frame, target), size * 0.3);
    let mut next = frame.clone();
    for _ in 0..STEPS {
        next.clone_from(frame);
        let pin = frame[sphere.pin];
        let away = (frame[target] - pin).normalize_or_zero();
        match rng.u32(..3) {
            // One vertex moves in any direction.
            0 => {
                let off = Vec3::new(rng.f32(), rng.f32(), rng.f32()) - 0.5;
                next[rng.usize(..frame.len())] += off * step;
            }
            // Some vertices move away from the pin.
            1 => next.iter_mut().filter(|_| rng.bool()).for_each(|p| *p += away * step),
            // All vertices move towards the line from the pin to the target, and along it.
            _ => {
                let narrower = 0.5 * rng.f32();
                for p in &mut next {
                    let along = away * (*p - pin).dot(away);
                    let across = *p - pin - along;
                    *p += along * (step / size) - across * narrower;
                }
            }
        }
        let share = sphere.share(&next, target);
        if share > best && measure_stretch(tree, next.as_slice()).is_ok() {
            best = share;
            std::mem::swap(frame, &mut next);
            step = (step * 1.5).min(size);
        } else {
            step = (step * 0.93).max(size * 1e-7);
        }
    }
}

/// Counts of trees and climbs, and the largest distance of a vertex from its pin, relative to its sphere's radius.
#[derive(Debug, Default)]
struct Seen {
    trees: u32,
    climbs: u32,
    nearest_miss: f64,
}

impl Seen {
    /// Compares every vertex of every section with its sphere.
    fn check(&mut self, built: &BuiltTree, tree: &Tree<'_, u16>, all: &[Sphere], frame: &[Vec3]) {
        let sigma = f64::from(measure_stretch(tree, frame).expect("admitted").sigma());
        for sphere in all {
            let (vertex, share) = sphere.farthest(frame);
            let Sphere { pin, radius, .. } = sphere;
            assert!(
                share <= sigma * (1.0 + 1e-9),
                "row {vertex} is {share} radii of {radius} from row {pin}, the surface is stretched by \
                 {sigma}: {frame:?} of {built:?}",
            );
            self.nearest_miss = self.nearest_miss.max(share / sigma);
        }
    }
}

/// Builds trees on the meshes of a family, with all kinds of paths, limits and leaves, and climbs on each.
fn climb_on(family: impl Fn(&mut Rng) -> Mesh, trees: u32, seed: u64) {
    let mut rng = Rng::with_seed(seed);
    let more: u32 = std::env::var("COVERAGE").map_or(1, |text| text.parse().expect("a number"));
    let mut seen = Seen::default();
    for _ in 0..trees * more {
        let mut mesh = family(&mut rng);
        for corners in &mut mesh.triangles {
            corners.rotate_left(rng.usize(..3));
            if rng.u8(..4) == 0 {
                corners.swap(0, 1);
            }
        }
        let scale = [1.0, 1.0, 1e3, 1e-3][rng.usize(..4)];
        mesh.positions.iter_mut().for_each(|p| *p *= scale);
        let stretch = [1.0, 1.0001, 1.1, 1.5, 3.0][rng.usize(..5)];
        let mut builder = Builder::new().stretch(stretch).leaf_triangles(rng.usize(1..=8));
        builder = match rng.u8(..6) {
            0 => builder.paths(Paths::Edges),
            1 => builder.paths(Paths::Surface { crossings: rng.u32(1..8) }),
            2 => builder.construction(Construction::PlaneSplit),
            _ => builder,
        };
        if rng.u8(..3) == 0 {
            let limit = |_: &[u32; 3]| 1.0 + (stretch - 1.0) * rng.f32() * 2.0;
            builder = builder.limits(mesh.triangles.iter().map(limit).collect());
        }
        // The builder refuses meshes with triangles without area, or with several parts.
        let Ok(built) = builder.build(&mesh) else { continue };
        let tree = built.tree::<u16>().expect("valid");
        let all = spheres(&tree);
        let rest = built.to_rows(&mesh.positions);
        let Some(start) = scaled(&tree, &rest) else { continue };
        seen.trees += 1;
        seen.check(&built, &tree, &all, &start);
        for _ in 0..3 {
            let sphere = &all[rng.usize(..all.len())];
            let target = sphere.covered[rng.usize(..sphere.covered.len())];
            if target == sphere.pin {
                continue;
            }
            let mut frame = start.clone();
            climb(&tree, sphere, target, &mut frame, &mut rng);
            seen.check(&built, &tree, &all, &frame);
            seen.climbs += 1;
        }
    }
    println!("{seen:?}");
    assert!(seen.trees > trees / 4 && seen.climbs > trees / 4, "hardly a mesh was fit: {seen:?}");
    assert!(seen.nearest_miss > 0.9999, "no vertex came near its sphere: {seen:?}");
}

/// Triangles on these points, each of which shares an edge with an earlier one. Some edges have three triangles, and
/// some triangles are repeated.
fn grown(mut positions: Vec<Vec3>, rng: &mut Rng) -> Mesh {
    let mut triangles = vec![[0, 1, 2]];
    let mut used = 3;
    for _ in 0..rng.usize(2..12) {
        let triangle: [u32; 3] = triangles[rng.usize(..triangles.len())];
        let first = rng.usize(..3);
        let (p, q) = (triangle[first], triangle[(first + 1) % 3]);
        let is_new = (used as usize) < positions.len() && rng.bool();
        let r = if is_new { used } else { rng.u32(..used) };
        used += u32::from(is_new);
        if r != p && r != q {
            triangles.push([q, p, r]);
        }
    }
    positions.truncate(used as usize);
    Mesh { positions, triangles, ..Mesh::default() }
}

/// A mesh's extent in two of its directions, relative to the third.
fn thinness(rng: &mut Rng) -> f32 {
    [1.0, 0.1, 0.01, 1e-3, 1e-5][rng.usize(..5)]
}

/// Edges of equal length, triangles without area, coincident points.
#[test]
fn on_lattices_with_ties_and_degenerate_triangles() {
    let family = |rng: &mut Rng| {
        let thin = thinness(rng);
        let point = |_| {
            let [x, y, z] = [5, 4, 3].map(|end| f32::from(rng.u8(..end)));
            Vec3::new(x, y * thin, if rng.clone().bool() { z * thin } else { 0.0 }) * 10.0
        };
        let points = (0..12).map(point).collect();
        grown(points, rng)
    };
    climb_on(family, 6000, 1);
}

/// Random points: fat triangles, needles and slivers, folded and planar.
#[test]
fn on_clouds_from_fat_to_flat() {
    let family = |rng: &mut Rng| {
        let thin = thinness(rng);
        let point = |_| Vec3::new(rng.f32(), rng.f32() * thin, rng.f32() * thin * 0.1) * 10.0;
        let points = (0..12).map(point).collect();
        grown(points, rng)
    };
    climb_on(family, 6000, 2);
}

/// A flat triangle between two fat ones: a chord across it can grow by more than the measured stretch, because the
/// check treats the flat triangle as higher at rest.
#[test]
fn on_chords_from_fat_to_fat_across_flat() {
    let family = |rng: &mut Rng| {
        let mut near =
            |up: f32| Vec3::new(3.0 + 4.0 * rng.f32(), up * (6.0 + 3.0 * rng.f32()), rng.f32());
        let (above, below) = (near(1.0), near(-1.0));
        let (left, right) = (Vec3::ZERO, Vec3::new(10.0, 0.5 * rng.f32(), 0.0));
        let mut middle = left.lerp(right, 0.3 + 0.4 * rng.f32());
        middle.y -= 10.0 * 10f32.powf(-2.0 - 3.0 * rng.f32());
        let mut positions = vec![left, right, above, below, middle];
        let mut triangles = vec![[0, 1, 2], [1, 0, 4], [0, 3, 4], [4, 3, 1]];
        for side in 0..rng.u32(..3) {
            let x = 1.0 + 8.0 * side as f32 + rng.f32();
            positions.push(Vec3::new(x, 14.0 + rng.f32(), rng.f32()));
            triangles.push([2, side, positions.len() as u32 - 1]);
        }
        Mesh { positions, triangles, ..Mesh::default() }
    };
    climb_on(family, 6000, 3);
}

/// Fans of isosceles needles on a sheet. Each has two equal longest edges: either may count as the longest, but builder
/// and check must choose the same.
#[test]
fn on_fans_of_isosceles_needles() {
    let family = |rng: &mut Rng| {
        let (width, rest) = (10f32.powf(-2.0 - 3.0 * rng.f32()), 0.4);
        // All spokes have the same length, even after rounding.
        let around = [(1, -4), (1, 4), (4, 1), (-4, 1), (-1, 4), (-1, -4), (-4, -1), (4, -1)];
        let spokes =
            around.map(|(y, z)| Vec3::new(10.0, y as f32 * width * rest, z as f32 * width));
        let (start, count) = (rng.usize(..8), rng.usize(2..7));
        let mut positions = vec![Vec3::ZERO, Vec3::new(-5.0, 8.0, 0.0), Vec3::new(-5.0, -8.0, 0.0)];
        positions.extend(spokes.iter().cycle().skip(start).take(count));
        let mut triangles = vec![[0, 1, 2], [0, 3, 1]];
        triangles.extend((3..count as u32 + 2).map(|spoke| [0, spoke, spoke + 1]));
        Mesh { positions, triangles, ..Mesh::default() }
    };
    climb_on(family, 6000, 4);
}

/// A bent sheet of larger sections, whose paths cross many triangles.
#[test]
fn on_sheets() {
    let family = |rng: &mut Rng| {
        let (columns, rows) = (rng.u32(2..5), rng.u32(2..5));
        let (thin, bend) = ([1.0, 0.1, 0.02][rng.usize(..3)], [0.0, 0.0, 0.5][rng.usize(..3)]);
        let at = |column: u32, row: u32| column * (rows + 1) + row;
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for column in 0..=columns {
            for row in 0..=rows {
                positions
                    .push(Vec3::new(column as f32, row as f32 * thin, bend * rng.f32()) * 10.0);
                if column == columns || row == rows {
                    continue;
                }
                let (a, b) = (at(column, row), at(column + 1, row));
                let (c, d) = (at(column, row + 1), at(column + 1, row + 1));
                triangles.extend(if rng.bool() {
                    [[a, b, c], [b, d, c]]
                } else {
                    [[a, b, d], [a, d, c]]
                });
            }
        }
        Mesh { positions, triangles, ..Mesh::default() }
    };
    climb_on(family, 2000, 5);
}
