//! The controller of `examples/ros2`, without ROS: its ticks act on a wall while frames come, and hold once they do not.

// Requirement: P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use dibs_build::{Builder, generate};
use dibs_nostd::Tree;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
use xtask::workspace;

use crate::programs::{include, library, run, tool};

/// One each 33 ms, the last one at 4,653 ms: from 4,734 ms on it is older than its limit.
const FRAMES: usize = 111;

/// Frames of a heart that beats, as the program reads them.
fn packets(tree: &Tree<'_, u16>, frames: &[Vec<dibs_build::glam::Vec3>]) -> Vec<u8> {
    let mut stream = Vec::new();
    for (epoch, frame) in (1..).zip(frames.iter().cycle().take(FRAMES)) {
        let rows: Vec<_> = (0..tree.vertex_count())
            .map(|row| frame[tree.vertex_number(row).expect("a number").0 as usize])
            .collect();
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let frame = FrameEncoder::<_, 1024>::new(id, Encoding::Float, &rows[..]);
        let (mut frame, mut buffer) = (frame.expect("a frame"), [0; 1024]);
        let (mut count, mut packets) = (0_u32, Vec::new());
        while let Some(packet) = frame.next_packet(&mut buffer) {
            packets.extend((packet.len() as u32).to_le_bytes());
            packets.extend_from_slice(packet);
            count += 1;
        }
        stream.extend(count.to_le_bytes());
        stream.extend(packets);
    }
    stream
}

#[test]
fn the_controller_of_ros_runs_without_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a tree");
    let tree = built.tree::<u16>().expect("a tree");
    let [bytes, stream, program] = ["tree", "stream", "alone"].map(|name| folder.join(name));
    fs::write(&bytes, built.blob()).expect("writable");
    // At rest.
    let still = vec![motion.frames[0].clone()];
    fs::write(&stream, packets(&tree, &still)).expect("writable");

    let mut compiler = tool("g++", "g++");
    compiler.args(["-std=c++17", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-I"]).arg(include());
    compiler.arg(workspace::root().join("examples/ros2/alone.cpp")).arg("-o").arg(&program);
    run(compiler.arg(library()).args(["-lpthread", "-ldl", "-lm"]));
    let mut alone = Command::new(&program);
    let said = run(alone.args([Path::new(&bytes), &stream]));

    let numbers =
        said.split(|c: char| !c.is_ascii_digit() && c != '.').filter_map(|n| n.parse().ok());
    let numbers: Vec<f64> = numbers.collect();
    let [free, acting, saturated, held, statuses, largest] = numbers[..] else { panic!("{said}") };
    assert_eq!(free + acting + saturated + held, 4000.0, "{said}");
    // For 1,000 clear ticks after the first frame, and from the age limit on.
    assert!((1_280.0..=1_320.0).contains(&held), "{said}");
    assert!(free > 100.0 && acting > 10.0 && statuses >= 30.0, "{said}");
    assert!(largest > 0.5 && largest <= 5.001, "{said}");
}
