//! The `dibs` program, as a script would run it.
//!
//! One file, because each test is a few commands.

// Requirement: P-08

use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;

use dibs_build::Format;
use dibs_nostd::Tree;
use serde_json::Value;

use crate::program::{dibs, fails, json, succeeds};

fn vector(value: &Value) -> [f64; 3] {
    serde_json::from_value(value.clone()).unwrap()
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn from_generated_mesh_to_answer() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    let built = json(folder, "build heart.ply -o heart.dibs --stretch 1.5 --json");
    assert_eq!(built["mesh"]["triangles"], 1000);
    assert_eq!(built["tree"]["index_bits"], 16);
    assert_eq!(json(folder, "inspect heart.dibs --json"), built["tree"]);
    let wide = json(folder, "build heart.ply -o wide.dibs --stretch 1.5 --index 32 --json");
    assert_eq!(wide["tree"]["index_bits"], 32);
    let paper =
        json(folder, "build heart.ply -o paper.dibs --construction paper --stretch 1.5 --json");
    assert_eq!(paper["tree"]["surface_paths"], false);

    let tool = "--tool capsule:-70,5,20,-90,0,80,4 --vertices heart.pc2 --frame 9 --json";
    let answers =
        ["heart", "wide", "paper"].map(|tree| json(folder, &format!("query {tree}.dibs {tool}")));
    let motion = dibs_build::Motion::read_pc2(folder.join("heart.pc2")).unwrap();
    for answer in &answers {
        let separation = answer["separation"].as_f64().unwrap();
        let on_surface = vector(&answer["point_on_surface"]);
        assert!((separation - answers[0]["separation"].as_f64().unwrap()).abs() < 1e-3);
        let apart = distance(on_surface, vector(&answer["point_on_tool"]));
        assert!((separation - apart).abs() < 1e-3, "{answer}");
        // The triangle is named by the input file's vertices.
        let corners: [usize; 3] = serde_json::from_value(answer["triangle"].clone()).unwrap();
        let weights = vector(&answer["barycentric"]);
        let mut point = [0.0; 3];
        for (corner, weight) in corners.into_iter().zip(weights) {
            let position = motion.frames[9][corner].to_array();
            for i in 0..3 {
                point[i] += weight * f64::from(position[i]);
            }
        }
        assert!(distance(point, on_surface) < 1e-3, "{answer}");
    }
    let measured = json(folder, &format!("query heart.dibs {tool} --stretch 1.5"));
    assert_eq!(measured["separation"], answers[0]["separation"]);
    assert!(measured["node_tests"].as_u64() <= answers[0]["node_tests"].as_u64());
}

#[test]
fn rust_source_is_named_after_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate brain --triangles 500 -o brain.ply");
    succeeds(folder, "build brain.ply -o left-brain.rs --stretch 2");
    let source = std::fs::read_to_string(folder.join("left-brain.rs")).unwrap();
    assert!(source.contains("pub mod left_brain {"), "{source}");
    // The bytes stand beside it, so that the compiler need not read them as a literal.
    let blob = std::fs::read(folder.join("left-brain.dibs")).unwrap();
    assert!(Tree::<u16>::from_bytes(&blob).is_ok() && source.len() < 8_192, "{}", source.len());
    succeeds(folder, "build brain.ply -o tree.rs --name cortex");
    let source = std::fs::read_to_string(folder.join("tree.rs")).unwrap();
    assert!(source.contains("pub mod cortex {"), "{source}");
}

#[test]
fn bad_input_is_one_sentence_and_no_output() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("ok.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\n");
    write("twice.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 3\nf 1 2 3\n");
    write("torn.obj", "v 0 0 0\nv 10 0 0\nv 0 10 0\nf 1 2 9\n");
    write("old.dibs", "what was there before");
    for (line, part) in [
        ("build absent.obj -o old.dibs", "absent.obj"),
        ("build torn.obj -o old.dibs", "vertex 9"),
        ("build twice.obj -o old.dibs --strict", "duplicate"),
        ("build ok.obj -o old.dibs --weld=-1", "tolerance"),
        ("build ok.obj -o old.dibs --stretch 0.5", "stretch limit of 0.5"),
        ("build ok.obj -o old.txt", ".dibs or .rs"),
        ("build ok.obj -o absent/new.dibs", "absent/new.dibs"),
        ("inspect ok.obj", "this is a mesh file (OBJ)"),
        ("inspect absent.dibs", "absent.dibs"),
        ("generate heart --triangles 11 -o heart.ply", "11 triangles"),
    ] {
        let error = fails(folder, line);
        assert!(error.contains(part), "{line}: {error}");
    }
    assert_eq!(std::fs::read_to_string(folder.join("old.dibs")).unwrap(), "what was there before");
    assert_eq!(std::fs::read_dir(folder).unwrap().count(), 4);

    succeeds(folder, "build ok.obj -o ok.dibs --stretch 1.2");
    write("far.obj", "v 0 0 0\nv 20 0 0\nv 0 10 0\nf 1 2 3\n");
    write("few.off", "OFF 2 0 0\n0 0 0\n1 0 0\n");
    for (line, part) in [
        ("--vertices far.obj", "stretched by 2"),
        ("--vertices few.off", "has 2 vertices and the tree's mesh has 3"),
        ("--vertices ok.obj --frame 0", ".pc2"),
        ("--vertices ok.obj --stretch 0.9", "more than the 0.9"),
        ("--vertices absent.pc2 --frame 0", "absent.pc2"),
    ] {
        let error = fails(folder, &format!("query ok.dibs --tool sphere:0,0,5,1 {line}"));
        assert!(error.contains(part), "{line}: {error}");
    }
    let rest = json(folder, "query ok.dibs --tool sphere:1,1,5,1 --json");
    assert!((rest["separation"].as_f64().unwrap() - 4.0).abs() < 1e-5, "{rest}");
    assert!(distance(vector(&rest["point_on_surface"]), [1.0, 1.0, 0.0]) < 1e-5, "{rest}");
}

/// The program and the library agree on what is wrong with a file, and on what they make of it; what the library
/// must say about each is asserted in the tests package.
#[test]
fn malformed_files_end_as_the_library_says() {
    const FILES: [(&str, &str); 8] = [
        ("empty.stl", ""),
        ("prose.txt", "very few triangles here"),
        ("cut.stl", "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n"),
        ("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n"),
        ("beyond.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
        ("two.off", "OFF\n6 2 0\n0 0 0\n1 0 0\n0 1 0\n5 0 0\n6 0 0\n5 1 0\n3 0 1 2\n3 3 4 5\n"),
        ("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n"),
        ("thin.off", "OFF\n5 2 0\n0 0 0\n1 0 0\n0 1 0\n2 0 0\n3 0 0\n3 0 1 2\n3 1 3 4\n"),
    ];
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("tree.dibs");
    let (mut meshes, mut errors) = (0, 0);
    for (name, text) in FILES {
        std::fs::write(folder.path().join(name), text).unwrap();
        let line = format!("build {name} -o tree.dibs --stretch 1.3 --json");
        match dibs_build::read(folder.path().join(name)) {
            Ok(import) => {
                let built = json(folder.path(), &line);
                let report = serde_json::to_value(&import.report).unwrap();
                assert_eq!(built["mesh"], report, "{line}");
                assert_eq!(built["tree"]["triangles"], report["triangles"], "{line}");
                json(folder.path(), "inspect tree.dibs --json");
                std::fs::remove_file(&output).unwrap();
                meshes += 1;
            }
            Err(error) => {
                let message = format!("{name}: {}", error.kind);
                assert_eq!(fails(folder.path(), &line), message);
                assert!(!output.exists(), "{line}");
                errors += 1;
            }
        }
    }
    assert_eq!((meshes, errors), (3, 5));
}

/// Nobody need read the results to the end, and where they cannot be printed that is an error, not a panic.
#[cfg(target_os = "linux")]
#[test]
fn results_that_nobody_reads_or_no_disk_holds() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 3");
    // More than a buffer holds.
    std::fs::write(folder.join("path.csv"), "sphere:90,10,20,3\n".repeat(5_000)).unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = format!("--to udp:{}", socket.local_addr().unwrap());
    for line in [
        "generate heart --triangles 320 -o other.ply --motion other.pc2",
        "build heart.ply -o other.dibs --json",
        "build heart.ply -o other.dibs",
        "stretch heart.ply --motion heart.pc2 --limits other.limits",
        "inspect heart.dibs",
        "inspect heart.dibs --json",
        "query heart.dibs --tool sphere:0,0,150,5 --json",
        "query heart.dibs --poses path.csv",
        "track heart.dibs --motion heart.pc2 --path path.csv",
        "track heart.dibs --motion heart.pc2 --path path.csv --json",
        "completions zsh",
        "man",
        "--version",
        "query --help",
        &format!("stream heart.dibs --motion heart.pc2 {to} --frames 3 --json"),
    ] {
        let run = |stdout: std::process::Stdio| {
            let words = line.split_whitespace();
            let mut dibs = Command::new(env!("CARGO_BIN_EXE_dibs"));
            dibs.current_dir(folder).args(words).stdout(stdout).output().unwrap()
        };
        let full = run(std::fs::File::options().write(true).open("/dev/full").unwrap().into());
        let error = String::from_utf8(full.stderr).unwrap();
        assert_eq!(full.status.code(), Some(1), "{line}: {error}");
        assert!(error.contains("error: the results cannot be printed"), "{line}: {error}");
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let closed = run(writer.into());
        let error = String::from_utf8(closed.stderr).unwrap();
        assert!(closed.status.success() && !error.contains("error"), "{line}: {error}");
    }
    // What was to be written was.
    for file in ["other.ply", "other.pc2", "other.dibs", "other.limits"] {
        assert!(folder.join(file).metadata().unwrap().len() > 100, "{file}");
    }
}

/// A mesh is written as what its name says, and reads back as the same surface.
#[test]
fn a_mesh_is_what_its_name_says() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mesh = dibs_build::generate::heart(320).unwrap().mesh;
    for (name, format) in [
        ("h.ply", Format::Ply),
        ("h.STL", Format::StlBinary),
        ("h.obj", Format::Obj),
        ("h.off", Format::Off),
    ] {
        succeeds(folder, &format!("generate heart --triangles 320 -o {name}"));
        let import = dibs_build::read(folder.join(name)).unwrap();
        assert_eq!(import.report.format, format, "{name}");
        assert_eq!(import.report.warnings().collect::<Vec<_>>(), [""; 0], "{name}");
        let corners = |mesh: &dibs_build::Mesh| -> Vec<_> {
            mesh.triangles
                .iter()
                .map(|corners| corners.map(|v| mesh.positions[v as usize]))
                .collect()
        };
        assert_eq!(corners(&import.mesh), corners(&mesh), "{name}");
    }
    let error = fails(folder, "generate heart --triangles 320 -o h.txt --motion h.pc2");
    assert_eq!(
        error,
        "h.txt: a mesh is written as what its name ends in: .ply, .stl, .obj or .off"
    );
    assert!(!folder.join("h.txt").exists() && !folder.join("h.pc2").exists());
}

/// The program's own name, and sentences in which one triangle is one triangle.
#[test]
fn it_says_its_name_and_counts_in_english() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert!(succeeds(folder, "--version").starts_with("dibs 0."));
    // Two triangles that share no vertex but two positions: welded, and nothing more to be said about them.
    let soup = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";
    std::fs::write(folder.join("soup.obj"), soup).unwrap();
    std::fs::write(folder.join("one.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let of = |name: &str| {
        let output = dibs(folder, &format!("build {name}.obj -o {name}.dibs"));
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap())
    };
    let (read, warnings) = of("soup");
    assert!(read.contains("4 vertices, 2 triangles, 2 vertices welded to others"), "{read}");
    assert_eq!(warnings, "warning: soup.obj: 4 open border edges\n");
    let (read, _) = of("one");
    assert!(read.contains("3 vertices, 1 triangle\n") && !read.contains("1 triangles"), "{read}");
}

#[test]
fn a_tracked_path_is_answered_as_whole_queries_are() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 1.5");
    let tool = |tick: u32| {
        let x = 60.0 + 0.1 * f64::from(tick);
        format!("capsule:{x},0,20,{x},10,80,2.5\n")
    };
    std::fs::write(folder.join("tools.csv"), (0..120).map(tool).collect::<String>()).unwrap();
    let lines = |options: &str| -> Vec<Value> {
        let line = format!("track heart.dibs --motion heart.pc2 --path tools.csv --json {options}");
        let text = succeeds(folder, &line);
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    };
    for surface in ["held", "interpolated", "extrapolated"] {
        let tracked = lines(&format!("--surface {surface}"));
        let whole = lines(&format!("--surface {surface} --full"));
        assert_eq!((tracked.len(), whole.len()), (120, 120));
        let tests = |lines: &[Value]| -> u64 {
            lines.iter().map(|line| line["node_tests"].as_u64().unwrap()).sum()
        };
        assert!(tests(&tracked) * 4 < tests(&whole), "{surface}");
        for (tick, (tracked, whole)) in tracked.iter().zip(&whole).enumerate() {
            assert_eq!(tracked["tick"], tick);
            let apart =
                |key| tracked[key].as_f64().unwrap() - whole["separation"].as_f64().unwrap();
            assert!(apart("separation").abs() < 1e-3 && apart("lower").abs() < 1e-3, "{tracked}");
            assert_eq!(tracked["side"], "outside");
            assert_eq!(tracked["side"], whole["side"]);
            assert_eq!(tracked["fallback"].is_null(), tick > 0, "{tracked}");
            assert!(whole["fallback"].is_null());
        }
    }
    // Interpolated is the default, and not held.
    assert_eq!(lines(""), lines("--surface interpolated"));
    assert_ne!(lines("--full"), lines("--full --surface held"));

    std::fs::write(folder.join("bad.csv"), "sphere:1,2,3,4\nsphere:1,2\n").unwrap();
    let path = "track heart.dibs --motion heart.pc2 --path tools.csv";
    let said = dibs(folder, &format!("{path} --json"));
    let summary: Value = serde_json::from_slice(&said.stderr).unwrap();
    let ticks = String::from_utf8(said.stdout).unwrap();
    let ticks = ticks.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
    let nodes: f64 = ticks.map(|tick| tick["node_tests"].as_f64().unwrap()).sum();
    assert!((summary["node_tests"].as_f64().unwrap() * 120.0 - nodes).abs() < 1e-6, "{summary}");
    assert_eq!((&summary["ticks"], &summary["fallbacks"]), (&120.into(), &1.into()));
    assert!(summary["triangle_tests"].as_f64().unwrap() > 0.0);
    let plain = String::from_utf8(dibs(folder, path).stderr).unwrap();
    assert!(plain.starts_with("120 ticks: ") && plain.ends_with(", 1 fallbacks\n"), "{plain}");
    let error = fails(folder, "track heart.dibs --motion heart.pc2 --path bad.csv");
    assert!(error.starts_with("bad.csv, line 2: "), "{error}");
}

/// Signed separation, sides, contacts, a chain and a scene; and winding that has no sides is said and mended.
#[test]
fn sides_contacts_chains_and_scenes() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let points =
        "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nv -9 -9 18\nv 9 -9 18\nv 9 9 18\nv -9 9 18\n";
    let faces = ["1 4 3 2", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"];
    let obj = |faces: &[String]| format!("{points}f {}\n", faces.join("\nf "));
    let turned = |face: &str| face.split(' ').rev().collect::<Vec<_>>().join(" ");
    write("box.obj", &obj(&faces.map(String::from)));
    write("inward.obj", &obj(&faces.map(turned)));
    let mut mixed = faces.map(String::from);
    mixed[2] = turned(faces[2]);
    write("mixed.obj", &obj(&mixed));
    succeeds(folder, "build box.obj -o box.dibs");
    let ask = |tool: &str| json(folder, &format!("query box.dibs --tool {tool} --json"));
    for (tool, side, separation) in [
        ("sphere:1,2,24,2", "outside", 4.0),
        ("sphere:1,2,19,2", "outside", -1.0),
        ("sphere:1,2,15,2", "inside", -5.0),
        ("capsule:1,2,15,1,2,40,2", "crossing", -5.0),
        ("sphere:1,2,18,2", "undefined", -2.0),
    ] {
        let answer = ask(tool);
        assert_eq!(answer["side"], side, "{answer}");
        assert!((answer["separation"].as_f64().unwrap() - separation).abs() < 1e-3, "{answer}");
        assert_eq!(answer["side_reason"].is_string(), side == "undefined", "{answer}");
        assert!(vector(&answer["direction"])[2] > 0.99, "{answer}");
        assert!(answer.get("contacts").is_none());
    }
    // The inner side of a corner of two walls, from outside: the box's edge; and two tools on two boxes.
    write("far.obj", &obj(&faces.map(String::from)).replace("v -9", "v 31").replace("v 9", "v 49"));
    succeeds(folder, "build far.obj -o far.dibs");
    let line =
        "query box.dibs far.dibs --tool sphere:0,0,21,1 --tool capsule:20,0,9,27.5,0,9,1 --json";
    let scene = json(folder, &format!("{line} --contacts 5"));
    assert_eq!((&scene["tree"], &scene["tool"]), (&"box.dibs".into(), &0.into()), "{scene}");
    // Accuracy and tests are those of all pairs.
    let far = json(folder, "query far.dibs --tool capsule:20,0,9,27.5,0,9,1 --json");
    assert!(far["accuracy"].as_f64() > ask("sphere:0,0,21,1")["accuracy"].as_f64());
    assert!(scene["accuracy"].as_f64() >= far["accuracy"].as_f64(), "{scene}");
    assert!(scene["node_tests"].as_u64() > far["node_tests"].as_u64(), "{scene}");
    let contacts = scene["contacts"].as_array().unwrap();
    let found: Vec<f64> = contacts.iter().map(|c| c["separation"].as_f64().unwrap()).collect();
    assert!(
        found.len() == 2 && (found[0] - 2.0).abs() < 1e-3 && (found[1] - 2.5).abs() < 1e-3,
        "{scene}"
    );
    assert!(contacts.iter().any(|c| c["tree"] == "far.dibs" && vector(&c["normal"])[0] < -0.99));
    assert!(contacts.iter().all(|c| c["triangle"].as_array().unwrap().len() == 3));
    let error = fails(folder, &format!("{line} --vertices box.obj"));
    assert!(error.contains("once for each"), "{error}");

    let warns = |line: &str| {
        let built = json(folder, &format!("build {line} --json"));
        let warnings = built["warnings"].as_array().unwrap().iter();
        let all = warnings.map(|w| w.as_str().unwrap().to_owned()).collect::<Vec<_>>().join("\n");
        (all, built)
    };
    assert!(warns("inward.obj -o inward.dibs").0.contains("faces inwards"));
    let (warnings, built) = warns("mixed.obj -o mixed.dibs");
    assert!(warnings.contains("wound against each other") && warnings.contains("--orient"));
    assert_eq!(built["tree"]["adjacency_bytes"], 0);
    for (name, turned) in [("inward", 12), ("mixed", 2), ("box", 0)] {
        let (warnings, built) = warns(&format!("{name}.obj -o {name}.dibs --orient"));
        assert!(!warnings.contains("wound") && !warnings.contains("inwards"), "{warnings}");
        assert_eq!(built["turned"], turned);
        let answer = json(folder, &format!("query {name}.dibs --tool sphere:1,2,15,2 --json"));
        assert_eq!(answer["side"], "inside", "{name}: {answer}");
    }
}

/// A file that is no tree is named, with the command that makes its tree.
#[test]
fn a_mesh_in_place_of_a_tree_is_named() {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../dibs-build/tests/fixtures");
    for (file, what) in [
        ("gmsh_41_binary.msh", "a mesh file (Gmsh)"),
        ("scene.glb", "a mesh file (glTF)"),
        ("scene.gltf", "a mesh file (glTF)"),
        ("trimesh.3mf", "a mesh file (3MF)"),
        ("vtk_42_binary.vtk", "a mesh file (legacy VTK)"),
        ("vtk_raw.vtp", "a mesh file (VTK XML)"),
        ("meshio.vtu", "a mesh file (VTK XML)"),
        ("frames.npy", "a motion (NumPy)"),
        ("meshio.inp", "an Abaqus input file"),
    ] {
        let error = fails(&fixtures, &format!("inspect {file}"));
        assert!(error.contains(what) && error.contains("dibs build"), "{file}: {error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    let mesh = dibs_build::read(folder.join("heart.ply")).unwrap().mesh;
    let mut stl = vec![0_u8; 80];
    stl.extend((mesh.triangles.len() as u32).to_le_bytes());
    stl.resize(84 + 50 * mesh.triangles.len(), 0);
    std::fs::write(folder.join("heart.stl"), stl).unwrap();
    std::fs::write(folder.join("text.stl"), "solid s\nendsolid s\n").unwrap();
    std::fs::write(folder.join("heart.off"), "OFF\n0 0 0\n").unwrap();
    std::fs::write(folder.join("empty.dibs"), "").unwrap();
    for (line, what) in [
        ("inspect heart.ply", "PLY); make its tree first: `dibs build heart.ply -o heart.dibs`"),
        ("query heart.ply --tool sphere:0,0,0,1", "PLY"),
        ("track heart.ply --motion heart.pc2 --path absent.csv", "PLY"),
        ("inspect heart.stl", "binary STL"),
        ("inspect text.stl", "ASCII STL"),
        ("inspect heart.off", "OFF"),
        ("inspect heart.pc2", "a motion (PC2)"),
        ("inspect empty.dibs", "the file is empty"),
    ] {
        let error = fails(folder, line);
        assert!(error.contains("not a tree") && error.contains(what), "{line}: {error}");
    }
}

/// Wound against itself, a surface has no side: the answer says so, and what to do.
#[test]
fn a_surface_wound_against_itself_is_told_how_to_be_turned() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let corners = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\n";
    let faces = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 3 4\n";
    std::fs::write(folder.join("mixed.obj"), [corners, faces].concat()).unwrap();
    succeeds(folder, "build mixed.obj -o mixed.dibs");
    let is_told =
        |said: &str| said.contains("wound against each other") && said.contains("--orient");
    let answer = json(folder, "query mixed.dibs --tool sphere:20,20,20,1 --json");
    assert!(is_told(answer["side_reason"].as_str().unwrap()), "{answer}");
    let error = fails(folder, "query mixed.dibs --tool sphere:20,20,20,1 --contacts 50");
    assert!(is_told(&error), "{error}");
    succeeds(folder, "build mixed.obj -o turned.dibs --orient");
    let answer = json(folder, "query turned.dibs --tool sphere:20,20,20,1 --json");
    assert_eq!(answer["side"], "outside");
}

/// Two closed parts that overlap are one tree, and building says so.
#[test]
fn parts_that_overlap_are_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (name, apart, is_said) in [("over.obj", 4, true), ("apart.obj", 14, false)] {
        let corner = |x: i32, first: i32| {
            format!("v {x} 0 0\nv {} 0 0\nv {x} 12 0\nv {x} 0 12\n", x + 12)
                + &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]
                    .map(|f| format!("f {} {} {}\n", f[0] + first, f[1] + first, f[2] + first))
                    .concat()
        };
        std::fs::write(folder.join(name), corner(0, 1) + &corner(apart, 5)).unwrap();
        let output = dibs(folder, &format!("build {name} -o parts.dibs"));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        assert_eq!(said.contains("two parts of the surface cross or touch"), is_said, "{said}");
    }
    let answer = json(folder, "query parts.dibs --tool sphere:1,1,1,0.5 --json");
    assert_eq!(answer["side"], "inside");
}
