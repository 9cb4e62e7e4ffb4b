//! Queries in C on a surface that nodes carry: the same bits as in Rust, and the refusal of bad input.

// Requirement: P-06

use std::fs;
use std::path::Path;
use std::process::Command;

use dibs_build::glam::DVec3;
use dibs_build::{Builder, Volume, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Capsule, Options, Query, Tree, VertexTable};

use crate::programs::{include, library, run, tool};

/// Nodes' positions that may be a quarter of a millimetre off.
struct Inexact<'a>(&'a [Vec3]);

impl VertexTable for Inexact<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn position(&self, row: u32) -> Option<Vec3> {
        self.0.position(row)
    }

    fn position_error(&self) -> f32 {
        0.25
    }
}

#[test]
fn queries_on_nodes_have_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = generate::heart(1_000).expect("a size").mesh;
    let lattice = Volume::lattice(&mesh, [3, 3, 4]).expect("a lattice");
    let built = Builder::new().stretch(1.5).nodes(&lattice).build(&mesh).expect("a tree");
    let tree = Tree::<u16>::from_bytes(built.blob()).expect("a tree");
    let nodes = Nodes::of(&tree).expect("nodes");
    let frame = |number: usize| -> Vec<Vec3> {
        let by = 0.05 * (number as f64 * 0.5).sin();
        let at = |at: &DVec3| (*at * DVec3::new(1.0 + by, 1.0 - by, 1.0)).as_vec3();
        lattice.nodes().iter().map(at).collect()
    };
    let frames: Vec<Vec<Vec3>> = (0..12).map(frame).collect();
    let tool_of = Capsule::new(Vec3::new(90.0, 10.0, 20.0), Vec3::new(120.0, 10.0, 40.0), 2.5);
    let capsule = tool_of.expect("a tool");
    let mut query = Query::<u16, 512>::new(&tree).expect("a stack");
    let mut expected = Vec::new();
    for frame in &frames {
        let table = Inexact(frame);
        let measured = nodes.measure(&table).expect("within the limit");
        let surface = nodes.surface(&table);
        let options = Options::new().stretch(measured);
        let found = query.closest(&surface, &capsule, &options).expect("sound");
        let numbers = [
            measured.sigma(),
            surface.position_error(),
            found.separation,
            found.lower,
            found.accuracy,
        ];
        let bits = numbers.map(|number| format!("{:08x}", number.to_bits())).join(" ");
        expected.push(format!("{bits} {}", found.node_tests));
    }
    let [blob, motion, program] = ["tree", "frames", "nodes"].map(|name| folder.path().join(name));
    fs::write(&blob, built.blob()).expect("writable");
    let floats = frames.iter().flatten().flat_map(Vec3::to_array);
    fs::write(&motion, floats.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()).expect("writable");
    let mut gcc = tool("gcc", "gcc");
    gcc.args(["-std=c11", "-g", "-Wall", "-Wextra", "-Werror"]);
    gcc.args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-I"]).arg(include());
    gcc.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/programs/nodes.c"));
    run(gcc.arg(library()).args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&program));
    let said = run(Command::new(program).arg(blob).arg(motion));
    let lines: Vec<&str> = said.lines().collect();
    assert!(lines.last().is_some_and(|line| line.contains(" 0 failures")), "{said}");
    assert_eq!(lines[..lines.len() - 1], expected);
}
