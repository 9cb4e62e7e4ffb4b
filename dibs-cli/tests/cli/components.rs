//! Meshes of several surfaces that share no vertex, on the command line.

// Requirement: A-08

use std::fmt::Write;

use crate::program::{dibs, fails, json, succeeds};

/// A heart and so many crumbs of eight triangles, 200 mm from each other.
fn heart_and_crumbs(folder: &std::path::Path, crumbs: usize) {
    succeeds(folder, "generate heart --triangles 320 -o heart.obj");
    let mut text = std::fs::read_to_string(folder.join("heart.obj")).unwrap();
    let mut vertices = text.lines().filter(|line| line.starts_with("v ")).count();
    for crumb in 1..=crumbs {
        let x = 200.0 * crumb as f32;
        for [dx, y, z] in [[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]] {
            writeln!(text, "v {} {y} {z}", x + dx as f32).unwrap();
        }
        for side in 0..4 {
            let [this, next] = [side, (side + 1) % 4].map(|corner| vertices + 1 + corner);
            let (top, bottom) = (vertices + 5, vertices + 6);
            writeln!(text, "f {this} {next} {top}\nf {next} {this} {bottom}").unwrap();
        }
        vertices += 6;
    }
    std::fs::write(folder.join("scan.obj"), text).unwrap();
}

#[test]
fn a_crumb_has_a_root_of_its_own_unless_only_the_largest_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart_and_crumbs(folder, 1);
    let built = dibs(folder, "build scan.obj -o scan.dibs");
    assert!(built.status.success());
    let said = String::from_utf8_lossy(&built.stderr);
    assert!(said.contains("1 smaller surface kept: each has a root of its own, 8 tri"), "{said}");
    assert!(succeeds(folder, "inspect scan.dibs").contains("roots    2, of surfaces"));
    let near = json(folder, "query scan.dibs --tool sphere:204,0,0,1 --json");
    assert!((near["separation"].as_f64().unwrap() - 2.0).abs() < 1e-4, "{near}");

    succeeds(folder, "build scan.obj -o heart.dibs --largest-component");
    assert!(!succeeds(folder, "inspect heart.dibs").contains("roots"));
    let far = json(folder, "query heart.dibs --tool sphere:204,0,0,1 --json");
    assert!(far["separation"].as_f64().unwrap() > 50.0, "{far}");
}

#[test]
fn more_surfaces_than_a_tree_has_roots_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    heart_and_crumbs(folder, 64);
    let error = fails(folder, "build scan.obj -o scan.dibs");
    assert!(error.contains("65 surfaces that share no vertex") && error.contains("64"), "{error}");
    assert!(error.contains("--largest-component"), "{error}");
    assert!(!folder.join("scan.dibs").exists());
    succeeds(folder, "build scan.obj -o scan.dibs --largest-component");
}
