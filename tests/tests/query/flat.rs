//! Meshes with some nearly flat triangles: answers stay correct, and rounding on the bus does not count as stretch.

// Requirement: A-01

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::{MAX_STACK, PathKind};
use dibs_nostd::wire::QuantisedBox;
use dibs_nostd::{Options, Query, Tree, measure_stretch};
use dibs_tests::deform::Deformation;
use dibs_tests::oracle::exhaustive;
use dibs_tests::poses::pose;
use dibs_tests::{ask, sample, stretch, surfaces};
use fastrand::Rng;
use glam::Vec3;

/// A heart with some triangles that have a corner nearly on the opposite edge, or nearly on another corner. The
/// flattest one's height is `flattest` times its longest edge.
fn with_flat_triangles(flattest: f32, rng: &mut Rng) -> Mesh {
    let mut mesh = generate::heart(320).expect("a valid size").mesh;
    let mut touched = vec![false; mesh.positions.len()];
    let count = 8;
    for number in 0..count {
        let flat = flattest.powf(1.0 - number as f32 / count as f32);
        let [a, b, c] = mesh.triangles[rng.usize(..mesh.triangles.len())].map(|v| v as usize);
        // Two changes at one vertex could leave a triangle without area.
        if [a, b, c].iter().any(|&v| std::mem::replace(&mut touched[v], true)) {
            continue;
        }
        let [start, end] = [mesh.positions[b], mesh.positions[c]];
        let foot = if rng.bool() { start } else { start + (end - start) * rng.f32() };
        let off = (mesh.positions[a] - foot).normalize() * (end - start).length();
        mesh.positions[a] = foot + off * flat;
    }
    mesh
}

/// Answers are correct in all deformations within the limits, with one limit for all triangles and with one for each.
#[test]
fn answers_are_right_whatever_is_flat() {
    let mut rng = Rng::with_seed(41);
    let mut worst: f64 = 0.0;
    for round in 0..12 {
        let mesh = with_flat_triangles(10f32.powf(-1.0 - 5.0 * rng.f32()), &mut rng);
        let limits: Vec<f32> = match round % 2 {
            0 => vec![1.3; mesh.triangles.len()],
            _ => mesh.triangles.iter().map(|_| 1.1 + 2.0 * rng.f32().powi(3)).collect(),
        };
        let built = Builder::new().limits(limits.clone()).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
        for deformation in Deformation::ALL {
            let keeps_to_limits = |moved: &[Vec3]| {
                limits.iter().enumerate().all(|(triangle, &limit)| {
                    stretch::of_triangle(&mesh, moved, triangle, PathKind::Surface)
                        <= f64::from(limit) * 0.999
                })
            };
            let moved = deformation.apply_while(&mesh, keeps_to_limits, &mut rng);
            let rows = built.to_rows(&moved);
            let measured = measure_stretch(&tree, rows.as_slice())
                .unwrap_or_else(|error| panic!("round {round}, {deformation:?}: {error}"));
            for _ in 0..12 {
                let tool = pose(&rows, &triangles, &mut rng);
                let truth = exhaustive(&rows, &triangles, &tool).expect("has triangles");
                for options in [Options::cold(), Options::cold().stretch(measured)] {
                    let found = ask::closest(&mut query, rows.as_slice(), &tool, &options);
                    let found = found.expect("a valid query");
                    let off = (f64::from(found.separation) - truth.separation).abs();
                    worst = worst.max(off / f64::from(found.accuracy));
                    assert!(worst <= 1.0, "round {round}, {deformation:?}, {tool:?}: {found:?}");
                }
            }
        }
    }
    println!("largest error: {worst:.2} of the stated accuracy");
}

/// A band has a very small height at rest, and now the largest that its limit allows. Its distances at rest do not
/// bound the present ones.
#[test]
fn what_is_flat_may_unfold() {
    let mut rng = Rng::with_seed(43);
    let mut mesh = surfaces::slivers(400);
    let high = mesh.positions.clone();
    mesh.positions.iter_mut().for_each(|p| p.y *= 1e-4);
    for limit in [1.2, 2.0] {
        let built = Builder::new().stretch(limit).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let triangles = surfaces::triangles(&tree);
        let unfolded = |by: f32| -> Vec<Vec3> {
            high.iter().map(|&p| Vec3::new(p.x, p.y * by, p.z)).collect()
        };
        let keeps = |by: f32| {
            stretch::largest(&mesh, &unfolded(by), PathKind::Surface) < f64::from(limit) * 0.999
        };
        let by = (0..200).map(|i| 1e-4 * 1.1f32.powi(i)).take_while(|&by| keeps(by)).last();
        let by = by.expect("at rest it keeps to the limit");
        assert!(by > 1.0, "unfolded to only {by} of a height that is not flat");
        let rows = built.to_rows(&unfolded(by));
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
        for _ in 0..300 {
            let tool = pose(&rows, &triangles, &mut rng);
            let truth = exhaustive(&rows, &triangles, &tool).expect("has triangles");
            let found = ask::closest(&mut query, rows.as_slice(), &tool, &Options::cold());
            let found = found.expect("a valid query");
            let off = (f64::from(found.separation) - truth.separation).abs();
            assert!(off <= f64::from(found.accuracy), "limit {limit}, {tool:?}: {found:?}");
        }
    }
}

/// Rounding to 16 bits on the bus moves a vertex by more than the height of such a triangle. The measured stretch of a
/// frame at rest hardly increases.
#[test]
fn a_bus_that_rounds_does_not_stretch_what_is_flat() {
    let mut rng = Rng::with_seed(42);
    let mut largest: f32 = 0.0;
    for _ in 0..sample(100) {
        let mesh = with_flat_triangles(1e-6, &mut rng);
        let built = Builder::new().stretch(1.3).build(&mesh).expect("a valid mesh");
        let grid = QuantisedBox::covering(&mesh.positions).expect("finite");
        let moved: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|&p| grid.position(grid.quantise(p).expect("inside")))
            .collect();
        let measured = of_frame(&built, &moved);
        largest = largest.max(measured);
    }
    println!("largest stretch by rounding alone: {largest:.4}");
    assert!(largest < 1.02);
}

fn of_frame(built: &BuiltTree, positions: &[Vec3]) -> f32 {
    let tree: Tree<'_, u16> = built.tree().expect("valid");
    measure_stretch(&tree, built.to_rows(positions).as_slice()).expect("within the limit").sigma()
}
