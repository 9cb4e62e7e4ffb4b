//! An answer's corners lead to the vertices of the mesh's file.

// Requirement: P-06

use std::fs;
use std::process::Command;

use dibs_build::Builder;
use dibs_nostd::glam::Vec3;

use crate::programs::{compile, run};
use crate::readme::shuffled;

#[test]
fn corners_are_numbers_of_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let mesh = shuffled(1_000);
    let builder = Builder::new().stretch(1.5);
    let built = builder.build(&mesh).expect("a tree");
    let without = builder.with_vertex_order(false).build(&mesh).expect("a tree");
    let positions = mesh.positions.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes);
    let paths = ["tree", "positions", "without"].map(|name| folder.path().join(name));
    fs::write(&paths[0], built.blob()).expect("writable");
    fs::write(&paths[1], positions.collect::<Vec<u8>>()).expect("writable");
    fs::write(&paths[2], without.blob()).expect("writable");
    let said = run(Command::new(compile("corners", folder.path())).args(paths));
    assert!(said.ends_with(" checks, 0 failures\n"), "{said}");
}
