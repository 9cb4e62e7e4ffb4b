//! Frames from the same process: the same results as with packets, from positions in the order of the mesh's file.

// Requirement: B-08

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;
use std::time::Instant;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::failsafe::State;
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Bus, Guard, GuardLimits, Surface};
use dibs_nostd::wire::{Encoding, Event, FrameEncoder, FrameId, Freshness};
use dibs_nostd::{
    Advance, Millis, Progress, ReceiveError, Sphere, StretchError, TreeBytes, Unavailable,
};
use dibs_tests::bus::collect;
use fastrand::Rng;

dibs_nostd::include_tree!("embedded_heart");

const ROWS: usize = 162;

type Ends<'t> = (Bus<'static, 't, u16>, Guard<'static, 't, u16, 64, 96>);

/// A heart whose file has its vertices shuffled, and one vertex that no triangle uses.
fn shuffled() -> (Mesh, BuiltTree) {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let mut order: Vec<u32> = (0..heart.positions.len() as u32).collect();
    Rng::with_seed(7).shuffle(&mut order);
    let mut positions = vec![Vec3::ZERO; heart.positions.len() + 1];
    for (&at, &position) in order.iter().zip(&heart.positions) {
        positions[at as usize] = position;
    }
    let renamed = |corners: &[u32; 3]| corners.map(|corner| order[corner as usize]);
    let mesh = Mesh {
        origin: heart.origin,
        positions,
        triangles: heart.triangles.iter().map(renamed).collect(),
    };
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    (mesh, built)
}

fn start(built: &BuiltTree, speed: f32) -> Ends<'_> {
    let surface: &'static Surface<ROWS> = Box::leak(Box::new(Surface::new()));
    let limits = GuardLimits::new(speed, Millis(100)).automatic();
    surface.start(TreeBytes::new(built.blob()), limits).expect("valid")
}

/// The mesh in the beat `now`.
fn beat(mesh: &Mesh, now: u32) -> Vec<Vec3> {
    let scale = 1.0 + 0.02 * (now as f32 * 0.01).sin();
    mesh.positions.iter().map(|&at| at * scale).collect()
}

fn published(bus: &mut Bus<'_, '_, u16>) -> bool {
    loop {
        match bus.work(50).expect("admitted") {
            Advance::Pending => (),
            outcome => return matches!(outcome, Advance::Published { .. }),
        }
    }
}

/// The same surface by packets and by a call gives the same answers to the bit, ages, stretch and states.
#[test]
fn a_call_gives_what_packets_give() {
    let (mesh, built) = shuffled();
    let (mut near, mut far) = (start(&built, 300.0), start(&built, 300.0));
    let mesh_id = built.summary().mesh_id;
    let mut compared = 0;
    // The first second is safe until the surface is trusted.
    for now in 1_000..4_000 {
        if now % 20 == 0 {
            // The frame is 7 ms old when it arrives.
            let positions = beat(&mesh, now - 7);
            assert!(matches!(
                near.0.frame(&positions, Millis(now - 7), Millis(now)),
                Ok(Progress::Complete { .. })
            ));
            let rows = built.to_rows(&positions);
            let id = FrameId { mesh_id, session: 1, epoch: now };
            let fresh = Freshness { age_ms: 7, echo: Some(now) };
            let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]);
            for packet in collect(sender.expect("valid").with_freshness(fresh)) {
                let _ = far.0.packet(&packet, Millis(now)).expect("a good packet");
            }
            assert!(published(&mut near.0) && published(&mut far.0));
        }
        let tool = Sphere::new(Vec3::new(78.0, 0.005 * (now - 1_000) as f32, 10.0), 2.0);
        let tool = tool.expect("valid");
        let [near, far] = [&mut near, &mut far].map(|ends| ends.1.closest(&tool, Millis(now)));
        let (Ok(a), Ok(b)) = (near.closest, far.closest) else {
            assert_eq!(near.closest.err(), far.closest.err());
            continue;
        };
        assert_eq!((a.separation.to_bits(), a.triangle), (b.separation.to_bits(), b.triangle));
        assert_eq!((near.velocity, near.trust.state), (far.velocity, State::Nominal));
        let [near, far] = [near, far].map(|answer| answer.searched.expect("a surface"));
        assert_eq!((near.frame.age, near.lag), (far.frame.age, far.lag));
        assert_eq!(a.coverage, b.coverage);
        compared += 1;
    }
    assert!(compared > 1_900, "{compared}");
    // A silent source is not kept alive.
    let tool = Sphere::new(Vec3::new(78.0, 0.0, 10.0), 2.0).expect("valid");
    for mut ends in [near, far] {
        let silent = ends.1.closest(&tool, Millis(4_200));
        assert!(matches!(silent.closest, Err(Unavailable::Stale { .. })), "{:?}", silent.closest);
    }
}

/// Errors are reported and counted, and the last good surface stays.
#[test]
fn a_wrong_frame_is_refused_and_the_last_good_one_stays() {
    let (mesh, built) = shuffled();
    let (mut bus, mut guard) = start(&built, 300.0);
    let good = beat(&mesh, 0);
    let used = mesh.triangles[0][0] as usize;
    let row = built.vertex_order().iter().position(|&vertex| vertex as usize == used);
    let row = row.expect("used") as u32;
    let _ = bus.frame(&good, Millis(1_000), Millis(1_000)).expect("good");
    assert!(published(&mut bus));
    let with = |at: Vec3| {
        let mut wrong = good.clone();
        wrong[used] = at;
        wrong
    };
    let count = ReceiveError::RowCount { rows: ROWS as u32 };
    let wrong = [
        // As many positions as rows, but the file has one more.
        (good[..ROWS].to_vec(), 1_010, count, Event::RowCount),
        (Vec::new(), 1_010, ReceiveError::RowCount { rows: 0 }, Event::RowCount),
        (with(Vec3::NAN), 1_010, ReceiveError::NotFinite { row }, Event::NotFinite),
        (with(Vec3::X * 1e6), 1_010, ReceiveError::TooFar { row }, Event::TooFar),
        (good.clone(), 900, ReceiveError::Earlier { by: Millis(100) }, Event::Stale),
        // A capture in the future, and one longer ago than a packet can state.
        (good.clone(), 1_100, ReceiveError::TooOld, Event::Stale),
        (good.clone(), 1_011_u32.wrapping_sub(66_000), ReceiveError::TooOld, Event::Stale),
    ];
    for (positions, captured, error, event) in wrong {
        let before = bus.counters().of(event);
        assert_eq!(bus.frame(&positions, Millis(captured), Millis(1_011)), Err(error));
        assert_eq!(bus.counters().of(event), before + 1, "{event:?}");
        assert_eq!(bus.work(u32::MAX), Ok(Advance::Idle), "{error:?}");
    }
    // A vertex that no triangle uses may have any position: it is not a row.
    let mut unused = good.clone();
    let loose = (0..unused.len()).find(|&at| !built.vertex_order().contains(&(at as u32)));
    unused[loose.expect("one")] = Vec3::NAN;
    let _ = bus.frame(&unused, Millis(1_012), Millis(1_012)).expect("good");
    assert_eq!(
        bus.frame(&good, Millis(1_013), Millis(1_013)).map_err(|error| error.event()),
        Err(Event::Busy)
    );
    assert!(published(&mut bus));
    // A vertex that moves too far in 10 ms, and a surface turned inside out.
    let torn = bus.frame(&with(good[used] + Vec3::X * 40.0), Millis(1_022), Millis(1_022));
    assert!(torn.is_ok(), "{torn:?}");
    let refused = loop {
        match bus.work(50) {
            Ok(Advance::Pending) => (),
            outcome => break outcome,
        }
    };
    assert!(
        matches!(refused, Err(ReceiveError::Stretch(StretchError::TooFast { .. }))),
        "{refused:?}"
    );
    let tool = Sphere::new(Vec3::new(78.0, 0.0, 10.0), 2.0).expect("valid");
    let answer = guard.closest(&tool, Millis(1_023));
    assert_eq!(answer.searched.expect("a surface").frame.age, Millis(11));
    assert!(answer.tracked.is_ok(), "{answer:?}");
}

/// Both sources in one process: packets may follow a call; a call may follow packets, and abandons their frame.
#[test]
fn a_call_and_packets_take_turns() {
    let (mesh, built) = shuffled();
    let (mut bus, _) = start(&built, 300.0);
    let rows = built.to_rows(&beat(&mesh, 0));
    for turn in 0..20_u32 {
        let now = Millis(1_000 + 20 * turn);
        let id = FrameId { mesh_id: built.summary().mesh_id, session: 9, epoch: 10 * turn };
        let fresh = Freshness { age_ms: 0, echo: Some(now.0) };
        let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).expect("valid");
        let packets = collect(sender.with_freshness(fresh));
        let half = if turn % 2 == 0 { packets.len() } else { packets.len() / 2 };
        for packet in &packets[..half] {
            let _ = bus.packet(packet, now).expect("a good packet");
        }
        if turn % 2 == 0 {
            assert!(published(&mut bus), "{turn}");
        }
        let begun = bus.frame(&beat(&mesh, 0), now, now).expect("good");
        let Progress::Complete { epoch } = begun else { panic!("{begun:?}") };
        assert_eq!(epoch, id.epoch + 1);
        assert!(published(&mut bus), "{turn}");
        if turn % 2 == 1 {
            let rest = bus.packet(&packets[half], now);
            assert_eq!(rest.map_err(|error| error.event()), Err(Event::Stale));
        }
    }
    assert_eq!(bus.counters().of(Event::Abandoned), 10);
}

/// A solver and a control loop in two threads: neither waits for the other, and every answer is of a complete surface.
#[test]
fn a_solver_s_thread_feeds_the_control_loop() {
    let (mesh, built) = shuffled();
    let (mut bus, mut guard) = start(&built, 1e4);
    let (clock, frames) = (AtomicU32::new(1_000), AtomicU32::new(0));
    thread::scope(|scope| {
        let solver = scope.spawn(|| {
            while frames.load(Ordering::Acquire) < 30 {
                let now = clock.load(Ordering::Acquire);
                let _ = bus.frame(&beat(&mesh, now), Millis(now), Millis(now)).expect("good");
                // Held while the control loop reads the buffer that would be written.
                while matches!(
                    bus.work(500).expect("admitted"),
                    Advance::Pending | Advance::Held { .. }
                ) {
                    thread::yield_now();
                }
                frames.fetch_add(1, Ordering::AcqRel);
                // On a busy computer the solver would otherwise end before the control loop has begun.
                let (seen, start) = (clock.load(Ordering::Acquire) + 2, Instant::now());
                while clock.load(Ordering::Acquire) < seen && start.elapsed().as_secs() < 5 {
                    thread::yield_now();
                }
            }
        });
        let tool = Sphere::new(Vec3::new(78.0, 0.0, 10.0), 2.0).expect("valid");
        let mut epochs = BTreeSet::new();
        while !solver.is_finished() {
            let now = clock.fetch_add(1, Ordering::AcqRel) + 1;
            let answer = guard.closest(&tool, Millis(now));
            if let Some(searched) = answer.searched {
                assert!(answer.tracked.is_ok(), "{answer:?}");
                assert!(epochs.last().is_none_or(|&last| last <= searched.frame.epoch));
                epochs.insert(searched.frame.epoch);
            }
            thread::yield_now();
        }
        assert!(epochs.len() > 10, "{epochs:?}");
    });
}

/// Nodes are given in their file's order.
#[test]
fn nodes_come_by_a_call() {
    static HEART: embedded_heart::Surface = embedded_heart::Surface::new();
    let limits = GuardLimits::new(300.0, Millis(200)).automatic();
    let (mut bus, mut guard) = embedded_heart::start(&HEART, limits).expect("valid");
    let tree = embedded_heart::TREE.validate().expect("valid");
    let nodes = dibs_nostd::nodes::Nodes::of(&tree).expect("valid");
    let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
    let tool = Sphere::new(Vec3::new(95.0, 3.0, 20.0), 2.0).expect("valid");
    let mut far = Vec::new();
    for (turn, shift) in [0.0, 1.0, 2.0].into_iter().enumerate() {
        let now = Millis(1_000 + 30 * turn as u32);
        let moved: Vec<Vec3> = rest.iter().map(|&node| node + Vec3::X * shift).collect();
        let _ = bus.frame(&moved, now, now).expect("good");
        while !matches!(bus.work(500), Ok(Advance::Published { .. })) {}
        far.push(guard.closest(&tool, now).tracked.expect("a surface").closest.separation);
    }
    assert!((far[0] - far[1] - 1.0).abs() < 0.3 && (far[1] - far[2] - 1.0).abs() < 0.3, "{far:?}");
    let one_less = bus.frame(&rest[1..], Millis(1_100), Millis(1_100));
    assert_eq!(one_less, Err(ReceiveError::RowCount { rows: rest.len() as u32 - 1 }));
}
