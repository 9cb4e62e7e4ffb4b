//! The loop of bus and guard in C: the same bits as in Rust, and its misuses.
//!
//! One file, because each step has its line for the program in C and its answer in Rust.

// Requirement: P-06

mod numbers;

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use dibs_build::glam::DVec3;
use dibs_build::{Builder, BuiltTree, Volume, generate};
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, SpringDamper};
use dibs_nostd::failsafe::State;
use dibs_nostd::filter::{AdmittedMotion, Filter, FilterError, Reason, RigidMotion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Answer, Bus, Guard, GuardLimits, Rows, Surface, Vertices};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::wire::{
    Encoding, Event, FrameEncoder, FrameId, Freshness, NoMac, enframe, framed_bytes,
};
use dibs_nostd::{
    Capsule, Contacts, Coverage, Fallback, Interval, Millis, Proximity, Sphere, TreeBytes,
};
pub use numbers::cause;
use numbers::{number, outcome, refusal, side};
use xtask::workspace;

use crate::programs::{compile, installed, run, tool, tree_and_stream};

/// Vertices of the generated heart of 1,000 triangles.
const VERTICES: usize = 502;

/// Nodes of a box of 3 x 3 x 4 cells.
const NODES: usize = 80;

/// The wall's margin, and how far contacts are looked for, in mm.
const MARGIN: f32 = 5.0;

/// ms between two frames.
const PERIOD: u32 = 30;

/// What happens at a time in ms.
enum Step {
    Packet(u32, Vec<u8>),
    Receive(u32, Vec<u8>),
    /// Now, when it was captured, and positions in the mesh's order.
    Frame(u32, u32, Vec<Vec3>),
    Work(u32),
    Status(u32, bool),
    /// Both ends of the axis, and the radius.
    Tick(u32, [f32; 7]),
    /// The same, with the contacts.
    Touch(u32, [f32; 7]),
    /// The same, with a command along x, in mm.
    Admit(u32, [f32; 7], f32),
    Blind(u32),
    Acknowledge,
    Counters,
}

/// Frames that come as packets, over a line, and by a call in turn. One is lost, one is damaged, one is stretched too far,
/// one lacks a vertex.
/// Then the line falls silent, and comes back.
fn script(built: &BuiltTree, frames: &[Vec<Vec3>]) -> Vec<Step> {
    let (mesh_id, mut steps) = (built.summary().mesh_id, Vec::new());
    for now in 1_000..3_600 {
        let number = (now - 1_000) / PERIOD;
        let is_silent = (3_300..3_450).contains(&now) || number == 9;
        let is_due = (now - 1_000) % PERIOD == 0 && !is_silent;
        let frame = &frames[number as usize % frames.len()];
        if is_due && number % 5 == 3 {
            let mut positions = frame.clone();
            positions.truncate(positions.len() - usize::from(number == 8));
            steps.push(Step::Frame(now, now - number % 4, positions));
        } else if is_due {
            // Nodes come in the order of their file.
            let is_of_nodes = built.summary().volume.is_some();
            let mut rows = if is_of_nodes { frame.clone() } else { built.to_rows(frame) };
            if number == 15 {
                let spoilt = rows.len() / 5;
                rows[spoilt] += Vec3::new(0.0, 0.0, 15.0);
            }
            let id = FrameId { mesh_id, session: 5, epoch: number };
            let fresh = Freshness { age_ms: number as u16 % 5, echo: Some(now - 1) };
            let frame = FrameEncoder::<_, 512>::new(id, Encoding::Float, &rows[..]);
            let mut frame = frame.expect("a frame").with_freshness(fresh);
            let (mut buffer, mut place) = ([0; 512], 0);
            while let Some(packet) = frame.next_packet(&mut buffer) {
                place += 1;
                let mut packet = packet.to_vec();
                packet[9] ^= u8::from((number, place) == (12, 3));
                steps.push(if number.is_multiple_of(2) {
                    Step::Packet(now, packet)
                } else {
                    let mut line = [0; framed_bytes(512)];
                    Step::Receive(now, enframe(&packet, &mut line).expect("room").to_vec())
                });
            }
        }
        steps.extend((0..4).map(|_| Step::Work(250)));
        steps.push(Step::Status(now, now % 2 == 0));
        // In and out.
        let start = Vec3::new(80.0 + 50.0 * (now as f32 * 0.01).sin(), 5.0, 20.0);
        // A sphere now and then.
        let end = if now % 7 == 0 { start } else { start + Vec3::new(40.0, 0.0, 30.0) };
        let [a, b] = [start, end].map(|point| point.to_array());
        steps.push(match now {
            1_333 => Step::Blind(now),
            // No tool at all, and one without a radius.
            1_334 => Step::Tick(now, [f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            1_335 => Step::Tick(now, [a[0], a[1], a[2], b[0], b[1], b[2], -1.0]),
            _ if now % 3 == 1 && start != end => {
                let along = if now % 40 == 0 { f32::NAN } else { -0.1 };
                Step::Admit(now, [a[0], a[1], a[2], b[0], b[1], b[2], 2.5], along)
            }
            _ if now % 3 == 2 => Step::Touch(now, [a[0], a[1], a[2], b[0], b[1], b[2], 2.5]),
            _ => Step::Tick(now, [a[0], a[1], a[2], b[0], b[1], b[2], 2.5]),
        });
        if now % 100 == 99 {
            steps.extend([Step::Acknowledge, Step::Counters]);
        }
    }
    steps
}

/// A heart whose frames are vertices.
fn vertices() -> (BuiltTree, Vec<Vec<Vec3>>) {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    (built, motion.frames)
}

/// A heart that a box of nodes carries.
fn embedded() -> (BuiltTree, Vec<Vec<Vec3>>) {
    let mesh = generate::heart(1_000).expect("a size").mesh;
    let lattice = Volume::lattice(&mesh, [3, 3, 4]).expect("a lattice");
    let built = Builder::new().stretch(1.5).nodes(&lattice).build(&mesh).expect("a tree");
    let frame = |number: usize| {
        let by = 0.05 * (number as f64 * 0.25).sin();
        let at = |at: &DVec3| (*at * DVec3::new(1.0 + by, 1.0 - by, 1.0)).as_vec3();
        lattice.nodes().iter().map(at).collect()
    };
    (built, (0..25).map(frame).collect())
}

fn lines(steps: &[Step]) -> String {
    let mut text = String::new();
    let hex = |bytes: &[u8]| bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    for step in steps {
        match step {
            Step::Packet(now, bytes) => writeln!(text, "packet {now} {}", hex(bytes)),
            Step::Receive(now, bytes) => writeln!(text, "receive {now} {}", hex(bytes)),
            Step::Frame(now, captured, positions) => {
                let numbers = positions.iter().flat_map(Vec3::to_array);
                let numbers: String = numbers.map(|number| format!(" {number}")).collect();
                writeln!(text, "frame {now} {captured}{numbers}")
            }
            Step::Work(most) => writeln!(text, "work {most}"),
            Step::Status(now, is_framed) => writeln!(text, "status {now} {}", u8::from(*is_framed)),
            Step::Tick(now, tool) => {
                writeln!(text, "tick {now} {}", tool.map(|number| number.to_string()).join(" "))
            }
            Step::Touch(now, tool) => {
                writeln!(text, "touch {now} {}", tool.map(|number| number.to_string()).join(" "))
            }
            Step::Admit(now, tool, along) => {
                let tool = tool.map(|number| number.to_string()).join(" ");
                writeln!(text, "admit {now} {tool} {along}")
            }
            Step::Blind(now) => writeln!(text, "blind {now}"),
            Step::Acknowledge => writeln!(text, "acknowledge 0"),
            Step::Counters => writeln!(text, "counters 0"),
        }
        .expect("a string");
    }
    text
}

type Ends<'t, R> = (Bus<'static, 't, u16, NoMac, R>, Guard<'static, 't, u16, 512, 256, R, 256>);

/// The Rust library's answer, in the program's words.
fn answer<R: Rows<Poses = ()>>((bus, guard): &mut Ends<'_, R>, step: &Step) -> String {
    match step {
        Step::Packet(now, bytes) => match bus.packet(bytes, Millis(*now)) {
            Ok(progress) => format!("packet 0 {}", number(progress)),
            Err(error) => format!("packet {} 0", refusal(&error)),
        },
        Step::Receive(now, bytes) => {
            bus.receive(bytes, Millis(*now));
            "receive 0".to_owned()
        }
        Step::Frame(now, captured, positions) => {
            let outcome = bus.frame(positions, Millis(*captured), Millis(*now));
            format!("frame {}", outcome.map_or_else(|error| refusal(&error), |_| 0))
        }
        Step::Work(most) => match bus.work(*most) {
            Ok(advance) => format!("work 0 {}", outcome(advance)),
            Err(error) => format!("work {} 0", refusal(&error)),
        },
        Step::Status(now, is_framed) => {
            let (mut packet, mut line) = ([0; 96], [0; 98]);
            let status = if *is_framed {
                bus.status_framed(Millis(*now), &mut line)
            } else {
                bus.status(Millis(*now), &mut packet)
            };
            let hex = status.unwrap_or_default().iter().map(|byte| format!("{byte:02x}"));
            format!("status {}", hex.collect::<String>())
        }
        Step::Tick(now, [a, b, c, d, e, f, radius]) => {
            let (start, end) = (Vec3::new(*a, *b, *c), Vec3::new(*d, *e, *f));
            let now = Millis(*now);
            if start == end {
                match Sphere::new(start, *radius) {
                    Ok(tool) => tick(0, &guard.closest(&tool, now)),
                    Err(_) => tick(201, &guard.without_pose(now)),
                }
            } else {
                match Capsule::new(start, end, *radius) {
                    Ok(tool) => tick(0, &guard.closest(&tool, now)),
                    Err(_) => {
                        let code = if start.is_finite() { 201 } else { 200 };
                        tick(code, &guard.without_pose(now))
                    }
                }
            }
        }
        Step::Touch(now, [a, b, c, d, e, f, radius]) => {
            let (start, end) = (Vec3::new(*a, *b, *c), Vec3::new(*d, *e, *f));
            let (now, mut list) = (Millis(*now), Contacts::<16>::new());
            let answer = if start == end {
                let tool = Sphere::new(start, *radius).expect("a tool");
                guard.contacts(&tool, MARGIN, now, &mut list)
            } else {
                let tool = Capsule::new(start, end, *radius).expect("a tool");
                guard.contacts(&tool, MARGIN, now, &mut list)
            };
            tick(0, &answer) + &touched(&list)
        }
        Step::Admit(now, [a, b, c, d, e, f, radius], along) => {
            let (start, end) = (Vec3::new(*a, *b, *c), Vec3::new(*d, *e, *f));
            let tool = Capsule::new(start, end, *radius).expect("a tool");
            let filter = Filter::new(1.0, 200.0).expect("a filter");
            let command = RigidMotion::new(start, Vec3::new(*along, 0.0, 0.0), Vec3::ZERO);
            let (answer, admitted) = guard.admit(&filter, &tool, &command, Millis(*now));
            tick(0, &answer) + &motion(admitted)
        }
        Step::Blind(now) => tick(0, &guard.without_pose(Millis(*now))),
        Step::Acknowledge => {
            format!("acknowledge {}", if guard.acknowledge().is_ok() { 0 } else { 505 })
        }
        Step::Counters => {
            let counters = Event::ALL.map(|event| bus.counters().of(event).to_string());
            format!("counters {}", counters.join(" "))
        }
    }
}

/// The contacts of a list, with its bound and accuracy.
fn touched(list: &Contacts<16>) -> String {
    let mut line = format!(" {}", list.len());
    let floats = |line: &mut String, values: &[f32]| {
        values.iter().for_each(|value| write!(line, " {:08x}", value.to_bits()).expect("a string"));
    };
    floats(&mut line, &[list.bound(), list.accuracy()]);
    for contact in list.iter() {
        floats(&mut line, &[contact.separation]);
        floats(&mut line, &contact.normal.to_array());
        write!(line, " {}", contact.triangle.0).expect("a string");
        floats(&mut line, &contact.velocity.to_array());
    }
    line
}

fn tick(code: u32, answer: &Answer) -> String {
    let spring = SpringDamper::stiffness(1.0).damping(0.002).hold_damping(0.001).max_force(5.0);
    let force = answer.force(&ForbiddenRegion::new(spring, MARGIN).expect("a margin"));
    let pair = answer.closest.unwrap_or(Proximity::NOWHERE);
    let unknown = Interval { lower: f32::NEG_INFINITY, upper: f32::INFINITY };
    let interval = answer.closest.map_or(unknown, |pair| pair.interval());
    let outcome = if code == 0 { answer.closest.err().map_or(0, cause) } else { code };
    let mut line = format!("tick {code} {outcome}");
    let floats = |line: &mut String, values: &[f32]| {
        values.iter().for_each(|value| write!(line, " {:08x}", value.to_bits()).expect("a string"));
    };
    let words = |line: &mut String, values: &[u32]| {
        values.iter().for_each(|value| write!(line, " {value}").expect("a string"));
    };
    floats(&mut line, &[pair.separation, pair.lower, pair.accuracy]);
    let coverage = match pair.coverage {
        Coverage::Measured => 0,
        Coverage::Proven => 1,
        _ => 2,
    };
    words(&mut line, &[side(pair.side), coverage]);
    floats(&mut line, &[pair.axis_distance]);
    for point in [pair.point_on_surface, pair.point_on_tool, pair.direction] {
        floats(&mut line, &point.to_array());
    }
    floats(&mut line, &[pair.axis_parameter]);
    words(&mut line, &[pair.triangle.map_or(u32::MAX, |row| row.0)]);
    words(&mut line, &pair.corners);
    floats(&mut line, &pair.barycentric);
    words(&mut line, &[pair.node_tests, pair.triangle_tests]);
    floats(&mut line, &[interval.lower, interval.upper]);
    floats(&mut line, &answer.velocity.to_array());
    let trust = &answer.trust;
    let state = match trust.state {
        State::Nominal => 0,
        State::Degraded => 1,
        State::Safe => 2,
    };
    words(&mut line, &[state, trust.cause.map_or(0, cause)]);
    floats(&mut line, &[trust.margin]);
    words(&mut line, &[trust.waits_for_acknowledgement.into()]);
    let age = answer.searched.map(|searched| searched.frame);
    words(&mut line, &age.map_or([0; 4], |age| [1, age.epoch, age.received.0, age.age.0]));
    let lag = answer.searched.and_then(|searched| searched.lag);
    let link = answer.link;
    words(&mut line, &[lag.map_or(u32::MAX, |lag| lag.0), link.silence.0, link.heartbeat.0]);
    words(&mut line, &[link.rejections, link.forgeries, link.transit.0, link.source_age.0]);
    let state = match force.state {
        ConstraintState::Inactive => 0,
        ConstraintState::Active => 1,
        ConstraintState::Saturated => 2,
        _ => 3,
    };
    words(&mut line, &[state]);
    floats(&mut line, &force.force.to_array());
    // The surface that was searched, and the pair on it.
    let tracked = answer.tracked.ok();
    let pair = tracked.map_or(Proximity::NOWHERE, |tracked| tracked.closest);
    words(&mut line, &[answer.tracked.err().map_or(0, cause)]);
    floats(&mut line, &[pair.separation, pair.lower, pair.accuracy]);
    let reason =
        tracked.and_then(|tracked| tracked.fallback).map_or(0, |fallback| match fallback {
            Fallback::Start => 1,
            Fallback::Surface => 2,
            Fallback::Jump => 3,
            _ => 4,
        });
    words(&mut line, &[tracked.is_some_and(|tracked| tracked.is_kept).into(), reason]);
    floats(&mut line, &[tracked.and_then(|tracked| tracked.moved).unwrap_or(-1.0)]);
    words(&mut line, &tracked.map_or([0; 3], |found| [found.opened, 0, found.searched]));
    let searched = answer.searched;
    words(&mut line, &[searched.map_or(0, |searched| searched.before)]);
    let residual = searched.and_then(|searched| searched.residual).unwrap_or(-1.0);
    let at = searched.map_or([0.0; 2], |searched| [searched.t, searched.position_error]);
    floats(&mut line, &[at[0], at[1], residual]);
    floats(&mut line, &searched.map_or([0.0; 3], |searched| searched.velocity.to_array()));
    line
}

/// The code, and the motion where there is one.
fn motion(admitted: Result<AdmittedMotion, FilterError>) -> String {
    match admitted {
        Ok(AdmittedMotion { motion, least_separation, reason, queries, instructions, .. }) => {
            let reasons = [
                Reason::Commanded,
                Reason::Nearest,
                Reason::Shortened,
                Reason::Stopped,
                Reason::Retreating,
                Reason::NoSafeMotion,
            ];
            let reason = reasons.iter().position(|other| *other == reason).expect("a reason");
            let mut line = format!(" 0 {reason} {queries} {instructions}");
            let vectors =
                [motion.about, motion.translation, motion.rotation].map(|of| of.to_array());
            for value in [least_separation].iter().chain(vectors.as_flattened()) {
                write!(line, " {:08x}", value.to_bits()).expect("a string");
            }
            line
        }
        Err(FilterError::Untrusted(because)) => format!(" {}", cause(because)),
        Err(FilterError::Command) => " 310".to_owned(),
        Err(error) => panic!("{error}"),
    }
}

/// Builds `examples/c/host` with the installed library.
fn example(folder: &Path) -> PathBuf {
    let build = folder.join("build");
    let mut configure = tool("cmake", "cmake");
    configure.arg("-S").arg(workspace::root().join("examples/c/host")).arg("-B").arg(&build);
    configure.arg("-DCMAKE_C_FLAGS=-g -fsanitize=address,undefined -fno-sanitize-recover=all");
    configure.arg(format!("-DCMAKE_PREFIX_PATH={}", installed(folder).display()));
    run(&mut configure);
    run(Command::new("cmake").arg("--build").arg(&build));
    build.join("dibs-host")
}

/// The answers of a surface of `N` rows, which are the same in C to the bit.
fn compared<const N: usize, R: Rows<Poses = ()>>(
    (built, frames): &(BuiltTree, Vec<Vec<Vec3>>),
) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let steps = script(built, frames);
    let surface: &Surface<N, R> = Box::leak(Box::new(Surface::new()));
    let limits = GuardLimits::new(300.0, Millis(80));
    let tree = TreeBytes::new(built.blob());
    let mut ends: Ends<'_, R> = surface.start_with_contacts(tree, limits, NoMac).expect("valid");
    let expected: Vec<_> = steps.iter().map(|step| answer(&mut ends, step)).collect();

    let [tree, script] = ["tree", "script"].map(|name| folder.path().join(name));
    fs::write(&tree, built.blob()).expect("writable");
    fs::write(&script, lines(&steps)).expect("writable");
    let said = run(Command::new(example(folder.path())).arg(tree).arg(script));
    for (number, (c, rust)) in said.lines().zip(&expected).enumerate() {
        assert_eq!(c, rust, "answer {number}");
    }
    assert_eq!(said.lines().count(), expected.len());
    expected
}

/// Answers about nodes' frames that a tick may act on, some of them after commands, and frames that are refused.
#[test]
fn the_loop_on_nodes_answers_with_the_same_bits() {
    let expected = compared::<NODES, Nodes<'static>>(&embedded());
    let acted = expected.iter().filter(|line| line.starts_with("tick 0 0 ")).count();
    assert!(acted > 700, "{acted}");
    for start in ["work 0 3", "work 313", "packet 400", "acknowledge 0"] {
        assert!(expected.iter().any(|line| line.starts_with(start)), "nothing is {start}");
    }
}

#[test]
fn the_loop_in_c_answers_with_the_same_bits() {
    let expected = compared::<VERTICES, Vertices>(&vertices());
    let ticks: Vec<Vec<&str>> = expected
        .iter()
        .filter(|line| line.starts_with("tick"))
        .map(|line| line.split(' ').collect())
        .collect();
    // Code, outcome, state, side and force, as they stand in a line.
    let count = |place: usize, word: &str| ticks.iter().filter(|tick| tick[place] == word).count();
    assert!(ticks.len() == 2_600 && count(2, "0") > 700, "{} answers to act on", count(2, "0"));
    for (place, word) in [(1, "200"), (1, "201"), (2, "300"), (2, "301"), (2, "317")] {
        assert!(count(place, word) > 0, "no {word} at {place}");
    }
    for (place, word) in
        [(6, "0"), (6, "2"), (33, "0"), (33, "1"), (33, "2"), (48, "0"), (48, "2"), (48, "3")]
    {
        assert!(count(place, word) > 10, "{} of {word} at {place}", count(place, word));
    }
    let width = ticks.iter().map(Vec::len).min().expect("ticks");
    // A list begins with its length, bound and accuracy, a command's answer with a code.
    let is_list = |tick: &&Vec<&str>| tick.get(width + 1).is_some_and(|word| word.len() == 8);
    let lists = ticks.iter().filter(is_list).filter(|tick| tick[width] != "0").count();
    assert!(lists > 100, "{lists} lists of contacts");
    let others = ticks.iter().filter(|tick| !is_list(tick));
    let admitted = others.filter_map(|tick| tick.get(width).copied());
    let (admitted, refused): (Vec<_>, Vec<_>) = admitted.partition(|&code| code == "0");
    assert!(admitted.len() > 100 && refused.len() > 100, "{} admitted", admitted.len());
    let not_finite = refused.iter().filter(|&&code| code == "310").count();
    assert!(not_finite > 5, "{not_finite} commands that are not finite");
    assert!(ticks.iter().any(|tick| tick[30] != tick[31] && tick[2] == "0"), "no velocity");
    for start in ["work 0 3", "work 313", "packet 400", "acknowledge 0", "acknowledge 505"] {
        assert!(expected.iter().any(|line| line.starts_with(start)), "nothing is {start}");
    }
    assert!(
        expected.iter().filter(|line| line.len() > 50 && line.starts_with("status")).count() > 20
    );
}

#[test]
fn misuse_of_the_loop_is_a_code() {
    let folder = tempfile::tempdir().expect("a folder");
    let files = tree_and_stream(folder.path());
    let said = run(Command::new(compile("misuse_loop", folder.path())).args(files));
    assert!(said.contains(" checks, 0 failures"), "{said}");
}
