//! Encodes answers as the records of a structured array.

use dibs_build::glam::{DVec3, Vec3};
use dibs_nostd::{Contact, Coverage, Interval, NoSide, Proximity, Side};

use crate::error;
use crate::tree::Owned;

/// For each field of a record: its name, its type, and its number of values.
pub type Fields = [(&'static str, &'static str, usize)];

/// The fields of an answer, as [`push_answer`] writes it.
pub const ANSWER: &Fields = &[
    ("separation", "<f4", 1),
    ("lower", "<f4", 1),
    ("accuracy", "<f4", 1),
    ("axis_distance", "<f4", 1),
    ("axis_parameter", "<f4", 1),
    ("point_on_surface", "<f8", 3),
    ("point_on_tool", "<f8", 3),
    ("direction", "<f4", 3),
    ("barycentric", "<f4", 3),
    ("triangle", "<u4", 3),
    ("node_tests", "<u4", 1),
    ("triangle_tests", "<u4", 1),
    ("surface", "<u4", 1),
    ("tool", "<u4", 1),
    ("label", "<i2", 1),
    ("side", "u1", 1),
    ("side_reason", "u1", 1),
    ("interval", "<f4", 2),
    ("coverage", "u1", 1),
];

/// The fields of a contact, as [`push_contact`] writes it.
pub const CONTACT: &Fields = &[
    ("pose", "<u4", 1),
    ("surface", "<u4", 1),
    ("tool", "<u4", 1),
    ("separation", "<f4", 1),
    ("axis_parameter", "<f4", 1),
    ("point_on_surface", "<f8", 3),
    ("point_on_tool", "<f8", 3),
    ("normal", "<f4", 3),
    ("velocity", "<f4", 3),
    ("barycentric", "<f4", 3),
    ("triangle", "<u4", 3),
    ("label", "<i2", 1),
];

/// The label of a triangle without one.
const NO_LABEL: i16 = -1;

/// Reasons for an undefined side; field `side_reason` counts them from 1.
const REASONS: [NoSide; 7] = [
    NoSide::NotAsked,
    NoSide::NoAdjacency,
    NoSide::OpenBoundary,
    NoSide::BelowAccuracy,
    NoSide::Degenerate,
    NoSide::CutShort,
    NoSide::NonManifold,
];

/// A sentence for each value of `side_reason`; empty for 0.
pub fn reasons() -> Vec<String> {
    [String::new()].into_iter().chain(REASONS.map(error::sentence)).collect()
}

/// Appends the answer for the pair of these indices: the surface's and the tool's.
pub fn push_answer(out: &mut Vec<u8>, found: &Proximity, tree: &Owned, pair: [usize; 2]) {
    let (side, reason) = match found.side {
        Side::Outside => (0, 0),
        Side::Inside => (1, 0),
        Side::Crossing => (2, 0),
        Side::Either => (4, 0),
        Side::Undefined(reason) => {
            let number = REASONS.iter().position(|&other| other == reason);
            (3, number.map_or(0, |number| number as u8 + 1))
        }
        _ => (3, 0),
    };
    let scalars =
        [found.separation, found.lower, found.accuracy, found.axis_distance, found.axis_parameter];
    floats(out, &scalars);
    point(out, found.point_on_surface, tree.origin);
    point(out, found.point_on_tool, tree.origin);
    floats(out, &found.direction.to_array());
    floats(out, &found.barycentric);
    corners(out, found.corners, tree);
    out.extend(found.node_tests.to_le_bytes());
    out.extend(found.triangle_tests.to_le_bytes());
    numbers(out, pair);
    label(out, found.triangle.and_then(|row| tree.label(row)));
    out.extend([side, reason]);
    let Interval { lower, upper } = found.interval();
    floats(out, &[lower, upper]);
    out.push(match found.coverage {
        Coverage::Measured => 0,
        Coverage::Proven => 1,
        _ => 2,
    });
}

/// Appends a contact of a pose.
pub fn push_contact(out: &mut Vec<u8>, pose: u32, found: &Contact, tree: &Owned) {
    out.extend(pose.to_le_bytes());
    numbers(out, [found.surface, found.tool]);
    floats(out, &[found.separation, found.axis_parameter]);
    point(out, found.point_on_surface, tree.origin);
    point(out, found.point_on_tool, tree.origin);
    floats(out, &found.normal.to_array());
    floats(out, &found.velocity.to_array());
    floats(out, &found.barycentric);
    corners(out, found.corners, tree);
    label(out, tree.label(found.triangle));
}

fn numbers(out: &mut Vec<u8>, numbers: [usize; 2]) {
    out.extend(numbers.into_iter().flat_map(|number| (number as u32).to_le_bytes()));
}

fn floats(out: &mut Vec<u8>, numbers: &[f32]) {
    out.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
}

/// A point in the coordinates of the mesh's file.
fn point(out: &mut Vec<u8>, point: Vec3, origin: DVec3) {
    // Adding zero would lose the sign of -0.
    let local = point.as_dvec3();
    let point = if origin == DVec3::ZERO { local } else { origin + local };
    out.extend(point.to_array().into_iter().flat_map(f64::to_le_bytes));
}

/// The corners of a triangle, numbered as in the mesh.
fn corners(out: &mut Vec<u8>, rows: [u32; 3], tree: &Owned) {
    let number = |row: u32| tree.order.get(row as usize).copied().unwrap_or(row);
    out.extend(rows.into_iter().flat_map(|row| number(row).to_le_bytes()));
}

fn label(out: &mut Vec<u8>, label: Option<u8>) {
    out.extend(label.map_or(NO_LABEL, i16::from).to_le_bytes());
}
