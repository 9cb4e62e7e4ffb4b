//! The closest pair between a triangle's edge and an axis.

use super::capsule::Axis;
use super::clamp;
use super::triangle::{Candidate, SLIVER, TINY};
use glam::Vec3;

/// A pair of an edge and an axis: the length along the axis, and the position on the edge (0 to 1).
#[derive(Clone, Copy)]
pub(super) struct EdgePair {
    pub distance_squared: f32,
    pub along: f32,
    pub x: f32,
}

impl EdgePair {
    #[inline(always)]
    pub fn on_ab(self) -> Candidate {
        self.candidate(self.x, 0.0)
    }

    #[inline(always)]
    pub fn on_ac(self) -> Candidate {
        self.candidate(0.0, self.x)
    }

    #[inline(always)]
    pub fn on_bc(self) -> Candidate {
        self.candidate(1.0 - self.x, self.x)
    }

    #[inline(always)]
    fn candidate(self, v: f32, w: f32) -> Candidate {
        Candidate { distance_squared: self.distance_squared, along: self.along, v, w }
    }
}

/// The closest pair between the edge from `corner` along `edge` and the origin, which is the axis' point at `along`.
#[inline(always)]
pub(super) fn edge_to_point(corner: Vec3, edge: Vec3, along: f32) -> EdgePair {
    let squared = edge.dot(edge);
    let x = if squared > TINY { clamp(-corner.dot(edge) / squared, 1.0) } else { 0.0 };
    let apart = corner + x * edge;
    EdgePair { distance_squared: apart.dot(apart), along, x }
}

/// The closest pair between the edge from `corner` (relative to the axis' start) along `edge`, and the
/// axis.
pub(super) fn edge_to_segment(axis: &Axis, corner: Vec3, edge: Vec3) -> EdgePair {
    let (corner_along, edge_along) = (corner.dot(axis.direction), edge.dot(axis.direction));
    let corner_across = corner - corner_along * axis.direction;
    let edge_across = edge - edge_along * axis.direction;
    let across_squared = edge_across.dot(edge_across);
    let x = if across_squared > TINY {
        clamp(-corner_across.dot(edge_across) / across_squared, 1.0)
    } else {
        0.0
    };
    let along = corner_along + x * edge_along;
    if across_squared > SLIVER * edge.dot(edge) {
        if along >= 0.0 && along <= axis.length {
            let apart = corner_across + x * edge_across;
            return EdgePair { distance_squared: apart.dot(apart), along, x };
        }
        let along = clamp(along, axis.length);
        return edge_to_point(corner - along * axis.direction, edge, along);
    }
    nearly_parallel(axis, corner, edge, along)
}

/// [`edge_to_segment`] for an edge whose direction across the axis, and so `along`, is lost in rounding; the ends are
/// then nearly as close.
///
/// No test shows that each candidate is needed: if the direction has an error of `u` times the edge, the distance along
/// the edge varies by as little. They are kept because the module's bound relies on them.
#[cold]
#[inline(never)]
fn nearly_parallel(axis: &Axis, corner: Vec3, edge: Vec3, along: f32) -> EdgePair {
    let (corner_along, edge_along) = (corner.dot(axis.direction), edge.dot(axis.direction));
    let from = |along: f32| {
        let along = clamp(along, axis.length);
        edge_to_point(corner - along * axis.direction, edge, along)
    };
    let mut best = from(along);
    for along in [corner_along, corner_along + edge_along, 0.0, axis.length] {
        let other = from(along);
        if other.distance_squared < best.distance_squared {
            best = other;
        }
    }
    best
}
