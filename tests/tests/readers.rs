//! Readers and checks on meshes written here: every format gives the same surface, numbers stay
//! the file's own, and no bytes make a reader panic, hang or allocate beyond the file's size.

use dibs_build::{Format, Import, Mesh, Motion, ReadErrorKind, ReadOptions};
use glam::Vec3;
use proptest::prelude::*;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// An octahedron with a seventh vertex (number 2) that no triangle uses.
fn octahedron() -> Mesh {
    let p = [
        [10.5, 0.0, 0.25],
        [-10.0, 0.0, 0.0],
        [1e-3, 77.0, 3.0],
        [0.0, 10.0, -0.125],
        [0.0, -10.1, 0.0],
        [0.0, 0.0, 10.0],
        [0.3, 0.0, -10.0],
    ];
    Mesh {
        positions: p.map(Vec3::from_array).to_vec(),
        triangles: vec![
            [0, 3, 5],
            [3, 1, 5],
            [1, 4, 5],
            [4, 0, 5],
            [3, 0, 6],
            [1, 3, 6],
            [4, 1, 6],
            [0, 4, 6],
        ],
    }
}

fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("# comment \\\no thing\n");
    for p in &mesh.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "f {}/1/1 {}//2 {}", a + 1, b + 1, c + 1).unwrap();
    }
    text.into_bytes()
}

fn off(mesh: &Mesh) -> Vec<u8> {
    let mut text =
        format!("OFF\n# a comment\n{} {} 0\n", mesh.positions.len(), mesh.triangles.len());
    for p in &mesh.positions {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "3 {a} {b} {c} 255 0 0 # red").unwrap();
    }
    text.into_bytes()
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]))
}

fn stl_ascii(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("solid facet\n");
    for triangle in corners(mesh) {
        text += "facet normal nan nan nan\nouter loop\n";
        for p in triangle {
            writeln!(text, "vertex {:e} {:e} {:e}", p.x, p.y, p.z).unwrap();
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

/// Written by another crate.
fn stl_binary(mesh: &Mesh) -> Vec<u8> {
    let triangles: Vec<stl_io::Triangle> = corners(mesh)
        .map(|t| stl_io::Triangle {
            normal: stl_io::Normal::new([0.0; 3]),
            vertices: t.map(|p| stl_io::Vertex::new(p.to_array())),
        })
        .collect();
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, triangles.iter()).unwrap();
    // Many exporters do this to binary files.
    bytes[..6].copy_from_slice(b"solid ");
    bytes
}

/// PLY with properties that nobody asked for, doubles, and an extra element.
fn ply(mesh: &Mesh, encoding: &str) -> Vec<u8> {
    let big = encoding == "binary_big_endian";
    let ascii = encoding == "ascii";
    let mut out = format!(
        "ply\nformat {encoding} 1.0\ncomment caf\u{e9}\nelement vertex {}\nproperty uchar red\n\
         property double x\nproperty float y\nproperty float z\nelement face {}\n\
         property list uchar ushort vertex_index\nproperty float quality\nend_header\n",
        mesh.positions.len(),
        mesh.triangles.len()
    )
    .into_bytes();
    for p in &mesh.positions {
        let x = f64::from(p.x);
        if ascii {
            out.extend(format!("7 {} {} {}\n", p.x, p.y, p.z).bytes());
        } else {
            out.push(7);
            out.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() });
            for c in [p.y, p.z] {
                out.extend(if big { c.to_be_bytes() } else { c.to_le_bytes() });
            }
        }
    }
    for t in &mesh.triangles {
        let t = t.map(|v| v as u16);
        if ascii {
            out.extend(format!("3 {} {} {} 0.5\n", t[0], t[1], t[2]).bytes());
        } else {
            out.push(3);
            for v in t {
                out.extend(if big { v.to_be_bytes() } else { v.to_le_bytes() });
            }
            out.extend(if big { 0.5_f32.to_be_bytes() } else { 0.5_f32.to_le_bytes() });
        }
    }
    out
}

/// One small valid file of each kind.
fn samples() -> Vec<(&'static str, Format, Vec<u8>)> {
    let mesh = octahedron();
    vec![
        ("a.obj", Format::Obj, obj(&mesh)),
        ("a.off", Format::Off, off(&mesh)),
        ("ascii.stl", Format::StlAscii, stl_ascii(&mesh)),
        ("binary.stl", Format::StlBinary, stl_binary(&mesh)),
        ("ascii.ply", Format::Ply, ply(&mesh, "ascii")),
        ("little.ply", Format::Ply, ply(&mesh, "binary_little_endian")),
        ("big.ply", Format::Ply, ply(&mesh, "binary_big_endian")),
    ]
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    fn read(&self, name: &str, bytes: impl AsRef<[u8]>) -> Result<Import, ReadErrorKind> {
        dibs_build::read(self.put(name, bytes)).map_err(|error| error.kind)
    }

    fn read_with(&self, options: ReadOptions, text: &str) -> Result<Import, ReadErrorKind> {
        options.read(self.put("with.obj", text)).map_err(|error| error.kind)
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
            // Numbered in the order in which they appear.
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
    // Just above the middle between 1 and its successor, by less than f64 can tell.
    let above = "1.000000059604644775390625000000000001";
    let text = format!("v {above} 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
    let mesh = Folder::new().read("a.obj", text).unwrap().mesh;
    assert_eq!(mesh.positions[0].x, 1.0 + f32::EPSILON);
}

#[test]
fn lying_counts_are_errors_and_cost_nothing() {
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

/// Two triangles that share an edge, with the shared vertices written twice, and a third that
/// shares a vertex number with the second.
const SEAM: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0.00001 0\nv 0 1 -0.0\nv 1 1 0\nv 2 2 0\n\
                    f 1 2 3\nf 4 6 5\nf 6 4 7\n";

#[test]
fn indexed_files_are_welded_on_request_only_and_keep_their_numbers() {
    let folder = Folder::new();
    let with = |weld_tolerance| {
        folder.read_with(ReadOptions { weld_tolerance, ..Import::options() }, SEAM)
    };
    let kind = with(None).unwrap_err();
    assert!(
        matches!(&kind, ReadErrorKind::Components { sizes, coincident: 1 } if sizes == &[2, 1]),
        "{kind}"
    );
    assert!(kind.to_string().contains("--weld 0"), "{kind}");

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
    let kind = folder.read("a.obj", text).unwrap_err();
    assert!(matches!(&kind, ReadErrorKind::Components { sizes, .. } if sizes == &[1, 1]), "{kind}");

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
    assert!(matches!(kind, ReadErrorKind::NoTriangles { degenerate: 2 }), "{kind}");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1\nf 1 2\n";
    assert_eq!(folder.read("a.obj", text).unwrap().report.dropped_degenerate, 2);
    let strict = ReadOptions { strict: true, ..Import::options() };
    let kind = folder.read_with(strict, text).unwrap_err();
    assert!(matches!(kind, ReadErrorKind::Degenerate { count: 2, face: 2 }), "{kind}");
}

#[test]
fn triangles_that_rounding_made_from_a_line_are_degenerate() {
    let folder = Folder::new();
    // Three points of one line in space that f32 cannot hold exactly.
    let line =
        "v 0.1 0.2 0.3\nv 10.1 20.2 30.3\nv 4.1 8.2 12.3\nv 9 9 0\nf 1 2 3\nf 1 3 4\nf 3 2 4\n";
    let import = folder.read("a.obj", line).unwrap();
    assert_eq!((import.report.dropped_degenerate, import.report.triangles), (1, 2));
    // A real sliver, a thousand times thicker than that, stays.
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
    assert!(matches!(kind, ReadErrorKind::Malformed { line: Some(1), .. }), "{kind}");
}

#[test]
fn motions_round_trip_and_bad_ones_are_errors() {
    let folder = Folder::new();
    let path = folder.0.path().join("a.pc2");
    let mesh = octahedron();
    let moved = mesh.positions.iter().map(|p| *p * 1.5 + Vec3::X).collect();
    let motion = Motion { frames: vec![mesh.positions.clone(), moved], rate: 25.0 };
    motion.write_pc2(&path).unwrap();
    let read = Motion::read_pc2(&path).unwrap();
    assert_eq!(read, motion);
    assert_eq!(read.check_fits(&mesh), Ok(()));

    let mut other = mesh.clone();
    other.positions.pop();
    let mismatch = read.check_fits(&other).unwrap_err();
    assert_eq!((mismatch.frame, mismatch.expected, mismatch.found), (0, 6, 7));

    let bytes = std::fs::read(&path).unwrap();
    let read = |bytes: &[u8]| Motion::read_pc2(folder.put("b.pc2", bytes)).map_err(|e| e.kind);
    assert!(matches!(read(&[]), Err(ReadErrorKind::Empty)));
    assert!(matches!(read(&bytes[..20]), Err(ReadErrorKind::NotPc2)));
    assert!(matches!(read(&bytes[..bytes.len() - 1]), Err(ReadErrorKind::Count { .. })));
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

    let uneven = Motion { frames: vec![mesh.positions.clone(), Vec::new()], rate: 0.0 };
    let untouched = std::fs::read(&path).unwrap();
    assert!(uneven.write_pc2(&path).is_err());
    assert_eq!(std::fs::read(&path).unwrap(), untouched);
}

/// What every accepted mesh promises.
fn check_promises(import: &Import) {
    let mesh = &import.mesh;
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    for t in &mesh.triangles {
        assert!(t.iter().all(|&v| (v as usize) < mesh.positions.len()));
        assert!(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
    }
}

/// Bytes that mean something in one format or another.
const TELLING: &[u8] = b"0123456789-+.eE/\\# \n\rvfnaif\0\xff";

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes flipped, overwritten with bytes that occur in such files, cut out, doubled, cut off.
    #[test]
    fn damaged_files_never_panic(
        which in 0_usize..7,
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0_u8..5, any::<u8>(), 1_usize..9), 1..6),
        largest_component: bool,
        weld in prop::option::of(0.0_f32..20.0),
    ) {
        let (name, _, mut bytes) = samples().swap_remove(which);
        for (at, kind, value, length) in changes {
            if bytes.is_empty() { break; }
            let at = at.index(bytes.len());
            let end = (at + length).min(bytes.len());
            match kind {
                0 => bytes[at] ^= 1 << (value % 8),
                1 => bytes[at] = TELLING[usize::from(value) % TELLING.len()],
                2 => drop(bytes.drain(at..end)),
                3 => { let copy = bytes[at..end].to_vec(); bytes.splice(at..at, copy); }
                _ => bytes.truncate(at),
            }
        }
        let folder = Folder::new();
        let path = folder.put(name, bytes);
        let options = ReadOptions { largest_component, weld_tolerance: weld, ..Import::options() };
        match options.read(path) {
            Ok(import) => check_promises(&import),
            Err(error) => prop_assert!(!error.to_string().contains('\n'), "{}", error),
        }
    }

    /// Polygons of any shape, flat or not, simple or not, are cut without a panic, and n corners
    /// give at most n - 2 triangles.
    #[test]
    fn polygons_of_any_shape_are_cut(
        points in prop::collection::vec((-5_i8..5, -5_i8..5, -1_i8..2), 3..40)
    ) {
        let mut text = String::new();
        for (x, y, z) in &points {
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
        text += "f";
        for i in 1..=points.len() {
            write!(text, " {i}").unwrap();
        }
        let options = ReadOptions { largest_component: true, ..Import::options() };
        match Folder::new().read_with(options, &text) {
            Ok(import) => {
                check_promises(&import);
                let report = &import.report;
                let triangles: usize = report.components.iter().sum();
                let cut = triangles + report.dropped_degenerate + report.dropped_duplicates;
                prop_assert!(cut <= points.len() - 2, "{} triangles", cut);
            }
            Err(kind) => prop_assert!(matches!(kind, ReadErrorKind::NoTriangles { .. }), "{}", kind),
        }
    }
}
