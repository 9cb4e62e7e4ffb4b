//! A tracker that starts within a controller's budget: it needs several ticks, says so, and settles.

// Requirement: T-02

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Cost, Fallback, NoSide, Odometer, Options, Query, Side, Tracker, Tree,
};
use glam::Vec3;

/// Instructions of a tick.
const INSTRUCTIONS: u32 = 40_000;
const TICKS: u32 = 120;
/// Ticks of a frame.
const FRAME: u32 = 40;
/// A point in the heart's chamber.
const MIDDLE: Vec3 = Vec3::new(12.0, -4.0, 38.0);

/// An interval that is narrower (mm) has settled.
const SETTLED: f32 = 4.0;

/// The ticks of a start.
#[derive(Debug, Default)]
struct Start {
    /// Ticks whose side the budget cut short; they are the first ones.
    without_side: u32,
    /// Ticks until the interval stays narrow.
    until_settled: u32,
}

/// Starts a tracker at a tool that moves by `step` a tick.
fn start(tree: &Tree<'_, u16>, frames: &[Vec<Vec3>], from: [Vec3; 2], step: Vec3) -> Start {
    let mut tracker = Tracker::<u16, MAX_STACK, 512>::new(tree).expect("deep enough");
    let mut query = Query::<u16, MAX_STACK>::new(tree).expect("deep enough");
    let mut odometer = Odometer::new(tree);
    let budget = Budget::for_instructions(INSTRUCTIONS, &Cost::M7_TICK);
    let mut found = Start::default();
    let mut surface = None;
    for tick in 0..TICKS {
        let (number, share) = ((tick / FRAME) as usize, (tick % FRAME) as f32 / FRAME as f32);
        let [before, after] = [number, number + 1].map(|number| frames[number].as_slice());
        if tick % FRAME == 0 {
            surface = Some(odometer.step(before, after));
        }
        let moving = surface.as_ref().expect("a step").at(share);
        let [tip, end] = from.map(|point| point + step * tick as f32);
        let tool = Capsule::new(tip, end, 2.5).expect("finite");
        let options = Options::new().budget(budget);
        let answer = tracker.closest(&moving, &tool, &options).expect("an answer");
        let options = Options::cold().depth_tolerance(0.01);
        let whole = query.closest(&moving, &tool, &options).expect("an answer");
        let closest = answer.closest;
        let [known, truth] = [closest.interval(), whole.interval()];
        let holds = known.lower <= truth.upper && truth.lower <= known.upper;
        assert!(holds, "{tick}: {closest:?} {whole:?}");
        assert_eq!(answer.fallback == Some(Fallback::Start), tick == 0, "{tick}: {answer:?}");
        if closest.side == Side::Undefined(NoSide::CutShort) {
            assert_eq!(found.without_side, tick, "a side was lost: {closest:?}");
            assert_eq!(known.lower, f32::NEG_INFINITY);
            found.without_side += 1;
        } else {
            assert_eq!(closest.side, whole.side, "{tick}");
        }
        if !(known.upper - known.lower < SETTLED) {
            found.until_settled = tick + 1;
        }
    }
    found
}

#[test]
fn a_start_within_a_budget_takes_several_ticks_and_says_so() {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: Vec<_> = motion.frames[..4].iter().map(|frame| built.to_rows(frame)).collect();
    let found = [Vec3::new(70.0, 0.0, 10.0), Vec3::X * 20.0].map(|from| {
        let tip = MIDDLE + from;
        start(&tree, &frames, [tip, tip + Vec3::X * 60.0], Vec3::NEG_X * 0.02)
    });
    println!("{found:?}");
    let [outside, crossing] = found;
    // The search for the closest pair takes several ticks outside, and that for the depth where the axis crosses.
    assert!(outside.without_side >= 2, "{outside:?}");
    assert!(crossing.until_settled >= 2, "{crossing:?}");
    assert!(outside.until_settled < 20 && crossing.until_settled < 60, "{outside:?} {crossing:?}");
}
