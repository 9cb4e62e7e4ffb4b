//! Writes the first inputs of each target's corpus: `cargo run --example seeds`.

use std::fs;
use std::path::Path;

use dibs_build::{Builder, IndexWidth, Mesh, generate};
use dibs_nostd::format::field::RADIUS_UNIT;
use dibs_nostd::RigidPose;
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::wire::{FrameEncoder, FrameId};
use dibs_tests::bus::{collect, encoding, frame};

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let write = |target: &str, name: &str, bytes: &[u8]| {
        let folder = folder.join(target);
        fs::create_dir_all(&folder).expect("a writable folder");
        fs::write(folder.join(name), bytes).expect("a writable folder");
    };
    let one = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    let heart = generate::heart(320).expect("a valid size").mesh;
    for (name, mesh, index) in [
        ("triangle16", &one, IndexWidth::Bits16),
        ("triangle32", &one, IndexWidth::Bits32),
        ("heart16", &heart, IndexWidth::Bits16),
    ] {
        let lean = Builder::new().index(index).with_rest_shape(false).with_vertex_order(false);
        write("tree", name, lean.build(mesh).expect("a valid mesh").blob());
    }
    for quantised in [false, true] {
        let mut input = Vec::new();
        for packet in frame(1, quantised).into_iter().chain(frame(2, quantised)) {
            input.push(packet.len() as u8);
            input.extend(packet);
        }
        write("packets", if quantised { "quantised" } else { "float" }, &input);
    }
    // Frames with a pose each: whole ones, and one that changes a part of the second.
    let posed = Builder::new().stretch(1.5).build(&heart).expect("a valid mesh");
    for quantised in [false, true] {
        let (mut input, mut held) = (Vec::new(), Vec::new());
        for epoch in 1..=3 {
            let mut rows = posed.to_rows(&heart.positions);
            rows[epoch as usize] *= 1.001;
            let id = FrameId { mesh_id: posed.summary().mesh_id, session: 1, epoch };
            let (turn, shift) = (Quat::from_rotation_z(0.1 * epoch as f32), Vec3::Z * epoch as f32);
            let pose = RigidPose::new(turn, shift).expect("a rotation");
            let (now, encoding) = (rows.clone(), encoding(quantised, &rows));
            let frame = if epoch < 3 {
                FrameEncoder::<_, 250>::new(id, encoding, &now[..])
            } else {
                FrameEncoder::partial(id, encoding, &now[..], epoch - 1, &held[..])
            };
            let frame = frame.and_then(|frame| frame.with_pose(pose)).expect("few packets");
            for packet in collect(frame) {
                input.push(packet.len() as u8);
                input.extend(packet);
            }
            held = rows;
        }
        write("poses", if quantised { "quantised" } else { "float" }, &input);
    }
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let off = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
               element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let stl = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n\
               endloop\nendfacet\nendsolid s\n";
    for (name, text) in [("obj", obj), ("off", off), ("ply", ply), ("stl", stl)] {
        write("mesh", name, text.as_bytes());
    }
    // What other programs write, small and large.
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../dibs-build/tests/fixtures");
    for (target, name) in [
        ("mesh", "labels_42.vtk"),
        ("mesh", "labels_51.vtk"),
        ("mesh", "labels_22.msh"),
        ("mesh", "labels_41_binary.msh"),
        ("formats", "labels.vtp"),
        ("formats", "vtk_ascii.vtp"),
        ("formats", "vtk_inline_zlib.vtp"),
        ("formats", "scene.glb"),
        ("formats", "trimesh.3mf"),
    ] {
        write(target, name, &fs::read(fixtures.join(name)).expect("a file"));
    }
    write("mesh", "groups", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\ng a\nf 1 2 3\nusemtl b\nf 1 2 4\n");
    // No damage, no moved vertex, no option, and a capsule beside the heart.
    let capsule = [60.0_f32, 0.0, 0.0, 90.0, 10.0, 0.0, 2.5];
    let words = [0_u32; 5].into_iter().chain(capsule.map(f32::to_bits));
    write("query", "capsule", &words.flat_map(u32::to_le_bytes).collect::<Vec<_>>());
    // The slowest query: a unit of the radii so large that no sphere and no plane rejects a triangle, and a capsule
    // that crosses the heart, whose depth takes many searches.
    let damage = [1, (RADIUS_UNIT / 4) as u32, 1e6_f32.to_bits()];
    let capsule = [-50.0_f32, 15.0, 0.0, 50.0, 0.0, 5.0, 1.0];
    let words = damage.into_iter().chain([0; 4]).chain(capsule.map(f32::to_bits));
    write("query", "crossing", &words.flat_map(u32::to_le_bytes).collect::<Vec<_>>());
}
