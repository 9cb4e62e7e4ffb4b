//! The blend of an embedded vertex, and the bound on its rounding.

use super::Stated;
use crate::goal::{Goal, of};
use crate::shipped::{EmbeddedSurface, Nodes, Parts, Scale, Table};
use crate::tape::{self, Tape, Traced, coordinate, input, length};
use crate::vector::Vec3;

const SAYS: &str = "The errors of two vertices that nodes carry are together at most what `rounding` adds to an answer's accuracy,
                    itself as computed. Component by component; the same shares bound vectors. The fourth node is within
                    the size and the stretched extent, an edge within the stretched longest edge; the weights' sizes have a sum of at
                    most the amplification. The first node is not nearer to the origin than 2^-50, no edge shorter.";

/// The factors of `rounding`: of the coordinates, and of the longest edge.
pub const COORDINATES: &str = "3.0 of a blend";
pub const EDGES: &str = "16.0 of a blend";

pub fn paths(stated: &Stated) -> Vec<(Vec<Goal>, Tape)> {
    tape::paths(|| {
        let fourth = Vec3::of(|axis| coordinate(&format!("fourth_{axis}")));
        let edges = [1, 2, 3].map(|at| Vec3::of(|axis| coordinate(&format!("edge{at}_{axis}"))));
        let weights = [1, 2, 3].map(|at| input(&format!("weight{at}"), "-1b18", "1b18"));
        let unit = input("unit", "1b-16", "1");
        let [a, b, c] = edges.map(|edge| fourth.plus(edge));
        let first = Vec3::of(|axis| coordinate(&format!("first_{axis}")));
        let surface = EmbeddedSurface {
            nodes: Nodes {
                limit: input("stretch", "1", "1b10"),
                parts: Parts {
                    scale: Scale { unit, weights },
                    extent: length("extent"),
                    edge: length("edge"),
                    amplification: input("amplification", "1", "1b10"),
                },
            },
            table: Table([a, b, c, fourth, first]),
        };
        let most = surface.rounding();
        let found = surface.position(0).expect("a vertex");
        let mut goals = Vec::new();
        for (at, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
            let edge = |edge: usize| edges[edge].each()[at].times(weights[edge]).times(unit);
            let exact = fourth.each()[at].plus(edge(0)).plus(edge(1)).plus(edge(2));
            let found = found.each()[at];
            for (side, error) in [("low", exact.minus(found)), ("high", found.minus(exact))] {
                let claim = most.minus(Traced::exact(stated.vertices).times(error));
                let names = [1, 2, 3].map(|at| (format!("edge{at}_{axis}"), format!("weight{at}")));
                let weighted = names.iter().map(|(edge, weight)| of(&[edge, "unit", weight]));
                let coordinates =
                    [of(&["amplification", "root1"]), of(&["amplification", "extent", "stretch"])];
                let longest = of(&["amplification", "edge", "stretch"]);
                let goal = Goal::new(&format!("blend_{axis}_{side}"), SAYS, claim, &[])
                    .share(
                        (COORDINATES, "fourth node, of two vertices"),
                        2.1,
                        vec![of(&[&format!("fourth_{axis}")])],
                        coordinates.into(),
                    )
                    .share(
                        (EDGES, "weighted edges, of two vertices"),
                        12.1,
                        weighted.collect(),
                        vec![longest.clone()],
                    )
                    .reserve(longest, -50, 1.0 / 16_777_216.0);
                goals.push(goal);
            }
        }
        goals
    })
}
