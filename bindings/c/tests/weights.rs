//! Frames of weights in C: the bits of Rust's modal surface and of its answers, and the refusal of wrong ones.

// Requirements: F-06, P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use dibs_build::generate::MovingMesh;
use dibs_build::modes::ModalFit;
use dibs_build::{Builder, generate};
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::{Bus, Guard, GuardLimits, PosedRows, Surface};
use dibs_nostd::modes::Modes;
use dibs_nostd::wire::NoMac;
use dibs_nostd::{
    Advance, Capsule, Millis, Options, Proximity, Query, Tree, TreeBytes, VertexTable,
    measure_stretch,
};

use crate::programs::{include, library, run, tool};

const VERTICES: usize = 162;
const FRAMES: usize = 20;
const PERIOD: u32 = 30;

type Ends<'s, 't> = (Bus<'s, 't, u16, NoMac, PosedRows>, Guard<'s, 't, u16, 512, 256, PosedRows>);

#[test]
fn frames_of_weights_have_the_bits_of_the_modal_surface() {
    let folder = tempfile::tempdir().expect("a folder");
    let MovingMesh { mesh, motion } = generate::heart(320).expect("a size");
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let plain = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    let built = plain.with_modes(&fit, 2).expect("two modes");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
    let modes = Modes::of(&tree).expect("modes");
    let recorded = &built.modal_motion().expect("a motion").weights;
    let weights: Vec<&Vec<f32>> = recorded.iter().cycle().take(FRAMES).collect();
    let surface: Surface<VERTICES, PosedRows> = Surface::new();
    let limits = GuardLimits::new(30_000.0, Millis(80)).automatic();
    let (mut bus, mut guard): Ends<'_, '_> =
        surface.start(TreeBytes::new(built.blob()), limits).expect("valid");
    // As in the program and in `expect.h`.
    let pose = (Quat::from_xyzw(0.0, 0.0, 0.01, 0.99995), Vec3::new(0.5, -0.3, 0.2));
    let capsule = Capsule::new(Vec3::new(100.0, 0.0, 20.0), Vec3::new(140.0, 0.0, 50.0), 2.5);
    let capsule = capsule.expect("a tool");
    let mut query = Query::<u16, 512>::new(&tree).expect("a stack");
    let bits = |number: f32| format!("{:08x}", number.to_bits());
    let [blob, other, sent, program] =
        ["tree", "other", "weights", "program"].map(|name| folder.path().join(name));
    fs::write(&blob, built.blob()).expect("writable");
    fs::write(&other, plain.blob()).expect("writable");
    let floats = weights.iter().copied().flatten().flat_map(|weight| weight.to_le_bytes());
    fs::write(&sent, floats.collect::<Vec<u8>>()).expect("writable");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/weights.c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let said = run(Command::new(program).args([blob, other, sent]));
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines.last().is_some_and(|line| line.contains(" 0 failures")), "{said}");
    assert_eq!(lines.len(), FRAMES + 1);
    for (number, (line, weights)) in lines.iter().zip(weights).enumerate() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let surface = modes.surface::<2>(weights).expect("in range");
        let rows = (0..VERTICES as u32).map(|row| surface.position(row).expect("a vertex"));
        let positions: Vec<String> = rows.flat_map(|at| at.to_array()).map(bits).collect();
        let (sent, in_c) = words.split_at(positions.len());
        assert_eq!(sent, positions, "frame {number}");
        let now = Millis(1_000 + number as u32 * PERIOD);
        let taken = match number % 2 {
            0 => bus.frame_of_weights(&modes, weights, now, now),
            _ => bus.frame_of_weights_at(&modes, weights, pose, now, now),
        };
        taken.expect("a good frame");
        let advance = loop {
            match bus.work(100).expect("a good frame") {
                Advance::Pending => (),
                advance => break advance,
            }
        };
        assert!(matches!(advance, Advance::Published { .. }), "frame {number}: {advance:?}");
        let in_rust = guard.closest(&capsule, now).tracked.expect("an answer").closest;
        let numbers = |found: &Proximity| {
            [found.separation, found.accuracy, found.point_on_surface.x].map(bits)
        };
        assert_eq!(in_c, numbers(&in_rust), "frame {number}");
        assert!(in_rust.accuracy > modes.position_error() && modes.position_error() > 0.0);
        if number == 0 {
            // The same as a query on the modal surface itself.
            let stretch = measure_stretch(&tree, &surface).expect("within the limit");
            let options = Options::new().stretch(stretch);
            let found = query.closest(&surface, &capsule, &options).expect("sound");
            let [separation, _, x] = numbers(&found);
            assert_eq!([in_c[0], in_c[2]], [&separation, &x]);
            // A tracker counts rounding twice, and the modes' error once.
            let rounding = found.accuracy - modes.position_error();
            assert!(in_rust.accuracy < modes.position_error() + 2.01 * rounding);
            assert!(rounding > 0.0 && in_rust.accuracy >= found.accuracy);
        }
    }
}
