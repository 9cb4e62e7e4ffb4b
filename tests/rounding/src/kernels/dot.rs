//! The dot product of a position and a normal.

use super::Stated;
use crate::goal::{Goal, of};
use crate::tape::{self, Tape, Traced, coordinate, length};
use crate::term::Monomial;
use crate::vector::Vec3;

const SAYS: &str = "A dot product's error is at most DOT C N + 2^-140, for a position of length C and a normal of length N.
                    That the sizes of the three products have a sum of at most C N is the inequality of Cauchy and Schwarz.";

/// `2^-140`: what underflow may add.
const LEAST: f64 = 1.0 / (1u128 << 70) as f64 / (1u128 << 70) as f64;

/// The products of a vector's components with the normal's.
pub fn products(vector: &str) -> Vec<Monomial> {
    let product = |axis| of(&[&format!("normal_{axis}"), &format!("{vector}_{axis}")]);
    ['x', 'y', 'z'].map(product).into()
}

pub fn paths(stated: &Stated) -> Vec<(Vec<Goal>, Tape)> {
    tape::paths(|| {
        let point = Vec3::of(|axis| coordinate(&format!("point_{axis}")));
        let normal = Vec3::of(|axis| coordinate(&format!("normal_{axis}")));
        let (found, exact) = (normal.dot(point), normal.exact_dot(point));
        let size = length("C").times(length("N"));
        let most = Traced::exact(stated.dot).times(size).plus(Traced::exact(LEAST));
        let sides = [("low", exact.minus(found)), ("high", found.minus(exact))];
        let goal = |(side, error)| {
            Goal::new(&format!("dot_{side}"), SAYS, most.minus(error), &[])
                .share(
                    ("DOT", "three roundings of each product"),
                    3.0,
                    products("point"),
                    vec![of(&["C", "N"])],
                )
                .reserve(of(&[]), 0, LEAST)
        };
        sides.map(goal).into()
    })
}
