//! Frames of another mesh, or in another unit, are refused wherever they come from; the accuracy covers what was dropped.

// Requirement: M-06

use std::fmt::Write;
use std::path::Path;

use dibs_build::glam::{DVec3, Vec3};
use dibs_build::{
    Builder, FrameCheck, FrameError, Import, Mesh, Motion, MotionMismatchError, ReadOptions, Unit,
    generate,
};
use dibs_stream::SurfaceOrder;

use crate::program::{fails, json, succeeds};

/// A closed box with corners that stand at `size` along the axes; the face of the last row is of four corners.
fn obj(size: [f64; 3], order: [usize; 8]) -> String {
    let mut text = String::new();
    for corner in order {
        let at = |axis: usize| if corner >> axis & 1 == 1 { size[axis] } else { 0.0 };
        writeln!(text, "v {} {} {}", at(0), at(1), at(2)).unwrap();
    }
    let of = |corner: usize| 1 + order.iter().position(|&c| c == corner).unwrap();
    for [a, b, c] in [
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
    ] {
        writeln!(text, "f {} {} {}", of(a), of(b), of(c)).unwrap();
    }
    writeln!(text, "f {} {} {} {}", of(1), of(3), of(7), of(5)).unwrap();
    text
}

const IN_ORDER: [usize; 8] = [0, 1, 2, 3, 4, 5, 6, 7];
const TOOL: &str = "--tool sphere:4,4,30,1 --json";

fn written(folder: &Path, name: &str, text: &str) {
    std::fs::write(folder.join(name), text).unwrap();
}

fn stl(positions: &[Vec3], triangles: &[[u32; 3]]) -> String {
    let mut text = String::from("solid s\n");
    for corners in triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for at in corners.map(|corner| positions[corner as usize]) {
            writeln!(text, "vertex {} {} {}", at.x, at.y, at.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid s\n"
}

#[test]
fn a_frame_file_has_the_triangles_of_the_tree() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    written(folder, "rest.obj", &obj([8.0, 8.0, 20.0], IN_ORDER));
    succeeds(folder, "build rest.obj -o rest.dibs --stretch 2");
    // The same frame in other formats and with its polygon cut the other way.
    let frame = obj([9.0, 8.5, 21.0], IN_ORDER);
    written(folder, "frame.obj", &frame);
    let right = json(folder, &format!("query rest.dibs --vertices frame.obj {TOOL}"));
    assert!((right["separation"].as_f64().unwrap() - 8.0).abs() < 1e-3, "{right}");
    let cut = frame.rsplit_once("f ").unwrap().0.to_owned() + "f 2 8 6\nf 2 4 8\n";
    written(folder, "cut.obj", &cut);
    // Cut otherwise, one of the tree's triangles is none of the frame's.
    let mesh = dibs_build::read(folder.join("rest.obj")).unwrap().mesh;
    let own = mesh.triangles.iter().filter(|t| t.iter().all(|c| [1, 3, 5, 7].contains(c)));
    if own.clone().any(|t| !t.contains(&1) || !t.contains(&7)) {
        assert!(
            fails(folder, &format!("query rest.dibs --vertices cut.obj {TOOL}"))
                .contains("no face with the vertices")
        );
    }
    // STL numbers vertices otherwise; so does another order of the same file.
    let moved: Vec<Vec3> = mesh.positions.iter().map(|p| *p * 1.05).collect();
    written(folder, "frame.stl", &stl(&moved, &mesh.triangles));
    let other = obj([9.0, 8.5, 21.0], [3, 1, 2, 0, 7, 5, 6, 4]);
    written(folder, "other.obj", &other);
    let error = fails(folder, &format!("query rest.dibs --vertices other.obj {TOOL}"));
    assert!(
        error.starts_with("other.obj") && error.contains("no face with the vertices"),
        "{error}"
    );
    let error = fails(folder, &format!("query rest.dibs --vertices frame.stl {TOOL}"));
    assert!(error.starts_with("frame.stl") && error.contains("STL"), "{error}");
}

#[test]
fn a_motion_of_another_mesh_or_unit_is_refused_before_anything_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(folder, "generate heart --triangles 500 -o large.ply --motion large.pc2");
    succeeds(folder, "build heart.ply -o heart.dibs");
    succeeds(folder, "build heart.ply -o metres.dibs --unit m");
    written(folder, "path.csv", "sphere:0,0,150,5\nsphere:0,0,151,5\n");
    for line in [
        "query heart.dibs --vertices large.pc2 --frame 3 --tool sphere:0,0,150,5 --json",
        "track heart.dibs --motion large.pc2 --path path.csv",
        "stream heart.dibs --motion large.pc2 --to udp:127.0.0.1:9 --frames 1",
    ] {
        let error = fails(folder, line);
        assert!(
            error.starts_with("large.pc2") && error.contains("vertices and the tree's mesh has"),
            "{line}: {error}"
        );
    }
    for line in [
        "query metres.dibs --vertices heart.pc2 --frame 3 --tool sphere:0,0,150,5 --json",
        "track metres.dibs --motion heart.pc2 --path path.csv",
        "stream metres.dibs --motion heart.pc2 --to udp:127.0.0.1:9 --frames 1",
    ] {
        let error = fails(folder, line);
        assert!(
            error.starts_with("heart.pc2")
                && error
                    .contains("(--unit states its own; the mesh's file is in m, as in --unit m)"),
            "{line}: {error}"
        );
    }
    json(
        folder,
        "query metres.dibs --unit m --vertices heart.pc2 --frame 3 --tool sphere:0,0,150000,5 --json",
    );
    assert!(fails(folder, "stretch heart.ply --motion large.pc2").contains("vertices"));
}

/// Each file of a series has the numbers of another mesh of as many vertices.
#[test]
fn the_files_of_a_series_have_the_triangles_of_the_tree() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    written(folder, "rest.obj", &obj([8.0, 8.0, 20.0], IN_ORDER));
    written(folder, "path.csv", "sphere:4,4,30,1\n");
    succeeds(folder, "build rest.obj -o rest.dibs --stretch 2");
    for number in 1..3 {
        let size = [8.0, 8.0, 20.0 + f64::from(number)];
        written(folder, &format!("own_{number:03}.obj"), &obj(size, IN_ORDER));
        let renumbered = obj(size, [3, 1, 2, 0, 7, 5, 6, 4]);
        written(folder, &format!("other_{number:03}.obj"), &renumbered);
    }
    let right = json(folder, &format!("query rest.dibs --vertices own_%03d.obj --frame 1 {TOOL}"));
    assert!((right["separation"].as_f64().unwrap() - 7.0).abs() < 1e-3, "{right}");
    succeeds(folder, "track rest.dibs --motion own_%03d.obj --motion-rate 9 --path path.csv");
    succeeds(folder, "stretch rest.obj --motion own_%03d.obj");
    succeeds(folder, "build rest.obj -o more.dibs --motion own_%03d.obj");
    for line in [
        &format!("query rest.dibs --vertices other_%03d.obj --frame 1 {TOOL}"),
        "track rest.dibs --motion other_%03d.obj --motion-rate 9 --path path.csv",
        "stream rest.dibs --motion other_%03d.obj --to udp:127.0.0.1:9 --motion-rate 9 --frames 1",
        "stream rest.obj --motion other_%03d.obj --to udp:127.0.0.1:9 --motion-rate 9 --frames 1",
        "stretch rest.obj --motion other_%03d.obj",
        "build rest.obj -o more.dibs --motion other_%03d.obj",
        "build rest.obj -o more.dibs --motion other_%03d.obj --modes 2",
    ] {
        let error = fails(folder, line);
        assert!(error.contains("no face with the vertices"), "{line}: {error}");
    }
}

#[test]
fn arrays_are_checked_as_files_are() {
    let generate::MovingMesh { mesh, motion } = generate::heart(320).unwrap();
    let built = Builder::new().unit(Unit::Metre).build(&mesh).unwrap();
    let tree = built.tree::<u16>().unwrap();
    let (check, order) = (FrameCheck::of(&tree), SurfaceOrder::of(&tree));
    for frame in &motion.frames {
        assert_eq!(check.to_rows(frame).unwrap(), built.to_rows(frame));
        assert_eq!(order.to_rows(frame).unwrap(), built.to_rows(frame));
    }
    let scaled = |by: f32| mesh.positions.iter().map(|p| *p * by).collect::<Vec<_>>();
    for by in [1e-3, 0.1, 25.4, 1e3] {
        let error = check.to_rows(&scaled(by)).unwrap_err();
        assert!(matches!(error, FrameError::Size { unit: Some(Unit::Metre), .. }), "{error}");
        assert!(order.to_rows(&scaled(by)).is_err());
    }
    for by in [0.5, 1.4] {
        assert!(check.to_rows(&scaled(by)).is_ok());
    }
    // A mirrored axis and two exchanged ones; two mirrored axes turn the surface.
    let mirrored = |signs: Vec3| mesh.positions.iter().map(|p| *p * signs).collect::<Vec<_>>();
    let exchanged: Vec<_> = mesh.positions.iter().map(|p| Vec3::new(p.x, p.z, p.y)).collect();
    for wrong in [mirrored(Vec3::new(-1.0, 1.0, 1.0)), mirrored(Vec3::NEG_ONE), exchanged] {
        let error = check.to_rows(&wrong).unwrap_err();
        assert!(matches!(error, FrameError::InsideOut { part } if part < -0.9), "{error}");
        assert!(order.to_rows(&wrong).is_err());
    }
    assert!(check.to_rows(&mirrored(Vec3::new(-1.0, -1.0, 1.0))).is_ok());
    assert!(check.to_rows(&mirrored(Vec3::new(1.0, 1.0, 0.0))).is_ok(), "it is flat");
    let mut longer = mesh.positions.clone();
    longer.push(Vec3::ZERO);
    for wrong in [&longer[..], &mesh.positions[1..], &[]] {
        assert!(matches!(check.to_rows(wrong), Err(FrameError::Vertices { .. })));
        assert!(order.to_rows(wrong).is_err());
    }
    let small = Motion { frames: vec![mesh.positions.clone(), scaled(1e-3)], ..Motion::default() };
    let error = small.check_fits(&mesh).unwrap_err();
    assert!(matches!(error, MotionMismatchError::Frame { frame: 1, .. }), "{error}");
    // Limits are not learned from a motion in another unit, which a tree would then admit.
    for by in [10.0, 25.4, 1e3] {
        let large = Motion { frames: vec![scaled(by)], ..Motion::default() };
        assert!(large.check_fits(&mesh).is_err(), "{by}");
    }
    let inflated = Motion { frames: vec![scaled(5.0)], ..Motion::default() };
    assert_eq!(inflated.check_fits(&mesh), Ok(()));
}

/// An open surface has no inside: mirrored, it is a shape as any other.
#[test]
fn an_open_surface_may_be_mirrored() {
    let mesh = generate::heart(320).unwrap().mesh;
    let open = Mesh { triangles: mesh.triangles[1..].to_vec(), ..mesh.clone() };
    let mirrored: Vec<Vec3> =
        mesh.positions.iter().map(|p| *p * Vec3::new(-1.0, 1.0, 1.0)).collect();
    for (mesh, is_ok) in [(&mesh, false), (&open, true)] {
        let built = Builder::new().build(mesh).unwrap();
        let check = FrameCheck::of(&built.tree::<u16>().unwrap());
        assert_eq!(check.to_rows(&mirrored).is_ok(), is_ok);
    }
}

/// The accuracy covers what was dropped: distances to the file's own triangles are within it.
#[test]
fn dropped_slivers_and_welds_are_in_the_position_error() {
    let at = DVec3::new(-1.9e6, 2.9e6, -2.1e6);
    for high in [0.125, 0.25, 0.5] {
        // A wall lower than a step of f32 between two squares, whose triangles share edges with each other, too.
        let corner = |x: f64, y: f64, z: f64| at + DVec3::new(x, y, z);
        let mut corners =
            vec![corner(0.0, 0.0, 0.0), corner(0.0, 4e3, 0.0), corner(-4e3, 0.0, 0.0)];
        corners.extend([corner(0.0, 0.0, high), corner(0.0, 4e3, high), corner(4e3, 0.0, high)]);
        let triangles = [[0, 1, 2], [0, 1, 4], [0, 4, 3], [3, 5, 4]];
        let options = ReadOptions { origin: Some(DVec3::ZERO), ..Import::options() };
        let import = options.check(&corners, &triangles).unwrap();
        let report = &import.report;
        if report.dropped_degenerate > 0 {
            assert!(report.position_error >= high / 2.0, "{report:?}");
            assert!(report.position_error < 10.0, "{report:?}");
        }
    }
    let corners =
        [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 0.0, 0.04), DVec3::new(1.0, 1.0, 0.0)];
    let weld = ReadOptions { weld_tolerance: Some(0.05), ..Import::options() };
    let import = weld.check(&corners, &[[0, 1, 2], [3, 4, 2]]).unwrap();
    assert_eq!(import.report.welded, 1);
    assert!((0.04..0.0401).contains(&import.report.position_error), "{:?}", import.report);
    // A repeated vertex is no surface.
    let plain = Import::options().check(&corners, &[[0, 1, 1], [0, 1, 2]]).unwrap();
    assert_eq!(plain.report.position_error, 0.0);
}

/// `stretch` is that of the surface, whatever the triangles' limits.
#[test]
fn the_rest_shape_is_not_stretched() {
    let Mesh { triangles, .. } = generate::heart(320).unwrap().mesh;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 320 -o heart.ply --motion heart.pc2");
    succeeds(folder, "stretch heart.ply --motion heart.pc2 --limits heart.limits --margin 0.1");
    succeeds(folder, "build heart.ply -o heart.dibs --limits heart.limits");
    let answer = json(folder, "query heart.dibs --tool sphere:0,0,150,5 --json");
    assert!((answer["stretch"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{answer}");
    let import = dibs_build::read(folder.join("heart.ply")).unwrap();
    assert_eq!(import.mesh.triangles.len(), triangles.len());
}
