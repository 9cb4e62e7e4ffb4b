//! Flat triangles, whose stretch says more about rounding than about tissue.
//!
//! Let a triangle be a thousand times longer than it is high. A vertex that moves by a thousandth of its
//! length, or that a bus quantises, doubles its height and so its stretch: one such triangle among a million
//! would have every sphere grow, or every frame refused. So its stretch is measured as if at rest it were a
//! little higher, and along-surface distances are counted on that higher triangle, which never makes them
//! shorter: what holds of stretch and distances holds as it did.

use glam::DVec3;

/// Height of a triangle over its longest edge below which it is flat.
const FLAT: f64 = 1.0 / 64.0;

/// Whether a triangle is flat.
pub(crate) fn is_flat(corners: [DVec3; 3]) -> bool {
    let (length, height, _) = apex(corners);
    height < FLAT * length
}

/// The corners, of which the one across from the longest edge is moved away from it, if the triangle is flat,
/// until it is not.
pub(crate) fn fattened(mut corners: [DVec3; 3]) -> [DVec3; 3] {
    let (length, height, apex) = apex(corners);
    if height < FLAT * length {
        let [start, end] = [corners[(apex + 1) % 3], corners[(apex + 2) % 3]];
        let along = (end - start) / length;
        let across = (corners[apex] - start).reject_from_normalized(along);
        // Twice, since of a very short vector rounding leaves a part along the edge, which would shorten another.
        let up = across.try_normalize().map(|up| up.reject_from_normalized(along));
        let up =
            up.and_then(DVec3::try_normalize).unwrap_or_else(|| along.any_orthonormal_vector());
        corners[apex] += up * (FLAT * length - height);
    }
    corners
}

/// Length of the longest edge, height above it, and the corner across from it.
fn apex(corners: [DVec3; 3]) -> (f64, f64, usize) {
    let squared = |apex: usize| corners[(apex + 1) % 3].distance_squared(corners[(apex + 2) % 3]);
    let longest = if squared(1) > squared(0) { 1 } else { 0 };
    let apex = if squared(2) > squared(longest) { 2 } else { longest };
    let length = squared(apex).sqrt();
    let [a, b, c] = corners;
    // All corners in one place: there is no triangle to be flat.
    let height = if length > 0.0 { (b - a).cross(c - a).length() / length } else { 0.0 };
    (length, height, apex)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-10.0..10.0).prop_map(DVec3::from_array)
    }

    proptest! {
        /// It is no longer flat, no direction in it has become shorter, and what is not flat stays.
        #[test]
        fn only_flat_triangles_grow(a in point(), b in point(), at in -0.2..1.2, off in point(),
                                    power in -9.0..0.0, turn in 0..3_usize) {
            let length = a.distance(b);
            prop_assume!(length > 0.1 && off.length() > 0.1);
            let mut corners = [a, b, a + (b - a) * at + off.normalize() * length * 10f64.powf(power)];
            corners.rotate_left(turn);
            let fat = fattened(corners);
            prop_assert_eq!(is_flat(corners), fat != corners);
            let (length, height, _) = apex(fat);
            // An edge to the corner that moved may be the longest now.
            let least = FLAT * length / (1.0 + FLAT * FLAT);
            prop_assert!(height >= least * (1.0 - 1e-9), "{} of {}", height, length);
            // The Gram matrix has grown: no path across the triangle is shorter.
            let gram = |[a, b, c]: [DVec3; 3]| {
                [(b - a).length_squared(), (b - a).dot(c - a), (c - a).length_squared()]
            };
            let [now, before] = [gram(fat), gram(corners)];
            let [p, q, r] = [0, 1, 2].map(|i| now[i] - before[i]);
            let least = (p + r) / 2.0 - ((p - r) / 2.0).hypot(q);
            prop_assert!(least >= -1e-12 * length * length, "{}", least);
        }
    }
}
