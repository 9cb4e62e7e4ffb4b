//! Motions of a volume's nodes: whole ones, and small changes for climbing.

use dibs_nostd::nodes::Nodes;
use fastrand::Rng;
use glam::{Mat3, Quat, Vec3};

use super::rest;
use crate::deform::unit;

/// A motion of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeMotion {
    /// Stretched along one axis up to the limit.
    Pulled,
    /// Long waves.
    Waves,
    /// Each node moved independently.
    Noise,
    /// Bent around an axis, until its ends may overlap.
    Bent,
    /// Only one node moved.
    Needle,
    /// Pressed nearly flat.
    Pressed,
    /// One half turned over onto the other.
    Folded,
    /// One node moved through the opposite face of an element.
    Flipped,
}

impl NodeMotion {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Pulled,
        Self::Waves,
        Self::Noise,
        Self::Bent,
        Self::Needle,
        Self::Pressed,
        Self::Folded,
        Self::Flipped,
    ];

    /// Nodes after a random motion of this kind, weakened until their stretch is within the limit, and a rigid motion.
    #[must_use]
    pub fn apply(self, nodes: &Nodes<'_>, rng: &mut Rng) -> Vec<Vec3> {
        let rest = rest(nodes);
        let middle = rest.iter().sum::<Vec3>() / rest.len() as f32;
        let size = rest.iter().map(|at| at.distance(middle)).fold(0.0, f32::max);
        let turn = turn(rng);
        let by = Vec3::from([(); 3].map(|()| size * (rng.f32() - 0.5)));
        let strain = nodes.stretch_limit() - 1.0;
        let waves = [(); 3].map(|()| [(); 4].map(|()| 6.0 * (rng.f32() - 0.5)));
        let noise: Vec<Vec3> =
            rest.iter().map(|_| Vec3::from([(); 3].map(|()| rng.f32() - 0.5))).collect();
        let (one, along) = (rng.usize(..rest.len()), turn * Vec3::X);
        let flipped = flipped(nodes, &rest, rng);
        let mut strength = 1.0_f32;
        loop {
            let at = |(node, at): (usize, &Vec3)| {
                let from = *at - middle;
                let moved = match self {
                    Self::Pulled => from + along * along.dot(from) * strain * strength * 0.99999,
                    Self::Waves => {
                        let wave = waves.map(|[x, y, z, phase]| {
                            (Vec3::new(x, y, z).dot(from) / size + phase).sin()
                        });
                        from + Vec3::from(wave) * size * 0.3 * strength
                    }
                    Self::Noise => from + noise[node] * size * 0.2 * strength,
                    Self::Bent => {
                        let angle = 4.0 * strength * from.x / size;
                        Quat::from_rotation_z(angle) * (from + Vec3::Y * size) - Vec3::Y * size
                    }
                    Self::Needle if node == one => from + along * size * strength,
                    Self::Needle => from,
                    Self::Folded => hinged(from, Vec3::ZERO, along, 3.0 * strength),
                    Self::Flipped => from + (flipped[node] - *at) * strength,
                    Self::Pressed => from - along * along.dot(from) * (1.0 - 1e-3) * strength,
                };
                turn * moved + middle + by
            };
            let moved: Vec<Vec3> = rest.iter().enumerate().map(at).collect();
            if nodes.measure(moved.as_slice()).is_ok() {
                return moved;
            }
            strength = if strength > 1e-3 { strength * 0.8 } else { 0.0 };
        }
    }
}

fn turn(rng: &mut Rng) -> Quat {
    let axis = Vec3::from([(); 3].map(|()| rng.f32() - 0.5)).normalize_or(Vec3::X);
    Quat::from_axis_angle(axis, std::f32::consts::TAU * rng.f32())
}

/// A random deformation gradient near a rotation.
#[must_use]
pub fn gradient(rng: &mut Rng, strain: f32) -> Mat3 {
    let mut random = || Vec3::from([(); 3].map(|()| strain * (rng.f32() - 0.5)));
    let shear = Mat3::from_cols(Vec3::X + random(), Vec3::Y + random(), Vec3::Z + random());
    Mat3::from_quat(turn(rng)) * shear
}

/// A position after the half of space in front of a plane was turned about an axis in it.
fn hinged(at: Vec3, on_plane: Vec3, normal: Vec3, angle: f32) -> Vec3 {
    let from = at - on_plane;
    let turn = Quat::from_axis_angle(normal.any_orthonormal_vector(), angle);
    if from.dot(normal) > 0.0 { on_plane + turn * from } else { at }
}

/// A frame with one node of an element moved towards the opposite face, or through it.
fn flipped(nodes: &Nodes<'_>, frame: &[Vec3], rng: &mut Rng) -> Vec<Vec3> {
    let mut next = frame.to_vec();
    let mut corners = nodes.element(rng.u32(..nodes.element_count())).expect("in the table");
    rng.shuffle(&mut corners);
    let [apex, face @ ..] = corners.map(|node| node as usize);
    let across = face.into_iter().map(|node| frame[node]).sum::<Vec3>() / 3.0;
    next[apex] = frame[apex].lerp(across, 1.2 * rng.f32());
    next
}

/// A frame stretched along a direction, by a factor less one.
#[must_use]
pub fn pulled(frame: &[Vec3], along: Vec3, strain: f32) -> Vec<Vec3> {
    frame.iter().map(|&at| at + along * along.dot(at - frame[0]) * strain).collect()
}

/// A frame changed a little, for climbing: one of these nodes moved, an element flattened or inverted, all nodes
/// sheared, one part turned about a hinge, or two nodes drawn apart. No node moves farther than about `most`.
#[must_use]
pub fn nudged(
    nodes: &Nodes<'_>,
    frame: &[Vec3],
    near: &[u32],
    most: f32,
    rng: &mut Rng,
) -> Vec<Vec3> {
    let mut next = frame.to_vec();
    let part = 10.0_f32.powf(-5.0 * rng.f32());
    let [one, other] = [(); 2].map(|()| near[rng.usize(..near.len())] as usize);
    let middle = frame[one];
    match rng.u32(..6) {
        0 | 1 => next[one] += unit(rng) * (most * part),
        2 => next = flipped(nodes, frame, rng),
        3 => {
            let by = gradient(rng, 0.3 * part);
            next.iter_mut().for_each(|at| *at = by * (*at - middle) + middle);
        }
        4 => {
            let (normal, angle) = (unit(rng), part);
            next.iter_mut().for_each(|at| *at = hinged(*at, middle, normal, angle));
        }
        _ => {
            let apart = (frame[other] - middle).normalize_or_zero() * (most * part);
            next[one] -= apart;
            next[other] += apart;
        }
    }
    next
}
