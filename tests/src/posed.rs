//! Frames with rigid poses: the mesh in world coordinates, in f64.

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::{Interval, Proximity, Side};
use glam::{DQuat, DVec3, Quat, Vec3};

use crate::oracle::closest_pair;
use crate::sides::is_inside;
use crate::surfaces;

/// A heart at some position.
pub struct Heart {
    /// Its mesh.
    pub mesh: Mesh,
    /// Its tree.
    pub built: BuiltTree,
    /// Its triangles, by rows.
    pub triangles: Vec<[u32; 3]>,
    /// The middle of its box.
    pub centre: Vec3,
}

impl Heart {
    /// A heart of 320 triangles, displaced in its mesh's own coordinates by `shift`.
    ///
    /// # Panics
    /// Never: the mesh is valid.
    #[must_use]
    pub fn new(shift: Vec3) -> Self {
        let mut mesh = generate::heart(320).expect("a valid size").mesh;
        mesh.positions.iter_mut().for_each(|at| *at += shift);
        let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
        let triangles = surfaces::triangles(&built.tree::<u16>().expect("16-bit indices"));
        let low = mesh.positions.iter().copied().reduce(Vec3::min).expect("has vertices");
        let high = mesh.positions.iter().copied().reduce(Vec3::max).expect("has vertices");
        Self { mesh, built, triangles, centre: (low + high) * 0.5 }
    }

    /// The positions of its file, scaled up by this fraction.
    #[must_use]
    pub fn grown(&self, part: f32) -> Vec<Vec3> {
        let grown = |&at: &Vec3| self.centre + (at - self.centre) * (1.0 + part);
        self.mesh.positions.iter().map(grown).collect()
    }
}

/// A pose as it is sent.
pub type Sent = (Quat, Vec3);

/// The exact pose in f64.
#[must_use]
pub fn exact((rotation, shift): &Sent) -> (DQuat, DVec3) {
    (rotation.as_dquat().normalize(), shift.as_dvec3())
}

/// The pose extrapolated beyond two poses, by a fraction of their step, about a centre that moves in a straight line.
#[must_use]
pub fn beyond(before: &Sent, after: &Sent, part: f64, centre: DVec3) -> (DQuat, DVec3) {
    let ((a, s), (b, t)) = (exact(before), exact(after));
    let turn = b * a.inverse();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let rotation = DQuat::from_scaled_axis(turn.to_scaled_axis() * part) * b;
    let ends = [a * centre + s, b * centre + t];
    (rotation, ends[1] + (ends[1] - ends[0]) * part - rotation * centre)
}

/// A pose on a steady motion about a heart's middle, at this time.
#[must_use]
pub fn steady(heart: &Heart, start: &Sent, spin: Vec3, flow: Vec3, time: f64) -> Sent {
    let (rotation, shift) = steady_at(heart.centre, start, spin, flow, time);
    (rotation.as_quat(), shift.as_vec3())
}

/// The exact pose, about any point.
#[must_use]
pub fn steady_at(centre: Vec3, start: &Sent, spin: Vec3, flow: Vec3, time: f64) -> (DQuat, DVec3) {
    let (rotation, shift) = exact(start);
    let centre = centre.as_dvec3();
    let turned = DQuat::from_scaled_axis(spin.as_dvec3() * time) * rotation;
    let middle = rotation * centre + shift + flow.as_dvec3() * time;
    (turned, middle - turned * centre)
}

/// The separation of a capsule from a surface in the world, in f64: signed for a sphere, otherwise as if outside.
pub struct Truth {
    /// The separation (mm).
    pub separation: f64,
    /// Whether a sphere's centre is inside; `None` on the surface, and for a capsule.
    pub is_inside: Option<bool>,
}

/// For rows at a pose, and a capsule between two ends.
#[must_use]
pub fn truth(
    triangles: &[[u32; 3]],
    rows: &[DVec3],
    (rotation, shift): (DQuat, DVec3),
    ends: [Vec3; 2],
    radius: f32,
) -> Truth {
    let world: Vec<DVec3> = rows.iter().map(|&row| rotation * row + shift).collect();
    let [start, end] = ends.map(Vec3::as_dvec3);
    let distance = triangles
        .iter()
        .map(|corners| closest_pair(start, end, corners.map(|row| world[row as usize])).distance)
        .fold(f64::INFINITY, f64::min);
    let local = rotation.inverse() * (start - shift);
    let near: Vec<Vec3> = rows.iter().map(|row| row.as_vec3()).collect();
    let is_inside = if start == end { is_inside(&near, triangles, local) } else { None };
    let signed = if is_inside == Some(true) { -distance } else { distance };
    Truth { separation: signed - f64::from(radius), is_inside }
}

/// The error of an answer relative to its accuracy; `None` if the axis may be inside and is not a point.
///
/// # Panics
/// If its interval does not contain the true separation.
#[must_use]
pub fn off(truth: &Truth, found: &Proximity) -> Option<f64> {
    match (found.side, truth.is_inside) {
        (Side::Outside, _) | (Side::Inside, Some(true)) => {
            let Interval { lower, upper } = found.interval();
            // The reference's own rounding.
            let slack = 1e-9;
            let is_held = f64::from(lower) - slack <= truth.separation
                && truth.separation <= f64::from(upper) + slack;
            let error = (truth.separation - f64::from(found.separation)).abs();
            let part = error / f64::from(found.accuracy);
            assert!(is_held || part > 1.0, "{} {found:?}", truth.separation);
            Some(part)
        }
        _ => None,
    }
}
