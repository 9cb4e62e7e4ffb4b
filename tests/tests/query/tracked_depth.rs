//! The depth of a crossing axis by a tracker, which keeps its proof between ticks, compared with complete queries.

// Requirements: S-03, T-01

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, Odometer, Options, Proximity, Query, Side, Tracker};
use dibs_tests::deform::unit;
use dibs_tests::surfaces::{ball, cuboid};
use fastrand::Rng;
use glam::Vec3;

/// A shaft on a random walk through a surface of this size: usually slow, sometimes with a leap.
struct Shaft {
    tip: Vec3,
    along: Vec3,
    length: f32,
    size: f32,
    rng: Rng,
}

impl Shaft {
    fn step(&mut self) -> Capsule {
        let rng = &mut self.rng;
        let far = match rng.u32(..300) {
            0 => {
                self.tip = unit(rng) * self.size * rng.f32();
                self.along = unit(rng);
                self.length = self.size * (0.1 + 1.4 * rng.f32());
                0.0
            }
            1..30 => 0.0,
            30..40 => 2.0,
            _ => 0.1,
        };
        self.tip += unit(rng) * far - self.tip * (0.001 * far);
        self.along = (self.along + unit(rng) * (far * 0.01)).normalize();
        let end = self.tip + self.along * self.length;
        Capsule::new(self.tip, end, 2.0).expect("finite")
    }
}

/// A complete query's answer is correct where a tracker's is: their intervals intersect.
fn meets(tracked: &Proximity, whole: &Proximity) -> bool {
    let accuracy = tracked.accuracy + whole.accuracy;
    tracked.lower <= whole.separation + accuracy && whole.lower <= tracked.separation + accuracy
}

#[test]
fn the_depth_is_that_of_a_whole_query() {
    let generate::MovingMesh { mesh, motion } = generate::heart(2_000).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: Vec<_> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let (ticks, size) = (if cfg!(debug_assertions) { 400 } else { 30_000 }, 50.0);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let mut shaft =
        Shaft { tip: Vec3::ZERO, along: Vec3::X, length: 60.0, size, rng: Rng::with_seed(1) };
    let mut step = None;
    let (mut crossing, mut cut_short, mut tests) = (0, 0, [0_u64; 2]);
    for tick in 0..ticks {
        let (frame, next) = (tick / 30 % frames.len(), (tick / 30 + 1) % frames.len());
        if tick % 30 == 0 {
            if shaft.rng.u32(..40) == 0 {
                // The motion so far is discarded.
                odometer.start(frames[frame].as_slice());
            }
            step = Some(odometer.step(frames[frame].as_slice(), frames[next].as_slice()));
        }
        let surface = step.as_ref().expect("a step").at((tick % 30) as f32 / 30.0);
        let capsule = shaft.step();
        let budget = match shaft.rng.u32(..50) {
            0 => Budget::new(shaft.rng.u32(..1_800)),
            _ => Budget::UNLIMITED,
        };
        let options = Options::new().budget(budget);
        let options = match shaft.rng.u32(..60) {
            0 => options.unsigned(),
            1 => options.depth_tolerance(f32::INFINITY),
            _ => options,
        };
        let tracked = tracker.closest(&surface, &capsule, &options).expect("an answer").closest;
        let whole = query.closest(&surface, &capsule, &Options::new()).expect("an answer");
        if matches!(tracked.side, Side::Undefined(_)) && whole.side != tracked.side {
            // Without a side, the separation is that of a tool outside.
            cut_short += 1;
            continue;
        }
        assert!(meets(&tracked, &whole), "tick {tick}: {tracked:?}\n{whole:?}");
        if whole.side == Side::Crossing {
            crossing += 1;
            if budget == Budget::UNLIMITED {
                tests[0] += u64::from(tracked.node_tests);
                tests[1] += u64::from(whole.node_tests);
            }
        }
    }
    println!("{crossing} crossing, {cut_short} cut short, {tests:?} node tests");
    assert!(crossing > ticks / 4 && cut_short < ticks / 20);
    assert!(tests[0] < 300 * crossing as u64, "{tests:?}: the tracker saves little");
    assert!(3 * tests[0] < tests[1], "{tests:?}: the tracker saves little");
}

/// The stated tolerance is kept on a slow path, and for a resting tool one point is enough.
#[test]
fn the_interval_is_within_the_tolerance() {
    let generate::MovingMesh { mesh, .. } = generate::heart(2_000).expect("a valid size");
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let options = Options::new().depth_tolerance(0.1);
    for tick in 0..400 {
        let tip = Vec3::new(25.0 - 0.1 * tick.min(300) as f32, 0.0, 30.0);
        let capsule = Capsule::new(tip, Vec3::new(90.0, 10.0, 35.0), 1.0).expect("finite");
        let tracked = tracker.closest(&surface, &capsule, &options).expect("an answer").closest;
        assert_eq!(tracked.side, Side::Crossing, "tick {tick}");
        let width = tracked.separation - tracked.lower;
        assert!(width <= 0.1 + tracked.accuracy, "tick {tick}: {width}");
        assert!(tick <= 301 || tracked.node_tests < 60, "tick {tick}: {}", tracked.node_tests);
    }
}

/// An axis that leaves the surface at a small angle, from a point that is closer than a tracker's accuracy and farther
/// than a search's: one test rules it out.
#[test]
fn an_axis_that_all_but_touches_takes_few_tests() {
    let (positions, triangles) = cuboid(Vec3::splat(-40.0), Vec3::splat(40.0));
    let (positions, triangles) = (positions.to_vec(), triangles.to_vec());
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let mut apart = 0;
    for step in 1..40 {
        let height = 40.0 + 3e-5 * step as f32;
        let (tip, end) = (Vec3::new(-5.0, 2.0, height), Vec3::new(25.0, 7.0, height + 0.6));
        let capsule = Capsule::new(tip, end, 1.0).expect("finite");
        tracker.forget();
        let found =
            tracker.closest(&surface, &capsule, &Options::cold()).expect("an answer").closest;
        apart +=
            u32::from(found.axis_distance > 0.5 * found.accuracy && found.side != Side::Outside);
        assert!(found.node_tests < 200, "{step}: {found:?}");
    }
    assert!(apart > 2, "{apart}: no pose is between the accuracies");
}

/// Around the middle of a ball the whole surface is equally far, and a tracker has no room for so many leaves.
#[test]
fn a_depth_at_the_middle_of_a_ball_is_that_of_a_whole_query() {
    let mesh = ball(4);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let size = mesh.positions[0].length();
    let (mut rng, mut at, mut slow) = (Rng::with_seed(5), Vec3::ZERO, 0.0);
    for tick in 0..2_000 {
        // Steps of very different sizes, so that there is room for the leaves of some searches.
        slow = if tick % 50 == 0 { 0.1 * 10.0_f32.powf(-4.0 * rng.f32()) } else { slow };
        at = (at + unit(&mut rng) * slow * size).clamp_length_max(0.1 * size);
        let end = at + Vec3::new(2.0, 0.3, 0.1) * size;
        let capsule = Capsule::new(at, end, 0.01 * size).expect("finite");
        let tracked =
            tracker.closest(&surface, &capsule, &Options::new()).expect("an answer").closest;
        let whole = query.closest(&surface, &capsule, &Options::new()).expect("an answer");
        assert!(meets(&tracked, &whole), "tick {tick}: {tracked:?}\n{whole:?}");
    }
}
