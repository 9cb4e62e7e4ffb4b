//! The slacks of a search: bounds on the f32 rounding of both sides of every comparison.
//!
//! With `u = 2^-24`, all lengths in a query are at most the *scale* `S`: the distance to the farthest point of the root
//! sphere, plus twice the axis and the tool's radius. The errors below are derived by hand, operation by operation. For
//! spheres as tools `cargo xtask rounding` proves [`BOUND`], [`PLANE`], [`DOT`] and [`COORDINATES`] by machine. Hill
//! climbing finds errors of at most 4 `u S`, so no test could detect a slack that is too small. The sums are asserted.

// Requirement: A-01

use crate::math::round::U;
use crate::tool::ACCURACY as KERNEL;

/// Error of a bound `d - R`, in units of `S`: 8 `u` of the pin's distance, 4 `u` of the radius and the difference.
const BOUND: f32 = 12.0 * U;

/// Error of a plane's comparison in units of `S`, without [`COORDINATES`] and [`TILT`].
const PLANE: f32 = 11.0 * U;

/// Slack of the cutoff, in units of `S`.
pub(super) const SLACK: f32 = 48.0 * U;

/// The error within [`Proximity::accuracy`](crate::Proximity::accuracy), in units of `S`: the kernel's error plus
/// that of the pair's last operations, a root, a difference and the tool's radius.
pub(super) const ACCURACY: f32 = 24.0 * U;

/// Tolerance of a tie, in units of `S`: how much farther than the closest distance found a triangle may seem that is as
/// close to the axis' point as the closest one.
///
/// The pair found is real, so its distance is at most 4 `u` more than computed, and 3 `u` more from the axis' point
/// with its rounded parameter: 7 `u`. No triangle that is closest to that point is farther from the axis, nor seems
/// farther by more than [`KERNEL`]. A tracker's lower bound has an error of at most 12 `u`.
pub(super) const TIE: f32 = 40.0 * U;

const _: () = {
    // A subtree's bound, or a plane, against a triangle's distance.
    assert!(SLACK >= BOUND + KERNEL && SLACK >= PLANE + KERNEL);
    assert!(TIE >= 7.0 * U + KERNEL && SLACK >= TIE && SLACK >= BOUND + 7.0 * U + KERNEL);
    assert!(ACCURACY >= KERNEL + 4.0 * U && ACCURACY >= BOUND);
};

/// Error of a dot product of a position and a normal, in units of the coordinates' size `C` times the normal's
/// length.
const DOT: f32 = 3.0 * U;

/// Error of the axis' point through which a plane goes, in units of `C`.
const ON_AXIS: f32 = 2.0 * U;

/// Slack of a plane's comparison in units of `C`, since it uses positions unshifted: two dot products, the axis' point,
/// and 2 `u` of the two sums.
pub(super) const COORDINATES: f32 = 16.0 * U;

/// An axis' deviation from perpendicular to the shortest vector to a point, in units of `S`.
const PERPENDICULAR: f32 = 16.0 * U;

/// Slack of a plane's comparison in units of `S^2`: an axis' ends, at most `S / 2` away, are beyond the plane by at
/// most half of [`PERPENDICULAR`].
pub(super) const TILT: f32 = 16.0 * U;

const _: () = assert!(COORDINATES >= 2.0 * DOT + ON_AXIS + 2.0 * U && TILT >= 0.5 * PERPENDICULAR);

/// A few times the length that the kernels treat as zero: slack and accuracy if tool and surface are one point.
pub(super) const FLOOR: f32 = 1e-14;
