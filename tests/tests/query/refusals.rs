//! Refused queries, and the answer within a budget without triangle tests.

// Requirement: A-07

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Options, Query, QueryError, Sphere, VertexTable, measure_stretch};
use glam::Vec3;

fn heart() -> (Mesh, BuiltTree) {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    (mesh, built)
}

/// Positions with a frame number.
struct Numbered<'r> {
    rows: &'r [Vec3],
    epoch: u32,
}

impl VertexTable for Numbered<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn position(&self, row: u32) -> Option<Vec3> {
        self.rows.get(row as usize).copied()
    }

    fn epoch(&self) -> Option<u32> {
        Some(self.epoch)
    }
}

#[test]
fn a_measurement_of_any_other_frame_is_refused() {
    let (mesh, built) = heart();
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
    let sphere = Sphere::new(Vec3::ZERO, 1.0).expect("valid");
    let numbered = |epoch| Numbered { rows: &rows, epoch };
    let measured = measure_stretch(&tree, &numbered(7)).expect("at rest");
    let options = Options::cold().stretch(measured);
    for expected in [0, 6, 8, u32::MAX] {
        let refused = Err(QueryError::OtherFrame { expected, found: 7 });
        assert_eq!(query.closest(&numbered(expected), &sphere, &options), refused);
        assert_eq!(query.closest_batched(&numbered(expected), &sphere, &options), refused);
    }
    // The measured frame itself is accepted, and so is a table without an epoch.
    assert!(query.closest(&numbered(7), &sphere, &options).is_ok());
    assert!(query.closest(rows.as_slice(), &sphere, &options).is_ok());
}

#[test]
fn a_stack_is_enough_or_refused() {
    let (_, built) = heart();
    let tree = built.tree::<u16>().expect("valid");
    let needed = tree.stack();
    let mut refused = 0;
    macro_rules! try_stacks {
        ($($available:literal)*) => {$(
            let query = Query::<u16, $available>::new(&tree).map(|_| ());
            if $available >= needed {
                assert_eq!(query, Ok(()), "{} of {needed}", $available);
            } else {
                refused += 1;
                assert_eq!(query, Err(QueryError::Stack { needed, available: $available }));
            }
        )*};
    }
    try_stacks!(8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28);
    assert!((1..21).contains(&refused), "{needed} entries are not among those tried");
}

/// The triangle of a warm start is tested within the budget, like any other.
#[test]
fn a_budget_of_nothing_tests_no_triangle() {
    let (mesh, built) = heart();
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
    for row in (0..rows.len()).step_by(7) {
        let sphere = Sphere::new(rows[row] * 1.2, 1.0).expect("valid");
        // Unsigned, because a query that a budget ended has no side.
        let unsigned = Options::cold().unsigned();
        let whole = query.closest(rows.as_slice(), &sphere, &unsigned).expect("an answer");
        for budget in [Budget::new(0), Budget::new(Budget::TRIANGLE - 1)] {
            let options = unsigned.warm_start(whole.triangle).budget(budget);
            for found in [
                query.closest(rows.as_slice(), &sphere, &options),
                query.closest_batched(rows.as_slice(), &sphere, &options),
            ] {
                let found = found.expect("a short budget is no error");
                assert_eq!((found.triangle, found.triangle_tests), (None, 0), "{found:?}");
                assert!(found.lower <= whole.separation + whole.accuracy, "{found:?} {whole:?}");
                assert!(found.separation >= whole.separation, "{found:?} {whole:?}");
            }
        }
    }
}
