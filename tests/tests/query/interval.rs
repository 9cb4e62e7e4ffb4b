//! Both bounds of the certified interval, as the budget grows and from tick to tick.
//!
//! The interval of every answer contains the true separation. A larger budget for the same query widens neither bound
//! beyond the accuracy. From tick to tick, with a warm start, the lower bound may decrease although nothing has moved,
//! because tests are spent elsewhere.

// Requirements

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Options, Proximity, Query, measure_stretch};
use dibs_tests::ask;
use dibs_tests::deform::Deformation;
use dibs_tests::oracle::{OraclePair, exhaustive};
use dibs_tests::poses::pose;
use dibs_tests::surfaces;
use fastrand::Rng;

/// Frames of each kind of deformation, and poses on each.
const FRAMES: usize = 4;
const POSES: usize = 30;
/// Number of increasing budgets of one query, from zero on.
const BUDGETS: u32 = 24;
/// Ticks of one pose, each warm-started from the last.
const TICKS: usize = 6;

/// The distance of the true separation from each bound, if it is outside the interval, in units of the accuracy: at
/// most 1 is correct.
fn beyond(found: &Proximity, truth: &OraclePair) -> [f64; 2] {
    let accuracy = f64::from(found.accuracy);
    let lower = f64::from(found.lower) - truth.separation;
    let upper = truth.separation - f64::from(found.separation);
    [lower / accuracy, upper / accuracy]
}

#[test]
fn both_ends_hold_the_truth_and_close_in_on_it_as_the_budget_grows() {
    let mut rng = Rng::with_seed(17);
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let triangles = surfaces::triangles(&tree);
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
    let (mut cut_short, mut fell, mut worst) = (0, 0, [0.0_f64; 2]);
    for deformation in Deformation::ALL.iter().cycle().take(FRAMES * Deformation::ALL.len()) {
        let moved = deformation.apply(&mesh, tree.paths(), tree.stretch(), &mut rng);
        let rows = built.to_rows(&moved);
        let measured = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
        for _ in 0..POSES {
            let tool = pose(&rows, &triangles, &mut rng);
            let truth = exhaustive(&rows, &triangles, &tool).expect("has triangles");
            let mut ask = |options: &Options| {
                let found = ask::closest(&mut query, &rows[..], &tool, options).expect("sound");
                let ends = beyond(&found, &truth);
                assert!(ends.iter().all(|&end| end <= 1.0), "{tool:?} {found:?} {truth:?}");
                assert!(found.lower <= found.separation, "{found:?}");
                for (worst, end) in worst.iter_mut().zip(ends) {
                    *worst = worst.max(end);
                }
                cut_short += u32::from(found.lower < found.separation);
                found
            };
            let options =
                if rng.bool() { Options::cold().stretch(measured) } else { Options::cold() };

            // The same query with increasing budgets.
            let mut before: Option<Proximity> = None;
            let mut budget = Budget::new(0);
            for _ in 0..BUDGETS {
                let found = ask(&options.budget(budget));
                if let Some(before) = before {
                    assert!(found.lower >= before.lower, "{budget:?} {before:?} {found:?}");
                    let most = before.separation + found.accuracy;
                    assert!(found.separation <= most, "{budget:?} {before:?} {found:?}");
                }
                before = Some(found);
                budget = Budget::new(budget.tests() + rng.u32(..budget.tests() / 2 + 13));
            }
            let whole = ask(&options.budget(Budget::UNLIMITED));
            assert!(whole.lower == whole.separation, "{whole:?}");
            let last = before.expect("asked");
            assert!(last.lower <= whole.lower, "{last:?} {whole:?}");

            // The same pose, tick after tick.
            let short = Budget::new(rng.u32(..168));
            let mut options = options.budget(short);
            let mut before: Option<Proximity> = None;
            for _ in 0..TICKS {
                let found = ask(&options);
                if let Some(before) = before {
                    let most = before.separation + found.accuracy;
                    assert!(found.separation <= most, "{short:?} {before:?} {found:?}");
                    fell += u32::from(found.lower < before.lower - found.accuracy);
                }
                if found.triangle.is_some() {
                    options = options.warm_start(found.triangle);
                    before = Some(found);
                }
            }
        }
    }
    println!(
        "{cut_short} cut short, worst ends {worst:?} accuracies, the lower fell {fell} times from tick to tick"
    );
    assert!(cut_short > 10_000, "{cut_short}");
}
