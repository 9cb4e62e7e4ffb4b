//! The program on a heart kilometres from the origin: coordinates go in and come out as the file has them, and
//! everything between counts from the tree's origin.

// Requirement: M-05

use std::fs;
use std::io::Read;
use std::net::TcpListener;
use std::path::Path;

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{Format, Mesh, Motion, WriteErrorKind, generate};
use dibs_nostd::wire::{Deframer, NoMac};
use dibs_nostd::{Advance, Assembler, Frames, Millis, StretchMonitor, Tree, VertexTable};
use serde_json::Value;

use crate::program::{fails, json, succeeds};

/// Vertices of the heart of 1,000 triangles.
const N: usize = 502;

/// A heart elsewhere, in millimetres.
struct FarHeart {
    triangles: Vec<[u32; 3]>,
    /// Rest shape, and frames.
    shapes: Vec<Vec<DVec3>>,
    /// What the files have: `mm`, or `m`.
    unit: &'static str,
}

impl FarHeart {
    /// Writes `heart.obj` and the frames `f0.obj`, `f1.obj`, ... in this unit.
    fn new(folder: &Path, away: DVec3, unit: &'static str) -> Self {
        let generate::MovingMesh { mesh, motion } = generate::heart(1_000).unwrap();
        let factor = if unit == "m" { 1e3 } else { 1.0 };
        let mut shapes = Vec::new();
        let frames = motion.frames.iter().step_by(8).take(3);
        for (number, positions) in std::iter::once(&mesh.positions).chain(frames).enumerate() {
            let in_file: Vec<DVec3> =
                positions.iter().map(|p| (p.as_dvec3() + away) / factor).collect();
            let mut text: String =
                in_file.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
            for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|vertex| vertex + 1)) {
                text += &format!("f {a} {b} {c}\n");
            }
            let name = match number.checked_sub(1) {
                None => "heart.obj".to_owned(),
                Some(frame) => format!("f{frame}.obj"),
            };
            fs::write(folder.join(name), text).unwrap();
            shapes.push(in_file.iter().map(|p| *p * factor).collect());
        }
        Self { triangles: mesh.triangles, shapes, unit }
    }

    /// The distance of a point from a shape, by exhaustive search in f64.
    fn distance(&self, shape: usize, point: DVec3) -> f64 {
        let corners = |t: &[u32; 3]| t.map(|vertex| self.shapes[shape][vertex as usize] - point);
        self.triangles.iter().map(|t| from_zero(corners(t))).fold(f64::INFINITY, f64::min)
    }

    /// An answer of the program for a sphere of radius 2 is right, and in the file's coordinates.
    fn check(&self, answer: &Value, shape: usize, centre: DVec3, most_accuracy: f64) {
        let number = |name: &str| answer[name].as_f64().unwrap();
        let point = |name: &str| -> DVec3 {
            serde_json::from_value::<[f64; 3]>(answer[name].clone()).unwrap().into()
        };
        let (accuracy, truth) = (number("accuracy"), self.distance(shape, centre));
        assert!(accuracy <= most_accuracy, "within {accuracy}");
        let separation = if number("separation") < truth - 3.0 { -truth } else { truth } - 2.0;
        let error = (number("separation") - separation).abs();
        // The tool's own coordinates are rounded, too.
        assert!(error <= accuracy + 1e-5, "off by {error}, within {accuracy}: {answer}");
        let error = (point("point_on_surface").distance(centre) - truth).abs();
        assert!(error <= 1e-3, "{answer}");
        assert!((point("point_on_tool").distance(centre) - 2.0).abs() <= 1e-3, "{answer}");
    }
}

/// The distance of a triangle from zero: to its plane where that is inside, else to an edge.
fn from_zero([a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let edges = [(a, b), (b, c), (c, a)];
    let foot = normal * (a.dot(normal) / normal.length_squared());
    if edges.iter().all(|(p, q)| (*q - *p).cross(foot - *p).dot(normal) >= 0.0) {
        return foot.length();
    }
    let to_edge = |(p, q): (DVec3, DVec3)| {
        let along = q - p;
        (p + along * (-p.dot(along) / along.length_squared()).clamp(0.0, 1.0)).length()
    };
    edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
}

/// Centres of tools around and in the heart.
fn centres(away: DVec3) -> Vec<DVec3> {
    let local = [[0.0, 0.0, 90.0], [60.25, -12.5, 3.0], [-31.0, 44.0, -17.0], [5.0, 3.0, 1.0]];
    local.iter().map(|&point| away + DVec3::from(point)).collect()
}

fn words(point: DVec3) -> String {
    format!("sphere:{},{},{},2", point.x, point.y, point.z)
}

#[test]
fn a_heart_far_away_is_answered_as_one_nearby() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // The accuracy of each answer near the origin.
    let mut near = Vec::new();
    for (away, unit) in [
        (DVec3::ZERO, "mm"),
        (DVec3::new(4e6, -1.3e6, 570_000.3), "mm"),
        // A point on the earth, by UTM.
        (DVec3::new(500_123_456.7, 4_649_776_224.9, 123_400.0), "m"),
    ] {
        let heart = FarHeart::new(folder, away, unit);
        let unit = format!("--unit {}", heart.unit);
        let build = format!("build heart.obj -o h.dibs --motion f%d.obj --stretch 1.6 {unit}");
        let built = json(folder, &format!("{build} --json"));
        let is_far = away != DVec3::ZERO;
        assert_eq!(built["mesh"]["recentred"], is_far);
        let inspected = json(folder, "inspect h.dibs --json");
        assert_eq!(inspected["origin"], built["tree"]["origin"]);
        let origin: [f64; 3] = serde_json::from_value(inspected["origin"].clone()).unwrap();
        let origin = DVec3::from(origin);
        assert!(origin == DVec3::ZERO && !is_far || origin.distance(away) < 60.0, "{origin}");
        let said = succeeds(folder, &build) + &succeeds(folder, "inspect h.dibs");
        assert_eq!(said.matches("\norigin   ").count(), if is_far { 2 } else { 0 }, "{said}");

        // One by one, at rest and in a frame, and as lines of a file.
        let at_rest =
            |centre| json(folder, &format!("query h.dibs --tool {} --json", words(centre)));
        let frame = format!("--vertices f%d.obj --frame 2 {unit}");
        let mut lines = String::new();
        for (number, centre) in centres(away).into_iter().enumerate() {
            let tool = words(centre);
            let answer = json(folder, &format!("query h.dibs --tool {tool} {frame} --json"));
            let answers = [at_rest(centre), answer.clone()];
            if !is_far {
                near.push(answers.clone().map(|answer| answer["accuracy"].as_f64().unwrap()));
            }
            heart.check(&answers[0], 0, centre, 1.1 * near[number][0]);
            heart.check(&answers[1], 3, centre, 1.1 * near[number][1]);
            let mesh = format!("--vertices f2.obj {unit}");
            assert_eq!(answer, json(folder, &format!("query h.dibs --tool {tool} {mesh} --json")));
            lines += &format!("{},{},{},2\n", centre.x, centre.y, centre.z);
        }
        fs::write(folder.join("poses.csv"), lines).unwrap();
        let answers = succeeds(folder, "query h.dibs --poses poses.csv");
        for (answer, centre) in answers.lines().zip(centres(away)) {
            let mut answer: Value = serde_json::from_str(answer).unwrap();
            answer.as_object_mut().unwrap().remove("line");
            assert_eq!(answer, at_rest(centre));
        }
        let contacts = json(
            folder,
            &format!("query h.dibs --tool {} --contacts 30 --json", words(centres(away)[1])),
        );
        let contact = &contacts["contacts"][0];
        assert_eq!(contact["point_on_surface"], contacts["point_on_surface"]);

        // Tick by tick.
        let tools: Vec<String> = centres(away)[..3].iter().map(|&centre| words(centre)).collect();
        fs::write(folder.join("tools.csv"), tools.join("\n")).unwrap();
        let track = "track h.dibs --motion f%d.obj --motion-rate 1 --rate 1 --path tools.csv --surface held";
        let ticks = succeeds(folder, &format!("{track} {unit} --json"));
        for (tick, centre) in ticks.lines().zip(centres(away)) {
            let tick: Value = serde_json::from_str(tick).unwrap();
            let shape = 1 + tick["tick"].as_u64().unwrap() as usize;
            let error = tick["separation"].as_f64().unwrap() + 2.0 - heart.distance(shape, centre);
            assert!(error.abs() <= 2e-3, "{tick}: off by {error}");
        }
        let stretches = json(folder, &format!("stretch heart.obj --motion f%d.obj {unit} --json"));
        assert!((1.0..1.7).contains(&stretches["uniform_limit"].as_f64().unwrap()));
    }
}

/// A controller gets the frame's positions from the tree's origin.
#[test]
fn a_far_motion_is_sent_from_the_origin() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let heart = FarHeart::new(folder, DVec3::new(4e6, -1.3e6, 570_000.3), "mm");
    succeeds(folder, "build heart.obj -o h.dibs --motion f%d.obj --stretch 1.6");
    let blob = fs::read(folder.join("h.dibs")).unwrap();
    let tree = Tree::<u16>::from_bytes(&blob).unwrap();
    for surface in ["h.dibs", "heart.obj"] {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let receiver = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
            bytes
        });
        let to = format!("--to tcp:127.0.0.1:{port} --motion-rate 20 --frames 1");
        succeeds(folder, &format!("stream {surface} --motion f%d.obj {to} --json"));
        let frames = Frames::<N>::new();
        let (writer, mut reader) = frames.split().unwrap();
        let monitor = StretchMonitor::new(&tree).unwrap();
        let mut assembler = Assembler::with_mac(writer, monitor, tree.mesh_id(), 1e3, NoMac);
        let mut deframer = Deframer::<1024>::new();
        for byte in receiver.join().unwrap() {
            if let Some(packet) = deframer.push(byte) {
                assembler.accept(packet.unwrap(), Millis(0)).unwrap();
            }
            while assembler.advance(1_000).unwrap() != Advance::Idle {}
        }
        let frame = reader.read().unwrap();
        for row in 0..tree.vertex_count() {
            let vertex = tree.vertex_number(row).unwrap().0 as usize;
            let exact = tree.local(heart.shapes[1][vertex].to_array());
            assert_eq!(frame.position(row).unwrap(), exact, "{surface}, row {row}");
        }
    }
}

#[test]
fn what_f32_has_spoilt_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let heart = FarHeart::new(folder, DVec3::new(4e6, 0.0, 0.0), "mm");
    succeeds(folder, "build heart.obj -o h.dibs");
    let frame: Vec<Vec3> = heart.shapes[1].iter().map(|p| p.as_vec3()).collect();
    let motion = Motion { frames: vec![frame.clone()], rate: 20.0, ..Motion::default() };
    motion.write_pc2(folder.join("single.pc2")).unwrap();
    let spoilt = Mesh { positions: frame, triangles: heart.triangles, ..Mesh::default() };
    spoilt.write_ply(folder.join("single.ply")).unwrap();
    for line in [
        "build single.ply -o s.dibs",
        "build heart.obj -o s.dibs --motion single.pc2",
        "query h.dibs --tool sphere:4e6,0,90,2 --vertices single.ply",
        "query h.dibs --tool sphere:4e6,0,90,2 --vertices single.pc2 --frame 0",
    ] {
        let error = fails(folder, line);
        assert!(error.contains("its shape is lost; export it in double precision"), "{error}");
    }
    let error = fails(folder, "build heart.obj -o s.dibs --origin 0,0,0");
    assert!(error.contains("from the origin of the mesh, where f32 numbers are"), "{error}");
    // A motion elsewhere is none of this mesh.
    generate::heart(1_000).unwrap().motion.write_pc2(folder.join("near.pc2")).unwrap();
    let error = fails(folder, "build heart.obj -o s.dibs --motion near.pc2");
    assert!(
        error.contains("frame 0 is") && error.contains("give a file of the same mesh"),
        "{error}"
    );
    succeeds(folder, "build heart.obj -o s.dibs --origin 4000000,0,-7.5");
    let inspected = json(folder, "inspect s.dibs --json");
    assert_eq!(inspected["origin"], serde_json::json!([4e6, 0.0, -7.5]));
}

/// A mesh that was read far away is written where it was.
#[test]
fn a_recentred_mesh_is_written_where_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let _heart = FarHeart::new(folder, DVec3::new(4e6, -1.3e6, 570_000.3), "mm");
    let mesh = dibs_build::read(folder.join("heart.obj")).unwrap().mesh;
    assert!(mesh.origin.x > 3.9e6);
    for (name, format) in [
        ("o.ply", Format::Ply),
        ("o.obj", Format::Obj),
        ("o.off", Format::Off),
        ("o.stl", Format::StlAscii),
    ] {
        mesh.write(folder.join(name), format).unwrap();
        let again = dibs_build::read(folder.join(name)).unwrap().mesh;
        if format == Format::StlAscii {
            assert_eq!((again.origin, again.triangles.len()), (mesh.origin, mesh.triangles.len()));
        } else {
            assert_eq!(again, mesh, "{name}");
        }
    }
    let error = mesh.write(folder.join("o.stl"), Format::StlBinary).unwrap_err();
    assert!(matches!(error.kind, WriteErrorKind::TooFar), "{error}");
}
