//! Times of capture: the speed limit holds whatever ages frames state, and an age that a packet cannot state does not
//! count as known.

// Requirement: B-05

use std::sync::OnceLock;

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::failsafe::{FailSafe, Limits, LinkStatus, Observation, State, ThresholdPair};
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, Event, FrameEncoder, FrameId, Freshness};
use dibs_nostd::{
    Advance, Assembler, FrameLabel, FrameReader, Frames, Millis, ReceiveError, StretchError,
    StretchMonitor, SurfaceLimits, Tree, VertexTable,
};
use dibs_tests::bus::collect;

/// Vertices of the heart of 320 triangles.
const ROWS: usize = 162;

const SPEED: f32 = 0.3;

struct Bus {
    assembler: Assembler<'static, StretchMonitor<'static, u16>>,
    reader: FrameReader<'static>,
    rest: &'static [Vec3],
    mesh_id: u32,
    epoch: u32,
}

/// A tree of the heart, and its rows at rest.
fn heart() -> (&'static BuiltTree, &'static [Vec3]) {
    static HEART: OnceLock<(BuiltTree, Vec<Vec3>)> = OnceLock::new();
    let (built, rest) = HEART.get_or_init(|| {
        let mesh = generate::heart(320).unwrap().mesh;
        let built = Builder::new().stretch(1.5).build(&mesh).unwrap();
        let rest = built.to_rows(&mesh.positions);
        (built, rest)
    });
    (built, rest)
}

impl Bus {
    fn new() -> Self {
        let (built, rest) = heart();
        let tree: &'static Tree<'static, u16> = Box::leak(Box::new(built.tree().unwrap()));
        let frames: &'static Frames<ROWS> = Box::leak(Box::new(Frames::new()));
        let (writer, reader) = frames.split().unwrap();
        let limits = SurfaceLimits::reach_mm(1e3).speed(SPEED);
        let assembler = Assembler::for_tree(writer, tree, limits).unwrap();
        Self { assembler, reader, rest, mesh_id: tree.mesh_id(), epoch: 0 }
    }

    /// Sends the shape at rest, moved, and `age` old, to arrive at `now`.
    fn send(&mut self, shift: f32, now: u32, freshness: Freshness) -> Result<(), ReceiveError> {
        self.epoch += 1;
        let id = FrameId { mesh_id: self.mesh_id, session: 1, epoch: self.epoch };
        let rows: Vec<Vec3> = self.rest.iter().map(|row| *row + Vec3::X * shift).collect();
        let encoder = FrameEncoder::<_, 512>::new(id, Encoding::Float, &rows[..]).unwrap();
        for packet in collect(encoder.with_freshness(freshness)) {
            self.assembler.accept(&packet, Millis(now))?;
        }
        while self.assembler.advance(1_000)? == Advance::Pending {}
        Ok(())
    }

    fn age(&mut self, now: u32) -> Millis {
        self.reader.latest(Millis(now)).frame().unwrap().age
    }
}

const fn aged(age_ms: u16) -> Freshness {
    Freshness { age_ms, echo: None }
}

/// A surface captured before the published one has no time to move in, whatever age it states: if the difference is
/// within a clock's jitter, the limit of one millisecond applies; otherwise it is refused.
#[test]
fn no_stated_age_voids_the_speed_limit() {
    for start in [1_000, 10_u32.wrapping_neg(), 30, i32::MAX as u32 - 10] {
        for age in [0, 10, 19, 20, 21, 30, 36, 37, 40, 60, 100, 1_000, 30_000, 65_534] {
            let at = |after: u32| start.wrapping_add(after);
            let mut bus = Bus::new();
            bus.send(0.0, at(0), aged(0)).unwrap();
            let before = i64::from(age) - 20;
            let jumped = bus.send(56.0, at(20), aged(age));
            match jumped {
                Err(ReceiveError::Stretch(StretchError::TooFast { limit, .. })) => {
                    assert!(before <= 16, "{age}");
                    let time = (-before).max(0) as f32;
                    assert!((limit - SPEED * (time + 1.0)).abs() < 1e-4, "{age}: {limit}");
                }
                Err(ReceiveError::Earlier { by }) => {
                    assert!(before > 16 && i64::from(by.0) == before, "{age}: {by}");
                    assert_eq!(bus.assembler.counters().of(Event::Stale), 1);
                }
                other => panic!("{age}: {other:?}"),
            }
            assert_eq!(bus.age(at(25)), Millis(25), "the published surface stays");
            // Correct frames go on.
            assert_eq!(bus.send(5.0, at(40), aged(0)), Ok(()), "{age}");
        }
    }
}

/// A series of frames, each captured a little before the last, does not creep: time that goes back gives no allowance.
#[test]
fn captures_that_go_back_give_no_time() {
    let mut bus = Bus::new();
    bus.send(0.0, 1_000, aged(0)).unwrap();
    let mut way = 0.0;
    for number in 1..200_u16 {
        let next = way + SPEED * 16.0;
        match bus.send(next, 1_000, aged(16 * number.min(4_000))) {
            Ok(()) => way = next,
            Err(ReceiveError::Earlier { .. } | ReceiveError::Stretch(_)) => (),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(way, 0.0);
    // Nor do captures that go back and forth.
    for _ in 0..50 {
        bus.send(way, 1_000, aged(16)).unwrap();
        let next = way + SPEED * 10.0;
        if bus.send(next, 1_000, aged(0)).is_ok() {
            way = next;
        }
    }
    assert_eq!(way, 0.0);
    // Jitter: of two sources, with ages of 5 and 45 ms, the later captures are accepted, and nothing jumps.
    let mut passed = 0;
    for number in 1..20_u32 {
        let (age, shift) = if number % 2 == 0 { (5, 0.0) } else { (45, 0.0) };
        passed += u32::from(bus.send(shift, 1_000 + 20 * number, aged(age)).is_ok());
    }
    assert_eq!(passed, 9);
}

/// The same without packets: two frames in the wrong order define no velocity.
#[test]
fn frames_written_in_the_wrong_order_are_held() {
    let frames = Frames::<1, 3>::new();
    let (mut writer, mut reader) = frames.split().unwrap();
    for (epoch, received) in [(1, 1_000), (2, 1_020), (3, 960)] {
        writer.begin();
        writer.push(Vec3::X * epoch as f32).unwrap();
        let received = Millis(received);
        writer.publish(FrameLabel { epoch, received, position_error: 0.0, stretch: None }).unwrap();
    }
    let frame = reader.latest(Millis(1_030)).of_any_age().unwrap();
    for surface in [frame.interpolated(), frame.extrapolated()] {
        assert_eq!(surface.position(0), Some(Vec3::X * 3.0));
        assert_eq!(surface.lag(), Some(Millis(70)));
    }
}

/// A source stops behind a sender that is alive, for an hour. An age that a packet cannot state is unknown: the surface
/// stays the last one whose age was known, which ages.
#[test]
fn a_surface_frozen_for_an_hour_is_never_nominal_again() {
    for (degraded, safe) in [(30_000, 60_000), (70_000, 90_000), (100_000, 120_000)] {
        let mut bus = Bus::new();
        let link = LinkStatus::new();
        let watch = ThresholdPair::new(Millis(degraded), Millis(safe)).unwrap();
        let limits = Limits::new(watch, 0.0).unwrap().without_transit().dwell(0).automatic();
        let mut machine = FailSafe::new(limits);
        let mut last_nominal = 0;
        for time in (0..3_600_000_u32).step_by(1_000) {
            let now = 5_000_000 + time;
            let age = u16::try_from(time).unwrap_or(u16::MAX);
            let sent = bus.send(0.0, now, aged(age));
            assert_eq!(sent, if age == u16::MAX { Err(ReceiveError::TooOld) } else { Ok(()) });
            link.set(&bus.assembler.health());
            let frame = bus.reader.latest(Millis(now)).frame();
            assert_eq!(frame.unwrap().age, Millis(time), "known all the time");
            let (no_answer, link) = (None, link.read(Millis(now)));
            let seen = Observation { frame, lag: None, link, no_answer, is_tree_corrupt: false };
            let state = machine.step(&seen).state;
            assert!(time <= safe || state == State::Safe, "{time}");
            if state == State::Nominal {
                last_nominal = time;
            }
        }
        assert_eq!(last_nominal, degraded);
        // The source works again.
        assert_eq!(bus.send(0.0, 9_000_000, aged(3)), Ok(()));
        assert_eq!(bus.age(9_000_000), Millis(3));
    }
}

/// An echo slightly ahead, because another core read its clock a little later, does not give an infinite transit time.
#[test]
fn an_echo_a_little_ahead_is_no_infinite_way() {
    for (ahead, transit) in [(0, 0), (1, 0), (16, 0), (17, u32::MAX), (1 << 30, u32::MAX)] {
        for now in [1_000_u32, u32::MAX - 3] {
            let mut bus = Bus::new();
            let echo = Some(now.wrapping_add(ahead));
            bus.send(0.0, now, Freshness { age_ms: 0, echo }).unwrap();
            assert_eq!(bus.assembler.health().transit, Millis(transit), "{ahead}");
        }
    }
    let mut bus = Bus::new();
    bus.send(0.0, 1_000, Freshness { age_ms: 0, echo: Some(900) }).unwrap();
    assert_eq!(bus.assembler.health().transit, Millis(100));
}
