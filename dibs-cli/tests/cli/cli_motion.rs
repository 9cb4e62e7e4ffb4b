//! The `dibs` program and recorded motions: modes, weights and limits.

// Requirement: P-08

use std::net::UdpSocket;
use std::time::Duration;

use dibs_build::glam::Vec3;
use dibs_build::{Mesh, Motion};
use dibs_nostd::modes::{ModalAdmissionCheck, ModalReader, Modes};
use dibs_nostd::{Advance, Assembler, Frames, Millis, Tree, VertexTable};
use serde_json::Value;

use crate::program::{dibs, fails, json, succeeds};

#[test]
fn modes_are_fitted_shown_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    let line = "build heart.ply -o heart.dibs --motion heart.pc2 --modes";
    let built = json(folder, &format!("{line} 2 --json"));
    assert_eq!(built["tree"]["modes"]["count"], 2);
    assert_eq!(json(folder, "inspect heart.dibs --json"), built["tree"]);
    let errors = built["mode_errors"].as_array().unwrap();
    let error = |modes: usize| errors[modes - 1]["max"].as_f64().unwrap();
    assert!(errors.len() == 2 && error(1) > 1.0 && error(2) < 1e-4, "{errors:?}");
    let stated = built["tree"]["modes"]["position_error"].as_f64().unwrap();
    assert!(stated >= error(2) && stated < 1e-3, "{stated}");
    assert!(succeeds(folder, &format!("{line} 1")).contains("<- written"));
    assert!(succeeds(folder, "inspect heart.dibs").contains("modes    1, within"));
    succeeds(folder, "build heart.ply -o heart.rs --motion heart.pc2 --modes 2");
    let source = std::fs::read_to_string(folder.join("heart.rs")).unwrap();
    assert!(source.contains("pub const MODES: usize = 2"), "{source}");

    let error = fails(folder, &format!("{line} 2 --stretch 1.2"));
    assert!(error.contains("triangles beyond their limits"), "{error}");

    std::fs::write(folder.join("old.dibs"), "what was there before").unwrap();
    succeeds(folder, "generate heart --triangles 998 -o other.ply --motion other.pc2");
    for (line, part) in [
        ("heart.pc2 --modes 0", "0 modes cannot be had: the motion has 2"),
        ("heart.pc2 --modes 3", "3 modes cannot be had: the motion has 2"),
        ("other.pc2 --modes 2", "has 501 vertices and the mesh has 502"),
        ("absent.pc2 --modes 2", "absent.pc2"),
        ("heart.ply --modes 2", "heart.ply"),
    ] {
        let error = fails(folder, &format!("build heart.ply -o old.dibs --motion {line}"));
        assert!(error.contains(part), "{line}: {error}");
    }
    let before = std::fs::read_to_string(folder.join("old.dibs")).unwrap();
    assert_eq!(before, "what was there before");
}

/// From the program, over UDP, to the surface that a controller searches.
#[test]
fn weights_are_streamed() {
    const MODES: usize = 2;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --motion heart.pc2 --modes 2");
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let to = format!("--to udp:{} --weights", socket.local_addr().unwrap());
    let sent = json(
        folder,
        &format!("stream heart.dibs --motion heart.pc2 {to} --motion-rate 500 --json"),
    );
    assert_eq!(sent["frames"], 25);
    // A begin of 64 bytes, two weights in 32, and a commit of 32.
    assert!(sent["bytes_per_frame"].as_f64().unwrap() >= 128.0, "{sent}");

    let blob: &'static [u8] = std::fs::read(folder.join("heart.dibs")).unwrap().leak();
    let tree = Tree::<u16>::from_bytes(blob).unwrap();
    let modes = Modes::of(&tree).unwrap();
    let frames: &'static Frames<MODES> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().unwrap();
    let admission_check = ModalAdmissionCheck::<_, MODES>::new(&modes, &tree).unwrap();
    let mut assembler = Assembler::new(writer, admission_check, tree.mesh_id(), 1e4);
    let mut reader = ModalReader::<MODES>::new(reader, &modes).unwrap();
    let motion = Motion::read_pc2(folder.join("heart.pc2")).unwrap();
    let (mut buffer, mut published) = ([0; 2048], 0);
    while let Ok(length) = socket.recv(&mut buffer) {
        assembler.accept(&buffer[..length], Millis(0)).unwrap();
        let Ok(Advance::Published { .. }) = assembler.advance(u32::MAX) else { continue };
        let (frame, recorded) = (reader.read().unwrap(), &motion.frames[published]);
        for row in 0..tree.vertex_count() {
            let exact = recorded[tree.vertex_number(row).unwrap().0 as usize];
            let away = frame.position(row).unwrap().distance(exact);
            assert!(away <= frame.label().position_error, "frame {published}, row {row}: {away}");
        }
        published += 1;
    }
    assert_eq!(published, 25);

    succeeds(folder, "build heart.ply -o bare.dibs");
    let error = fails(folder, &format!("stream bare.dibs --motion heart.pc2 {to}"));
    assert!(error.contains("--motion and --modes"), "{error}");
    let error = fails(folder, &format!("stream heart.ply --motion heart.pc2 {to}"));
    assert!(error.contains("heart.ply"), "{error}");
}

#[test]
fn limits_are_learned_from_a_motion_and_hold_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    let line = "stretch heart.ply --motion heart.pc2 --margin 0.05 --limits heart.limits --picture heart.svg";
    let learned = json(folder, &format!("{line} --json"));
    let worst = &learned["worst"][0];
    let (largest, uniform) =
        (worst["stretch"].as_f64().unwrap(), learned["uniform_limit"].as_f64());
    assert!((largest * 1.05 - uniform.unwrap()).abs() < 1e-3, "{learned}");
    assert_eq!(learned["percentiles"][5][1], worst["stretch"]);
    assert!(std::fs::read_to_string(folder.join("heart.svg")).unwrap().contains("<svg"));
    assert!(
        succeeds(folder, "stretch heart.ply --motion heart.pc2 --construction paper")
            .contains("worst    triangle")
    );

    // The learned limits hold the motion. Lower ones do not: the error names a triangle and the remedy.
    let built = json(
        folder,
        "build heart.ply -o heart.dibs --limits heart.limits --motion heart.pc2 --json",
    );
    let limit = built["tree"]["stretch"].as_f64().unwrap();
    assert!((limit - uniform.unwrap()).abs() < 1e-6);
    assert!(built["tree"]["least_stretch_limit"].as_f64().unwrap() < limit - 0.05);
    let plain =
        json(folder, "build heart.ply -o plain.dibs --stretch 1.5 --motion heart.pc2 --json");
    assert_eq!(plain["tree"]["least_stretch_limit"], plain["tree"]["stretch"]);
    let error = fails(folder, "build heart.ply -o old.dibs --stretch 1.02 --motion heart.pc2");
    let named = format!("most of all triangle {} in frame {}", worst["triangle"], worst["frame"]);
    assert!(error.contains(&named) && error.contains("dibs stretch --limits"), "{error}");
    assert!(!folder.join("old.dibs").exists());

    // Both trees give the same distances on a frame of the motion.
    let tool = "--tool sphere:-70,5,20,3 --vertices heart.pc2 --frame 9 --stretch 2 --json";
    let [one, other] =
        ["heart", "plain"].map(|tree| json(folder, &format!("query {tree}.dibs {tool}")));
    assert_eq!(one["separation"], other["separation"]);
}

/// A controller refuses a frame that is inside out, whatever its limits: no limits are learned from it.
#[test]
fn a_frame_that_is_inside_out_is_named_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    let mut motion = Motion::read(folder.join("heart.pc2")).unwrap();
    motion.frames.truncate(5);
    motion.frames[3].iter_mut().for_each(|at| at.x = -at.x);
    motion.write_pc2(folder.join("mirrored.pc2")).unwrap();
    for line in [
        "stretch heart.ply --motion mirrored.pc2 --limits new.limits --picture new.svg",
        "build heart.ply -o new.dibs --stretch 9 --motion mirrored.pc2",
        "build heart.ply -o new.dibs --stretch 9 --motion mirrored.pc2 --modes 2",
    ] {
        let error = fails(folder, line);
        let part = "mirrored.pc2: frame 3 of the motion: is inside out: its volume is -0.9";
        assert!(error.starts_with(part), "{line}: {error}");
        for output in ["new.limits", "new.svg", "new.dibs"] {
            assert!(!folder.join(output).exists(), "{line}: {output}");
        }
    }
}

/// Whichever limit refuses a frame, the error names the file of the frame.
#[test]
fn a_frame_beyond_a_limit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs --stretch 1.5");
    succeeds(folder, "build heart.ply -o narrow.dibs --stretch 1.001");
    let ask = "--tool sphere:0,0,150,5 --vertices heart.pc2 --frame 9";
    let by_option = fails(folder, &format!("query heart.dibs {ask} --stretch 1.001"));
    assert!(by_option.starts_with("heart.pc2, frame 9: the surface is stretched"), "{by_option}");
    let by_tree = fails(folder, &format!("query narrow.dibs {ask}"));
    assert!(by_tree.starts_with("heart.pc2, frame 9: triangle"), "{by_tree}");
    assert!(by_tree.contains("a larger --stretch"), "{by_tree}");
    let at_rest = "query heart.dibs --tool sphere:0,0,150,5 --stretch 0.9";
    let error = fails(folder, at_rest);
    assert!(error.starts_with("heart.dibs: the surface is stretched"), "{error}");
}

#[test]
fn limits_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    succeeds(folder, "generate heart --triangles 998 -o other.ply --motion other.pc2");
    succeeds(folder, "stretch heart.ply --motion heart.pc2 --limits heart.limits");
    let text = std::fs::read_to_string(folder.join("heart.limits")).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    write("short.limits", &lines[..500].join("\n"));
    write("low.limits", &text.replace(lines[700], "0.5"));
    write("none.limits", "v 1 2 3");
    for (line, expected) in [
        ("build other.ply -o t.dibs --limits heart.limits", "is of mesh"),
        ("build heart.ply -o t.dibs --limits short.limits", "has 496 limits, 1000 are needed"),
        ("build heart.ply -o t.dibs --limits low.limits", "'0.5' is not a limit"),
        (
            "build heart.ply -o t.dibs --limits none.limits",
            "no file of stretch limits: `dibs stretch MESH --motion MOTION",
        ),
        ("build heart.ply -o t.dibs --limits missing.limits", "cannot be read"),
        ("stretch heart.ply --motion other.pc2", "vertices and the mesh has"),
        ("stretch heart.ply --motion heart.pc2 --margin=-1", "a margin of -1 makes no sense"),
        ("build heart.ply -o t.dibs --stretch 0.5", "a stretch limit of 0.5 makes no sense"),
    ] {
        let error = fails(folder, line);
        assert!(error.contains(expected), "{line}: {error}");
        assert!(!folder.join("t.dibs").exists());
    }
}

/// A triangle that no f32 arithmetic can measure is named when the tree is built, not when the controller
/// refuses every frame.
#[test]
fn what_the_stretch_check_cannot_measure_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let square = "v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\n";
    let write = |name: &str, rest: &str| {
        std::fs::write(folder.join(name), format!("{square}{rest}")).unwrap();
    };
    write("good.obj", "f 1 2 3\nf 1 3 4\n");
    write("flat.obj", "v 0.01 0.00001 0\nf 1 2 3\nf 1 3 4\nf 2 1 5\n");
    write("tiny.obj", "v 1e-8 0 0\nv 0 1e-8 0\nf 1 2 3\nf 1 3 4\nf 1 5 6\n");
    for (mesh, unmeasurable) in [("good", 0), ("flat", 0), ("tiny", 1)] {
        let output = dibs(folder, &format!("build {mesh}.obj -o {mesh}.dibs --json"));
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{errors}");
        let built: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(built["tree"]["unmeasurable"], unmeasurable, "{built}");
        let warned = built["warnings"].to_string().contains("0, 4 and 5) are too small");
        assert_eq!(warned, unmeasurable > 0, "{built}");
        assert_eq!(errors.contains("weld or drop them"), unmeasurable > 0, "{errors}");
    }
}

/// At the centre of a ball all triangles are as close: more than a tracker has places for.
#[test]
fn a_tracker_with_too_few_places_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    const RINGS: u32 = 100;
    let mut positions = vec![Vec3::Z * 50.0];
    for ring in 1..RINGS {
        let (sin, cos) = (ring as f32 / RINGS as f32 * std::f32::consts::PI).sin_cos();
        positions.extend((0..2 * RINGS).map(|at| {
            let (y, x) = (at as f32 / RINGS as f32 * std::f32::consts::PI).sin_cos();
            Vec3::new(sin * x, sin * y, cos) * 50.0
        }));
    }
    positions.push(Vec3::Z * -50.0);
    let last = positions.len() as u32 - 1;
    let at = |ring: u32, place: u32| match ring {
        0 => 0,
        RINGS => last,
        ring => 1 + (ring - 1) * 2 * RINGS + place % (2 * RINGS),
    };
    let quads = (0..RINGS).flat_map(|ring| (0..2 * RINGS).map(move |place| (ring, place)));
    let triangles = quads.flat_map(|(ring, place)| {
        let [a, b] = [at(ring, place), at(ring, place + 1)];
        let [c, d] = [at(ring + 1, place), at(ring + 1, place + 1)];
        [[a, c, d], [a, d, b]]
    });
    let has_area = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let triangles: Vec<[u32; 3]> = triangles.filter(has_area).collect();
    let mesh = Mesh { positions: positions.clone(), triangles, ..Mesh::default() };
    mesh.write_ply(folder.join("ball.ply")).unwrap();
    let motion = Motion { frames: vec![positions; 2], rate: 10.0, ..Motion::default() };
    motion.write_pc2(folder.join("ball.pc2")).unwrap();
    std::fs::write(folder.join("path.csv"), "sphere:0,0,0,1\n".repeat(3)).unwrap();
    succeeds(folder, "build ball.ply -o ball.dibs");
    let output = dibs(folder, "track ball.dibs --motion ball.pc2 --path path.csv");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(said.starts_with("warning: 3 of 3 ticks were whole queries"), "{said}");
    std::fs::write(folder.join("path.csv"), "sphere:0,0,70,1\n".repeat(3)).unwrap();
    let output = dibs(folder, "track ball.dibs --motion ball.pc2 --path path.csv");
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && !said.contains("warning"), "{said}");
}
