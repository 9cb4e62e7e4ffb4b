//! A controller's loop on frames with rigid poses: refused frames, and surfaces that are held.

// Requirement: F-08

use dibs_nostd::filter::{Filter, Reason, RigidMotion};
use dibs_nostd::glam::{DQuat, DVec3, Quat, Vec3};
use dibs_nostd::guard::{GuardLimits, PosedRows, Surface};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::wire::{Encoding, Event, FrameEncoder, FrameId, Freshness};
use dibs_nostd::{
    Advance, Capsule, Millis, PoseError, Proximity, ReceiveError, StretchError, TreeBytes,
};
use dibs_tests::bus::collect;
use dibs_tests::posed::{Heart, Sent, Truth, exact, off, steady, steady_at, truth};
use dibs_tests::{embedded, surfaces};
use fastrand::Rng;

use crate::guard_posed::{PERIOD, ROWS, TheBus, TheGuard, limits, send, work};

dibs_nostd::include_tree!("embedded_heart");

/// A heart that beats, rotates and travels.
struct World<'h> {
    heart: &'h Heart,
    start: Sent,
    /// Rotation vector and displacement in a period.
    spin: Vec3,
    flow: Vec3,
}

impl World<'_> {
    fn pose(&self, now: u32) -> Sent {
        let time = f64::from(now) / f64::from(PERIOD);
        steady(self.heart, &self.start, self.spin, self.flow, time)
    }

    /// The positions in its file, and the exact rows in world coordinates.
    fn frame(&self, now: u32) -> Vec<Vec3> {
        self.heart.grown(0.02 * now as f32 * 1e-3)
    }

    /// The exact rows and pose.
    fn exact(&self, time: f64) -> (Vec<DVec3>, (DQuat, DVec3)) {
        let centre = self.heart.centre.as_dvec3();
        let grown = |at: &Vec3| centre + (at.as_dvec3() - centre) * (1.0 + 2e-5 * time);
        let rows = self.heart.built.to_rows(&self.heart.mesh.positions);
        let time = time / f64::from(PERIOD);
        let pose = steady_at(self.heart.centre, &self.start, self.spin, self.flow, time);
        (rows.iter().map(grown).collect(), pose)
    }
}

/// The loop of a controller on a heart that beats, rotates and travels: its answers are correct at every tick, with few
/// whole queries, the velocity is that of its points, and admitted motions keep the stand-off.
#[test]
fn a_controller_runs_on_a_mesh_that_turns_and_travels() {
    let heart = Heart::new(Vec3::new(20.0, 30.0, -10.0));
    let mut rng = Rng::with_seed(9);
    let mut checked = 0;
    for _ in 0..3 {
        let mut vector = |size: f32| {
            let mut number = || (rng.f32() - 0.5) * 2.0 * size;
            Vec3::new(number(), number(), number())
        };
        let start = (Quat::from_scaled_axis(vector(1.5)).normalize(), vector(300.0));
        // Up to 0.6 rad/s and 50 mm/s.
        let world = World { heart: &heart, start, spin: vector(0.01), flow: vector(0.9) };
        checked += walk(&world);
    }
    assert!(checked > 3_800, "{checked}");
}

/// Whether an answer has a side; its separation must be correct.
fn is_right(truth: &Truth, found: &Proximity, now: u32) -> bool {
    let Some(part) = off(truth, found) else { return false };
    assert!(part <= 1.0 && found.accuracy < 0.1, "{now}: {} {found:?}", truth.separation);
    true
}

fn walk(world: &World<'_>) -> u32 {
    let heart = world.heart;
    let surface: Surface<ROWS, PosedRows> = Surface::new();
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let limits = GuardLimits::new(300.0, Millis(200)).automatic();
    let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
        surface.start(tree, limits).expect("valid");
    let filter = Filter::new(1.0, 400.0).expect("in range");
    let (mut checked, mut whole, mut moved, mut turned) = (0, 0, 0, 0);
    let middle = |now: u32| {
        let (rotation, shift) = exact(&world.pose(now));
        (rotation * heart.centre.as_dvec3() + shift).as_vec3()
    };
    let out = Vec3::new(0.8, 0.5, 0.33).normalize();
    let mut ends = [130.0, 170.0].map(|far| middle(0) + out * far);
    for now in 0..2_500 {
        if now % PERIOD == 0 {
            let sent = send(&mut bus, &world.frame(now), &world.pose(now), now);
            assert!(matches!(sent, Ok(Advance::Published { .. })), "{sent:?}");
        }
        let [tip, _] = ends;
        let tool = Capsule::new(ends[0], ends[1], 2.0).expect("valid");
        let towards = (middle(now) - tip).normalize_or_zero() * 0.15;
        let turn = Vec3::new(0.4e-3, -0.3e-3, 0.2e-3) * (now as f32 * 2e-3).cos();
        let command = RigidMotion::new(tip, towards, turn);
        let (answer, motion) = guard.admit(&filter, &tool, &command, Millis(now));
        let executed =
            motion.map_or(RigidMotion::translation(Vec3::ZERO), |admitted| admitted.motion);
        if let Ok(closest) = answer.closest
            && now > 40 * PERIOD
        {
            let (rows, pose) = world.exact(f64::from(now));
            let truth = truth(&heart.triangles, &rows, pose, ends, 2.0);
            assert!(is_right(&truth, &closest, now), "{now}: {closest:?}");
            let (rotation, shift) = pose;
            let on_mesh = rotation.inverse() * (closest.point_on_surface.as_dvec3() - shift);
            let at = |time: f64| {
                let (_, (rotation, shift)) = world.exact(time);
                let centre = heart.centre.as_dvec3();
                let grown = 1.0 + 2e-5 * (time - f64::from(now));
                rotation * (centre + (on_mesh - centre) * grown) + shift
            };
            let velocity = (at(f64::from(now) + 0.5) - at(f64::from(now) - 0.5)) * 1e3;
            let searched = answer.searched.expect("a surface");
            let error = (searched.velocity.as_dvec3() - velocity).length();
            assert!(error < 0.3, "{now}: {} {velocity}", searched.velocity);
            assert_eq!(searched.lag, Some(Millis(0)));
            // The two points of the pair agree with its direction and separation.
            let between = closest.point_on_tool - closest.point_on_surface;
            let along = between - closest.direction * closest.separation;
            assert!(along.length() < 1e-3 + closest.accuracy, "{now}: {closest:?}");
            whole += u32::from(answer.tracked.expect("an answer").fallback.is_some());
            checked += 1;
            let motion = motion.expect("admitted");
            moved += u32::from(executed.translation.length() > 0.01);
            turned += u32::from(executed.rotation.length() > 1e-4);
            if motion.reason == Reason::Commanded {
                assert_eq!(executed, command);
            }
            assert!(motion.reason != Reason::NoSafeMotion, "{now}: {motion:?}");
            assert!(truth.separation > 0.9, "{now}: {}", truth.separation);
        }
        ends = ends.map(|end| executed.apply(end));
    }
    println!("checked {checked}, whole queries {whole}, moved {moved}, turned {turned}");
    assert!(whole < checked / 10 && moved > 300 && turned > 300);
    checked
}

/// Nodes that grow, rotate and travel: their surface is correct between frames, whatever its vertices' weights.
#[test]
fn nodes_may_have_a_pose() {
    const STACK: usize = embedded_heart::STACK;
    static HEART: Surface<{ embedded_heart::NODES }, PosedRows<Nodes<'static>>> = Surface::new();
    let limits = GuardLimits::new(300.0, Millis(200)).automatic();
    let (mut bus, mut guard) =
        HEART.start::<_, STACK, 96>(embedded_heart::TREE, limits).expect("valid");
    let tree = embedded_heart::TREE.validate().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let triangles = surfaces::triangles(&tree);
    let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
    let low = rest.iter().copied().reduce(Vec3::min).expect("has nodes");
    let high = rest.iter().copied().reduce(Vec3::max).expect("has nodes");
    let middle = (low + high) * 0.5;
    let grown = |now: u32| -> Vec<Vec3> {
        rest.iter().map(|&at| middle + (at - middle) * (1.0 + 2e-5 * now as f32)).collect()
    };
    let start = (Quat::from_rotation_x(0.7), Vec3::new(90.0, -300.0, 40.0));
    let (spin, flow) = (Vec3::new(0.01, -0.006, 0.012), Vec3::new(0.5, 0.9, -0.6));
    let pose = |time: f64| steady_at(middle, &start, spin, flow, time / f64::from(PERIOD));
    let mut checked = 0;
    for now in 0..1_500 {
        if now % PERIOD == 0 {
            let (rotation, shift) = pose(f64::from(now));
            let sent = (rotation.as_quat(), shift.as_vec3());
            bus.frame_at(&grown(now), sent, Millis(now), Millis(now)).expect("a good frame");
            while bus.work(100).expect("admitted") == Advance::Pending {}
        }
        if now < 10 * PERIOD {
            continue;
        }
        let (rotation, shift) = pose(f64::from(now));
        let at = (rotation * middle.as_dvec3() + shift).as_vec3() + Vec3::new(70.0, 30.0, 60.0);
        let ends = [at, at + Vec3::new(20.0, -30.0, 25.0)];
        let tool = Capsule::new(ends[0], ends[1], 1.5).expect("valid");
        let answer = guard.closest(&tool, Millis(now));
        let Ok(closest) = answer.closest else { continue };
        let table = grown(now);
        let rows = embedded::rows(&nodes.surface(table.as_slice()));
        let rows: Vec<DVec3> = rows.iter().map(|row| row.as_dvec3()).collect();
        let truth = truth(&triangles, &rows, (rotation, shift), ends, 1.5);
        checked += u32::from(is_right(&truth, &closest, now));
    }
    assert!(checked > 150, "{checked}");
}

/// The last frames' residual covers a steady acceleration: the error of each answer between frames is within its
/// accuracy, and uses most of it.
#[test]
fn a_change_of_the_meshs_speed_is_in_the_accuracy() {
    let heart = Heart::new(Vec3::ZERO);
    let surface: Surface<ROWS, PosedRows> = Surface::new();
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
        surface.start(tree, limits()).expect("valid");
    let turn = Quat::from_rotation_z(0.9);
    // 200 mm/s².
    let pose = |now: u32| (turn, Vec3::new(1e-4 * (now * now) as f32, 70.0, 0.0));
    let rows = heart.built.to_rows(&heart.mesh.positions);
    let rows: Vec<DVec3> = rows.iter().map(|row| row.as_dvec3()).collect();
    let mut worst = 0.0_f64;
    for now in 0..600 {
        if now % PERIOD == 0 {
            send(&mut bus, &heart.grown(0.0), &pose(now), now).expect("admitted");
        }
        let (_, shift) = pose(now);
        let at = shift + Vec3::X * 110.0;
        let tool = Capsule::new(at, at, 2.0).expect("valid");
        let answer = guard.closest(&tool, Millis(now));
        if now < 4 * PERIOD || now % 3 != 0 {
            continue;
        }
        let searched = answer.searched.expect("a surface");
        let residual = searched.residual.expect("extrapolated");
        assert!((residual - 0.18).abs() < 0.01, "{residual}");
        let truth = truth(&heart.triangles, &rows, exact(&pose(now)), [at; 2], 2.0);
        let found = answer.tracked.expect("an answer").closest;
        let part = off(&truth, &found).expect("outside");
        assert!(part <= 1.0, "{now}: {part} {found:?}");
        worst = worst.max(part);
    }
    assert!(worst > 0.5, "{worst}");
}

/// If a time of capture goes back because of a clock's jitter, rows and pose are held; then both continue by the same
/// time, so that a steady motion has no residual.
#[test]
fn a_capture_that_goes_back_leaves_no_residual_of_the_pose() {
    let heart = Heart::new(Vec3::ZERO);
    let surface: Surface<ROWS, PosedRows> = Surface::new();
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
        surface.start(tree, limits()).expect("valid");
    // 100 mm/s.
    let pose = |at: u32| (Quat::from_rotation_x(0.4), Vec3::Y * (0.1 * at as f32));
    let mut residuals = Vec::new();
    for (captured, now) in [(0, 0), (30, 30), (60, 60), (50, 65), (80, 90), (110, 120), (140, 150)]
    {
        let (captured, now) = (Millis(1_000 + captured), Millis(1_000 + now));
        bus.frame_at(&heart.grown(0.0), pose(captured.0), captured, now).expect("a good frame");
        work(&mut bus).expect("admitted");
        let tool = Capsule::new(Vec3::X * 300.0, Vec3::X * 330.0, 2.0).expect("valid");
        residuals.push(guard.closest(&tool, now).searched.expect("a surface").residual);
    }
    let is_held = residuals.iter().map(Option::is_none).collect::<Vec<_>>();
    assert_eq!(is_held, [true, true, false, true, true, false, false], "{residuals:?}");
    for residual in residuals.into_iter().flatten() {
        assert!(residual < 0.01, "{residual}");
    }
}

/// An invalid pose is refused and counted, and so is one that is too fast together with its rows, although neither is
/// too fast alone; the last good frame stays. After an operator's registration the frame is accepted.
#[test]
fn a_wrong_pose_is_refused_and_the_last_good_frame_stays() {
    let heart = Heart::new(Vec3::ZERO);
    let surface: Surface<ROWS, PosedRows> = Surface::new();
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let limits = GuardLimits::new(100.0, Millis(200)).automatic();
    let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
        surface.start(tree, limits).expect("valid");
    let here = (Quat::IDENTITY, Vec3::X * 40.0);
    send(&mut bus, &heart.grown(0.0), &here, 1_000).expect("admitted");
    let tool = Capsule::new(Vec3::new(140.0, 0.0, 0.0), Vec3::new(160.0, 9.0, 0.0), 2.0);
    let tool = tool.expect("valid");
    let mut ask = |now: u32| {
        let found = guard.closest(&tool, Millis(now)).tracked.expect("an answer").closest;
        (found.separation, found.point_on_surface, found.direction)
    };
    let before = ask(1_010);
    let hostile = [
        (Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0), Vec3::ZERO, Event::NotFinite),
        (Quat::IDENTITY, Vec3::Y * f32::INFINITY, Event::NotFinite),
        (Quat::IDENTITY, Vec3::Y * -1e30, Event::TooFar),
        (Quat::from_xyzw(0.0, 0.0, 0.0, 0.0), Vec3::ZERO, Event::Malformed),
        (Quat::from_xyzw(0.0, 0.0, 0.0, 1.001), Vec3::ZERO, Event::Malformed),
        (Quat::from_xyzw(1e30, 0.0, 0.0, 1.0), Vec3::ZERO, Event::Malformed),
    ];
    for (rotation, shift, event) in hostile {
        let counted = bus.counters().of(event);
        let refused = send(&mut bus, &heart.grown(0.0), &(rotation, shift), 1_020);
        assert!(matches!(refused, Err(ReceiveError::Pose(_))), "{refused:?}");
        assert_eq!(refused.expect_err("refused").event(), event);
        assert_eq!(bus.counters().of(event), counted + 1);
        assert_eq!(ask(1_010), before);
    }
    let refused = bus.frame_at(
        &heart.grown(0.0),
        (Quat::IDENTITY * 0.5, Vec3::X),
        Millis(1_020),
        Millis(1_020),
    );
    assert_eq!(refused, Err(ReceiveError::Pose(PoseError::NoRotation { squared: 0.25 })));
    // A wrong number of rows leaves no pose behind.
    let two =
        bus.frame_at(&[Vec3::X; 2], (Quat::IDENTITY, Vec3::X * 41.0), Millis(1_020), Millis(1_020));
    assert_eq!(two, Err(ReceiveError::RowCount { rows: 2 }));
    // 31 ms at 100 mm/s are 3.1 mm. The heart's farthest vertex grows by less than 2 mm.
    let farthest = heart.mesh.positions.iter().map(|&at| at.distance(heart.centre));
    let lever = farthest.fold(0.0, f32::max);
    let grown = heart.grown(2.0 / lever);
    let turned = |angle: f32| {
        let turn = Quat::from_rotation_y(angle);
        (turn, here.1 + heart.centre - turn * heart.centre)
    };
    let moves = [
        (heart.grown(0.0), (Quat::IDENTITY, here.1 + Vec3::Z * 2.0), true),
        (heart.grown(0.0), (Quat::IDENTITY, here.1 + Vec3::Z * 3.2), false),
        (heart.grown(0.0), turned(2.0 / lever), true),
        (heart.grown(0.0), turned(3.2 / lever), false),
        (grown.clone(), here, true),
        (grown.clone(), (Quat::IDENTITY, here.1 + Vec3::Z * 2.0), false),
        (grown, turned(2.0 / lever), false),
    ];
    let mut now = 1_000;
    for (rows, pose, is_taken) in moves {
        now += PERIOD;
        let counted = bus.counters().of(Event::TooFast);
        let outcome = send(&mut bus, &rows, &pose, now);
        if is_taken {
            assert!(outcome.is_ok(), "{outcome:?}");
            let back = send(&mut bus, &heart.grown(0.0), &here, now + PERIOD);
            now += PERIOD;
            assert!(back.is_ok(), "{back:?}");
        } else {
            let error = outcome.expect_err("too fast");
            let ReceiveError::Stretch(StretchError::TooFast { step, limit, .. }) = error else {
                panic!("{error:?}")
            };
            assert!(step > limit && step < 2.0 * limit, "{error:?}");
            assert_eq!(bus.counters().of(Event::TooFast), counted + 1);
            // The surface ages meanwhile.
            send(&mut bus, &heart.grown(0.0), &here, now + 1).expect("admitted");
            now += 1;
        }
    }
    assert_eq!(ask(now).1, before.1);
    // The patient was moved.
    let there = (Quat::IDENTITY, here.1 + Vec3::Z * 500.0);
    assert!(send(&mut bus, &heart.grown(0.0), &there, now + PERIOD).is_err());
    bus.register();
    send(&mut bus, &heart.grown(0.0), &there, now + PERIOD).expect("registered");
    assert!(ask(now + PERIOD).1.z > 400.0);
}

/// A frame in packets without a pose is at the mesh's own coordinates; a partial frame keeps the pose. If a step
/// rotates by more than half a radian, and before the third frame, the surface is held.
#[test]
fn packets_have_no_pose_and_a_fast_turn_is_held() {
    let heart = Heart::new(Vec3::ZERO);
    let surface: Surface<ROWS, PosedRows> = Surface::new();
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
        surface.start(tree, limits()).expect("valid");
    let tool = Capsule::new(Vec3::new(200.0, 0.0, 0.0), Vec3::new(260.0, 9.0, 0.0), 2.0);
    let tool = tool.expect("valid");
    let rows = heart.built.to_rows(&heart.mesh.positions);
    let mut now = 1_000;
    let mut lag = |pose: Option<Sent>| {
        now += PERIOD;
        match pose {
            Some(pose) => drop(send(&mut bus, &heart.grown(0.0), &pose, now).expect("admitted")),
            None => {
                let mesh_id = heart.built.summary().mesh_id;
                let id = FrameId { mesh_id, session: 0, epoch: 4_000 + now };
                let fresh = Freshness { age_ms: 0, echo: Some(now) };
                let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]);
                for packet in collect(sender.expect("valid").with_freshness(fresh)) {
                    bus.packet(&packet, Millis(now)).expect("a good packet");
                }
                let outcome = work(&mut bus);
                assert!(matches!(outcome, Ok(Advance::Published { .. })), "{outcome:?}");
            }
        }
        let answer = guard.closest(&tool, Millis(now + 10));
        let searched = answer.searched.expect("a surface");
        let found = answer.tracked.expect("an answer").closest;
        (searched.lag.expect("a clock").0, found.point_on_surface.x)
    };
    let turned = |angle: f32| Some((Quat::from_rotation_z(angle), Vec3::X * 100.0));
    assert_eq!(lag(turned(0.0)).0, 10);
    assert_eq!(lag(turned(0.0)).0, 10);
    let (third, at) = lag(turned(0.0));
    assert!(third == 0 && at > 120.0, "{at}");
    assert_eq!(lag(turned(0.4)).0, 0);
    assert_eq!(lag(turned(1.0)).0, 10, "0.6 rad");
    assert_eq!(lag(turned(1.1)).0, 10, "nothing to compare it with");
    assert_eq!(lag(turned(1.2)).0, 0);
    let (_, at) = lag(None);
    assert!(at < 100.0, "{at}");
}
