//! Labels of triangles, from a text file to the answers of `dibs query`.

// Requirement: A-12

use std::fmt::Write;

use dibs_build::{Builder, LabelsErrorKind, generate, read_labels};

use crate::program::{fails, json, succeeds};

/// Every tenth triangle of a heart has the label 7, the others 0 to 4.
fn label(triangle: usize) -> u8 {
    if triangle.is_multiple_of(10) { 7 } else { (triangle % 5) as u8 }
}

#[test]
fn a_label_follows_its_triangle_to_the_answer() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply");
    let mesh = dibs_build::read(folder.join("heart.ply")).unwrap().mesh;
    let mut text = String::from("# tissues\n\n");
    for triangle in 0..mesh.triangles.len() {
        writeln!(text, " {}", label(triangle)).unwrap();
    }
    std::fs::write(folder.join("tissues.txt"), text).unwrap();
    let built = json(folder, "build heart.ply -o heart.dibs --labels tissues.txt --json");
    assert_eq!(built["tree"]["labels"], 6);
    assert!(succeeds(folder, "inspect heart.dibs").contains("labels   6 different"));
    let mut seen = 0;
    for pose in ["sphere:0,0,150,5", "sphere:90,0,20,1", "sphere:-90,10,0,1", "sphere:0,70,0,2"] {
        let line = format!("query heart.dibs --tool {pose} --contacts 300 --json");
        let answer = json(folder, &line);
        let contacts = answer["contacts"].as_array().unwrap();
        for found in [&answer].into_iter().chain(contacts) {
            let corners: [u32; 3] = serde_json::from_value(found["triangle"].clone()).unwrap();
            let is_it = |own: &[u32; 3]| corners.iter().all(|corner| own.contains(corner));
            let number = mesh.triangles.iter().position(is_it).unwrap();
            assert_eq!(found["label"], label(number), "{pose}: {found}");
            seen += 1;
        }
    }
    assert!(seen >= 8, "{seen}");
    // Without labels an answer has none.
    succeeds(folder, "build heart.ply -o plain.dibs");
    let answer = json(folder, "query plain.dibs --tool sphere:0,0,150,5 --json");
    assert!(answer.get("label").is_none(), "{answer}");
}

#[test]
fn labels_that_do_not_fit_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply");
    let mesh = generate::heart(320).unwrap().mesh;
    let refuse = |text: &str| {
        std::fs::write(folder.join("bad.txt"), text).unwrap();
        fails(folder, "build heart.ply -o heart.dibs --labels bad.txt")
    };
    for (text, expected) in [
        ("1\n2\n", "bad.txt: has 2 labels for 320 triangles"),
        ("1\n256\n", "bad.txt: line 2: '256' is not a label"),
        ("# a\n\n-1\n", "bad.txt: line 3: '-1' is not a label"),
        ("1.5\n", "bad.txt: line 1: '1.5' is not a label"),
    ] {
        let error = refuse(text);
        assert!(error.starts_with(expected), "{error}");
    }
    let missing = fails(folder, "build heart.ply -o heart.dibs --labels none.txt");
    assert!(missing.starts_with("none.txt: cannot be read"), "{missing}");
    assert!(!folder.join("heart.dibs").exists());
    let kind = read_labels(folder.join("bad.txt"), &mesh).unwrap_err().kind;
    assert!(matches!(kind, LabelsErrorKind::Line { line: 1, .. }), "{kind}");
    let error = Builder::new().labels(vec![0; 319]).build(&mesh).unwrap_err();
    assert_eq!(
        error.to_string(),
        "319 labels for a mesh of 320 triangles: there must be one for each"
    );
}
