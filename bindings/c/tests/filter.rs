//! The filter of commands in C: the same bits as in Rust, for a chain pushed into a moving surface.

// Requirement: P-06

use std::fmt::Write;
use std::fs;
use std::process::Command;

use dibs_build::{Builder, generate};
use dibs_nostd::filter::{Filter, MotionRow, Reason, RigidMotion, Uncertainty};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, MovingTable, Odometer, Tracker, Tree};

use crate::programs::{compile, run};

const TICKS: usize = 1_500;

/// A label with a stand-off of its own.
const VESSEL: u8 = 2;

/// Ticks of a frame.
const HELD: usize = 60;

struct Tick {
    frame: usize,
    motion: [f32; 6],
    rows: usize,
}

/// In, along the surface, and out again, with a turn.
fn ticks() -> impl Iterator<Item = Tick> {
    (0..TICKS).map(|tick| {
        let inwards = if tick % 1_000 < 700 { -0.15 } else { 0.2 };
        let turn = if tick % 11 < 5 { 0.001 } else { -0.0008 };
        Tick {
            frame: tick / HELD,
            motion: [inwards, 0.03 * (tick as f32 * 0.02).sin(), -0.02, 0.0, turn, 0.0004],
            rows: usize::from(tick % 300 > 200),
        }
    })
}

fn bits(line: &mut String, values: &[f32]) {
    values.iter().for_each(|value| write!(line, " {:08x}", value.to_bits()).expect("a string"));
}

#[test]
fn admitted_motions_have_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a size");
    let is_vessel = |rows: &[u32; 3]| mesh.positions[rows[0] as usize].y > 30.0;
    let labels = mesh.triangles.iter().map(|rows| if is_vessel(rows) { VESSEL } else { 0 });
    let built = Builder::new().stretch(1.5).labels(labels.collect()).build(&mesh).expect("a tree");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
    let frames: Vec<Vec<Vec3>> =
        motion.frames.iter().map(|frame| built.to_rows(frame)).take(TICKS / HELD).collect();

    let tracker = || Tracker::<_, 512, 256, 256>::with_range(&tree).expect("a stack");
    let (mut first, mut second) = (tracker(), tracker());
    let mut odometer = Odometer::new(&tree);
    let mut surface: Option<MovingTable<'_, [Vec3]>> = None;
    let mut chain = [
        (Vec3::new(110.0, 3.0, 60.0), Vec3::new(110.0, 80.0, 90.0), 2.5),
        (Vec3::new(110.0, 80.0, 90.0), Vec3::new(150.0, 90.0, 120.0), 4.0),
    ];
    let row = MotionRow::along(Vec3::Y, -0.02);
    let (mut commands, mut expected, mut reasons) = (String::new(), Vec::new(), [0; 6]);
    for (tick, Tick { frame, motion, rows }) in ticks().enumerate() {
        let numbers = motion.map(|number| number.to_string()).join(" ");
        writeln!(commands, "{frame} {numbers} {rows}").expect("a string");
        if tick % HELD == 0 {
            let [before, now] = [frame.saturating_sub(1), frame].map(|at| frames[at].as_slice());
            surface = Some(match surface {
                None => odometer.start(now),
                Some(_) => odometer.step(before, now).after(),
            });
        }
        let surface = surface.as_ref().expect("the first frame");
        let tools =
            chain.map(|(start, end, radius)| Capsule::new(start, end, radius).expect("one"));
        let [x, y, z, a, b, c] = motion;
        let command = RigidMotion::new(chain[1].1, Vec3::new(x, y, z), Vec3::new(a, b, c));
        let instructions = if tick % 5 == 4 { 30_000 } else { 200_000 };
        let filter = Filter::new(1.0, 400.0).expect("a filter");
        let filter = filter.budget(instructions);
        let filter = if tick % 3 == 2 { filter.approach(0.02).expect("a time") } else { filter };
        let filter = if tick % 7 == 6 { filter.lever(50.0).expect("a lever") } else { filter };
        let of_vessel = if tick % 4 == 3 { 1.0 } else { 3.0 };
        let by_label = filter.stand_off_of([(VESSEL, of_vessel)]).expect("at least the filter's");
        let mut pairs = [(&mut first, surface, &tools[0]), (&mut second, surface, &tools[1])];
        let tissue = Uncertainty::new(20.0).error(0.05);
        let rows = &[row][..rows];
        let admitted = by_label.admit(&mut pairs, &command, 0.001, &tissue, rows);
        let admitted = admitted.expect("an answer");
        let number = [
            Reason::Commanded,
            Reason::Nearest,
            Reason::Shortened,
            Reason::Stopped,
            Reason::Retreating,
            Reason::NoSafeMotion,
        ]
        .iter()
        .position(|reason| *reason == admitted.reason);
        let number = number.expect("a reason");
        reasons[number] += 1;
        let mut line = format!("{number} {} {}", admitted.queries, admitted.instructions);
        bits(&mut line, &[admitted.least_separation]);
        let RigidMotion { about, translation, rotation } = admitted.motion;
        [about, translation, rotation].iter().for_each(|of| bits(&mut line, &of.to_array()));
        for (start, end, radius) in &mut chain {
            (*start, *end) = (admitted.motion.apply(*start), admitted.motion.apply(*end));
            bits(&mut line, &[start.to_array(), end.to_array()].concat());
            bits(&mut line, &[*radius]);
        }
        expected.push(line);
    }
    assert!(reasons[0] > 200 && reasons[1] > 200, "{reasons:?}");

    let floats = frames.iter().flatten().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes);
    let files: [(&str, Vec<u8>); 3] = [
        ("tree", built.blob().to_vec()),
        ("frames", floats.collect()),
        ("commands", commands.into_bytes()),
    ];
    let mut command = Command::new(compile("filter", folder.path()));
    for (name, bytes) in files {
        let path = folder.path().join(name);
        fs::write(&path, bytes).expect("writable");
        command.arg(path);
    }
    let said = run(&mut command);
    for (number, (c, rust)) in said.lines().zip(&expected).enumerate() {
        assert_eq!(c, rust, "tick {number}");
    }
    assert_eq!(said.lines().count(), TICKS);
}
