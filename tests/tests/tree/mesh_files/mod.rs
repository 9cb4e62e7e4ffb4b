//! Small mesh files of every kind, and a folder for them.

use std::fmt::Write;
use std::path::PathBuf;

use dibs_build::{Format, Import, Mesh, ReadErrorKind, ReadOptions};
use glam::Vec3;

/// An octahedron with a seventh vertex (number 2) that no triangle uses.
pub fn octahedron() -> Mesh {
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
        ..Mesh::default()
    }
}

pub fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::from("# comment \\\no thing\n");
    for p in &mesh.positions {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(text, "f {}/1/1 {}//2 {}", a + 1, b + 1, c + 1).unwrap();
    }
    text.into_bytes()
}

pub fn off(mesh: &Mesh) -> Vec<u8> {
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

pub fn corners(mesh: &Mesh) -> impl Iterator<Item = [Vec3; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.positions[v as usize]))
}

pub fn stl_ascii(mesh: &Mesh) -> Vec<u8> {
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

/// Written by the crate `stl_io`.
pub fn stl_binary(mesh: &Mesh) -> Vec<u8> {
    let triangles: Vec<stl_io::Triangle> = corners(mesh)
        .map(|t| stl_io::Triangle {
            normal: stl_io::Normal::new([0.0; 3]),
            vertices: t.map(|p| stl_io::Vertex::new(p.to_array())),
        })
        .collect();
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, triangles.iter()).unwrap();
    // Many exporters begin binary files with this word.
    bytes[..6].copy_from_slice(b"solid ");
    bytes
}

/// PLY with additional properties and elements, and with coordinates of two types.
pub fn ply(mesh: &Mesh, encoding: &str) -> Vec<u8> {
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
pub fn samples() -> Vec<(&'static str, Format, Vec<u8>)> {
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

pub struct Folder(pub tempfile::TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn put(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    pub fn read_with(&self, options: ReadOptions, text: &str) -> Result<Import, ReadErrorKind> {
        options.read(self.put("with.obj", text)).map_err(|error| error.kind)
    }
}
