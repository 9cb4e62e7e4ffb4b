//! A query cut short by its budget: the interval contains the true separation and shrinks as the budget grows, and the
//! force is computed from its lower bound.

// Requirements, C-02

use std::ops::AddAssign;

use anyhow::Result;
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Options, Proximity, Query, TriangleRow, measure_stretch};
use dibs_tests::ask;
use dibs_tests::deform::Deformation;
use dibs_tests::oracle::{OraclePair, exhaustive};
use dibs_tests::poses::pose;
use dibs_tests::surfaces::{self, Surface};
use fastrand::Rng;
use glam::Vec3;
use rayon::prelude::*;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{EDGES, FAULTS, FLOW},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "budgets on this computer",
    run: check,
    promises: &[
        note("anytime.cases"),
        note("anytime.cut-short"),
        note("anytime.held"),
        Promise {
            id: "anytime.outside",
            says: "A query cut short by any budget, none included, gives an interval that holds the true separation",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {anytime.cases} budgets, {anytime.cut-short} of them cut short",
            limits: "Surfaces within their stretch limit; truth by exhaustive search in f64.",
        },
        Promise {
            id: "anytime.worst-error",
            says: "An end of the interval is off by at most the stated accuracy",
            criterion: EDGES,
            bound: Bound::AtMost(1.0),
            unit: "of the accuracy, at the most",
            limits: "Nine kinds of deformation, collapsed surfaces among them.",
        },
        Promise {
            id: "anytime.grown",
            says: "The interval never grows with the budget, nor its upper end from tick to tick under warm start",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {anytime.cases} budgets",
            limits: "Upper ends within the accuracy.",
        },
        Promise {
            id: "anytime.unfinished",
            says: "An unlimited query has an interval of one point",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {anytime.cases} budgets",
            limits: "",
        },
        Promise {
            id: "anytime.too-weak",
            says: "The force of a query cut short is at least that of the true separation, where it is no hold",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "of {anytime.cases} budgets",
            limits: "The size; the direction is that of the best pair found. Left out are {anytime.held} answers without a \
                     direction, to which the wall answers with its hold: damping, no spring.",
        },
    ],
};

/// Budgets tried on each pose, from none to unlimited.
const BUDGETS: usize = 10;
/// Ticks that continue with a short budget and a warm start.
const TICKS: usize = 4;
const POSES: usize = 25;
const CASES: usize = POSES * (BUDGETS + TICKS);

/// Stiffness (N/mm), largest force (N) and margin (mm) of the wall.
const STIFFNESS: f32 = 1.0;
const MAX_FORCE: f32 = 5.0;
const MARGIN: f32 = 20.0;

#[derive(Clone, Copy, Default)]
struct Tally {
    cases: u64,
    cut_short: u64,
    outside: u64,
    grown: u64,
    unfinished: u64,
    too_weak: u64,
    /// Number of answers for which the wall could only hold.
    held: u64,
    /// Largest error of a bound of an interval, in units of the stated accuracy.
    worst: f64,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.cases += other.cases;
        self.cut_short += other.cut_short;
        self.outside += other.outside;
        self.grown += other.grown;
        self.unfinished += other.unfinished;
        self.too_weak += other.too_weak;
        self.held += other.held;
        self.worst = self.worst.max(other.worst);
    }
}

/// Runs at least the requested number of budgets.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let surfaces = surfaces::all(false);
    let frames = effort.cases.div_ceil(CASES);
    let tallies: Vec<Tally> = (0..frames)
        .into_par_iter()
        .map(|frame| {
            let deformation = Deformation::ALL[frame % Deformation::ALL.len()];
            let surface = &surfaces[frame / Deformation::ALL.len() % surfaces.len()];
            on_one_frame(surface, deformation, &mut Rng::with_seed(frame as u64))
        })
        .collect();
    let mut sum = Tally::default();
    tallies.into_iter().for_each(|tally| sum += tally);
    figures.note("anytime.cases", sum.cases as f64);
    figures.note("anytime.cut-short", sum.cut_short as f64);
    figures.note("anytime.held", sum.held as f64);
    figures.note("anytime.worst-error", sum.worst);
    figures.note("anytime.outside", sum.outside as f64);
    figures.note("anytime.grown", sum.grown as f64);
    figures.note("anytime.unfinished", sum.unfinished as f64);
    figures.note("anytime.too-weak", sum.too_weak as f64);
    Ok(Outcome::Passed)
}

fn on_one_frame(surface: &Surface, deformation: Deformation, rng: &mut Rng) -> Tally {
    let tree = surface.tree.tree::<u16>().expect("16-bit indices");
    let triangles = surfaces::triangles(&tree);
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
    let moved = deformation.apply(&surface.mesh, tree.paths(), tree.stretch(), rng);
    let rows = surface.tree.to_rows(&moved);
    let measured = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
    let mut tally = Tally::default();
    for _ in 0..POSES {
        let tool = pose(&rows, &triangles, rng);
        let truth = exhaustive(&rows, &triangles, &tool).expect("has triangles");
        let mut options = Options::cold();
        if rng.bool() {
            options = options.stretch(measured);
        }
        if rng.bool() {
            options = options.warm_start(Some(TriangleRow(rng.u32(..tree.triangle_count() + 2))));
        }
        let mut ask = |options: &Options| {
            ask::closest(&mut query, rows.as_slice(), &tool, options).expect("a sound tree")
        };
        let mut before: Option<Proximity> = None;
        for budget in ladder(tree.triangle_count(), rng) {
            let answer = ask(&options.budget(budget));
            judge(&answer, &truth, &mut tally);
            let narrower = |before: Proximity| {
                answer.lower >= before.lower
                    && answer.separation <= before.separation + answer.accuracy
            };
            tally.grown += u64::from(!before.is_none_or(narrower));
            let unlimited = budget == Budget::UNLIMITED;
            tally.unfinished += u64::from(unlimited && answer.lower != answer.separation);
            before = Some(answer);
        }
        let short = Budget::new(rng.u32(..88));
        let mut options = options.budget(short);
        let mut before: Option<Proximity> = None;
        for _ in 0..TICKS {
            let answer = ask(&options);
            judge(&answer, &truth, &mut tally);
            let no_worse =
                |before: Proximity| answer.separation <= before.separation + answer.accuracy;
            tally.grown += u64::from(!before.is_none_or(no_worse));
            if answer.triangle.is_some() {
                options = options.warm_start(answer.triangle);
                before = Some(answer);
            }
        }
    }
    tally
}

/// Budgets that increase from zero to unlimited.
fn ladder(triangles: u32, rng: &mut Rng) -> [Budget; BUDGETS] {
    let mut budgets = [Budget::new(0); BUDGETS];
    for i in 1..BUDGETS {
        let most = triangles >> (BUDGETS - i).min(7);
        let before = budgets[i - 1];
        budgets[i] = Budget::new(before.tests() + rng.u32(..=4 * most + 8));
    }
    budgets[BUDGETS - 1] = Budget::UNLIMITED;
    budgets
}

/// Checks that the interval contains the true separation, and that the force is at least that of the true separation.
fn judge(answer: &Proximity, truth: &OraclePair, tally: &mut Tally) {
    let accuracy = f64::from(answer.accuracy);
    let below = f64::from(answer.lower) - truth.separation;
    let above = truth.separation - f64::from(answer.separation);
    tally.cases += 1;
    tally.cut_short += u64::from(answer.lower < answer.separation);
    tally.outside += u64::from(!(below <= accuracy && above <= accuracy));
    tally.worst = tally.worst.max(below.max(above) / accuracy);

    let spring = SpringDamper::stiffness(STIFFNESS).max_force(MAX_FORCE);
    let wall = ForbiddenRegion::new(spring, MARGIN).expect("a valid margin");
    let force = wall.force(&Ok(*answer), Vec3::ZERO);
    let needed = (f64::from(STIFFNESS) * (f64::from(MARGIN) - truth.separation))
        .clamp(0.0, f64::from(MAX_FORCE));
    let held = matches!(force.state, ConstraintState::Safe(_));
    tally.held += u64::from(held);
    let strong = f64::from(force.force.length()) >= needed * (1.0 - 1e-6) - 1e-6;
    tally.too_weak += u64::from(!held && !strong);
}
