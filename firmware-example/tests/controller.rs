//! The control logic on the host, with a bus in the same process: the same bytes as on the board.

// Requirement: P-05

use std::collections::HashMap;
use std::sync::OnceLock;

use controller::surface::{self, Surface};
use controller::telemetry::{Tick, cause_code};
use controller::{BusStatus, ContactList, Control, DWELL, MTU, Receiver, Script, Trust, start};
use dibs_build::{Builder, generate};
use dibs_nostd::failsafe::State;
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Encoding, FrameEncoder, FrameId, Freshness, NoMac, QuantisedBox, encode_heartbeat, enframe,
    framed_bytes,
};
use dibs_nostd::{Millis, Ticks, Unavailable};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::sides;

const SILENCE_WARNING: u32 = Trust::SERIAL.silence.0;
const SILENCE_LIMIT: u32 = Trust::SERIAL.silence.1;
const SURFACE_AGE_WARNING: u32 = Trust::SERIAL.age.0;
const SURFACE_AGE_LIMIT: u32 = Trust::SERIAL.age.1;

fn firmware_tree() -> &'static surface::Tree {
    static TREE: OnceLock<surface::Tree> = OnceLock::new();
    TREE.get_or_init(|| surface::TREE.validate().expect("valid"))
}

/// A controller's two ends, and its counters.
fn controller() -> (Receiver, Control<Script>, &'static BusStatus) {
    let surface: &'static Surface = Box::leak(Box::new(Surface::new()));
    let bus: &'static BusStatus = Box::leak(Box::new(BusStatus::new()));
    let contacts = Box::leak(Box::new(ContactList::new()));
    let (receiver, control) = start(surface, bus, &Trust::SERIAL, Script, contacts).unwrap();
    (receiver, control, bus)
}

/// The sending side: the generated heart, in the tree's order.
struct Sender {
    frames: Vec<Vec<Vec3>>,
    triangles: Vec<[u32; 3]>,
    /// The controller's positions of each frame sent.
    decoded: HashMap<u32, Vec<Vec3>>,
}

impl Sender {
    fn new() -> Self {
        let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a heart");
        let tree = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
        assert_eq!(
            tree.summary().mesh_id,
            firmware_tree().mesh_id(),
            "the firmware has another surface"
        );
        let mut row = vec![0; mesh.positions.len()];
        for (place, &vertex) in (0..).zip(tree.vertex_order()) {
            row[vertex as usize] = place;
        }
        Self {
            frames: motion.frames.iter().map(|frame| tree.to_rows(frame)).collect(),
            triangles: mesh.triangles.iter().map(|t| t.map(|v| row[v as usize])).collect(),
            decoded: HashMap::new(),
        }
    }

    /// A frame as the bytes of the bus, captured and sent at `now`, right after a status.
    fn bytes(&mut self, epoch: u32, now: Millis) -> Vec<u8> {
        self.sent(epoch, Freshness { age_ms: 0, echo: Some(now.0) })
    }

    /// A frame as the bytes of the bus, with this freshness.
    fn sent(&mut self, epoch: u32, freshness: Freshness) -> Vec<u8> {
        let exact = &self.frames[epoch as usize % self.frames.len()];
        let grid = QuantisedBox::covering(exact).expect("finite positions");
        let decode = |&p: &Vec3| grid.position(grid.quantise(p).expect("inside its own box"));
        self.decoded.insert(epoch, exact.iter().map(decode).collect());
        let encoding = Encoding::Quantised(grid);
        let id = FrameId { mesh_id: firmware_tree().mesh_id(), session: 1, epoch };
        let mut encoder = FrameEncoder::<_, MTU>::new(id, encoding, &exact[..]).unwrap();
        encoder = encoder.with_freshness(freshness);
        let (mut packet, mut line, mut all) = ([0; MTU], [0; framed_bytes(MTU)], Vec::new());
        let mut beat = [0; 64];
        let beat = encode_heartbeat(&id, epoch, None, &NoMac, &mut beat);
        all.extend_from_slice(enframe(beat, &mut line).expect("room"));
        while let Some(packet) = encoder.next_packet(&mut packet) {
            all.extend_from_slice(enframe(packet, &mut line).expect("room"));
        }
        all
    }

    /// Compares an answer with an exhaustive search on its surface, which may be between two frames or extrapolated.
    fn check(&self, tick: &Tick) {
        let (start, end) = (Vec3::from(tick.tool_start), Vec3::from(tick.tool_end));
        let tool = Instrument::capsule(start, end, tick.tool_radius);
        let frames = self.decoded[&tick.epoch_before].iter().zip(&self.decoded[&tick.epoch]);
        let rows: Vec<Vec3> = frames.map(|(&a, &b)| a + (b - a) * tick.blend).collect();
        let truth = exhaustive(&rows, &self.triangles, &tool).unwrap();
        // Both sides use the vertices as decoded, so there is no position error.
        let accuracy = f64::from(tick.accuracy) - f64::from(tick.position_error);
        let (low, high) = sides::signed_separation(&rows, &self.triangles, &tool, &truth, accuracy);
        assert!(f64::from(tick.separation) >= low - accuracy, "tick {}: {low}", tick.tick);
        assert!(f64::from(tick.lower) <= high + accuracy, "tick {}: {high}", tick.tick);
    }
}

fn force(tick: &Tick) -> f32 {
    Vec3::from(tick.force).length()
}

#[test]
fn every_answer_is_that_of_whole_frames() {
    let (mut receiver, mut control, bus) = controller();
    let mut sender = Sender::new();

    let first = control.tick(|| 0);
    assert_eq!(first.state, State::Safe as u32);
    assert!(!first.is_answered());

    let (mut answers, mut checked, mut acting, mut free) = (0, 0, 0, 0);
    let (mut last_epoch, mut moving) = (0, 0);
    for epoch in 1..=30 {
        // A tick every 122 bytes, so that most ticks are inside a packet, and a pause as long as the frame.
        let bytes = sender.bytes(epoch, control.now());
        let chunks: Vec<&[u8]> = bytes.chunks(122).collect();
        for chunk in chunks.iter().copied().chain(chunks.iter().map(|_| &[][..])) {
            for byte in chunk.chunks(1) {
                receiver.bytes(byte, control.now());
                while receiver.work() {}
            }
            let tick = control.tick(|| 0);
            if tick.is_answered() {
                assert!(tick.epoch == epoch || tick.epoch + 1 == epoch);
                // An exhaustive search takes as long as hundreds of ticks: only each new frame's first answer, and
                // every fifth.
                if tick.epoch != last_epoch || answers % 5 == 0 {
                    sender.check(&tick);
                    checked += 1;
                }
                (last_epoch, answers) = (tick.epoch, answers + 1);
                moving += u32::from(tick.blend > 1.0 && tick.blend < 3.0 && tick.margin < 0.1);
                if force(&tick) > 0.0 { acting += 1 } else { free += 1 }
            }
        }
        assert_eq!(bus.published(), epoch);
    }
    assert_eq!(bus.rejected(), 0);
    assert!(answers > 10_000 && checked > 2_000, "{answers} answers, {checked} checked");
    assert!(moving > answers * 9 / 10, "{moving} of {answers} on a moving surface");
    assert!(acting > 100 && free > 100, "the wall acted {acting} times and was still {free} times");
}

#[test]
fn a_damaged_frame_is_not_published_and_silence_or_age_make_the_output_safe() {
    let (mut receiver, mut control, bus) = controller();
    let mut sender = Sender::new();
    let mut feed = |bytes: &[u8], now: Millis| {
        for byte in bytes.chunks(1) {
            receiver.bytes(byte, now);
            while receiver.work() {}
        }
    };

    feed(&sender.bytes(1, control.now()), control.now());
    for _ in 0..DWELL {
        assert_eq!(control.tick(|| 0).state, State::Safe as u32, "for the dwell");
    }
    let mut damaged = sender.bytes(2, control.now());
    damaged[9_000] ^= 4;
    feed(&damaged, control.now());
    let tick = control.tick(|| 0);
    assert_eq!((tick.epoch, bus.published()), (1, 1), "the damaged frame is not acted on");
    assert!(bus.rejected() > 0);

    // The line is cut: two seconds later, exact to a tick, the output is safe.
    assert_eq!(tick.state, State::Nominal as u32);
    // The damaged frame's other packets were the last good packets.
    let (cut, age) = (tick.tick, tick.age);
    let mut before = tick;
    for silence in 1..SILENCE_LIMIT + 500 {
        let tick = control.tick(|| 0);
        assert_eq!((tick.tick, tick.age), (cut + silence, age + silence));
        let expected = match silence {
            _ if silence <= SILENCE_WARNING => (State::Nominal, 0),
            _ if silence <= SILENCE_LIMIT => {
                (State::Degraded, cause_code(&Unavailable::LinkLost { silence: Millis(silence) }))
            }
            _ => (State::Safe, cause_code(&Unavailable::LinkLost { silence: Millis(silence) })),
        };
        assert_eq!((tick.state, tick.cause), (expected.0 as u32, expected.1), "after {silence}");
        sender.check(&tick);
        if expected.0 == State::Safe {
            // The hold: pure damping, against the motion of the instrument.
            let moved = Vec3::from(tick.tool_start) - Vec3::from(before.tool_start);
            assert!(Vec3::from(tick.force).dot(moved) <= 0.0);
        }
        before = tick;
    }

    // A new frame recovers, after the dwell time.
    feed(&sender.bytes(3, control.now()), control.now());
    for _ in 0..DWELL {
        assert_eq!(control.tick(|| 0).state, State::Safe as u32);
    }
    let tick = control.tick(|| 0);
    assert_eq!((tick.epoch, tick.state), (3, State::Nominal as u32));

    // Packets arrive, but never a whole frame: the surface ages.
    let (received, mut epoch) = (tick.tick - tick.age, 4);
    for age in tick.age + 1..SURFACE_AGE_LIMIT + 100 {
        if age % 500 == 0 {
            feed(&sender.bytes(epoch, control.now())[..2_000], control.now());
            feed(&[0], control.now()); // ends the packet that was cut
            epoch += 1;
        }
        let tick = control.tick(|| 0);
        assert_eq!((tick.tick, tick.age), (received + age, age));
        let expected = match age {
            _ if age <= SURFACE_AGE_WARNING => State::Nominal,
            _ if age <= SURFACE_AGE_LIMIT => State::Degraded,
            _ => State::Safe,
        };
        assert_eq!(tick.state, expected as u32, "at the age of {age}");
    }
}

/// The age alone does not reveal a frame with a long transit time, one that was old when it was sent, one without an
/// echo, or a series of refused frames. Each makes the output safe, and a good frame recovers.
#[test]
fn a_late_frame_an_old_one_and_a_row_of_refused_ones_make_the_output_safe() {
    let (mut receiver, mut control, _bus) = controller();
    let mut sender = Sender::new();
    control.skip(Ticks(100_000));
    let mut epoch = 0;
    let mut after = |freshness: &dyn Fn(u32) -> Freshness, is_damaged: bool| {
        // The good frame comes late enough that it is not too fast relative to the previous one.
        control.skip(Ticks(if is_damaged { 100 } else { 4_000 }));
        epoch += 1;
        let mut bytes = sender.sent(epoch, freshness(control.now().0));
        if is_damaged {
            bytes[9_000] ^= 4;
        }
        for byte in bytes.chunks(1) {
            receiver.bytes(byte, control.now());
            while receiver.work() {}
        }
        // The state gets worse at once, and better after the dwell time.
        for _ in 0..if is_damaged { 0 } else { DWELL } {
            control.tick(|| 0);
        }
        let tick = control.tick(|| 0);
        assert_eq!(tick.epoch == epoch, !is_damaged);
        (tick.state, tick.cause)
    };
    let echo = |ago: u32| move |now: u32| Freshness { age_ms: 0, echo: Some(now - ago) };
    let old = |age_ms| move |now| Freshness { age_ms, echo: Some(now) };
    let unknown = |_| Freshness { age_ms: 0, echo: None };
    let (nominal, safe) = ((State::Nominal as u32, 0), State::Safe as u32);
    let degraded = State::Degraded as u32;
    let delayed = cause_code(&Unavailable::Delayed { transit: Millis(0) });
    let stale = cause_code(&Unavailable::SourceStale { age: Millis(0) });
    let rejected = cause_code(&Unavailable::Rejections { streak: 0 });

    assert_eq!(after(&unknown, false), (safe, delayed), "who knows how long it was on its way");
    for (good, late, cause) in
        [(500, [501, 1_000, 1_001], delayed), (0, [1_001, 2_000, 2_001], stale)]
    {
        assert_eq!(after(&echo(good), false), nominal);
        for (value, state) in late.into_iter().zip([degraded, degraded, safe]) {
            let found = if cause == delayed {
                after(&echo(value), false)
            } else {
                after(&old(value as u16), false)
            };
            assert_eq!(found, (state, cause), "{value}");
        }
    }
    assert_eq!(after(&echo(0), false), nominal);
    // A damaged frame is counted when the next one begins.
    for streak in 1..=32 {
        let expected = match streak {
            ..=11 => nominal,
            12..=31 => (degraded, rejected),
            _ => (safe, rejected),
        };
        assert_eq!(after(&echo(0), true), expected, "after {streak}");
    }
    assert_eq!(after(&echo(0), false), nominal);
}
