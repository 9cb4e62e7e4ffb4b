//! Ticks that the budget ends: the last tick's bounds, reduced by the motion since, still give an answer.

// Requirement: T-02

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Contacts, Interval, NoSide, Odometer, Options, Proximity, Query, Side, Sphere,
    Tool, Tracker,
};
use dibs_tests::deform::unit;
use dibs_tests::surfaces::cuboid;
use fastrand::Rng;
use glam::Vec3;

/// A tool that moves back and forth through a surface of this size, and rotates.
struct Path {
    tip: Vec3,
    along: Vec3,
    goal: Vec3,
    length: f32,
    size: f32,
    rng: Rng,
}

impl Path {
    fn step(&mut self) -> Capsule {
        let rng = &mut self.rng;
        if self.tip.distance(self.goal) < 1.0 {
            self.goal = unit(rng) * self.size * rng.f32();
        }
        let far = self.size * [0.0, 0.001, 0.004, 0.02][rng.usize(..4)];
        self.tip += (self.goal - self.tip).normalize_or_zero() * far;
        self.along = (self.along + unit(rng) * 0.01).normalize();
        Capsule::new(self.tip, self.tip + self.along * self.length, 1.0).expect("finite")
    }
}

/// A random budget, from none to nearly enough.
fn any_budget(rng: &mut Rng) -> Budget {
    let up_to = |most: u32, rng: &mut Rng| (most as f32 * rng.f32().powi(3)) as u32;
    Budget::new(up_to(6_000, rng))
}

fn meet(one: Interval, other: Interval) -> bool {
    one.lower <= other.upper && other.lower <= one.upper
}

/// A tracker's ticks with changing budgets, compared with complete queries.
fn ticks_hold(mesh: &Mesh, frames: &[Vec<Vec3>], size: f32, ticks: u32, seed: u64) -> [u32; 3] {
    let built = Builder::new().stretch(1.5).build(mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: Vec<_> = frames.iter().map(|frame| built.to_rows(frame)).collect();
    let mut tracker = Tracker::<u16, MAX_STACK, 512, 512>::with_range(&tree).expect("deep enough");
    let mut list = Contacts::<8>::new();
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let mut rng = Rng::with_seed(seed);
    let (mut settled, mut narrowed, mut wide) = (0, 0, 0);
    let (mut has_past, mut past) = (false, None::<Interval>);
    let mut step = None;
    for length in [0.0, 0.1 * size, size] {
        let (tip, along) = (Vec3::X * 2.0 * size, Vec3::Y);
        let mut path =
            Path { tip, along, goal: Vec3::ZERO, length, size, rng: Rng::with_seed(seed) };
        for tick in 0..ticks {
            let (frame, next) =
                (tick as usize / 10 % frames.len(), (tick as usize / 10 + 1) % frames.len());
            if tick % 10 == 0 {
                step = Some(odometer.step(frames[frame].as_slice(), frames[next].as_slice()));
            }
            let surface = step.as_ref().expect("a step").at((tick % 10) as f32 / 10.0);
            let tool = path.step();
            let budget = if tick == 0 { Budget::UNLIMITED } else { any_budget(&mut rng) };
            let options = Options::new().budget(budget);
            // At times with all contacts.
            let tracked = match tick % 3 {
                1 => tracker.contacts(&surface, &tool, 0.1 * size, &options, &mut list),
                _ => tracker.closest(&surface, &tool, &options),
            };
            let tracked = tracked.expect("an answer");
            let closest = tracked.closest;
            let whole = Options::cold().depth_tolerance(0.001 * size);
            let whole = query.closest(&surface, &tool, &whole).expect("an answer");
            let found = query.closest(&surface, &tool, &options).expect("an answer");
            has_past &= tracked.moved.is_some();
            let interval = closest.interval();
            if let (true, Some(past), Some(moved)) = (has_past, past, tracked.moved) {
                // What was certain a tick ago, widened by the motion.
                let most = moved + 4.0 * closest.accuracy;
                let is_certain =
                    interval.lower >= past.lower - most && interval.upper <= past.upper + most;
                assert!(is_certain, "{tick}: {interval:?} after {past:?}, moved {moved}");
            }
            past = Some(interval);
            if matches!(whole.side, Side::Undefined(_)) {
                continue;
            }
            assert!(meet(interval, whole.interval()), "{tick}: {closest:?} {whole:?}");
            assert!(closest.lower <= closest.separation, "{closest:?}");
            if has_past {
                assert!(!matches!(closest.side, Side::Undefined(_)), "{tick}: {closest:?}");
                assert!((closest.direction.length() - 1.0).abs() < 1e-3, "{tick}: {closest:?}");
                settled += u32::from(found.side == Side::Undefined(NoSide::CutShort));
                narrowed += u32::from(
                    interval.lower > found.interval().lower + 2.0 * found.accuracy
                        && found.interval().lower.is_finite(),
                );
                wide += u32::from(interval.upper - interval.lower > tool.axis_length() + size);
            }
            has_past |= !matches!(closest.side, Side::Undefined(_));
        }
    }
    [settled, narrowed, wide]
}

#[test]
fn what_was_certain_a_tick_ago_stays_an_answer_under_any_budget() {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000).expect("a valid size");
    let ticks = if cfg!(debug_assertions) { 600 } else { 6_000 };
    let heart = ticks_hold(&mesh, &motion.frames, 60.0, ticks, 1);
    let (positions, triangles) = cuboid(Vec3::new(-30.0, -30.0, -0.5), Vec3::new(30.0, 30.0, 0.5));
    let plate =
        Mesh { positions: positions.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() };
    let frames = [positions.to_vec(), positions.map(|at| at * 1.02).to_vec()];
    let plate = ticks_hold(&plate, &frames, 40.0, ticks, 2);
    println!("{heart:?} {plate:?} sides, narrower, wide");
    assert!(heart[0] > ticks / 10 && heart[1] > ticks / 100, "{heart:?}");
}

/// With three quarters of the instructions that a tick needs, the bounds near the tool run out in every tick. Each subtree
/// is searched again within some ticks, so that the interval is at most some motions wide.
#[test]
fn every_bound_has_its_turn_under_a_budget_that_is_always_too_small() {
    const STEP: f32 = 0.3;
    const TICKS: u32 = 400;
    let heart = generate::heart(20_000).expect("a valid size").mesh;
    let built = Builder::new().build(&heart).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&heart.positions);
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let tool = |tick: u32| {
        let tip = Vec3::new(5.0, 0.0, 20.0) + Vec3::Y * STEP * (tick % 2) as f32;
        Capsule::new(tip, tip + Vec3::Z * 30.0, 1.0).expect("finite")
    };
    let ask = |budget: Budget| {
        let mut tracker = Tracker::<u16, MAX_STACK, 1_024>::new(&tree).expect("deep enough");
        let options = Options::new().unsigned().budget(budget);
        let mut answer = |tick: u32| {
            let options = if tick == 0 { Options::new().unsigned() } else { options };
            tracker.closest(&surface, &tool(tick), &options).expect("an answer").closest
        };
        (0..TICKS).map(&mut answer).collect::<Vec<_>>()
    };
    let whole = ask(Budget::UNLIMITED);
    let tests = whole.iter().skip(2).map(|found| found.node_tests + 8 * found.triangle_tests);
    let mean = tests.sum::<u32>() / (TICKS - 2);
    let cut = ask(Budget::new(mean * 3 / 4));
    let width = |found: &Proximity| found.separation - found.lower;
    let short = cut.iter().filter(|found| width(found) > STEP).count();
    let widest = cut.iter().map(width).fold(0.0, f32::max);
    println!("{mean} tests a tick; {short} of {TICKS} cut, {widest} mm wide at most");
    assert!(short > TICKS as usize / 10, "the budget of {mean} is enough");
    assert!(widest < 20.0 * STEP, "{widest}");
}

/// A much thicker tool at the same place has an accuracy that is larger than the interval of the tick before.
#[test]
fn an_interval_that_is_narrower_than_the_accuracy_stays_in_order() {
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let tool = |radius: f32| Sphere::new(Vec3::new(80.0, 0.0, 20.0), radius).expect("finite");
    let mut tick = |radius: f32, budget: Budget| {
        let options = Options::new().budget(budget);
        tracker.closest(&surface, &tool(radius), &options).expect("an answer")
    };
    let thin = tick(1.0, Budget::UNLIMITED);
    let thick = tick(500.0, Budget::new(0));
    assert!(thick.is_kept && thick.closest.side == Side::Outside, "{thick:?}");
    assert!(thick.closest.accuracy > 2.0 * thin.closest.accuracy, "{thin:?} {thick:?}");
    assert!(thick.closest.lower <= thick.closest.separation, "{thick:?}");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let whole = query.closest(&surface, &tool(500.0), &Options::cold()).expect("an answer");
    assert!(meet(thick.closest.interval(), whole.interval()), "{thick:?} {whole:?}");
}

/// A tick that needs more tests than its budget has makes as many as the budget has.
#[test]
fn a_tick_takes_all_of_its_budget_and_no_more() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let mut most = 0;
    for row in (0..rows.len()).step_by(7) {
        let sphere = Sphere::new(rows[row] * 1.2, 1.0).expect("valid");
        let first = |budget| {
            let mut tracker = Tracker::<u16, MAX_STACK, 64>::new(&tree).expect("enough");
            let options = Options::cold().unsigned().budget(budget);
            tracker.closest(&surface, &sphere, &options).expect("an answer").closest
        };
        // Within a budget a tick also counts its work between tests.
        let [unlimited, whole] = [Budget::UNLIMITED, Budget::new(1_000_000)].map(first);
        assert!(whole.node_tests > unlimited.node_tests, "{whole:?} {unlimited:?}");
        let mut counted = whole;
        counted.node_tests = unlimited.node_tests;
        assert_eq!(counted, unlimited);
        // A plane's test requires that an exact test would still fit.
        let enough = whole.work() + Budget::TRIANGLE;
        assert_eq!(first(Budget::new(enough)), whole);
        most = most.max(whole.triangle_tests);
        for too_few in 0..whole.work() - 1 {
            let found = first(Budget::new(too_few));
            // A triangle is only tested if the visit to its leaf, its plane and an exact test fit in the budget.
            let spare = 5 + Budget::TRIANGLE;
            assert!(
                found.work() <= too_few + 1 && found.work() + spare > too_few,
                "{too_few} {found:?}"
            );
            assert!(found.separation >= whole.separation, "{found:?} {whole:?}");
            assert!(found.lower <= whole.separation + whole.accuracy, "{found:?} {whole:?}");
        }
        // Without a test there is no closest triangle.
        assert_eq!(first(Budget::new(0)).triangle, None);
    }
    assert!(most >= 3, "{most} tests at most");
}
