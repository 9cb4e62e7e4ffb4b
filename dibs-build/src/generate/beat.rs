//! The heart's motion: three control frames, and the path between them.

use glam::{DVec2, DVec3, Vec3};

use super::heart::{BASE, LEFT};
use crate::Motion;

/// Frames of one cycle, and cycles a second (72 a minute).
const FRAMES: usize = 25;
const RATE: f64 = 1.2;

/// One control frame, as a deformation of the shape at end diastole.
struct Control {
    /// Fraction of the radius that the left ventricle's inner wall loses.
    contraction: f64,
    /// Fraction of the distance from the left ventricle's axis that the right free wall loses.
    right_contraction: f64,
    /// Fraction of the length that is lost.
    shortening: f64,
    /// Rotation of the apex against the base, radians.
    twist: f64,
}

const MID_SYSTOLE: Control =
    Control { contraction: 0.19, right_contraction: 0.06, shortening: 0.05, twist: 0.19 };
const END_SYSTOLE: Control =
    Control { contraction: 0.29, right_contraction: 0.11, shortening: 0.12, twist: 0.24 };

/// The motion of the generated [`heart`](super::heart()) at any points, say at the nodes of a volume that moves it: one
/// cycle from their positions (mm) at end diastole, which are frame 0.
///
/// A point moves on the parabola through its three control positions, with the phase `(1 - cos(2 pi t)) / 2`:
/// sinusoidally, from end diastole to end systole and back.
///
/// ```
/// use dibs_build::{Volume, generate};
/// let heart = generate::heart(320)?;
/// assert_eq!(generate::beat(&heart.mesh.positions), heart.motion);
/// let lattice = Volume::lattice(&heart.mesh, [4, 4, 4])?;
/// let nodes: Vec<_> = lattice.nodes().iter().map(|node| node.as_vec3()).collect();
/// assert_eq!(generate::beat(&nodes).frames[12].len(), 125);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn beat(rest: &[Vec3]) -> Motion {
    let controls: Vec<[DVec3; 3]> = rest
        .iter()
        .map(|&point| {
            let point = point.as_dvec3();
            [point, MID_SYSTOLE.place(point), END_SYSTOLE.place(point)]
        })
        .collect();
    let frames = (0..FRAMES)
        .map(|frame| {
            let turn = std::f64::consts::TAU * frame as f64 / FRAMES as f64;
            let phase = (1.0 - libm::cos(turn)) / 2.0;
            // Lagrange weights of the parabola's points at 1/2 and 1; the weight at 0 is one minus their sum.
            let middle = 4.0 * phase * (1.0 - phase);
            let end = phase * (2.0 * phase - 1.0);
            controls
                .iter()
                .map(|[start, mid, last]| {
                    (start + (mid - start) * middle + (last - start) * end).as_vec3()
                })
                .collect()
        })
        .collect();
    Motion { frames, rate: (FRAMES as f64 * RATE) as f32, ..Motion::default() }
}

impl Control {
    fn place(&self, point: DVec3) -> DVec3 {
        // The muscle thickens because its inner wall moves inwards more than its outer wall.
        let level = LEFT.level(point) / 0.92;
        let square = level * level;
        let inward = 1.0 / (1.0 + (square * square) * (square * square));
        let right = smooth_step(point.x / 60.0);
        let radius = 1.0 - self.contraction * inward - self.right_contraction * right;
        let height = point.z / BASE;
        // Apex and base rotate in opposite directions, the base less.
        let angle = self.twist * (0.75 - height);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let flat = DVec2::new(cos, sin).rotate(point.truncate()) * radius;
        flat.extend(point.z * (1.0 - self.shortening))
    }
}

/// 0 below 0, 1 above 1, smooth between.
fn smooth_step(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
