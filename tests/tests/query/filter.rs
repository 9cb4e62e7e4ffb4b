//! A filter of commands: no tick of adversarial walks comes closer than the stand-off unless its reason says so, and no
//! tick brakes along a wall.
//!
//! One file, because nearly all tests ask the same filter.

// Requirements: C-05, C-06

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::filter::{
    AdmittedMotion, Filter, FilterError, MotionRow, Reason, RigidMotion, Uncertainty,
};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Cost, Millis, MovingTable, Odometer, Tracker};
use dibs_tests::deform::unit;
use dibs_tests::filter::{Episode, Tally, glide, scenes, walk};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::sample;
use dibs_tests::surfaces::{Inexact, ball, sheet};
use fastrand::Rng;
use glam::Vec3;
use rayon::prelude::*;

/// Walks of 400 ticks: `DIBS_FILTER_WALKS`, if set.
fn walks() -> u64 {
    std::env::var("DIBS_FILTER_WALKS")
        .map_or(sample(100) as u64, |text| text.parse().expect("a number"))
}

#[test]
fn no_walk_comes_nearer_than_the_stand_off() {
    let scenes = scenes();
    let tallies: Vec<(usize, Tally)> = (0..walks())
        .into_par_iter()
        .map(|seed| {
            let scene = seed as usize % scenes.len();
            let episode = Episode::any(&mut Rng::with_seed(seed));
            let tally = walk(&scenes[scene], &episode, seed);
            if tally.violations + tally.uncertain + tally.too_fast > 0 {
                println!("{seed} {}: {episode:?} {tally:?}", scenes[scene].name);
            }
            (scene, tally)
        })
        .collect();
    let mut all = Tally::default();
    for (number, scene) in scenes.iter().enumerate() {
        let mut sum = Tally::default();
        tallies.iter().filter(|(scene, _)| *scene == number).for_each(|(_, one)| sum += *one);
        println!("{:12} {sum:?}", scene.name);
        all += sum;
    }
    println!("{all:?}");
    assert_eq!((all.violations, all.uncertain, all.too_fast, all.cries), (0, 0, 0, 0));
    assert_eq!(all.over_budget, 0);
    // The walks must reach the walls, and motions must be admitted there.
    let admitted: u64 = all.reasons.iter().sum();
    assert!(all.near > all.ticks / 2 && all.reasons[1] > all.ticks / 5);
    assert!(admitted > all.ticks / 2 && all.below > all.ticks / 100);
}

/// On the medial axis two walls are equally near, so that a tick's closest point may be on another wall than the last
/// one's.
#[test]
fn no_walk_to_a_medial_axis_comes_nearer_than_the_stand_off() {
    let scenes: Vec<_> = scenes().into_iter().filter(|scene| !scene.is_convex).collect();
    let tallies = (0..walks() / 2).into_par_iter().map(|seed| {
        let scene = &scenes[seed as usize % scenes.len()];
        let any = Episode::any(&mut Rng::with_seed(seed));
        let episode = Episode { is_medial: true, ticks: 200, ..any };
        walk(scene, &episode, seed)
    });
    let all = tallies.reduce(Tally::default, |mut sum, one| {
        sum += one;
        sum
    });
    println!("{all:?}");
    assert_eq!((all.violations, all.uncertain, all.too_fast), (0, 0, 0));
    assert!(all.medial > all.ticks / 10 && all.near > all.ticks / 2, "{all:?}");
}

#[test]
fn along_a_wall_it_does_not_brake() {
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let (mut instructions, mut ticks) = (0, 0);
    for seed in 1..4 {
        let glided = glide(&mesh, &motion, 1.5, (4_000, seed), 0.0);
        println!("{glided:?}");
        assert!(glided.free > 1_000 && glided.whole == glided.free);
        assert!(glided.along > 40 && glided.least_along >= 0.95);
        assert_eq!(glided.unsafe_ticks, 0);
        assert!(glided.most <= 200_000);
        (instructions, ticks) = (instructions + glided.instructions, ticks + glided.ticks);
    }
    // By the cost of a tick, which is above the instructions of each search.
    assert!(instructions <= 60_000 * u64::from(ticks), "{instructions} in {ticks} ticks");
}

/// A surface at rest, and a tool with a filter.
struct Bench {
    built: BuiltTree,
    rows: Vec<Vec3>,
    filter: Filter,
    uncertainty: Uncertainty,
    own: Vec<MotionRow>,
    period: f32,
}

impl Bench {
    fn new(mesh: &Mesh, stand_off: f32) -> Self {
        let built = Builder::new().build(mesh).expect("a valid mesh");
        let rows = built.to_rows(&mesh.positions);
        let filter = Filter::new(stand_off, 200.0).expect("in range");
        Self { built, rows, filter, uncertainty: Uncertainty::NONE, own: vec![], period: 0.001 }
    }

    fn ask(&self, tool: &Capsule, command: &RigidMotion) -> Result<AdmittedMotion, FilterError> {
        let tree = self.built.tree::<u16>().expect("16-bit indices");
        let mut tracker = Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(self.rows.as_slice());
        let mut pairs = [(&mut tracker, &surface, tool)];
        self.filter.admit(&mut pairs, command, self.period, &self.uncertainty, &self.own)
    }
}

fn capsule(start: Vec3, end: Vec3) -> Capsule {
    Capsule::new(start, end, 1.0).expect("finite")
}

#[test]
fn bad_input_is_named() {
    let mut bench = Bench::new(&ball(2), 1.0);
    let tool = capsule(Vec3::Z * 45.0, Vec3::Z * 80.0);
    let step = RigidMotion::translation(Vec3::X * 0.1);
    assert_eq!(bench.ask(&tool, &step).expect("an answer").reason, Reason::Commanded);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in [Vec3::X, Vec3::Z] {
            let commands = [
                RigidMotion { translation: axis * bad, ..step },
                RigidMotion { rotation: axis * bad, ..step },
                RigidMotion { about: axis * bad, ..step },
            ];
            for command in commands {
                assert_eq!(bench.ask(&tool, &command), Err(FilterError::Command));
            }
        }
        bench.own = vec![MotionRow::along(Vec3::X, 0.0), MotionRow::along(Vec3::X, bad)];
        assert_eq!(bench.ask(&tool, &step), Err(FilterError::Row { row: 1 }));
        bench.own.clear();
    }
    // Factors whose squares f32 does not hold, and a limit that it does not hold once they are scaled.
    for (factor, least) in [(1e20, 1e19), (1e-18, 1e-19), (1e-30, -1e-31), (1e-10, 1e30)] {
        bench.own = vec![MotionRow::along(Vec3::X * factor, least)];
        assert_eq!(bench.ask(&tool, &step), Err(FilterError::Row { row: 0 }), "{factor} {least}");
    }
    bench.own = vec![MotionRow::along(Vec3::ZERO, -1.0), MotionRow::along(Vec3::X * 1e10, 2e9)];
    let pushed = bench.ask(&tool, &step).expect("an answer");
    assert!((pushed.motion.translation.x - 0.2).abs() < 1e-3, "{pushed:?}");
    bench.own.clear();
    let named = |error| match error {
        FilterError::Parameter { parameter, .. } => parameter,
        other => panic!("{other:?}"),
    };
    for bad in [0.0, -0.001, f32::NAN, f32::INFINITY] {
        bench.period = bad;
        assert_eq!(named(bench.ask(&tool, &step).unwrap_err()), "period", "{bad}");
        assert_eq!(named(Filter::new(1.0, bad).unwrap_err()), "speed", "{bad}");
        assert_eq!(named(bench.filter.lever(bad).unwrap_err()), "lever", "{bad}");
        if bad != 0.0 {
            assert_eq!(named(bench.filter.approach(bad).unwrap_err()), "approach", "{bad}");
        }
    }
    bench.period = 0.001;
    for bad in [-1.0, f32::NAN, f32::INFINITY] {
        assert_eq!(named(Filter::new(bad, 200.0).unwrap_err()), "stand_off", "{bad}");
        bench.uncertainty = Uncertainty::NONE.error(bad);
        assert_eq!(named(bench.ask(&tool, &step).unwrap_err()), "uncertainty", "{bad}");
        bench.uncertainty = Uncertainty::new(bad);
        assert_eq!(named(bench.ask(&tool, &step).unwrap_err()), "tissue speed", "{bad}");
    }
    bench.uncertainty = Uncertainty::new(100.0).after(Millis(u32::MAX));
    let lost = bench.ask(&tool, &step).expect("an answer");
    assert_eq!(lost.reason, Reason::NoSafeMotion);
    bench.uncertainty = Uncertainty::NONE;
    bench.own = vec![MotionRow::along(Vec3::X, -9.0); 9];
    assert_eq!(bench.ask(&tool, &step), Err(FilterError::Rows { found: 9, most: 8 }));
    type Pair<'p> =
        (&'p mut Tracker<'p, u16, MAX_STACK, 256>, &'p MovingTable<'p, [Vec3]>, &'p Capsule);
    let none: &mut [Pair<'_>] = &mut [];
    let refused = bench.filter.admit(none, &step, 0.001, &Uncertainty::NONE, &[]);
    assert_eq!(refused, Err(FilterError::Pairs { found: 0, most: Filter::MOST_PAIRS }));
    // A large command is shortened to the robot's speed.
    bench.own.clear();
    let leap = RigidMotion::new(tool.start(), Vec3::splat(1e30), Vec3::splat(-1e9));
    let admitted = bench.ask(&tool, &leap).expect("an answer");
    assert!(admitted.motion.translation.length() < 0.2001, "{admitted:?}");
    assert_ne!(admitted.reason, Reason::Commanded);
}

/// A tool that starts inside, crossing, or closer than its stand-off moves out, and the reason says so until it is out.
#[test]
fn a_start_too_near_leads_out_and_is_no_pass() {
    let mesh = ball(2);
    let truth = |tool: &Capsule| {
        let tool = Instrument::capsule(tool.start(), tool.end(), 1.0);
        exhaustive(&mesh.positions, &mesh.triangles, &tool).expect("triangles").separation
    };
    let starts = [
        (capsule(Vec3::Z * 39.9, Vec3::new(3.0, 1.0, 60.0)), 1.0),
        (capsule(Vec3::Z * 36.0, Vec3::new(3.0, 1.0, 60.0)), 1.0),
        (capsule(Vec3::Z * 20.0, Vec3::new(3.0, 1.0, 30.0)), 1.0),
        (capsule(Vec3::Z * 41.5, Vec3::Z * 60.0), 1.0),
        // A stand-off that exceeds the initial separation.
        (capsule(Vec3::Z * 45.0, Vec3::Z * 60.0), 9.0),
    ];
    for (number, (mut tool, stand_off)) in starts.into_iter().enumerate() {
        let bench = Bench::new(&mesh, stand_off);
        let (mut said, mut ticks) = (0, 0);
        while truth(&tool) < f64::from(stand_off) - 0.011 || ticks == 0 || ticks < 20 {
            let command = RigidMotion::new(tool.start(), Vec3::NEG_Z * 0.2, Vec3::ZERO);
            let admitted = bench.ask(&tool, &command).expect("an answer");
            let is_near = truth(&tool) < f64::from(stand_off) - 0.02;
            assert!(!is_near || admitted.reason == Reason::NoSafeMotion, "{number}: {admitted:?}");
            said += u32::from(admitted.reason == Reason::NoSafeMotion);
            let moved = admitted.motion;
            tool = capsule(moved.apply(tool.start()), moved.apply(tool.end()));
            ticks += 1;
            assert!(ticks < 2_000, "{number}: it stays at {} {admitted:?}", truth(&tool));
        }
        assert!(said > 0, "{number}");
    }
}

/// Between walls nearer than the stand-off no motion is safe.
#[test]
fn a_gap_too_narrow_is_said() {
    let gap = sheet(12, 40.0, |x, _| 30.0 * ((x.abs() - 3.5) / 3.0).clamp(0.0, 1.0));
    let bench = Bench::new(&gap, 4.0);
    let tool = capsule(Vec3::new(0.1, 0.0, 10.0), Vec3::new(0.0, 0.0, 60.0));
    let admitted = bench.ask(&tool, &RigidMotion::translation(Vec3::X * 0.1)).expect("an answer");
    assert_eq!(admitted.reason, Reason::NoSafeMotion);
}

/// The caller's rows and the stand-off are kept, whatever the command and the walls are.
#[test]
fn rows_of_the_caller_hold() {
    let mesh = ball(2);
    let mut bench = Bench::new(&mesh, 1.0);
    // A remote centre of motion on the shaft: no motion across the shaft there.
    let (tip, port) = (Vec3::new(0.3, 0.2, 42.02), Vec3::new(5.0, 2.0, 100.0));
    let tool = capsule(tip, port);
    let shaft = (port - tip).normalize();
    let across = [shaft.any_orthonormal_pair().0, shaft.any_orthonormal_pair().1];
    for direction in across.into_iter().flat_map(|across| [across, -across]) {
        let arm = port - tip;
        let angular = arm.cross(direction).to_array();
        bench.own.push(MotionRow { linear: direction.to_array(), angular, least: 0.0 });
    }
    let mut rng = Rng::with_seed(3);
    let (mut moved, mut walls) = (0, 0);
    for _ in 0..200 {
        let push = unit(&mut rng) * 0.2;
        let command = RigidMotion::new(tip, push, unit(&mut rng) * 0.003);
        let admitted = bench.ask(&tool, &command).expect("an answer");
        let motion = admitted.motion;
        let at_port = motion.translation + motion.rotation.cross(port - tip);
        for direction in across {
            assert!(at_port.dot(direction).abs() < 1e-3, "{admitted:?}");
        }
        let [start, end] = [tip, port].map(|end| motion.apply(end));
        let at_end = Instrument::capsule(start, end, 1.0);
        let truth = exhaustive(&mesh.positions, &mesh.triangles, &at_end).expect("triangles");
        assert_ne!(admitted.reason, Reason::NoSafeMotion, "{admitted:?}");
        assert!(truth.separation > 0.98, "{truth:?} {admitted:?}");
        moved += usize::from(motion.rotation.length() > 1e-4);
        let down = motion.translation.dot(Vec3::NEG_Z);
        walls += usize::from(push.z < -0.1 && down < 0.8 * -push.z);
    }
    assert!(moved > 100 && walls > 20, "{moved} {walls}");
}

/// Rows that no motion keeps leave the tool where it is: two that exclude each other, and one far beyond any motion.
#[test]
fn rows_that_no_motion_keeps_leave_the_tool_at_rest() {
    let mut bench = Bench::new(&ball(2), 1.0);
    let tool = capsule(Vec3::Z * 45.0, Vec3::Z * 80.0);
    let apart = [Vec3::X, Vec3::NEG_X].map(|along| MotionRow::along(along, 0.05));
    let far = MotionRow { linear: [0.0; 3], angular: [0.0, 0.0, 1.0], least: 1e20 };
    for own in [apart.to_vec(), vec![far]] {
        bench.own = own;
        let admitted =
            bench.ask(&tool, &RigidMotion::translation(Vec3::X * 0.1)).expect("an answer");
        assert_eq!(admitted.reason, Reason::Stopped, "{admitted:?}");
        let RigidMotion { translation, rotation, .. } = admitted.motion;
        assert_eq!((translation, rotation), (Vec3::ZERO, Vec3::ZERO));
    }
}

/// A reference point so far away that the lever to it overflows gives motions that are no numbers: the tool stays where
/// it is.
#[test]
fn a_reference_point_too_far_away_leaves_the_tool_at_rest() {
    let bench = Bench::new(&ball(2), 1.0);
    let tool = capsule(Vec3::Z * 45.0, Vec3::Z * 80.0);
    for (step, turn) in [(Vec3::X * 0.1, Vec3::ZERO), (Vec3::ZERO, Vec3::Z * 0.1)] {
        let command = RigidMotion::new(Vec3::X * 1e20, step, turn);
        let admitted = bench.ask(&tool, &command).expect("an answer");
        assert_eq!(admitted.reason, Reason::Stopped, "{admitted:?}");
        let RigidMotion { translation, rotation, .. } = admitted.motion;
        assert_eq!((translation, rotation), (Vec3::ZERO, Vec3::ZERO));
    }
}

/// Without a command a tool leaves a surface that approaches; with one it keeps the command besides.
#[test]
fn a_tool_without_a_command_retreats_from_an_approaching_surface() {
    let mut bench = Bench::new(&sheet(20, 60.0, |_, _| 0.0), 1.0);
    // 0.1 mm in a period, half of which is left.
    bench.uncertainty = Uncertainty::new(100.0);
    let tip = Vec3::new(0.3, 0.2, 2.05);
    let tool = capsule(tip, tip + Vec3::Z * 40.0);
    for (step, reason) in [(Vec3::ZERO, Reason::Retreating), (Vec3::X * 0.1, Reason::Nearest)] {
        let admitted =
            bench.ask(&tool, &RigidMotion::new(tip, step, Vec3::ZERO)).expect("an answer");
        assert_eq!(admitted.reason, reason, "{admitted:?}");
        let off = admitted.motion.translation - step - Vec3::Z * 0.05;
        assert!(off.length() < 5e-3, "{admitted:?}");
    }
}

/// It retreats, too, where the robot's full speed keeps the stand-off only to the promised hundredth of a millimetre.
/// Rounding may make that motion a little longer than the smallest one.
#[test]
fn a_tool_without_a_command_retreats_at_the_robots_speed() {
    let mut bench = Bench::new(&sheet(20, 60.0, |x, _| x), 1.0);
    // 0.3 mm in a period, of which the robot makes 0.2.
    bench.uncertainty = Uncertainty::new(300.0);
    let out = Vec3::new(-1.0, 0.0, 1.0).normalize();
    for step in 0..100_u8 {
        // After that step up to 0.008 mm of the stand-off are missing.
        let apart = 2.092 + 7e-5 * f32::from(step);
        let tip = Vec3::new(0.3, 0.2, 0.3) + out * apart;
        let tool = capsule(tip, tip + out * 40.0);
        let command = RigidMotion::new(tip, Vec3::ZERO, Vec3::ZERO);
        let admitted = bench.ask(&tool, &command).expect("an answer");
        assert_eq!(admitted.reason, Reason::Retreating, "{apart}: {admitted:?}");
        let off = admitted.motion.translation - out * 0.2;
        assert!(off.length() < 1e-3, "{apart}: {admitted:?}");
    }
}

/// An error of the surface's positions adds to the stand-off, as a stated error of registration does.
#[test]
fn an_error_of_the_positions_adds_to_the_stand_off() {
    let mut bench = Bench::new(&sheet(20, 60.0, |_, _| 0.0), 1.0);
    let tip = Vec3::new(0.3, 0.2, 2.55);
    let tool = capsule(tip, tip + Vec3::Z * 40.0);
    let push = RigidMotion { about: tip, ..RigidMotion::translation(Vec3::Z * -0.2) };
    let tree = bench.built.tree::<u16>().expect("16-bit indices");
    let mut tracker = Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let (inexact, mut odometer) = (Inexact(&bench.rows, 0.5), Odometer::new(&tree));
    let surface = odometer.start(&inexact);
    let mut pairs = [(&mut tracker, &surface, &tool)];
    let found = bench.filter.admit(&mut pairs, &push, bench.period, &Uncertainty::NONE, &[]);
    bench.uncertainty = Uncertainty::NONE.error(0.5);
    for admitted in [found, bench.ask(&tool, &push)] {
        let step = admitted.expect("an answer").motion.translation.z;
        assert!((step + 0.05).abs() < 2e-3, "{admitted:?}");
    }
}

/// Sixteen rows are kept. Beside eight of the caller and those of eight pairs the wall that a motion meets at its end
/// replaces another, so that the motion is led along it.
#[test]
fn a_wall_beyond_the_sixteenth_row_replaces_another() {
    let corner = sheet(40, 40.0, |x, _| x.abs());
    let bench = Bench::new(&corner, 1.0);
    let tree = bench.built.tree::<u16>().expect("16-bit indices");
    let surface = Odometer::new(&tree).start(bench.rows.as_slice());
    // The left slope is nearest, and leads to the right one.
    let [left, right] = [2.05, 2.1].map(|apart: f32| apart * std::f32::consts::SQRT_2);
    let tip = Vec3::new(0.5 * (left - right), 0.3, 0.5 * (left + right));
    let tool = capsule(tip, tip + Vec3::Z * 40.0);
    let command = RigidMotion::new(tip, Vec3::X * 0.2, Vec3::ZERO);
    let mut trackers: [_; Filter::<0>::MOST_PAIRS] =
        std::array::from_fn(|_| Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough"));
    let mut pairs: Vec<_> = trackers.iter_mut().map(|tracker| (tracker, &surface, &tool)).collect();
    let own = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE].map(|one| [one, -one]);
    let own: Vec<_> = own.iter().flatten().map(|along| MotionRow::along(*along, -1.0)).collect();
    let filter = bench.filter.budget(2_000_000);
    let admitted = filter.admit(&mut pairs, &command, 0.001, &Uncertainty::NONE, &own);
    let admitted = admitted.expect("an answer");
    assert_eq!(admitted.reason, Reason::Nearest, "{admitted:?}");
    let moved = admitted.motion.translation;
    assert!(moved.x > 0.12 && moved.z > 0.02, "{admitted:?}");
    let [start, end] = [tool.start(), tool.end()].map(|end| admitted.motion.apply(end));
    let at_end = Instrument::capsule(start, end, 1.0);
    let truth = exhaustive(&corner.positions, &corner.triangles, &at_end).expect("triangles");
    assert!(truth.separation > 1.0 - 0.001, "{truth:?}");
}

/// Without a budget nothing is admitted.
#[test]
fn nothing_unverified_is_admitted() {
    let mut bench = Bench::new(&ball(3), 1.0);
    let tool = capsule(Vec3::Z * 50.0, Vec3::Z * 90.0);
    let mut admitted = 0;
    for budget in [0, 2_000, 5_000, 10_000, 30_000, 100_000] {
        bench.filter = bench.filter.budget(budget);
        let found = bench.ask(&tool, &RigidMotion::translation(Vec3::X * 0.1)).expect("an answer");
        assert!(found.instructions <= budget, "{budget}: {found:?}");
        let is_admitted = found.reason == Reason::Commanded;
        assert!(is_admitted || found.motion.translation == Vec3::ZERO, "{found:?}");
        admitted += usize::from(is_admitted);
    }
    assert!((1..5).contains(&admitted), "{admitted}");
}

/// Each search takes instructions from the filter's budget, by the filter's [`Cost`], which is that of a tracker's tick
/// unless another is given. A search that would take more than the budget has is not made.
#[test]
fn a_search_costs_what_the_filter_was_told() {
    let mut bench = Bench::new(&ball(3), 1.0);
    let tool = capsule(Vec3::Z * 50.0, Vec3::Z * 90.0);
    let ample = bench.filter.budget(2_000_000);
    let mut asked = |filter: Filter| {
        bench.filter = filter;
        bench.ask(&tool, &RigidMotion::translation(Vec3::X * 0.1)).expect("an answer")
    };
    let by_default = asked(ample);
    assert_eq!(asked(ample.cost(Cost::M7_TICK)), by_default);
    let Cost { base, node_test, triangle_test } = Cost::M7_TICK;
    let times = |factor: u32| Cost {
        base: factor * base,
        node_test: factor * node_test,
        triangle_test: factor * triangle_test,
    };
    let [free, twice, thrice] = [0, 2, 3].map(|factor| asked(ample.cost(times(factor))));
    for found in [&free, &twice, &thrice] {
        assert_eq!((found.reason, found.queries), (by_default.reason, by_default.queries));
    }
    // Searches alone scale with the cost; rows and paths take what `Filter::budget` says.
    assert!((1..=800 + 1_400).contains(&free.instructions), "{free:?}");
    let searches = by_default.instructions - free.instructions;
    assert!(searches > base, "{by_default:?}");
    assert_eq!(twice.instructions - free.instructions, 2 * searches);
    assert_eq!(thrice.instructions - free.instructions, 3 * searches);
    let none = asked(ample.cost(times(3)).budget(3 * base - 1));
    assert_eq!((none.reason, none.queries), (Reason::NoSafeMotion, 0));
    assert!(none.instructions < 3 * base, "{none:?}");
}

/// A budget for little more than the queries' base costs leaves no pair out: each has the last tick's interval, less the
/// motion since.
#[test]
fn no_pair_goes_without_an_answer() {
    let bench = Bench::new(&ball(3), 1.0);
    let tree = bench.built.tree::<u16>().expect("16-bit indices");
    let surface = Odometer::new(&tree).start(bench.rows.as_slice());
    let tools =
        [-20.0, 0.0, 20.0].map(|x| capsule(Vec3::new(x, 0.0, 50.0), Vec3::new(x, 0.0, 90.0)));
    let mut trackers =
        tools.map(|_| Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough"));
    let command = RigidMotion::translation(Vec3::X * 0.1);
    let rows = [MotionRow::along(Vec3::Z, -1.0); 8];
    let least = 800 + 3 * (1_400 + Cost::M7_TICK.base);
    let eight = least + 8 * 64;
    for (budget, rows) in [(200_000, &rows[..]), (least, &[]), (eight, &rows)] {
        let mut pairs: Vec<_> = trackers
            .iter_mut()
            .zip(&tools)
            .map(|(tracker, tool)| (tracker, &surface, tool))
            .collect();
        let filter = bench.filter.budget(budget);
        let admitted = filter.admit(&mut pairs, &command, 0.001, &Uncertainty::NONE, rows);
        let admitted = admitted.expect("an answer");
        assert_eq!(admitted.reason, Reason::Commanded, "{budget}: {admitted:?}");
        assert!(admitted.instructions <= budget, "{budget}: {admitted:?}");
    }
}

/// Straight towards a wall with a time constant of 20 ms the speed decreases with the distance, and the stand-off is
/// reached; along the wall and away from it nothing changes.
#[test]
fn an_approach_takes_its_time() {
    const TIME: f32 = 0.02;
    let mut bench = Bench::new(&sheet(20, 60.0, |_, _| 0.0), 1.0);
    bench.filter = bench.filter.approach(TIME).expect("in range");
    let at = |height: f32| capsule(Vec3::new(0.0, 0.0, height), Vec3::new(0.0, 0.0, height + 40.0));
    let asked = |height: f32, step: Vec3| {
        bench.ask(&at(height), &RigidMotion::translation(step)).expect("an answer")
    };
    let push = Vec3::Z * -0.2;
    let (mut height, mut eased) = (10.0, 0);
    for _ in 0..400 {
        // Distance from the stand-off, which includes the tool's radius.
        let room = height - 2.0;
        let most = room * bench.period / TIME;
        let admitted = asked(height, push);
        let step = -admitted.motion.translation.z;
        if most > 0.2 + 0.002 {
            assert_eq!(admitted.reason, Reason::Commanded, "{height}");
        } else {
            assert!(step <= most + 1e-3 && step >= most - 2e-3, "{height}: {step}, {most}");
            eased += 1;
        }
        height -= step;
    }
    assert!(eased > 100 && (height - 2.0).abs() < 0.02, "{eased} {height}");
    for step in [Vec3::X * 0.2, Vec3::Z * 0.2] {
        assert_eq!(asked(height, step).motion.translation, step);
    }
}
