//! A sender in C, whose frames a bus of the same program receives over UDP.

// Requirements: F-08, P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use dibs_build::{Builder, generate};
use dibs_nostd::glam::Vec3;
use fastrand::Rng;

use crate::programs::{include, library, run, tool};

/// The mesh's file has its vertices in another order than the tree's rows, and one that no triangle has. All frames arrive in
/// the tree's order. From the third frame on the sending thread allocates nothing. A frame of another length, or with NaN, is
/// refused with a sentence. Frames with a pose are answered as by a call, bit for bit, and numbers that are no pose are
/// refused.
#[test]
fn frames_go_from_c_to_a_bus() {
    let folder = tempfile::tempdir().expect("a folder");
    let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000).expect("a size");
    let (mut mesh, mut rng) = (heart.clone(), Rng::with_seed(11));
    let mut order: Vec<usize> = (0..heart.positions.len()).collect();
    rng.shuffle(&mut order);
    let shuffled = |positions: &[Vec3]| -> Vec<Vec3> {
        let lone = Vec3::new(1.0, 2.0, 3.0);
        order.iter().map(|&vertex| positions[vertex]).chain([lone]).collect()
    };
    let mut place = vec![0; order.len()];
    for (at, &vertex) in order.iter().enumerate() {
        place[vertex] = at as u32;
    }
    mesh.positions = shuffled(&heart.positions);
    for corners in &mut mesh.triangles {
        *corners = corners.map(|vertex| place[vertex as usize]);
    }
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    let frames: Vec<Vec<Vec3>> = motion.frames.iter().take(12).map(|f| shuffled(f)).collect();
    let floats = |rows: &[Vec3]| -> Vec<u8> {
        rows.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect()
    };
    let [tree, sent, expected, program] =
        ["tree", "sent", "expected", "sender"].map(|name| folder.path().join(name));
    fs::write(&tree, built.blob()).expect("writable");
    fs::write(&sent, frames.iter().flat_map(|frame| floats(frame)).collect::<Vec<_>>())
        .expect("writable");
    let rows = frames.iter().flat_map(|frame| floats(&built.to_rows(frame)));
    fs::write(&expected, rows.collect::<Vec<_>>()).expect("writable");

    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=gnu11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    let counted = ["malloc", "calloc", "realloc", "posix_memalign"];
    gcc.args(counted.map(|name| format!("-Wl,--wrap={name}")));
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/sender.c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let said = run(Command::new(program).args([tree, sent, expected]));
    assert!(said.contains(" 0 failures"), "{said}");
    assert!(said.contains("12 frames received, 0 allocations"), "{said}");
    assert!(said.contains("12 poses received"), "{said}");
}
