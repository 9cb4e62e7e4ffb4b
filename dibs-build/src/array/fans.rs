//! The order of a leaf's triangles and of their corners: fans, for the controller's stretch check.
//!
//! A triangle whose first two corners are the first and the third of the one before shares an edge
//! with it, and the controller has two of its corners and one of its edges at hand.

use glam::DVec3;

use crate::Mesh;

/// A triangle of the mesh, and its corners in the order in which they are stored: rotated, so that the
/// orientation stays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placed {
    pub triangle: u32,
    pub corners: [u32; 3],
}

/// A way to store one of a leaf's triangles.
#[derive(Clone, Copy)]
struct Choice {
    placed: Placed,
    openness: f64,
    /// The triangle's bit among the leaf's.
    bit: u32,
}

/// Orders a leaf's triangles by fans, the first of which may continue the last triangle before.
pub(crate) fn arrange(mesh: &Mesh, leaf: &[u32], before: Option<Placed>) -> Vec<Placed> {
    let choices: Vec<Choice> =
        leaf.iter().zip(0..).flat_map(|(&t, i)| rotations(mesh, t, 1 << i)).collect();
    let mut left: u32 = (1 << leaf.len()) - 1;
    let mut placed = Vec::with_capacity(leaf.len());
    let mut last = before;
    while left != 0 {
        let next = last.and_then(|last| continuation(&choices, left, last));
        let next = next.unwrap_or_else(|| start(&choices, left));
        left &= !next.bit;
        placed.push(next.placed);
        last = Some(next.placed);
    }
    placed
}

/// The triangle that continues the fan of `last`.
fn continuation(choices: &[Choice], left: u32, last: Placed) -> Option<Choice> {
    let [a, _, c] = last.corners;
    let continues = |choice: &&Choice| {
        left & choice.bit != 0 && choice.placed.corners[0] == a && choice.placed.corners[1] == c
    };
    choices.iter().find(continues).copied()
}

/// The triangle and corner from which the longest fan starts.
fn start(choices: &[Choice], left: u32) -> Choice {
    let length = |first: &Choice| {
        let (mut left, mut last, mut length) = (left & !first.bit, *first, 0);
        while let Some(next) = continuation(choices, left, last.placed) {
            (left, last, length) = (left & !next.bit, next, length + 1);
        }
        length
    };
    let possible = choices.iter().filter(|choice| left & choice.bit != 0);
    let best = possible
        .map(|choice| (length(choice), *choice))
        // Of equally long fans the one at the best corner, then the first.
        .reduce(|a, b| if (b.0, b.1.openness) > (a.0, a.1.openness) { b } else { a });
    best.map_or(choices[0], |(_, choice)| choice)
}

/// The ways to store a triangle: those whose first corner is neither too pointed nor too flat to measure
/// the stretch from.
fn rotations(mesh: &Mesh, triangle: u32, bit: u32) -> impl Iterator<Item = Choice> {
    let [a, b, c] = mesh.triangles[triangle as usize];
    let all = [[a, b, c], [b, c, a], [c, a, b]].map(|corners| {
        let [a, b, c] = corners.map(|v| mesh.positions[v as usize].as_dvec3());
        let placed = Placed { triangle, corners };
        Choice { placed, openness: openness(b - a, c - a), bit }
    });
    let best = all.iter().map(|choice| choice.openness).fold(0.0, f64::max);
    all.into_iter().filter(move |choice| choice.openness >= OPEN.min(best))
}

/// Openness of a corner that is good enough: 18 degrees.
const OPEN: f64 = 0.05;

/// `1 - |cos|` of the angle between two edges, without its cancellation: the check's rounding grows with its
/// inverse.
pub(crate) fn openness(e1: DVec3, e2: DVec3) -> f64 {
    let lengths = e1.length() * e2.length();
    let sine = e1.cross(e2).length() / lengths;
    let openness = sine * sine / (1.0 + (e1.dot(e2) / lengths).abs());
    // An edge without length has no angle.
    if openness.is_nan() { 0.0 } else { openness }
}
