//! The vector from a sphere's centre to a point.

use super::Stated;
use crate::goal::Goal;
use crate::shipped::{Axis, Sphere};
use crate::tape::{self, Tape, Traced, coordinate, length};
use crate::vector::Vec3;

const SAYS: &str =
    "A component of the vector from a sphere's centre to a point is within u (1 + 2^-20) of itself.
                    Of a positive component: that of a negative one is its mirror image.";

/// The largest relative error, as Gappa writes it.
pub const ERROR: &str = "0x1.00001p-24";
const MOST: f64 = 1.000_000_953_674_316_4 / 16_777_216.0;

pub fn paths(_: &Stated) -> Vec<(Vec<Goal>, Tape)> {
    tape::paths(|| {
        let centre = Vec3::of(|axis| coordinate(&format!("centre_{axis}")));
        let to = Vec3::of(|axis| length(&format!("to_{axis}")));
        let found = Sphere { centre }.axis_to(centre.plus(to));
        let (to, found, most) = (to.x, found.x, Traced::exact(MOST));
        let size = most.times(found);
        let sides = [("low", to.minus(found)), ("high", found.minus(to))];
        let goal = |(side, error)| Goal::new(&format!("axis_{side}"), SAYS, size.minus(error), &[]);
        sides.map(goal).into()
    })
}
