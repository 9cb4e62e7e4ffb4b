//! Text in every encoding, and the formats that are text.

use super::{Folder, is_tetrahedron, warnings};
use crate::program::fails;
use dibs_build::{LabelsErrorKind, read_labels};

const OBJ: &str = "v 0 0 0\nv 4 0 0\nv 0 5 0\nv 0 0 6\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
const OFF: &str = "OFF\n4 4 0\n0 0 0\n4 0 0\n0 5 0\n0 0 6\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 4\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0\n4 0 0\n0 5 0\n0 0 6\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
const VTK: &str = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n\
    0 0 0 4 0 0 0 5 0 0 0 6\nPOLYGONS 4 16\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
const MSH: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 4 0 0\n3 0 5 0\n4 0 0 6\n$EndNodes\n\
    $Elements\n4\n1 2 2 0 1 1 3 2\n2 2 2 0 1 1 2 4\n3 2 2 0 1 2 3 4\n4 2 2 0 1 3 1 4\n$EndElements\n";
const VTU: &str = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\">\
    <UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"4\">\
    <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 4 0 0 0 5 0 0 0 6</DataArray></Points>\
    <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 3 1 2 3 2 0 3</DataArray>\
    <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3 6 9 12</DataArray>\
    <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">5 5 5 5</DataArray></Cells>\
    </Piece></UnstructuredGrid></VTKFile>\n";

fn utf16(text: &str, unit: fn(u16) -> [u8; 2]) -> Vec<u8> {
    text.encode_utf16().flat_map(unit).collect()
}

#[test]
fn text_may_have_any_encoding_line_and_end() {
    let folder = Folder::new();
    for (name, text) in [
        ("a.obj", OBJ),
        ("a.off", OFF),
        ("a.ply", PLY),
        ("a.vtk", VTK),
        ("a.msh", MSH),
        ("a.vtu", VTU),
    ] {
        for (how, bytes) in [
            ("plain", text.as_bytes().to_vec()),
            ("CRLF", text.replace('\n', "\r\n").into_bytes()),
            ("UTF-8 with a mark", format!("\u{feff}{text}").into_bytes()),
            ("UTF-16", utf16(&format!("\u{feff}{text}"), u16::to_le_bytes)),
            ("UTF-16, big-endian", utf16(&format!("\u{feff}{text}"), u16::to_be_bytes)),
            ("UTF-16 without a mark", utf16(text, u16::to_le_bytes)),
            ("a final zero", format!("{text}\0").into_bytes()),
            ("final zeros", format!("{text}\0\0\0\n").into_bytes()),
        ] {
            let import = folder.read(name, bytes);
            is_tetrahedron(&import, 1.0, &format!("{name}, {how}"));
            assert_eq!(warnings(&import), [""; 0], "{name}, {how}");
        }
    }
    for (name, text) in [("a.obj", OBJ), ("a.ply", PLY)] {
        is_tetrahedron(&folder.read(name, text.replace('\n', "\r")), 1.0, name);
    }
}

/// A count below what the file has drops no face without a word.
#[test]
fn more_than_a_file_counts_is_named() {
    let folder = Folder::new();
    let binary = |more: &[u8]| {
        let mut bytes = PLY
            .split("0 0 0\n")
            .next()
            .unwrap()
            .replace("ascii", "binary_little_endian")
            .into_bytes();
        bytes.extend(super::POINTS.iter().flatten().flat_map(|x| x.to_le_bytes()));
        for face in super::FACES {
            bytes.push(3);
            bytes.extend(face.iter().flat_map(|corner| corner.to_le_bytes()));
        }
        [&bytes, more].concat()
    };
    is_tetrahedron(&folder.read("a.ply", binary(&[])), 1.0, "binary");
    for (name, bytes, says) in [
        ("a.off", format!("{OFF}# more\n3 0 1 2\n\n").into_bytes(), "1 line was left out"),
        ("a.ply", format!("{PLY}\n3 0 1 2\n3 0 1 3\n").into_bytes(), "2 lines were left out"),
        ("a.ply", binary(&[3, 0, 0, 0, 0]), "5 bytes were left out"),
    ] {
        let import = folder.read(name, bytes);
        is_tetrahedron(&import, 1.0, says);
        let found = warnings(&import);
        assert!(found.len() == 1 && found[0].contains(says), "{name}: {found:?}");
    }
    for (from, to) in [("$Elements\n4", "$Elements\n3"), ("$Nodes\n4", "$Nodes\n3")] {
        let message = folder.says("a.msh", MSH.replace(from, to));
        assert!(message.contains("than it counts"), "{message}");
    }
    let message = folder.says("a.off", b"OFF BINARY\n\0\0\0\x04\0\0\0\x04\0\0\0\0");
    assert!(message.contains("this is a binary OFF"), "{message}");
}

#[test]
fn the_error_is_that_of_the_reader_whose_extension_a_file_has() {
    let folder = Folder::new();
    for (extension, format) in [
        ("obj", "no triangles"),
        ("stl", "ASCII STL"),
        ("ply", "not valid PLY"),
        ("off", "not valid OFF"),
        ("vtk", "not valid legacy VTK"),
        ("vtp", "not valid VTK XML"),
        ("VTU", "not valid VTK XML"),
        ("gltf", "not valid glTF"),
        ("glb", "not valid glTF"),
        ("msh", "not valid Gmsh"),
        ("3mf", "not valid 3MF"),
    ] {
        for content in [&b"nonsense\n"[..], b"7\n8 9\n", b"{}\n", b"<a/>\n"] {
            let message = folder.says(&format!("a.{extension}"), content);
            let is_empty = message.starts_with("no triangles");
            assert!(message.contains(format) || is_empty, "{extension}: {message}");
            assert!(!message.contains("neither content"), "{extension}: {message}");
        }
    }
    assert!(folder.says("a.stl", b"\0\x01\x02").contains("binary STL"));
    assert!(folder.says("a.xyz", "nonsense").contains("neither content nor extension"));
    for (content, what) in [
        ("version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "a pointer of Git LFS"),
        ("<!DOCTYPE html>\n<html></html>\n", "a web page"),
    ] {
        assert!(folder.says("a.ply", content).contains(what));
    }
}

#[test]
fn ply_strips_and_lists_of_other_names_are_read() {
    let folder = Folder::new();
    let head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n";
    let points = "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n";
    let strips = "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    let import = folder.read("a.ply", format!("{head}{strips}{points}9 0 1 2 3 -1 4 3 2 -1\n"));
    assert_eq!(import.mesh.triangles, [[0, 1, 2], [2, 1, 3], [4, 3, 2]]);
    let faces = |properties: &str, line: &str| {
        format!("{head}element face 1\n{properties}end_header\n{points}{line}\n")
    };
    for (properties, line) in [
        ("property list uchar int vertex_indexes\n", "3 0 1 2"),
        ("property list uchar float texcoord\nproperty list uchar uint corners\n", "1 7.5 3 0 1 2"),
    ] {
        let import = folder.read("a.ply", faces(properties, line));
        assert_eq!(import.mesh.triangles, [[0, 1, 2]]);
        assert!(warnings(&import)[0].contains("taken from the list"), "{:?}", warnings(&import));
    }
    let two = "property list uchar int a\nproperty list uchar int b\n";
    let message = folder.says("a.ply", faces(two, "3 0 1 2 3 0 1 2"));
    assert!(message.contains("but 'a', 'b'"), "{message}");
    let message = folder.says("a.ply", faces("property int flags\n", "3"));
    assert!(message.contains("vertex_index', but none"), "{message}");
    // Other elements are named.
    let edges = "element edge 2\nproperty int vertex1\nproperty int vertex2\nend_header\n";
    let message = folder.says("a.ply", format!("{head}{edges}{points}0 1\n1 2\n"));
    assert!(message.starts_with("no triangles (2 elements 'edge' were left out)"), "{message}");
}

#[test]
fn obj_names_what_is_no_polygon() {
    let folder = Folder::new();
    let more = "l 1 2\np 1\ncurv2 1 2\nsurf 0 1 0 1 1 2 3 4\ncall other.obj\n";
    let found = warnings(&folder.read("a.obj", format!("{OBJ}{more}")));
    assert_eq!(found.len(), 3, "{found:?}");
    assert!(found[0].starts_with("2 elements were left out: points and lines"));
    assert!(found[1].starts_with("1 free-form surface was left out"));
    assert!(found[2].starts_with("1 other file"));
    for header in ["off", "NCOFF", "STCNOFF"] {
        is_tetrahedron(&folder.read("a", OFF.replace("OFF", header)), 1.0, header);
    }
    for header in ["4OFF", "nOFF", "C4nOFF"] {
        let message = folder.says("a.off", OFF.replace("OFF", header));
        assert!(message.contains("no header of an OFF in three dimensions"), "{message}");
    }
}

/// Labels follow the faces of the file, also where some are dropped or cut.
#[test]
fn labels_follow_the_faces_of_the_file() {
    let folder = Folder::new();
    let at = folder.path();
    // A face without area, a square, and a triangle twice.
    let text =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 1\nf 1 1 2\nf 1 2 3 4\nf 2 5 3\nf 5 3 2\n";
    let import = folder.read("m.obj", text);
    assert_eq!((&import.faces[..], import.report.faces), (&[1, 1, 2][..], 4));
    let labels = |text: &str| read_labels(folder.put("l.txt", text), &import);
    assert_eq!(labels("9\n1\n2\n3\n").unwrap(), [1, 1, 2]);
    assert_eq!(labels("5\n6\n7\n").unwrap(), [5, 6, 7]);
    let message = labels("5\n").unwrap_err().kind.to_string();
    assert!(message.contains("1 labels for 3 triangles of a file with 4 faces"), "{message}");
    // As many faces as triangles, but other ones.
    let import = folder.read("m.obj", text.replace("f 5 3 2\n", ""));
    assert_eq!((import.faces.len(), import.report.faces), (3, 3));
    let kind = read_labels(folder.put("l.txt", "1\n2\n3\n"), &import).unwrap_err().kind;
    assert!(matches!(kind, LabelsErrorKind::Ambiguous { found: 3 }), "{kind}");
    assert!(fails(at, "build m.obj -o m.dibs --labels l.txt").contains("--strict"));
}

#[cfg(unix)]
#[test]
fn pipes_devices_and_folders_are_refused_at_once() {
    let folder = Folder::new();
    let at = folder.path();
    let made = std::process::Command::new("mkfifo").arg(at.join("pipe.ply")).status().unwrap();
    assert!(made.success());
    std::fs::create_dir(at.join("folder.ply")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", at.join("zero.ply")).unwrap();
    folder.put("m.obj", OBJ);
    for (line, says) in [
        ("build pipe.ply -o a.dibs", "pipe.ply: cannot be read (it is a pipe or a device"),
        ("build zero.ply -o a.dibs", "pipe or a device"),
        ("build folder.ply -o a.dibs", "it is a folder"),
        ("build m.obj -o a.dibs --labels pipe.ply", "pipe or a device"),
        ("build m.obj -o a.dibs --limits zero.ply", "pipe or a device"),
        ("stretch m.obj --motion zero.ply", "pipe or a device"),
        ("stretch m.obj --motion %dpe.ply", "no file has this name"),
    ] {
        let message = fails(at, line);
        assert!(message.contains(says), "{line}: {message}");
    }
}
