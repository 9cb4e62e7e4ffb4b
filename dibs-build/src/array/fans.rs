//! The order of a leaf's triangles and of their corners: fans, for the controller's stretch check.
//!
//! A triangle whose first two corners are the first and the third of the one before shares an edge
//! with it, and the controller has two of its corners and one of its edges at hand.
//!
//! The corners of the leaf's first triangle and the third ones of the others are all of its vertices:
//! a query looks at no others to reject the leaf.

use glam::DVec3;

use crate::Mesh;
use crate::stretch::fattened;

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
    /// Whether the first corner is neither too pointed nor too flat to measure the stretch from, or at
    /// least the triangle's best.
    is_fit: bool,
    /// Whether it is so pointed that the stretch measured from it is off by a thousandth, and not the best.
    is_misfit: bool,
    /// The triangle's bit among the leaf's.
    bit: u32,
}

/// Orders a leaf's triangles by fans, the first of which may continue the last triangle before.
///
/// Where that leaves a triangle at a corner too pointed to measure from, the leaf starts at whichever
/// triangle leaves the fewest.
pub(crate) fn arrange(mesh: &Mesh, leaf: &[u32], before: Option<Placed>) -> Vec<Placed> {
    best_order(mesh, leaf, before).0
}

/// The triangles of a leaf that even its best order stores at far too pointed a corner, though they have a
/// better one: alone in a leaf, they are stored at that.
pub(crate) fn misfits(mesh: &Mesh, leaf: &[u32]) -> Vec<u32> {
    let (_, unfit) = best_order(mesh, leaf, None);
    unfit.iter().filter(|choice| choice.is_misfit).map(|choice| choice.placed.triangle).collect()
}

/// The best order, and what it stores at a bad corner.
fn best_order(mesh: &Mesh, leaf: &[u32], before: Option<Placed>) -> (Vec<Placed>, Vec<Choice>) {
    let choices: Vec<Choice> =
        leaf.iter().zip(0..).flat_map(|(&t, i)| rotations(mesh, t, 1 << i)).collect();
    let all: u32 = (1 << leaf.len()) - 1;
    let first = before.and_then(|last| continuation(&choices, all, last));
    let Some(first) = first.or_else(|| start(&choices, all, &[])) else {
        return Default::default();
    };
    let greedy = arrange_from(&choices, all, first);
    if greedy.1.is_empty() {
        return greedy;
    }
    let starts = choices.iter().filter(|choice| choice.is_fit);
    let others = starts.map(|&first| arrange_from(&choices, all, first));
    // Of equally good ones the first.
    let orders = std::iter::once(greedy).chain(others);
    let misfits = |unfit: &[Choice]| unfit.iter().filter(|choice| choice.is_misfit).count();
    orders.min_by_key(|(_, unfit)| (misfits(unfit), unfit.len())).unwrap_or_default()
}

/// The order from this start, and which triangles it stores at a bad corner.
fn arrange_from(choices: &[Choice], all: u32, first: Choice) -> (Vec<Placed>, Vec<Choice>) {
    let mut left = all & !first.bit;
    let mut placed = vec![first.placed];
    let (mut last, mut unfit) = (first, Vec::new());
    if !first.is_fit {
        unfit.push(first);
    }
    while left != 0 {
        let next = continuation(choices, left, last.placed);
        let Some(next) = next.or_else(|| start(choices, left, &placed)) else { break };
        left &= !next.bit;
        placed.push(next.placed);
        if !next.is_fit {
            unfit.push(next);
        }
        last = next;
    }
    (placed, unfit)
}

/// The triangle that continues the fan of `last`.
fn continuation(choices: &[Choice], left: u32, last: Placed) -> Option<Choice> {
    let [a, _, c] = last.corners;
    let continues = |choice: &&Choice| {
        let [first, second, _] = choice.placed.corners;
        left & choice.bit != 0 && choice.is_fit && first == a && second == c
    };
    choices.iter().find(continues).copied()
}

/// The triangle and corner from which the longest fan starts. Only its third corner may be new to the
/// leaf, unless it is the first: since a leaf hangs together by edges, there is one.
fn start(choices: &[Choice], left: u32, placed: &[Placed]) -> Option<Choice> {
    let is_known = |v: u32| placed.is_empty() || placed.iter().any(|p| p.corners.contains(&v));
    let possible = |choice: &&Choice| {
        let [first, second, _] = choice.placed.corners;
        left & choice.bit != 0 && is_known(first) && is_known(second)
    };
    let length = |first: &Choice| {
        let (mut left, mut last, mut length) = (left & !first.bit, *first, 0);
        while let Some(next) = continuation(choices, left, last.placed) {
            (left, last, length) = (left & !next.bit, next, length + 1);
        }
        length
    };
    // Of equally long fans the one at the best corner, then the first.
    let key = |choice: &Choice| (choice.is_fit, length(choice), choice.openness);
    let mut possible = choices.iter().filter(possible);
    let first = possible.next()?;
    let mut best = (first, key(first));
    for choice in possible {
        let key = key(choice);
        if key > best.1 {
            best = (choice, key);
        }
    }
    Some(*best.0)
}

/// The ways to store a triangle.
fn rotations(mesh: &Mesh, triangle: u32, bit: u32) -> [Choice; 3] {
    let [a, b, c] = mesh.triangles[triangle as usize];
    let all = [[a, b, c], [b, c, a], [c, a, b]].map(|corners| {
        let [a, b, c] = fattened(corners.map(|v| mesh.positions[v as usize].as_dvec3()));
        let placed = Placed { triangle, corners };
        Choice { placed, openness: openness(b - a, c - a), is_fit: false, is_misfit: false, bit }
    });
    let best = all.iter().map(|choice| choice.openness).fold(0.0, f64::max);
    all.map(|choice| Choice {
        is_fit: choice.openness >= OPEN.min(best),
        is_misfit: choice.openness < POINTED.min(best),
        ..choice
    })
}

/// Openness of a corner that is good enough: 18 degrees.
const OPEN: f64 = 0.05;

/// Openness of a corner that is far too pointed: 3 degrees.
const POINTED: f64 = 0.0014;

/// `1 - |cos|` of the angle between two edges, without its cancellation: the check's rounding grows with its
/// inverse.
pub(crate) fn openness(e1: DVec3, e2: DVec3) -> f64 {
    let lengths = e1.length() * e2.length();
    let sine = e1.cross(e2).length() / lengths;
    let openness = sine * sine / (1.0 + (e1.dot(e2) / lengths).abs());
    // An edge without length has no angle.
    if openness.is_nan() { 0.0 } else { openness }
}
