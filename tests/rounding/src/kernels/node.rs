//! The bound of a node's sphere: its pin's distance minus its radius.

use super::Stated;
use crate::constants::{CLOSEST, FLOOR};
use crate::goal::{Goal, U, of};
use crate::shipped::{Meter, Node, Search, Sphere, Tree};
use crate::tape::{self, Tape, Traced, branches, coordinate, input, length, near_one};
use crate::vector::Vec3;

const PUSHED: &str = "A node's lower bound exceeds the true one, `d - R`, by at most BOUND S + FLOOR: for a sphere as a tool.
                      S is at least d + R. The scale of radii, unit times stretch, is a normal number.";

const REJECTED: &str = "A node that is rejected, since its bound exceeds the cutoff K, has `d - R >= K - BOUND S - FLOOR`:
                        d^2 - (K + R)^2 >= -(BOUND S + FLOOR) (d + K + R). For a sphere as a tool.
                        S is at least d and R; d is at least 2^-50; K is at most 1.25 S: above that, nothing is rejected.";

/// The goal of a node that is rejected has BOUND times a sum: its shares are not those of BOUND.
const SUM: &str = "BOUND (d + K + R)";

pub fn paths(stated: &Stated) -> Vec<(Vec<Goal>, Tape)> {
    tape::paths(|| {
        let centre = Vec3::of(|axis| coordinate(&format!("centre_{axis}")));
        let to = Vec3::of(|axis| coordinate(&format!("to_{axis}")));
        let (code, cutoff, parent) =
            (input("code", "0", "65535"), length("cutoff"), length("parent"));
        // The product of `Search::start`.
        let scale = length("unit").times(input("stretch", "1", "1b10"));
        let radius_scale = scale.times(near_one("rounding", "1b-24"));
        let radius = code.times(scale);
        let node = Node { pin: centre.plus(to), radius_code: code, link: 0 };
        let zero = Traced::exact(0.0);
        let mut search = Search {
            tool: Sphere { centre },
            tree: Tree { node },
            vertices: (),
            meter: Meter,
            waiting: 0,
            radius_scale,
            cutoff,
            cutoff_squared: zero,
            coordinate_slack: zero,
            tilt_slack: zero,
            pushed: None,
        };
        search.expand::<CLOSEST>(parent, 0, 1, zero).expect("a node");
        let size = length("scale");
        let error = Traced::exact(stated.bound).times(size).plus(Traced::exact(f64::from(FLOOR)));
        match search.pushed {
            None => vec![rejected(to, cutoff.plus(radius), error)],
            // The child's bound is its parent's, whose goal is the same.
            Some(lower) if lower.name() == parent.name() => Vec::new(),
            Some(lower) => {
                let above = lower.minus(tape::root(1).minus(radius));
                let goal = Goal::new("node_pushed", PUSHED, error.minus(above), &[]);
                let parts = vec![of(&["root1"]), of(&["code", "stretch", "unit"])];
                let goal =
                    goal.share(("BOUND", "distance and radius"), 4.6, parts, vec![of(&["scale"])]);
                vec![goal.reserve(of(&[]), 0, f64::from(FLOOR))]
            }
        }
    })
}

fn rejected(to: Vec3, far: Traced, error: Traced) -> Goal {
    let distance = input("distance", "1b-50", "1b33");
    let squares = to.exact_dot(to).minus(far.times(far));
    let claim = squares.plus(error.times(distance.plus(far)));
    let [first, ..] = branches()[..] else { unreachable!("a comparison") };
    // `distance^2` is the sum of the squares, so that it is at most `scale * distance`.
    let squares = ["to_x", "to_y", "to_z"].map(|name| of(&[name, name]));
    let radius = ["code", "stretch", "unit"];
    let with = |names: &[&str]| of(&[&radius[..], names].concat());
    Goal::new("node_rejected", REJECTED, claim, &[(first.greater.minus(first.less), 1.0 + 6.0 * U)])
        .share((SUM, "twice the distance"), 11.1, squares.into(), vec![of(&["distance", "scale"])])
        .share((SUM, "radius"), 1.1, vec![with(&radius)], vec![with(&["scale"])])
        .share((SUM, "radius and cutoff"), 2.1, vec![with(&["cutoff"])], vec![with(&["scale"])])
        .of_sizes(1.25)
        .reserve(of(&["distance"]), -50, f64::from(FLOOR) / 2.0)
}
