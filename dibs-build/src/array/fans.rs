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

/// Orders a leaf's triangles by fans, the first of which may continue the last triangle before.
pub(crate) fn arrange(mesh: &Mesh, leaf: &[u32], before: Option<Placed>) -> Vec<Placed> {
    let mut left = leaf.to_vec();
    let mut placed = Vec::with_capacity(leaf.len());
    let mut last = before;
    while !left.is_empty() {
        let next = last.and_then(|last| continuation(mesh, &left, last));
        let next = next.unwrap_or_else(|| start(mesh, &left));
        left.retain(|&t| t != next.triangle);
        placed.push(next);
        last = Some(next);
    }
    placed
}

/// The triangle that continues the fan of `last`.
fn continuation(mesh: &Mesh, left: &[u32], last: Placed) -> Option<Placed> {
    let [a, _, c] = last.corners;
    let candidates = left.iter().flat_map(|&t| rotations(mesh, t));
    candidates.into_iter().find(|p| p.corners[0] == a && p.corners[1] == c)
}

/// The triangle and corner from which the longest fan starts.
fn start(mesh: &Mesh, left: &[u32]) -> Placed {
    let candidates: Vec<Placed> = left.iter().flat_map(|&t| rotations(mesh, t)).collect();
    let length = |&first: &Placed| {
        let mut left: Vec<u32> = left.iter().copied().filter(|&t| t != first.triangle).collect();
        let mut last = first;
        let mut length = 0;
        while let Some(next) = continuation(mesh, &left, last) {
            left.retain(|&t| t != next.triangle);
            last = next;
            length += 1;
        }
        length
    };
    // Of equally long fans the one at the best corner, then the first.
    let key = |p: &Placed| (length(p), openness(mesh, p.corners));
    let better = |best: (Placed, (usize, f64)), p: Placed| {
        let key = key(&p);
        if key > best.1 { (p, key) } else { best }
    };
    let first = candidates[0];
    candidates.into_iter().fold((first, key(&first)), better).0
}

/// The ways to store a triangle: those whose first corner is neither too pointed nor too flat to measure
/// the stretch from.
fn rotations(mesh: &Mesh, triangle: u32) -> Vec<Placed> {
    let [a, b, c] = mesh.triangles[triangle as usize];
    let all = [[a, b, c], [b, c, a], [c, a, b]];
    let best = all.map(|corners| openness(mesh, corners)).into_iter().fold(0.0, f64::max);
    let is_fit = |corners: &[u32; 3]| openness(mesh, *corners) >= OPEN.min(best);
    all.into_iter().filter(is_fit).map(|corners| Placed { triangle, corners }).collect()
}

/// Openness of a corner that is good enough: 18 degrees.
const OPEN: f64 = 0.05;

/// `1 - |cos|` of the angle at the first corner: the check's rounding grows with its inverse.
pub(crate) fn openness(mesh: &Mesh, corners: [u32; 3]) -> f64 {
    let [a, b, c] = corners.map(|v| mesh.positions[v as usize].as_dvec3());
    openness_of(b - a, c - a)
}

/// The same for the two edges at the corner, without the cancellation.
pub(crate) fn openness_of(e1: DVec3, e2: DVec3) -> f64 {
    let lengths = e1.length() * e2.length();
    let sine = e1.cross(e2).length() / lengths;
    let openness = sine * sine / (1.0 + (e1.dot(e2) / lengths).abs());
    // An edge without length has no angle.
    if openness.is_nan() { 0.0 } else { openness }
}
