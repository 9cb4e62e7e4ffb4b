//! The kernels, one a file: inputs, what is claimed of each path, and where its error goes.

mod axis;
mod blend;
mod dot;
mod node;
mod plane;

use crate::constants;
use crate::goal::{Goal, U};
use crate::tape::Tape;

/// The constants that goals are about. A test states others.
#[derive(Clone, Copy, Debug)]
pub struct Stated {
    /// Error of a node's bound, in units of the scale.
    pub bound: f64,
    /// Error of a plane's comparison, in units of the scale.
    pub plane: f64,
    /// Slack of a plane's comparison, in units of the coordinates' size.
    pub coordinates: f64,
    /// Error of a dot product.
    pub dot: f64,
    /// Most errors of a vertex that the bound on a blend's rounding has to cover: a pair's two.
    pub vertices: f64,
}

impl Stated {
    /// The constants as shipped.
    #[must_use]
    pub fn shipped() -> Self {
        Self {
            bound: f64::from(constants::BOUND),
            plane: f64::from(constants::PLANE),
            coordinates: f64::from(constants::COORDINATES),
            dot: f64::from(constants::DOT),
            vertices: 2.0,
        }
    }
}

/// All goals, and what was recorded on their paths.
#[must_use]
pub fn goals(stated: &Stated) -> Vec<(Goal, Tape)> {
    let kernels = [axis::paths, node::paths, dot::paths, plane::paths, blend::paths];
    let paths = kernels.iter().flat_map(|paths| paths(stated));
    paths
        .flat_map(|(goals, tape)| goals.into_iter().map(move |goal| (goal, tape.clone())))
        .collect()
}

/// The constants by the names that shares have, in units of `u`.
#[must_use]
pub fn stated() -> [(&'static str, f64); 6] {
    let Stated { bound, plane, coordinates, dot, .. } = Stated::shipped();
    [
        ("BOUND", bound / U),
        ("PLANE", plane / U),
        ("COORDINATES", coordinates / U),
        ("DOT", dot / U),
        (blend::COORDINATES, 3.0),
        (blend::EDGES, 16.0),
    ]
}
