//! Frames with a rigid pose each in C: the same bits as in Rust.

// Requirements: F-08, P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use dibs_build::{Builder, generate};
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::{Bus, Guard, GuardLimits, PosedRows, Surface};
use dibs_nostd::wire::NoMac;
use dibs_nostd::{Advance, Capsule, Millis, TreeBytes};

use crate::programs::{include, library, run, tool};

const VERTICES: usize = 162;
const FRAMES: u32 = 20;
const PERIOD: u32 = 30;

type Ends<'s, 't> = (Bus<'s, 't, u16, NoMac, PosedRows>, Guard<'s, 't, u16, 512, 256, PosedRows>);

#[test]
fn frames_with_poses_have_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = generate::heart(320).expect("a size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    let surface: Surface<VERTICES, PosedRows> = Surface::new();
    let limits = GuardLimits::new(300.0, Millis(80)).automatic();
    let tree = TreeBytes::<u16>::new(built.blob());
    let (mut bus, mut guard): Ends<'_, '_> = surface.start(tree, limits).expect("valid");
    // As in `expect.h`.
    let capsule = Capsule::new(Vec3::new(100.0, 0.0, 20.0), Vec3::new(140.0, 0.0, 50.0), 2.5);
    let capsule = capsule.expect("a tool");
    let poses: Vec<(Quat, Vec3)> = (0..FRAMES)
        .map(|frame| {
            let time = frame as f32;
            let turn = Quat::from_scaled_axis(Vec3::new(0.4, 0.01 * time, -0.02 * time));
            (turn.normalize(), Vec3::new(3.0 * (0.3 * time).sin(), -2.0, 0.5 * time))
        })
        .collect();
    let mut expected = Vec::new();
    for (frame, pose) in (0..).zip(&poses) {
        let now = 1_000 + frame * PERIOD;
        bus.frame_at(&mesh.positions, *pose, Millis(now), Millis(now)).expect("a good frame");
        let mut advance = Ok(Advance::Pending);
        while advance == Ok(Advance::Pending) {
            advance = bus.work(100);
        }
        let answer = guard.closest(&capsule, Millis(now + 11));
        let found = answer.tracked.expect("an answer").closest;
        let residual = answer.searched.and_then(|searched| searched.residual).unwrap_or(-1.0);
        let at = found.point_on_surface;
        let numbers = [
            found.separation,
            found.accuracy,
            at.x,
            at.y,
            at.z,
            found.direction.x,
            answer.velocity.x,
            residual,
        ];
        let bits = numbers.map(|number| format!("{:08x} ", number.to_bits()));
        expected.push(bits.concat());
    }
    let paths = ["tree", "frame", "poses", "pose"].map(|name| folder.path().join(name));
    let [blob, frame, sent, program] = paths;
    fs::write(&blob, built.blob()).expect("writable");
    let bytes =
        |floats: Vec<f32>| floats.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<_>>();
    let floats = mesh.positions.iter().flat_map(Vec3::to_array).collect();
    fs::write(&frame, bytes(floats)).expect("writable");
    let floats = |(turn, shift): &(Quat, Vec3)| [&turn.to_array()[..], &shift.to_array()].concat();
    fs::write(&sent, bytes(poses.iter().flat_map(floats).collect())).expect("writable");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/pose.c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let said = run(Command::new(program).args([blob, frame, sent]));
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines.last().is_some_and(|line| line.contains(" 0 failures")), "{said}");
    assert_eq!(lines[..lines.len() - 1], expected);
}
