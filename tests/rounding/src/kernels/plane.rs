//! The plane that rejects leaves and triangles.

use super::dot::products;
use super::{Stated, axis};
use crate::constants::FLOOR;
use crate::goal::{Goal, of};
use crate::shipped::{Given, Meter, Node, Search, Tree};
use crate::tape::{self, Tape, Traced, branches, coordinate, input, length, near_one};
use crate::vector::Vec3;

const SAYS: &str = "A point that is found beyond the plane is farther from a sphere's centre than the cutoff K, less PLANE S and
                    FLOOR: n . (point - centre) >= (K - PLANE S - FLOOR) |n|, with COORDINATES C in the cutoff.
                    The normal n is within its own goal of the vector from the centre to the plane's point. The lengths of point and
                    centre are at most C, so that the inequality of Cauchy and Schwarz bounds the products; |n| is at most S, K at
                    most 1.25 S: above that, nothing is rejected;
                    |n| is at least 2^-50. C as computed is within 2^-20 of itself.";

pub fn paths(stated: &Stated) -> Vec<(Vec<Goal>, Tape)> {
    tape::paths(|| {
        let centre = Vec3::of(|axis| coordinate(&format!("centre_{axis}")));
        let point = Vec3::of(|axis| coordinate(&format!("point_{axis}")));
        let normal = Vec3::of(|axis| coordinate(&format!("normal_{axis}")));
        let errors = Vec3::of(|axis| near_one(&format!("error_{axis}"), axis::ERROR));
        let to = Vec3 {
            x: normal.x.times(errors.x),
            y: normal.y.times(errors.y),
            z: normal.z.times(errors.z),
        };
        let cutoff = length("cutoff");
        let slack = Traced::exact(stated.coordinates).times(length("C"));
        let zero = Traced::exact(0.0);
        let search = Search {
            tool: Given { to: normal },
            tree: Tree { node: Node { pin: centre, radius_code: zero, link: 0 } },
            vertices: (),
            meter: Meter,
            waiting: 0,
            radius_scale: zero,
            cutoff,
            cutoff_squared: zero,
            coordinate_slack: slack.times(near_one("rounding", "1b-20")),
            tilt_slack: input("tilt", "0", "1b70"),
            pushed: None,
        };
        if !search.plane_towards(centre.plus(to)).has_beyond(point) {
            // It rejects nothing.
            return Vec::new();
        }
        let size = Traced::exact(stated.plane).times(length("scale"));
        let cutoff = cutoff.minus(size.plus(Traced::exact(f64::from(FLOOR))));
        let along = normal.exact_dot(point).minus(normal.exact_dot(centre));
        let claim = along.minus(cutoff.times(tape::root(1)));
        let [beyond] = branches()[..] else { unreachable!("one comparison") };
        let goal =
            Goal::new("plane_beyond", SAYS, claim, &[(beyond.greater.minus(beyond.less), 1.0)])
                .share(
                    ("COORDINATES", "dot product of the point"),
                    3.0,
                    products("point"),
                    vec![of(&["C", "root1"])],
                )
                .share(
                    ("COORDINATES", "that of the point on the axis, whose own error, and two sums"),
                    6.1,
                    products("centre"),
                    vec![of(&["C", "root1"])],
                )
                .share(
                    ("PLANE", "error of the normal"),
                    1.1,
                    products("normal"),
                    vec![of(&["root1", "scale"])],
                )
                .share(
                    ("PLANE", "cutoff times the normal's length"),
                    6.6,
                    vec![of(&["cutoff", "root1"])],
                    vec![of(&["root1", "scale"])],
                )
                .of_sizes(1.25)
                .reserve(of(&["root1"]), -50, f64::from(FLOOR) / 2.0);
        vec![goal]
    })
}
