//! Sweeps between ticks in C: the same bits as in Rust, and the refusal of bad input.

// Requirement: P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use dibs_build::{Builder, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Odometer, Options, Sweep, Tracker, Tree};

use crate::programs::{include, library, run, tool};

#[test]
fn sweeps_have_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
    let frames: Vec<Vec<Vec3>> = motion.frames[..4].iter().map(|at| built.to_rows(at)).collect();
    let mut odometer = Odometer::new(&tree);
    let mut tracker = Tracker::<u16, 512, 256, 256>::with_range(&tree).expect("a stack");
    let (mut expected, mut touched) = (Vec::new(), 0);
    for (number, pair) in frames.windows(2).enumerate() {
        let step = odometer.step(pair[0].as_slice(), pair[1].as_slice());
        // Outside, towards the surface, and through it.
        for (at, end) in [(90.0, 88.0), (80.0, 46.0), (80.0, -80.0), (60.0, 60.0)] {
            let capsule = |x: f32| {
                let start = Vec3::new(x, 10.0 + number as f32, 20.0);
                Capsule::new(start, start + Vec3::new(40.0, 0.0, 20.0), 2.5).expect("finite")
            };
            let sweep = Sweep { step: &step, t: [0.25, 1.0], tools: [capsule(at), capsule(end)] };
            let swept = tracker.sweep(&sweep, 1.5, 24, &Options::new()).expect("sound");
            touched += usize::from(swept.contact.is_some());
            let numbers =
                [swept.clear_until, swept.contact.unwrap_or(-1.0), swept.at_end.separation];
            let bits = numbers.map(|number| format!("{:08x}", number.to_bits())).join(" ");
            expected.push(format!("{bits} {}", swept.samples));
        }
    }
    assert!((1..12).contains(&touched), "{touched}");
    let [blob, shapes, program] = ["tree", "frames", "sweep"].map(|name| folder.path().join(name));
    fs::write(&blob, built.blob()).expect("writable");
    let floats = frames.iter().flatten().flat_map(Vec3::to_array);
    fs::write(&shapes, floats.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()).expect("writable");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/sweep.c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let said = run(Command::new(program).arg(blob).arg(shapes));
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines.last().is_some_and(|line| line.contains(" 0 failures")), "{said}");
    assert_eq!(lines[..lines.len() - 1], expected);
}
