//! Frames that are turned inside out, each edge as long as at rest: only the sign of a closed surface's volume shows it.

// Requirement: F-03

use std::f32::consts::TAU;

use dibs_build::{Builder, Mesh};
use dibs_nostd::{
    Admission, AdmissionCheck, FrameExtent, IncomingSurface, StretchError, StretchMonitor, Tree,
};
use dibs_tests::surfaces::{ball, sheet, triangles};
use glam::{Vec2, Vec3};

/// The outcomes of a frame at rest, of its mirror image, and of one whose triangles are moved inwards a little.
fn outcomes(builder: Builder, mesh: &Mesh) -> [Result<bool, StretchError>; 3] {
    let built = builder.stretch(1.5).build(mesh).expect("a valid mesh");
    let tree: Tree<'_, u16> = built.tree().expect("valid");
    let mut monitor = StretchMonitor::new(&tree).expect("a metric");
    assert_eq!(monitor.tree().checksum(), tree.checksum());
    let rest = built.to_rows(&mesh.positions);
    let mirrored: Vec<Vec3> = rest.iter().map(|&row| Vec3::new(-row.x, row.y, row.z)).collect();
    let mut inwards = rest.clone();
    for corners in triangles(&tree) {
        let [a, b, c] = corners.map(|row| rest[row as usize]);
        let inward = (c - a).cross(b - a).normalize();
        corners.into_iter().for_each(|row| inwards[row as usize] += inward * 0.01);
    }
    [rest, mirrored, inwards].map(|rows| {
        let count = tree.vertex_count();
        monitor.begin(FrameExtent::Whole);
        monitor.moved(0..count);
        let found = monitor.advance(IncomingSurface::new(rows.as_slice(), count), u32::MAX)?;
        monitor.published();
        Ok(matches!(found, Admission::Admitted(Some(_))))
    })
}

fn turned(mesh: &Mesh) -> Mesh {
    let triangles = mesh.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    Mesh { triangles, ..mesh.clone() }
}

/// Wound outwards or inwards, with the volume of its rest shape or, without one, of the first frame.
#[test]
fn a_closed_surface_is_not_its_mirror_image() {
    let ball = ball(2);
    for mesh in [ball.clone(), turned(&ball)] {
        for has_rest in [true, false] {
            let found = outcomes(Builder::new().with_rest_shape(has_rest), &mesh);
            let [rest, mirrored, inwards] = found;
            assert_eq!([rest, inwards], [Ok(true); 2]);
            let Err(StretchError::InsideOut { volume, reference }) = mirrored else {
                panic!("{mirrored:?}")
            };
            assert!((volume + reference).abs() < 1e-3 * reference.abs(), "{volume} {reference}");
        }
    }
}

/// A flat polygon with a front and a back, joined along its border.
fn flat() -> Mesh {
    let rim = (0..12_u8).map(|at| Vec2::from_angle(f32::from(at) * TAU / 12.0).extend(0.0) * 10.0);
    let mut mesh = Mesh { positions: rim.collect(), ..Mesh::default() };
    mesh.positions.extend([Vec3::X, Vec3::NEG_X]);
    for at in 0..12 {
        let next = (at + 1) % 12;
        mesh.triangles.extend([[at, next, 12], [next, at, 13]]);
    }
    mesh
}

/// An open surface, and a closed one that is flat, have no volume whose sign says something: not at rest, and so not
/// later.
#[test]
fn a_surface_without_a_volume_may_be_mirrored() {
    let open = sheet(6, 20.0, |x, y| 0.02 * x * y);
    for mesh in [open, flat()] {
        for has_rest in [true, false] {
            let found = outcomes(Builder::new().with_rest_shape(has_rest), &mesh);
            assert_eq!(found, [Ok(true); 3]);
        }
    }
}
