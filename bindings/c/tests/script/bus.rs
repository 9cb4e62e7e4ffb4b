//! The part of a script that concerns the bus: packets, and control ticks between them.

use std::fmt::Write;

use dibs_build::BuiltTree;
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper, Wrench};
use dibs_nostd::failsafe::{FailSafe, Limits, LinkStatus, Observation, State, ThresholdPair};
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, QuantisedBox};
use dibs_nostd::{
    Advance, Assembler, Capsule, Frames, Millis, Options, Progress, Query, ReceiveError,
    StretchError, SurfaceLimits, Tree, wire,
};

use super::print::Line;
use super::track::Track;

/// Vertices of the generated heart of 1,000 triangles.
const VERTICES: usize = 502;

/// A packet or a control tick, at a time in ms.
pub enum Event {
    Packet(u32, Vec<u8>),
    Tick(u32, Capsule),
}

/// Frames of this motion in alternating encodings, with a tick after every packet. Packets are lost, another is
/// damaged, a frame is stretched too far, and at the end the line falls silent.
pub fn events(built: &BuiltTree, motion: &[Vec<Vec3>], lines: &mut String) -> Vec<Event> {
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
    let (mesh_id, mut events) = (tree.mesh_id(), Vec::new());
    let mut now = 0;
    for epoch in 1..=12_u32 {
        let mut rows = motion[epoch as usize % motion.len()].clone();
        if epoch == 7 {
            // Too far for the edges, not for the speed or the recovery.
            rows[100] += Vec3::new(0.0, 0.0, 25.0);
        }
        let packed = QuantisedBox::covering(&rows).expect("a box");
        let encoding = if epoch % 2 == 0 { Encoding::Float } else { Encoding::Quantised(packed) };
        let id = FrameId { mesh_id, session: 5, epoch };
        let mut sender = FrameEncoder::<_, 1_024>::new(id, encoding, &rows[..]).expect("a frame");
        let mut buffer = [0; 1_024];
        let mut number = 0;
        while let Some(packet) = sender.next_packet(&mut buffer) {
            number += 1;
            let mut packet = packet.to_vec();
            match (epoch, number) {
                // A row packet, and a begin.
                (4, 3) | (9, 1) => continue,
                (5, 2) => packet[20] ^= 1,
                _ => (),
            }
            events.push(Event::Packet(now, packet));
            now += 2;
            events.push(Event::Tick(now, tool(now)));
        }
    }
    for _ in 0..40 {
        now += 5;
        events.push(Event::Tick(now, tool(now)));
    }
    for event in &events {
        match event {
            Event::Packet(now, bytes) => {
                write!(lines, "packet {now} ").expect("a string");
                bytes.iter().for_each(|byte| write!(lines, "{byte:02x}").expect("a string"));
                lines.push('\n');
            }
            Event::Tick(now, tool) => {
                let [a, b] = [tool.start(), tool.end()];
                let radius = dibs_nostd::Tool::radius(tool);
                let ends = [a.x, a.y, a.z, b.x, b.y, b.z, radius].map(|number| number.to_string());
                writeln!(lines, "tick {now} {}", ends.join(" ")).expect("a string");
            }
        }
    }
    events
}

/// The instrument at a time: a capsule that moves through the heart.
fn tool(now: u32) -> Capsule {
    let along = now as f32 * 0.3;
    let start = Vec3::new(120.0 - along, 5.0, 20.0);
    Capsule::new(start, start + Vec3::new(40.0, 0.0, 30.0), 2.5).expect("a tool")
}

/// The Rust library's answers.
pub fn answers(built: &BuiltTree, events: &[Event]) -> Vec<String> {
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
    let frames = Frames::<VERTICES>::new();
    let (writer, mut reader) = frames.split().expect("split once");
    let mut receiver =
        Assembler::for_tree(writer, &tree, SurfaceLimits::reach_mm(300.0)).expect("a metric");
    let link = LinkStatus::new();
    let mut query = Query::<_, 512>::new(&tree).expect("a stack");
    let watch =
        |degraded, safe| ThresholdPair::new(Millis(degraded), Millis(safe)).expect("limits");
    let limits = Limits::new(watch(40, 80), 0.1).and_then(|limits| limits.recovery(2));
    let limits = limits
        .expect("limits")
        .silence(watch(30, 100))
        .rejections(ThresholdPair::count(1, 10).expect("limits"));
    let mut machine = FailSafe::new(limits.without_transit().dwell(3).automatic());
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(5.0);
    let wall = ForbiddenRegion::new(spring, 5.0).expect("a margin");

    let mut track = Track::new(&tree);

    let answer = |event: &Event| match event {
        Event::Packet(now, bytes) => {
            let accepted = receiver.accept(bytes, Millis(*now));
            let mut checked = receiver.advance(200);
            while checked == Ok(Advance::Pending) {
                checked = receiver.advance(200);
            }
            link.set(&receiver.health());
            let (code, progress) = accepted.map_or_else(|e| (code(&e), 0), |p| (0, number(p)));
            let (refused, advance) = match checked {
                Ok(Advance::Published { .. }) => (0, 3),
                Ok(_) => (0, 0),
                Err(error) => (self::code(&error), 0),
            };
            format!("packet {code} {progress} {refused} {advance}")
        }
        Event::Tick(now, tool) => {
            let latest = reader.latest(Millis(*now));
            let frame = latest.frame();
            let mut tracked = String::new();
            let found = latest.of_any_age().and_then(|surface| {
                let found = query.closest(&surface, tool, &Options::new())?;
                tracked = track.answer(&surface, tool) + "\n";
                Ok(found)
            });
            let link = link.read(Millis(*now));
            let seen =
                Observation { frame, lag: None, link, no_answer: None, is_tree_corrupt: false };
            let verdict = machine.step(&seen);
            let admitted = found.and_then(|found| verdict.admit(found));
            let force = wall.force(&admitted, Vec3::new(10.0, -20.0, 5.0));

            let cause = verdict.cause.map_or(0, crate::guard::cause);
            let outcome = admitted.err().map_or(0, crate::guard::cause);
            let state = match verdict.state {
                State::Nominal => 0,
                State::Degraded => 1,
                State::Safe => 2,
            };
            let age = frame.map_or(0, |frame| frame.age.0);
            let mut line = Line::new(&format!("tick {outcome} {state} {cause} {age}"));
            line.floats(&[verdict.margin]);
            if let Ok(found) = &admitted {
                line.proximity(found);
            }
            let wrench = Wrench { force: force.force, torque: Vec3::ZERO, state: force.state };
            match force.state {
                ConstraintState::Safe(_) => line.hold(&wrench, outcome),
                _ => line.force(&wrench),
            }
            tracked + &line.end()
        }
    };
    let lines = events.iter().map(answer).collect::<Vec<_>>().join("\n");
    lines.lines().map(str::to_owned).collect()
}

fn number(progress: Progress) -> u32 {
    match progress {
        Progress::Begun { .. } => 1,
        Progress::Stored => 2,
        Progress::Complete { .. } => 4,
        other => panic!("{other:?}"),
    }
}

fn code(error: &ReceiveError) -> u32 {
    match error {
        ReceiveError::Packet(_) => 400,
        ReceiveError::Unexpected { .. } => 406,
        ReceiveError::Order { .. } => 412,
        ReceiveError::Digest { .. } => 415,
        ReceiveError::Stretch(StretchError::Exceeded { .. })
        | ReceiveError::Refused { cause: wire::Event::Stretch, .. } => 311,
        other => panic!("{other:?}"),
    }
}
