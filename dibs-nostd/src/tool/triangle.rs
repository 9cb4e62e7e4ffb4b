//! The closest pair between a triangle and a point or segment, in f32, for any shape of triangle.
//!
//! # Method
//! Call the *foot* the axis' point nearest to the triangle's plane: an end, or where the axis crosses the plane. If the
//! foot projects into the triangle, that projection is the answer. Otherwise the answer is on an edge for which the
//! projection is on the outer side. (Proof: at the optimum the separation `d` has an in-plane part in the normal cone
//! of the triangle's boundary there, and moving back along the axis to the foot, towards the plane, can only go further
//! out along that part, because `d` is perpendicular to the axis or the optimum is an end.) So most triangles cost one
//! projection and one or two edges.
//!
//! A search rejects most triangles by a plane before this test.
//!
//! # Why the error is bounded, whatever the shape
//! Everything is computed relative to the axis' start, so that all numbers are rounded relative to
//! the size `S` of the problem (see [`super`]), by `u = 2^-24`. Each candidate is a pair of points,
//! one on the axis and one on the triangle, whose distance is then evaluated from their difference:
//! a candidate is never below the true distance by more than that evaluation's rounding, a few `u S`.
//! It remains that one candidate is near the optimum.
//! - *Projections* are successive: along an edge (or the axis) first, then along the part of the other
//!   vector that is perpendicular to it. Their in-plane error is a few `u S` plus `D t`, where `D` is the
//!   distance from the plane and `t` the error of the perpendicular part's direction, at most `c u / a`
//!   for an angle with sine `a` and `c` about 6. An in-plane error costs second order: `D t^2 / 2`.
//! - *Clear* cases, with sines above 2^-8 and axes inclined by more than 2^-12 to the plane, make that
//!   less than `u S / 16`, and the foot is the right one or lies within a few `u S` of it where it matters:
//!   an error of the plane's tilt is levered by the distance from the triangle, which is zero on it.
//!   A pierced triangle is then pierced up to a few `u S`, and its distance reported as 0.
//! - *Slivers* (and axes nearly parallel to the plane or to an edge) get all candidates: the face's and
//!   all the edges'. A point of a sliver is within `S a` of an edge, so the edges' error is at most
//!   `(S a)^2 / 2 D`, the face's at most `D (c u / a)^2 / 2`, and the smaller of the two at most the
//!   geometric mean, `c u S / 2`, for every `a`.

// Requirement: A-01

use super::capsule::Axis;
use super::edge::{edge_to_point, edge_to_segment};
use super::{AxisPair, clamp};
use crate::math::order::larger;
use glam::Vec3;

/// Square of the sine below which two directions count as nearly parallel: 2^-16.
pub(crate) const SLIVER: f32 = 1.0 / 65_536.0;
/// Square of the sine below which the axis counts as parallel to the plane: 2^-24.
const PARALLEL: f32 = 1.0 / 16_777_216.0;
/// Squared lengths below this are not used as divisors: 2^-100, the square of 1e-15.
pub(super) const TINY: f32 = 7.888_609e-31;
/// Squared lengths below this give no clear plane, because products of four of them underflow: 2^-40, the square of
/// 1e-6.
const SMALL: f32 = 9.094_947e-13;

/// The closest pair between a point and a triangle, if closer than the limit.
#[inline(never)]
pub(super) fn closest_to_point(
    point: Vec3,
    corners: &[Vec3; 3],
    limit_squared: f32,
) -> Option<AxisPair> {
    let [a, b, c] = *corners;
    let (to_a, ab, ac) = (a - point, b - a, c - a);
    let plane = Plane::new(ab, ac);
    if !plane.is_clear() {
        return closest_of_all(&Axis::point(point), corners, limit_squared);
    }
    let foot = plane.project(to_a, ab);
    // No point of the plane is closer than the foot's projection.
    if foot.distance_squared > limit_squared {
        return None;
    }
    let mut best = Candidate::none(limit_squared);
    if foot.edges.is_empty() {
        best.improve(foot.candidate(0.0));
    }
    if foot.edges.contains(Edges::AB) {
        best.improve(edge_to_point(to_a, ab, 0.0).on_ab());
    }
    if foot.edges.contains(Edges::AC) {
        best.improve(edge_to_point(to_a, ac, 0.0).on_ac());
    }
    if foot.edges.contains(Edges::BC) {
        best.improve(edge_to_point(b - point, c - b, 0.0).on_bc());
    }
    best.below(limit_squared)?;
    Some(best.pair(a, ab, ac, point, 0.0))
}

/// The closest pair between a segment and a triangle, if closer than the limit.
#[inline(never)]
pub(super) fn closest_to_segment(
    axis: &Axis,
    corners: &[Vec3; 3],
    limit_squared: f32,
) -> Option<AxisPair> {
    let [a, b, c] = *corners;
    let (to_a, ab, ac) = (a - axis.start, b - a, c - a);
    let plane = Plane::new(ab, ac);
    let normal = plane.normal(ab);
    let (height, slope) = (-normal.dot(to_a), normal.dot(axis.direction));
    let inclined = slope * slope > PARALLEL * normal.dot(normal);
    if !(plane.is_clear() && inclined) {
        return closest_of_all(axis, corners, limit_squared);
    }
    let crossing = -height / slope;
    let foot = clamp(crossing, axis.length);
    let crosses = crossing > 0.0 && crossing < axis.length;
    if !crosses {
        let height = height + foot * slope;
        if height * (plane.ab_inverse * plane.rise_inverse) * height > limit_squared {
            return None;
        }
    }
    let projection = plane.project(to_a - foot * axis.direction, ab);
    let mut best = Candidate::none(limit_squared);
    if projection.edges.is_empty() {
        let mut candidate = projection.candidate(foot);
        if crosses {
            candidate.distance_squared = 0.0;
        }
        best.improve(candidate);
    }
    if projection.edges.contains(Edges::AB) {
        best.improve(edge_to_segment(axis, to_a, ab).on_ab());
    }
    if projection.edges.contains(Edges::AC) {
        best.improve(edge_to_segment(axis, to_a, ac).on_ac());
    }
    if projection.edges.contains(Edges::BC) {
        best.improve(edge_to_segment(axis, b - axis.start, c - b).on_bc());
    }
    best.below(limit_squared)?;
    Some(best.pair_on(axis, a, ab, ac))
}

/// The closest pair by trying every candidate: for triangles and axes that are not clear cases.
#[cold]
#[inline(never)]
fn closest_of_all(axis: &Axis, corners: &[Vec3; 3], limit_squared: f32) -> Option<AxisPair> {
    let [a, b, c] = *corners;
    let (to_a, ab, ac) = (a - axis.start, b - a, c - a);
    let plane = Plane::new(ab, ac);
    // Written so that NaN returns too.
    let finite = to_a.dot(to_a) + plane.ab_squared + plane.ac_squared <= f32::MAX;
    if !finite {
        return None;
    }
    let mut best = Candidate::none(limit_squared);
    if plane.exists() {
        let normal = plane.normal(ab);
        let crossing = normal.dot(to_a) / normal.dot(axis.direction);
        for foot in [0.0, clamp(crossing, axis.length), axis.length] {
            let projection = plane.project(to_a - foot * axis.direction, ab);
            if projection.edges.is_empty() {
                best.improve(projection.candidate(foot));
            }
        }
    }
    best.improve(edge_to_segment(axis, to_a, ab).on_ab());
    best.improve(edge_to_segment(axis, to_a, ac).on_ac());
    best.improve(edge_to_segment(axis, b - axis.start, c - b).on_bc());
    best.below(limit_squared)?;
    Some(best.pair_on(axis, a, ab, ac))
}

/// A pair found so far: the length along the axis, and the weights of the second and third corner.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    pub distance_squared: f32,
    pub along: f32,
    pub v: f32,
    pub w: f32,
}

impl Candidate {
    /// The limit as a pair: any pair below it is an improvement.
    #[inline(always)]
    fn none(limit_squared: f32) -> Self {
        Self { distance_squared: limit_squared, along: 0.0, v: 0.0, w: 0.0 }
    }

    /// Takes `other` if it is strictly closer; never if it is NaN.
    #[inline(always)]
    fn improve(&mut self, other: Self) {
        if other.distance_squared < self.distance_squared {
            *self = other;
        }
    }

    /// `None` unless some pair was below the limit.
    #[inline(always)]
    fn below(&self, limit_squared: f32) -> Option<()> {
        (self.distance_squared < limit_squared).then_some(())
    }

    #[inline(always)]
    fn pair_on(&self, axis: &Axis, a: Vec3, ab: Vec3, ac: Vec3) -> AxisPair {
        let on_axis = axis.start + self.along * axis.direction;
        let parameter = if axis.length > 0.0 { self.along / axis.length } else { 0.0 };
        self.pair(a, ab, ac, on_axis, parameter)
    }

    #[inline(always)]
    fn pair(&self, a: Vec3, ab: Vec3, ac: Vec3, on_axis: Vec3, axis_parameter: f32) -> AxisPair {
        let rest = 1.0 - self.v - self.w;
        AxisPair {
            distance_squared: self.distance_squared,
            on_axis,
            axis_parameter,
            on_surface: a + self.v * ab + self.w * ac,
            barycentric: [larger(rest, 0.0), self.v, self.w],
        }
    }
}

#[derive(Clone, Copy)]
struct Edges(u32);

impl Edges {
    const AB: u32 = 1;
    const AC: u32 = 2;
    const BC: u32 = 4;

    #[inline(always)]
    fn contains(self, edge: u32) -> bool {
        self.0 & edge != 0
    }

    #[inline(always)]
    fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// A triangle's plane, spanned by the edge `ab` and the height `rise` on it through the third corner.
struct Plane {
    ab_squared: f32,
    ac_squared: f32,
    rise_squared: f32,
    ab_inverse: f32,
    rise_inverse: f32,
    rise: Vec3,
    /// The foot of the height, in units of `ab`.
    skew: f32,
}

/// A point projected into the plane.
struct Projection {
    distance_squared: f32,
    v: f32,
    w: f32,
    /// The edges for which it is on the outer side.
    edges: Edges,
}

impl Plane {
    #[inline(always)]
    fn new(ab: Vec3, ac: Vec3) -> Self {
        let ab_squared = ab.dot(ab);
        let ab_inverse = 1.0 / ab_squared;
        let skew = ab.dot(ac) * ab_inverse;
        let rise = ac - skew * ab;
        let rise_squared = rise.dot(rise);
        Self {
            ab_squared,
            ac_squared: ac.dot(ac),
            rise_squared,
            ab_inverse,
            rise_inverse: 1.0 / rise_squared,
            rise,
            skew,
        }
    }

    /// Whether the plane's tilt is certain enough to select the edges. False for NaN.
    #[inline(always)]
    fn is_clear(&self) -> bool {
        self.rise_squared > SLIVER * self.ac_squared
            && self.rise_squared > SMALL
            && self.ab_squared > SMALL
    }

    /// Whether there is a plane to project onto, however uncertain its tilt.
    #[inline(always)]
    fn exists(&self) -> bool {
        self.ab_squared > TINY && self.rise_squared > TINY
    }

    /// A vector perpendicular to the plane, `|ab|` times `|rise|` long.
    ///
    /// Not `ab.cross(ac)`: in a sliver, rounding would also tilt that along `ab`, magnified by its length.
    #[inline(always)]
    fn normal(&self, ab: Vec3) -> Vec3 {
        ab.cross(self.rise)
    }

    /// Projects the point from which `to_a` leads to the first corner.
    #[inline(always)]
    fn project(&self, to_a: Vec3, ab: Vec3) -> Projection {
        let x = -to_a.dot(ab) * self.ab_inverse;
        let across = to_a + x * ab;
        let w = -across.dot(self.rise) * self.rise_inverse;
        let v = x - w * self.skew;
        let apart = across + w * self.rise;
        let mut edges = 0;
        if w < 0.0 {
            edges |= Edges::AB;
        }
        if v < 0.0 {
            edges |= Edges::AC;
        }
        if 1.0 - v - w < 0.0 {
            edges |= Edges::BC;
        }
        Projection { distance_squared: apart.dot(apart), v, w, edges: Edges(edges) }
    }
}

impl Projection {
    #[inline(always)]
    fn candidate(&self, along: f32) -> Candidate {
        Candidate { distance_squared: self.distance_squared, along, v: self.v, w: self.w }
    }
}
