//! Readers and checks on mesh files written here: every format gives the same surface, and indexed files keep the
//! numbers of their vertices.

// Requirement: M-03

use std::path::Path;

use dibs_build::{Format, Import, Motion, MotionMismatchError, ReadErrorKind, ReadOptions};
use glam::Vec3;

use crate::mesh_files::{Folder, corners, obj, octahedron, samples, stl_ascii, stl_binary};

impl Folder {
    fn read(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<Import, ReadErrorKind> {
        dibs_build::read(self.put(name, bytes)).map_err(|error| error.kind)
    }
}

#[test]
fn every_format_gives_the_same_surface() {
    let folder = Folder::new();
    let mesh = octahedron();
    let surface: Vec<[Vec3; 3]> = corners(&mesh).collect();
    for (name, format, bytes) in samples() {
        let import = folder.read(name, bytes).unwrap();
        assert_eq!(import.report.format, format, "{name}");
        assert_eq!(corners(&import.mesh).collect::<Vec<_>>(), surface, "{name}");
        assert_eq!(import.report.border_edges, 0, "{name}");
        if matches!(format, Format::StlAscii | Format::StlBinary) {
            assert_eq!(import.mesh.positions.len(), 6, "{name}");
            assert_eq!(import.report.welded, 18, "{name}");
            // Vertices are numbered in the order of their first use.
            assert_eq!(import.mesh.triangles[..2], [[0, 1, 2], [1, 3, 2]], "{name}");
        } else {
            assert_eq!(import.mesh, mesh, "{name}");
            assert_eq!(import.report.unreferenced_vertices, 1, "{name}");
            assert_eq!(import.report.welded, 0, "{name}");
        }
    }
}

#[test]
fn what_we_write_we_read_back() {
    let folder = Folder::new();
    let path = folder.0.path().join("out.ply");
    octahedron().write_ply(&path).unwrap();
    assert_eq!(dibs_build::read(&path).unwrap().mesh, octahedron());
}

#[test]
fn content_decides_over_the_extension() {
    let folder = Folder::new();
    for (_, format, bytes) in samples() {
        for name in ["wrong.obj", "wrong.stl", "wrong.ply", "wrong.off", "wrong.txt", "none"] {
            let report = folder.read(name, &bytes).unwrap().report;
            assert_eq!(report.format, format, "{name}");
            let says_so = name == format!("wrong.{}", format.extension()) || name == "none";
            assert_eq!(report.extension_disagrees, !says_so, "{format} as {name}");
        }
    }
}

#[test]
fn obj_agrees_with_tobj() {
    let bytes = obj(&octahedron());
    let options =
        tobj::LoadOptions { single_index: false, triangulate: true, ..Default::default() };
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut bytes.as_slice(), &options, no_materials).unwrap();
    let theirs: Vec<[f32; 3]> = models
        .iter()
        .flat_map(|model| {
            let mesh = &model.mesh;
            mesh.indices.iter().map(|&i| {
                let i = 3 * i as usize;
                [mesh.positions[i], mesh.positions[i + 1], mesh.positions[i + 2]]
            })
        })
        .collect();
    let mesh = Folder::new().read("a.obj", bytes).unwrap().mesh;
    let ours: Vec<[f32; 3]> = corners(&mesh).flatten().map(|p| p.to_array()).collect();
    assert_eq!(ours, theirs);
}

#[test]
fn stl_agrees_with_stl_io() {
    let mesh = octahedron();
    let ascii = String::from_utf8(stl_ascii(&mesh)).unwrap().replace("nan nan nan", "0 0 1");
    let mut binary = stl_binary(&mesh);
    binary[..6].fill(0);
    for bytes in [ascii.into_bytes(), binary] {
        let theirs = stl_io::read_stl(&mut std::io::Cursor::new(&bytes)).unwrap();
        let theirs: Vec<[[f32; 3]; 3]> =
            theirs.faces.iter().map(|face| face.vertices.map(|v| theirs.vertices[v].0)).collect();
        let mesh = Folder::new().read("a.stl", bytes).unwrap().mesh;
        let ours: Vec<[[f32; 3]; 3]> = corners(&mesh).map(|t| t.map(|p| p.to_array())).collect();
        assert_eq!(ours, theirs);
    }
}

#[test]
fn text_is_rounded_to_f32_once() {
    // A number above the midpoint between 1 and its successor, by less than f64 can resolve.
    let above = "1.000000059604644775390625000000000001";
    let text = format!("v {above} 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
    let mesh = Folder::new().read("a.obj", text).unwrap().mesh;
    assert_eq!(mesh.positions[0].x, 1.0 + f32::EPSILON);
}

#[test]
fn lying_counts_are_errors() {
    let folder = Folder::new();
    let huge = u32::MAX;
    let header =
        |element: &str| format!("ply\nformat binary_little_endian 1.0\n{element}end_header\n");
    let vertices = header(&format!(
        "element vertex {huge}\nproperty float x\nproperty float y\nproperty float z\n"
    ));
    let ascii = vertices.replace("binary_little_endian", "ascii");
    let no_properties = header(&format!("element nothing {huge}\n"));
    for text in [&vertices, &ascii, &no_properties] {
        let bytes = [text.as_bytes(), &[0; 100]].concat();
        let kind = folder.read("lie.ply", bytes).unwrap_err();
        assert!(
            matches!(kind, ReadErrorKind::Count { claimed, found, .. }
                if claimed == u64::from(huge) && found < 200),
            "{kind}"
        );
    }
    let long_list = header("element face 1\nproperty list uint int vertex_indices\n");
    let kind = folder.read("lie.ply", [long_list.as_bytes(), &[0xff; 100]].concat()).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Truncated { .. }), "{kind}");

    for counts in ["3 99999999999 0", "18446744073709551615 1 0"] {
        let text = format!("OFF\n{counts}\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
        let kind = folder.read("lie.off", text).unwrap_err();
        assert!(matches!(kind, ReadErrorKind::Count { .. }), "{kind}");
    }
    let kind = folder.read("lie.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n99999999999999 0 1 2\n");
    assert!(matches!(kind, Err(ReadErrorKind::Malformed { line: Some(5), .. })), "{kind:?}");

    for count in [0, 7, 9, huge] {
        let mut bytes = stl_binary(&octahedron());
        bytes[80..84].copy_from_slice(&count.to_le_bytes());
        let kind = folder.read("lie.stl", bytes).unwrap_err();
        assert!(
            matches!(kind, ReadErrorKind::Count { claimed, found: 8, .. } if claimed == u64::from(count)),
            "{kind}"
        );
    }
}

/// Two triangles that share an edge, with the shared vertices written twice, and a third that shares two vertex numbers
/// with the second.
const SEAM: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0.00001 0\nv 0 1 -0.0\nv 1 1 0\nv 2 2 0\n\
                    f 1 2 3\nf 4 6 5\nf 6 4 7\n";

#[test]
fn indexed_files_are_welded_on_request_only_and_keep_their_numbers() {
    let folder = Folder::new();
    let with = |weld_tolerance| {
        folder.read_with(ReadOptions { weld_tolerance, ..Import::options() }, SEAM)
    };
    let apart = with(None).unwrap().report;
    assert_eq!((&apart.components[..], apart.coincident), (&[2, 1][..], 1));
    let warnings: Vec<String> = apart.warnings().collect();
    assert!(warnings[0].contains("--weld 0 joins it"), "{warnings:?}");
    assert!(warnings[1].contains("1 smaller surface kept"), "{warnings:?}");

    let exact = with(Some(0.0)).unwrap();
    assert_eq!(exact.mesh.triangles, [[0, 1, 2], [3, 5, 2], [5, 3, 6]]);
    assert_eq!((exact.report.welded, exact.report.unreferenced_vertices), (1, 1));

    let near = with(Some(1e-4)).unwrap();
    assert_eq!(near.mesh.triangles, [[0, 1, 2], [1, 5, 2], [5, 1, 6]]);
    assert_eq!(near.mesh.positions.len(), 7);
    assert_eq!((near.report.welded, near.report.border_edges), (2, 5));

    for tolerance in [-1.0, f32::NAN, f32::INFINITY] {
        let kind = with(Some(tolerance)).unwrap_err();
        assert!(matches!(kind, ReadErrorKind::Tolerance { .. }), "{kind}");
    }
}

#[test]
fn dropping_joins_and_parts_nothing_unnoticed() {
    let folder = Folder::new();
    // The degenerate second face must not connect the others.
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\nf 3 4 4\nf 4 5 6\n";
    assert_eq!(folder.read("a.obj", text).unwrap().report.components, [1, 1]);

    let strict = ReadOptions { strict: true, ..Import::options() };
    let kind = folder.read_with(strict, text).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Degenerate { count: 1, face: 2 }), "{kind}");

    let twice = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 2 1 3\n";
    let kind = folder.read_with(strict, twice).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Duplicate { count: 1, face: 2 }), "{kind}");
    assert_eq!(folder.read("a.obj", twice).unwrap().report.dropped_duplicates, 1);
}

#[test]
fn faces_of_fewer_than_three_corners_are_degenerate() {
    let folder = Folder::new();
    let kind = folder.read("a.off", "OFF 0 2 0\n0\n0\n").unwrap_err();
    assert!(matches!(kind, ReadErrorKind::NoTriangles { degenerate: 2, .. }), "{kind}");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1\nf 1 2\n";
    assert_eq!(folder.read("a.obj", text).unwrap().report.dropped_degenerate, 2);
    let strict = ReadOptions { strict: true, ..Import::options() };
    let kind = folder.read_with(strict, text).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Degenerate { count: 2, face: 2 }), "{kind}");
}

#[test]
fn triangles_that_rounding_made_from_a_line_are_degenerate() {
    let folder = Folder::new();
    // Three points of one line in space that f32 cannot represent exactly.
    let line =
        "v 0.1 0.2 0.3\nv 10.1 20.2 30.3\nv 4.1 8.2 12.3\nv 9 9 0\nf 1 2 3\nf 1 3 4\nf 3 2 4\n";
    let import = folder.read("a.obj", line).unwrap();
    assert_eq!((import.report.dropped_degenerate, import.report.triangles), (1, 2));
    // A sliver that is not caused by rounding is kept.
    let sliver = "v 0 0 0\nv 30 0 0\nv 15 0.004 0\nf 1 2 3\n";
    assert_eq!(folder.read("a.obj", sliver).unwrap().report.dropped_degenerate, 0);
}

#[test]
fn extreme_scales_are_errors_and_ordinary_ones_are_not() {
    let folder = Folder::new();
    let at = |scale: f64| {
        let text = format!("v 0 0 0\nv {scale:e} 0 0\nv 0 {scale:e} 0\nf 1 2 3\n");
        folder.read("a.obj", text).map(|import| import.mesh.triangles.len())
    };
    for scale in [1e-5, 1e-3, 1.0, 1e4, 5e8] {
        assert_eq!(at(scale).unwrap(), 1, "{scale}");
    }
    assert!(matches!(at(1e-7), Err(ReadErrorKind::TooSmall { .. })));
    assert!(matches!(at(1e-44), Err(ReadErrorKind::TooSmall { .. })));
    assert!(matches!(at(2e9), Err(ReadErrorKind::TooLarge { .. })));
    assert!(matches!(at(1e39), Err(ReadErrorKind::Overflow { .. })));
    let text = "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n";
    assert!(matches!(folder.read("a.obj", text), Err(ReadErrorKind::Overflow { .. })));
    let text = "v 0 0 0\nv -inf 0 0\nv 0 1 0\nf 1 2 3\n";
    assert!(matches!(folder.read("a.obj", text), Err(ReadErrorKind::NonFinite { .. })));
}

#[test]
fn bad_vertex_numbers_are_named_as_written() {
    let folder = Folder::new();
    let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for bad in [0_i64, 4, -4, 4_294_967_297, i64::MAX, i64::MIN] {
        let kind = folder.read("a.obj", format!("{vertices}f 1 2 3\nf 1 2 {bad}\n")).unwrap_err();
        assert!(
            matches!(kind, ReadErrorKind::IndexOutOfRange { face: 2, index, vertices: 3, first: 1 }
                if index == bad),
            "{kind}"
        );
    }
    for bad in [3_i64, -1, i64::MAX] {
        let text = format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 {bad}\n");
        let kind = folder.read("a.off", text).unwrap_err();
        assert!(
            matches!(kind, ReadErrorKind::IndexOutOfRange { face: 1, index, first: 0, .. }
                if index == bad),
            "{kind}"
        );
    }
    let many = " 1 2 3".repeat(5000);
    let kind = folder.read("a.obj", format!("{vertices}f{many}\n")).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::LargePolygon { corners: 15_000, .. }), "{kind}");
    // A face may refer to a vertex that comes later.
    assert!(folder.read("a.obj", format!("f 1 2 3\n{vertices}")).is_ok());
}

#[test]
fn off_spellings_are_read() {
    let folder = Folder::new();
    let body = "0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n4 0 1 2 3\n";
    for header in ["OFF\n4 1 0\n", "OFF 4 1 0\n", "COFF\n\n# x\n4 1\n", "off\r\n4 1 4\r\n"] {
        let report = folder.read("a.off", format!("{header}{body}")).unwrap().report;
        assert_eq!((report.format, report.triangles), (Format::Off, 2), "{header}");
    }
    let kind = folder.read("a.off", "OFF BINARY\n\0\0\0\u{4}").unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Foreign { .. }), "{kind}");
}

#[test]
fn motions_round_trip_and_bad_ones_are_errors() {
    let folder = Folder::new();
    let path = folder.0.path().join("a.pc2");
    let mesh = octahedron();
    let moved = mesh.positions.iter().map(|p| *p * 1.5 + Vec3::X).collect();
    let motion =
        Motion { frames: vec![mesh.positions.clone(), moved], rate: 25.0, ..Motion::default() };
    motion.write_pc2(&path).unwrap();
    let read = Motion::read_pc2(&path).unwrap();
    assert_eq!(read, motion);
    assert_eq!(read.check_fits(&mesh), Ok(()));

    let mut other = mesh.clone();
    other.positions.pop();
    let mismatch = read.check_fits(&other).unwrap_err();
    let wrong = MotionMismatchError::Vertices { frame: 0, expected: 6, found: 7 };
    assert_eq!(mismatch, wrong);

    let bytes = std::fs::read(&path).unwrap();
    let read = |bytes: &[u8]| Motion::read_pc2(folder.put("b.pc2", bytes)).map_err(|e| e.kind);
    assert!(matches!(read(&[]), Err(ReadErrorKind::Empty)));
    assert!(matches!(read(&bytes[..20]), Err(ReadErrorKind::NotPc2)));
    // The rate follows the last frame: a file that is cut off within it has all frames, like a file without a rate.
    let frames = bytes.len() - 12;
    for end in frames..bytes.len() {
        let unrated = read(&bytes[..end]).unwrap();
        assert_eq!((&unrated.frames, unrated.rate), (&motion.frames, 0.0), "{end} bytes");
    }
    for end in [32, frames / 2, frames - 1] {
        assert!(matches!(read(&bytes[..end]), Err(ReadErrorKind::Count { .. })), "{end} bytes");
    }
    let changed = |at: usize, value: [u8; 4]| {
        let mut bytes = bytes.clone();
        bytes[at..at + 4].copy_from_slice(&value);
        read(&bytes)
    };
    assert!(changed(0, *b"POIN").is_ok());
    assert!(matches!(changed(0, *b"poin"), Err(ReadErrorKind::NotPc2)));
    assert!(matches!(changed(12, [2, 0, 0, 0]), Err(ReadErrorKind::NotPc2)));
    assert!(matches!(changed(16, [0xff; 4]), Err(ReadErrorKind::Count { .. })));
    assert!(matches!(changed(28, [0xff; 4]), Err(ReadErrorKind::Count { .. })));
    assert!(matches!(changed(32, f32::NAN.to_le_bytes()), Err(ReadErrorKind::NonFinite { .. })));

    let uneven = Motion { frames: vec![mesh.positions.clone(), Vec::new()], ..Motion::default() };
    let untouched = std::fs::read(&path).unwrap();
    assert!(uneven.write_pc2(&path).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), untouched);
}
