//! The batched search: its counts, stacks and budgets. `differential.rs` tests the accuracy of both searches.

// Requirement: A-01

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Options, Query, Sphere, measure_stretch};
use dibs_tests::deform::unit;
use dibs_tests::surfaces::cuboid;
use fastrand::Rng;
use glam::Vec3;

fn heart() -> (Mesh, BuiltTree) {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    (mesh, built)
}

fn tool(mesh: &Mesh, rng: &mut Rng) -> Sphere {
    let on_surface = mesh.positions[rng.usize(..mesh.positions.len())];
    Sphere::new(on_surface + unit(rng) * 40.0 * rng.f32(), 2.0).expect("valid")
}

/// Counts are compared exactly: they reveal any change of the tree or of the batches, which must be intended.
#[test]
fn counts_of_a_fixed_stream_are_what_they_were() {
    let (mesh, built) = heart();
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let measured = measure_stretch(&tree, rows.as_slice()).expect("at rest");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(1);
    let mut counts = [(0, 0); 3];
    let mut last = None;
    for _ in 0..400 {
        let tool = tool(&mesh, &mut rng);
        let options = [
            Options::cold().unsigned(),
            Options::cold().unsigned().stretch(measured),
            Options::cold().unsigned().stretch(measured).warm_start(last),
        ];
        for (count, options) in counts.iter_mut().zip(options) {
            let found = query.closest_batched(rows.as_slice(), &tool, &options);
            let found = found.expect("an answer");
            *count = (count.0 + found.node_tests, count.1 + found.triangle_tests);
            last = found.triangle;
        }
    }
    assert_eq!(counts, GOLDEN, "node and triangle tests: limit, measured, measured and warm");
}

/// Node and triangle tests of the stream above.
const GOLDEN: [(u32, u32); 3] = [(79_879, 2_526), (51_200, 2_497), (51_126, 2_895)];

/// Entries that the tree above needs.
const NEEDED: usize = 26;

#[test]
fn any_stack_that_holds_the_tree_is_enough() {
    let (mesh, built) = heart();
    assert_eq!(built.tree::<u16>().expect("valid").stack() as usize, NEEDED);
    let rows = built.to_rows(&mesh.positions);
    let least = tests_with::<NEEDED>(&mesh, &built, &rows);
    let more = tests_with::<{ NEEDED + 16 }>(&mesh, &built, &rows);
    let most = tests_with::<{ NEEDED + 128 }>(&mesh, &built, &rows);
    println!("{least}, {more} and {most} node tests on stacks that spare 0, 16 and 128 entries");
    assert!(least != more && more != most, "spare entries of the stack are used");
    assert_eq!(tests_with::<{ NEEDED + 129 }>(&mesh, &built, &rows), most, "128 are used");
    assert_eq!(tests_with::<MAX_STACK>(&mesh, &built, &rows), most, "128 are used");
}

/// From the middle of a block all leaves are equally near, so that a batch fills the stack to its last entry.
#[test]
fn a_batch_may_fill_the_stack() {
    let (positions, triangles) = cuboid(Vec3::splat(-10.0), Vec3::splat(10.0));
    let mesh = Mesh { positions: positions.into(), triangles: triangles.into(), ..Mesh::default() };
    let tool = Sphere::new(Vec3::ZERO, 1.0).expect("valid");
    let mut asked = 0;
    for leaf in 1..=6 {
        let built = Builder::new().leaf_triangles(leaf).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(&mesh.positions);
        macro_rules! ask_with {
            ($($stack:literal)*) => {$(
                if tree.stack() == $stack {
                    let mut query = Query::<u16, $stack>::new(&tree).expect("deep enough");
                    let options = Options::cold().unsigned();
                    let found = query.closest_batched(rows.as_slice(), &tool, &options);
                    let found = found.expect("an answer");
                    assert!((found.separation - 9.0).abs() <= found.accuracy, "{leaf}: {found:?}");
                    asked += 1;
                }
            )*};
        }
        ask_with!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
    }
    assert_eq!(asked, 6);
}

/// Node tests of a stream on a stack of `D` entries. Its separations must agree with [`Query::closest`].
fn tests_with<const D: usize>(mesh: &Mesh, built: &BuiltTree, rows: &[Vec3]) -> u32 {
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, D>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(2);
    let mut tests = 0;
    for _ in 0..400 {
        let tool = tool(mesh, &mut rng);
        let one_at_a_time =
            query.closest(rows, &tool, &Options::cold().unsigned()).expect("an answer");
        let batched =
            query.closest_batched(rows, &tool, &Options::cold().unsigned()).expect("an answer");
        let apart = (one_at_a_time.separation - batched.separation).abs();
        assert!(apart <= 2.0 * batched.accuracy, "{one_at_a_time:?} {batched:?}");
        tests += batched.node_tests;
    }
    tests
}

/// A larger budget continues the same search: neither bound of the interval widens by more than the accuracy.
#[test]
fn more_budget_tells_no_less() {
    let (mesh, built) = heart();
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(3);
    let mut cut_short = 0;
    for _ in 0..400 {
        let tool = tool(&mesh, &mut rng);
        let truth =
            query.closest(rows.as_slice(), &tool, &Options::cold().unsigned()).expect("an answer");
        let (mut lower, mut upper) = (f32::NEG_INFINITY, f32::INFINITY);
        for node_tests in (0..400).step_by(9) {
            let budget = Budget::new(node_tests);
            let options = Options::cold().unsigned().budget(budget);
            let found = query.closest_batched(rows.as_slice(), &tool, &options);
            let found = found.expect("a short budget is no error");
            assert!(found.work() <= budget.tests() + 1, "{budget:?} {found:?}");
            assert!(found.lower <= truth.separation + found.accuracy, "{found:?} {truth:?}");
            assert!(found.separation >= truth.separation - found.accuracy, "{found:?} {truth:?}");
            assert!(found.lower >= lower && found.separation <= upper + found.accuracy);
            (lower, upper) = (found.lower, found.separation);
            cut_short += u32::from(found.lower < found.separation);
        }
    }
    println!("{cut_short} of 18,000 queries were cut short");
    assert!(cut_short > 1_000);
}
