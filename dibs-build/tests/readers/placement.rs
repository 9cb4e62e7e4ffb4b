//! Surfaces that a scene mirrors: a placement of negative determinant turns a surface inside out unless its triangles
//! are flipped.

// Requirement: M-03

use std::io::Write;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use dibs_build::glam::Vec3;
use dibs_build::{Mesh, check_winding};
use tempfile::TempDir;

/// A tetrahedron of volume 1/6, its triangles wound outwards.
const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// Positive where the triangles of a closed surface are wound outwards.
fn volume(mesh: &Mesh) -> f32 {
    let corners = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
    let tetrahedra = mesh.triangles.iter().map(|triangle| {
        let [a, b, c] = corners(triangle);
        a.dot(b.cross(c)) / 6.0
    });
    tetrahedra.sum()
}

fn read(folder: &TempDir, name: &str, bytes: &[u8]) -> Mesh {
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    dibs_build::read(path).unwrap().mesh
}

/// A scene whose nodes, each a child of the one before, have these placements.
fn gltf(nodes: &[&str], mode: u32, rows: &[u32]) -> String {
    let positions = CORNERS.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    let bytes: Vec<u8> = positions.chain(rows.iter().flat_map(|row| row.to_le_bytes())).collect();
    let last = nodes.len() - 1;
    let nodes = nodes.iter().enumerate().map(|(number, place)| match number {
        _ if number == last => format!(r#"{{"mesh": 0{place}}}"#),
        _ => format!(r#"{{"children": [{}]{place}}}"#, number + 1),
    });
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1, "mode": {mode}}}]}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
            {{"bufferView": 1, "componentType": 5125, "count": {}, "type": "SCALAR"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 48}}, {{"buffer": 0, "byteOffset": 48}}],
        "buffers": [{{"byteLength": {}, "uri": "data:application/octet-stream;base64,{}"}}]}}"#,
        nodes.collect::<Vec<_>>().join(", "),
        rows.len(),
        bytes.len(),
        BASE64_STANDARD.encode(&bytes)
    )
}

const MIRROR: &str = r#", "scale": [-1, 1, 1]"#;
const MIRROR_MATRIX: &str = r#", "matrix": [1,0,0,0, 0,1,0,0, 0,0,-1,0, 5,6,7,1]"#;

#[test]
fn a_mirrored_node_keeps_its_outer_side() {
    let folder = tempfile::tempdir().unwrap();
    for (nodes, first) in [
        (vec![""], Vec3::X),
        (vec![MIRROR], -Vec3::X),
        (vec![MIRROR, ""], -Vec3::X),
        (vec![MIRROR, MIRROR], Vec3::X),
        (vec![MIRROR_MATRIX], Vec3::new(6.0, 6.0, 7.0)),
        (vec![r#", "scale": [-1, -1, -1]"#], -Vec3::X),
        (vec![r#", "rotation": [0, 0, 1, 0]"#], -Vec3::X),
    ] {
        // As triangles, and as a strip, whose every second triangle is the other way round.
        for (mode, rows) in [(4, TRIANGLES.as_flattened()), (5, &[3, 0, 1, 2, 3, 0])] {
            let mut mesh = read(&folder, "scene.gltf", gltf(&nodes, mode, rows).as_bytes());
            // In metres, as the file.
            mesh.positions.iter_mut().for_each(|position| *position /= 1000.0);
            assert!((mesh.positions[1] - first).length() < 1e-6, "{nodes:?}: {mesh:?}");
            check_winding(&mesh).unwrap();
            assert!((volume(&mesh) - 1.0 / 6.0).abs() < 1e-5, "{nodes:?}, mode {mode}");
        }
    }
}

#[test]
fn a_mirrored_component_keeps_its_outer_side() {
    let folder = tempfile::tempdir().unwrap();
    let mirror = r#" transform="-1 0 0 0 1 0 0 0 1 0 0 0""#;
    for (item, component) in [("", ""), (mirror, ""), ("", mirror), (mirror, mirror)] {
        let vertices = CORNERS.map(|[x, y, z]| format!(r#"<vertex x="{x}" y="{y}" z="{z}"/>"#));
        let triangles =
            TRIANGLES.map(|[a, b, c]| format!(r#"<triangle v1="{a}" v2="{b}" v3="{c}"/>"#));
        let model = format!(
            r#"<model unit="millimeter"><resources>
            <object id="1"><mesh><vertices>{}</vertices><triangles>{}</triangles></mesh></object>
            <object id="2"><components><component objectid="1"{component}/></components></object>
            </resources><build><item objectid="2"{item}/></build></model>"#,
            vertices.concat(),
            triangles.concat()
        );
        let mut package = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
        package.start_file("3D/3dmodel.model", zip::write::SimpleFileOptions::default()).unwrap();
        package.write_all(model.as_bytes()).unwrap();
        let mesh = read(&folder, "scene.3mf", &package.finish().unwrap().into_inner());
        let first = if item == component { Vec3::X } else { -Vec3::X };
        assert_eq!(mesh.positions[1], first, "{item}, {component}");
        check_winding(&mesh).unwrap();
        assert!((volume(&mesh) - 1.0 / 6.0).abs() < 1e-5, "'{item}', '{component}'");
    }
}
