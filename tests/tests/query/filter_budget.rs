//! A filter whose budget is below the need of its commands: the tool slows down. Where the budget does not even cover
//! the start, some ticks have no safe motion.

// Requirement: C-05

use dibs_build::{Builder, generate};
use dibs_nostd::filter::{Filter, Reason, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Options, Query, Tracker};
use dibs_tests::deform::unit;
use dibs_tests::filter::{Beat, fastest};
use fastrand::Rng;
use glam::Vec3;

const TICK: f32 = 0.001;
const STAND_OFF: f32 = 1.0;
const ROBOT: f32 = 300.0;
const TICKS: u32 = 3_000;

#[derive(Debug, Default)]
struct Run {
    ticks: u32,
    held: u32,
    unsafe_ticks: u32,
    shortened: u32,
    /// mm.
    nearest: f32,
    /// Length of the way (mm).
    way: f32,
}

/// Pushes a capsule against a beating heart, and along it.
fn push(instructions: u32, seed: u64) -> Run {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: Vec<Vec<Vec3>> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let filter = Filter::new(STAND_OFF, ROBOT).expect("in range").budget(instructions);
    let uncertainty = Uncertainty::new(fastest(&motion));
    let mut tracker = Tracker::<_, MAX_STACK, 512>::new(&tree).expect("deep enough");
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("deep enough");
    let mut beat = Beat::new(&tree, &frames, motion.rate);
    let mut rng = Rng::with_seed(seed);
    let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
    let outward = unit(&mut rng);
    let mut ends = [100.0, 160.0].map(|far| middle + outward * far);
    let mut along = unit(&mut rng);
    let mut pushed = Run { nearest: f32::INFINITY, ..Run::default() };
    for tick in 0..TICKS {
        let surface = beat.at(tick as f32 * TICK).surface;
        let outward = (ends[0] - middle).normalize();
        let tool = Capsule::new(ends[0], ends[1], 2.5).expect("finite");
        if tick % 100 == 0 {
            along = unit(&mut rng);
        }
        let way = (along.cross(outward) - outward * 0.5).normalize() * ROBOT * TICK;
        let mut pairs = [(&mut tracker, &surface, &tool)];
        let admitted = filter
            .admit(
                &mut pairs,
                &RigidMotion { about: ends[0], ..RigidMotion::translation(way) },
                TICK,
                &uncertainty,
                &[],
            )
            .expect("an answer");
        let found = query.closest(&surface, &tool, &Options::new()).expect("an answer");
        if tick > 500 {
            pushed.ticks += 1;
            pushed.nearest = pushed.nearest.min(found.separation);
            pushed.held += u32::from(admitted.reason != Reason::Commanded);
            pushed.unsafe_ticks += u32::from(admitted.reason == Reason::NoSafeMotion);
            pushed.shortened += u32::from(admitted.reason == Reason::Shortened);
            pushed.way += admitted.motion.translation.length();
        }
        ends = ends.map(|end| admitted.motion.apply(end));
    }
    pushed
}

/// Searches that the budget ends would admit nothing: without the shortened motions most ticks had no safe motion.
#[test]
fn a_budget_that_is_too_small_slows_the_tool_down() {
    let pushed = |instructions| {
        let pushes = [0, 1, 2].map(|seed| push(instructions, seed));
        println!("{instructions}: {pushes:?}");
        pushes
    };
    let enough = pushed(100_000);
    assert!(enough.iter().all(|one| one.shortened + one.unsafe_ticks == 0 && one.way > 500.0));
    let fewer = pushed(60_000);
    for (few, enough) in fewer.iter().zip(&enough) {
        assert!(few.nearest > STAND_OFF - 0.02 && few.way > 0.5 * enough.way, "{few:?}");
    }
    let few = pushed(46_000);
    assert!(
        few.iter().all(|one| one.held == one.ticks && one.shortened > one.ticks / 2),
        "{few:?}"
    );
    let [unsafe_ticks, ticks] = [
        few.iter().map(|one| one.unsafe_ticks).sum(),
        few.iter().map(|one| one.ticks).sum::<u32>(),
    ];
    assert!(unsafe_ticks < ticks / 10, "{few:?}");
}
