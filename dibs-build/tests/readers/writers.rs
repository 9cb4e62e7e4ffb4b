//! Files that other programs write now: `../writers.py` runs those that are installed.

// Requirement: M-03

use std::path::Path;
use std::process::Command;

use serde::Deserialize;

use dibs_build::glam::Vec3;
use dibs_build::{Import, ReadOptions};

#[derive(Deserialize)]
struct File {
    file: String,
    writer: String,
    points: Vec<[f64; 3]>,
    triangles: Vec<[usize; 3]>,
    labels: Option<Vec<u8>>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Line {
    File(File),
    Absent { absent: String },
}

/// Triangles by the positions of their corners, each from its least corner on, with their labels; sorted.
fn placed(
    triangles: impl Iterator<Item = ([Vec3; 3], Option<u8>)>,
) -> Vec<([[f32; 3]; 3], Option<u8>)> {
    // Text has six digits in some programs.
    let round = |p: Vec3| p.to_array().map(|x| (x * 1e3).round() / 1e3 + 0.0);
    let turned = triangles.map(|(corners, label)| {
        let [a, b, c] = corners.map(round);
        let least =
            [[a, b, c], [b, c, a], [c, a, b]].into_iter().min_by(|a, b| a.partial_cmp(b).unwrap());
        (least.unwrap(), label)
    });
    let mut all: Vec<_> = turned.collect();
    all.sort_by(|a, b| a.partial_cmp(b).unwrap());
    all
}

fn check(folder: &Path, file: &File) {
    let name = format!("{} of {}", file.file, file.writer);
    let options = ReadOptions { groups: file.labels.is_some(), ..Import::options() };
    let import =
        options.read(folder.join(&file.file)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let mesh = &import.mesh;
    // glTF is in metres, whatever the program's own unit is.
    let scale = import.report.unit.millimetres();
    let label = |triangle: usize| import.groups.as_ref().map(|groups| groups.labels[triangle]);
    let found =
        placed(mesh.triangles.iter().enumerate().map(|(number, t)| {
            (t.map(|v| mesh.positions[v as usize] / scale as f32), label(number))
        }));
    let expected = placed(file.triangles.iter().enumerate().map(|(number, t)| {
        let label = file.labels.as_ref().map(|labels| labels[number]);
        (t.map(|v| Vec3::from(file.points[v].map(|x| x as f32))), label)
    }));
    assert_eq!(found, expected, "{name}");
    assert_eq!(import.report.border_edges, 0, "{name}");
}

/// Fails where no such program is installed: the list of `cargo xtask test` says then that it was skipped.
#[test]
#[ignore = "needs a Python with vtk, gmsh, meshio, trimesh or pymeshlab: `cargo test -p dibs-build --features formats --test readers -- --ignored`"]
fn files_written_by_other_programs_now_are_read() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let own = root.join("../target/writers/bin/python3");
    let python = if own.exists() { own } else { "python3".into() };
    let folder = tempfile::tempdir().unwrap();
    let output =
        Command::new(&python).arg(root.join("tests/writers.py")).arg(folder.path()).output();
    let output = output.expect("skipped: no python3");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
    let text = String::from_utf8(output.stdout).unwrap();
    let (mut files, mut absent) = (Vec::new(), Vec::new());
    for line in text.lines() {
        match serde_json::from_str(line).unwrap() {
            Line::File(file) => files.push(file),
            Line::Absent { absent: name } => absent.push(name),
        }
    }
    files.iter().for_each(|file| check(folder.path(), file));
    let mut writers: Vec<&str> = files.iter().map(|file| file.writer.as_str()).collect();
    writers.sort_unstable();
    writers.dedup();
    assert!(!files.is_empty(), "skipped: none of {} is installed", absent.join(", "));
    for writer in writers {
        let count = files.iter().filter(|file| file.writer == writer).count();
        println!("read {count} files of {writer}");
    }
    absent.iter().for_each(|name| println!("skipped: {name} is not installed"));
}
