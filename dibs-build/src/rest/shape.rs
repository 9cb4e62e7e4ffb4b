//! The rest shape of one triangle.
//!
//! Consider a triangle a thousand times longer than high. A vertex that moves by a thousandth of that length, or that
//! is quantised on the bus, doubles the height and so the stretch: one such triangle among a million would make every
//! sphere grow, or every frame be refused. So where paths cross triangles, a *flat* triangle, whose height is less than
//! 1/64 of its longest edge, has a rest shape of that height.
//!
//! Coverage only requires that builder, tree and stretch check use the same shape: an arc along an edge has the length
//! of that edge in the rest shape of one of its triangles, and the stretch check bounds how much longer the edge is
//! now. The rest shapes of neighbours need not match at their common edge; that of a flat triangle does not, so no
//! chord crosses it. The fattened shape is nowhere shorter than the true one, so the true one stays within its spheres.

// Requirement: A-02

use dibs_nostd::format::PathKind;
use glam::{DVec3, Vec3};

/// Height of a triangle over its longest edge below which it counts as flat.
const FLAT: f64 = 1.0 / 64.0;

/// The shape that a triangle's stretch is measured against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RestShape {
    /// Its corners, in the given order.
    pub corners: [DVec3; 3],
    /// Whether it is higher than the true triangle, and so does not match its neighbours.
    pub is_flat: bool,
}

impl RestShape {
    /// The rest shape of a triangle with these corners, for paths of this kind. The same corners in another order give
    /// the same shape, bit for bit, because the tree's order differs from the mesh's.
    pub fn new(corners: [Vec3; 3], kind: PathKind) -> Self {
        let mut shape = Self { corners: corners.map(Vec3::as_dvec3), is_flat: false };
        if kind == PathKind::EdgePath {
            return shape;
        }
        // The order of the positions determines the choice between equal edges, and the rounding.
        let mut order = [0, 1, 2];
        order.sort_unstable_by(|&i, &j| by_position(corners[i], corners[j]));
        if let Some(fattened) = fattened(order.map(|i| shape.corners[i])) {
            shape.is_flat = true;
            order.into_iter().zip(fattened).for_each(|(i, corner)| shape.corners[i] = corner);
        }
        shape
    }
}

fn by_position(a: Vec3, b: Vec3) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
}

/// Whether a triangle has an area: its height is more than 10^-12 of its longest edge, the allowance for f64 rounding.
pub(crate) fn has_area(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(Vec3::as_dvec3);
    let longest = [b - a, c - b, a - c].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
    (b - a).cross(c - a).length() > 1e-12 * longest
}

/// The corners of a flat triangle, with the apex moved away from the longest edge until it is not flat; `None` for
/// other triangles.
fn fattened(mut corners: [DVec3; 3]) -> Option<[DVec3; 3]> {
    let Apex { corner, edge, height } = apex(corners);
    if height >= FLAT * edge {
        return None;
    }
    let [start, end] = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
    let along = (end - start) / edge;
    let across = (corners[corner] - start).reject_from_normalized(along);
    // Rejected twice, since rounding leaves a very short vector a component along the edge, which would shorten another
    // edge.
    let up = across.try_normalize().map(|up| up.reject_from_normalized(along));
    let up = up.and_then(DVec3::try_normalize).unwrap_or_else(|| along.any_orthonormal_vector());
    corners[corner] += up * (FLAT * edge - height);
    Some(corners)
}

/// The corner opposite to the longest edge; of equal edges, to the first.
struct Apex {
    corner: usize,
    /// Length of the longest edge.
    edge: f64,
    /// Height of the corner above it.
    height: f64,
}

fn apex(corners: [DVec3; 3]) -> Apex {
    let squared = |apex: usize| corners[(apex + 1) % 3].distance_squared(corners[(apex + 2) % 3]);
    let longest = if squared(1) > squared(0) { 1 } else { 0 };
    let corner = if squared(2) > squared(longest) { 2 } else { longest };
    let edge = squared(corner).sqrt();
    let [a, b, c] = corners;
    // If all corners coincide, the height is 0.
    let height = if edge > 0.0 { (b - a).cross(c - a).length() / edge } else { 0.0 };
    Apex { corner, edge, height }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-10.0_f32..10.0).prop_map(Vec3::from_array)
    }

    /// A point on a small lattice: triangles between such points often have equal edges, or no area.
    fn lattice_point() -> impl Strategy<Value = Vec3> {
        (-2_i8..3, -1_i8..2, 0_i8..2)
            .prop_map(|(x, y, z)| Vec3::new(f32::from(x), f32::from(y) * 1e-3, f32::from(z) * 1e-3))
    }

    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

    proptest! {
        /// A flat triangle grows until it is not flat, and shrinks in no direction; other triangles do not change.
        #[test]
        fn only_flat_triangles_grow(a in point(), b in point(), at in -0.2_f32..1.2, off in point(),
                                    power in -6.0_f32..0.0, turn in 0..3_usize) {
            let length = a.distance(b);
            prop_assume!(length > 0.1 && off.length() > 0.1);
            let mut given = [a, b, a + (b - a) * at + off.normalize() * length * 10f32.powf(power)];
            given.rotate_left(turn);
            let corners = given.map(Vec3::as_dvec3);
            let shape = RestShape::new(given, PathKind::Surface);
            prop_assert_eq!(shape.is_flat, shape.corners != corners);
            let Apex { edge, height, .. } = apex(shape.corners);
            // An edge to the moved corner may be the longest now.
            let least = FLAT * edge / (1.0 + FLAT * FLAT);
            prop_assert!(height >= least * (1.0 - 1e-9), "{} of {}", height, edge);
            // The Gram matrix has grown: no path across the triangle is shorter.
            let gram = |[a, b, c]: [DVec3; 3]| {
                [(b - a).length_squared(), (b - a).dot(c - a), (c - a).length_squared()]
            };
            let [now, before] = [gram(shape.corners), gram(corners)];
            let [p, q, r] = [0, 1, 2].map(|i| now[i] - before[i]);
            let least = (p + r) / 2.0 - ((p - r) / 2.0).hypot(q);
            prop_assert!(least >= -1e-12 * edge * edge, "{}", least);
        }

        /// The order of the corners changes no bit, even with equal edges or collinear corners.
        #[test]
        fn the_order_of_the_corners_does_not_matter(
            corners in prop::array::uniform3(prop_oneof![lattice_point(), point()]), scale in 1e-3_f32..1e3,
        ) {
            let corners = corners.map(|corner| corner * scale);
            let shape = RestShape::new(corners, PathKind::Surface);
            for order in ORDERS {
                let other = RestShape::new(order.map(|i| corners[i]), PathKind::Surface);
                prop_assert_eq!(other.is_flat, shape.is_flat);
                // Coinciding corners are interchangeable.
                let distinct = corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0];
                prop_assert!(!distinct || other.corners == order.map(|i| shape.corners[i]));
            }
        }
    }
}
