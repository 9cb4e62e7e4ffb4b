//! The side of a point from the triangles that tie for the closest.
//!
//! The triangles are compared by their distances. The closest feature (face, edge or vertex) of each triangle that may
//! be the closest decides a side. The side is certain if all of them agree.
//!
//! # The side at a feature
//! Seen from the closest point, the surface is a cone; the point is on the side of the cone's element at the least
//! angle to it.
//! - *Face*: the triangle.
//! - *Edge*: all its triangles are at 90 degrees or more to the point. So the least angle is that of the triangle whose
//!   plane has the largest sine to the point.
//! - *Vertex*: its edges are at 90 degrees or more, and the angle to a plane has no minimum beyond that. So the least
//!   angle is that of an edge, and the rule of the edge applies.
//!
//! A point on an edge next to a vertex may be classified as the vertex: then the edge's angle is 90 degrees, and no
//! other edge's is clearly less. A point in a face has sine 1 to it, and the edge has the face's side.

// Requirement: S-01

use super::NoSide;
use super::normal::{Feature, NORMAL, turned};
use super::precision::Precision;
use super::side::AxisPlace;
use crate::math::sqrt::sqrt;
use crate::tree::{MAX_RING, after};
use crate::unavailable::QueryError;
use crate::{Index, Tree, VertexTable};

/// Whether the point is above, or why that is not certain.
pub(super) type SideOfPlane = Result<bool, NoSide>;

/// The point, and the closest triangles so far.
pub(super) struct Exact<'s, 't, I, V: ?Sized, P: Precision> {
    tree: &'s Tree<'t, I>,
    vertices: &'s V,
    at: &'s AxisPlace,
    start: P::Vector,
    along: P::Vector,
    /// Square of the least distance, and its error.
    least: P,
    doubt: P,
    above: SideOfPlane,
    /// The last vertex, by the least row of a triangle around it, and its answer.
    vertex: Option<(u32, u32, SideOfPlane)>,
    /// Node tests left, and made.
    left: u32,
    pub work: u32,
}

/// A triangle as seen from the point.
#[derive(Clone, Copy)]
struct TriangleView<P: Precision> {
    /// The vectors from the point to the corners.
    to: [P::Vector; 3],
    /// Edge `e` leads from corner `e` to the next one.
    edges: [P::Vector; 3],
    normal: P::Vector,
    square: P,
    /// Height of the point above the plane, times the normal's length; and its error.
    height: P,
    doubt: P,
    /// The edges span no plane at this precision.
    is_flat: bool,
    /// The size of the terms that are added to give `to`.
    far: P,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, P: Precision> Exact<'s, 't, I, V, P> {
    /// For a point, with at most `left` node tests.
    pub fn new(tree: &'s Tree<'t, I>, vertices: &'s V, at: &'s AxisPlace, left: u32) -> Self {
        Self {
            tree,
            vertices,
            at,
            start: P::vector(at.start),
            along: P::vector(at.span) * P::from(at.parameter),
            least: P::from(f32::INFINITY),
            doubt: P::from(0.0),
            above: Err(NoSide::BelowAccuracy),
            vertex: None,
            left,
            work: 0,
        }
    }

    /// The same in f64, with the remaining node tests.
    pub fn finer(&self) -> Exact<'s, 't, I, V, f64> {
        Exact::new(self.tree, self.vertices, self.at, self.left)
    }

    /// Whether the point is above the closest of the triangles.
    pub fn of(&mut self, rows: impl Iterator<Item = u32>) -> Result<SideOfPlane, QueryError> {
        for row in rows {
            if !self.add(row)? {
                break;
            }
        }
        Ok(self.above)
    }

    /// Whether the point is above the closest of the triangles added.
    pub const fn answer(&self) -> SideOfPlane {
        self.above
    }

    fn spend(&mut self, tests: u32) -> bool {
        let is_enough = tests <= self.left;
        if is_enough {
            self.left -= tests;
            self.work = self.work.saturating_add(tests);
        }
        is_enough
    }

    /// Adds a triangle. Returns `false` if the side can no longer become certain.
    #[cold]
    #[inline(never)]
    pub fn add(&mut self, row: u32) -> Result<bool, QueryError> {
        if !self.spend(P::DISTANCE_COST) {
            self.above = Err(NoSide::CutShort);
            return Ok(false);
        }
        let seen = self.see(row)?;
        let (square, feature) = seen.closest();
        if (seen.is_flat && P::IS_ROUGH) || square.is_not_a_number() {
            self.above = Err(NoSide::BelowAccuracy);
            return Ok(false);
        }
        let tilt = if feature == Feature::Face { seen.tilt() } else { P::from(1.0) };
        let doubt = P::from(8.0) * P::ROUNDING * (square * tilt + seen.far * square.root());
        if !(square - doubt <= self.least + self.doubt) {
            return Ok(true);
        }
        let above = self.above(row, feature, &seen)?;
        if square + doubt < self.least - self.doubt {
            self.above = above;
        } else if self.above != above {
            let reason = |above: SideOfPlane| above.err().unwrap_or(NoSide::BelowAccuracy);
            let (one, other) = (reason(self.above), reason(above));
            self.above = Err(if one == NoSide::BelowAccuracy { other } else { one });
        }
        if square < self.least {
            self.least = square;
        }
        if doubt > self.doubt {
            self.doubt = doubt;
        }
        Ok(true)
    }

    /// Whether the point is above a triangle's plane, where that is certain.
    #[inline(always)]
    pub fn is_above_plane(&self, row: u32) -> Result<Option<bool>, QueryError> {
        Ok(self.see(row)?.is_above())
    }

    #[inline(always)] // A tick needs only the planes.
    fn see(&self, row: u32) -> Result<TriangleView<P>, QueryError> {
        let corrupt = QueryError::Corrupt { row };
        let [a, b, c] = self.tree.triangle(row).ok_or(corrupt)?;
        let position = |row| self.vertices.position(row).map(P::vector).ok_or(corrupt);
        let corners = [position(a)?, position(b)?, position(c)?];
        Ok(TriangleView::new(corners, self.start, self.along))
    }

    /// Whether the point is above a triangle's feature.
    fn above(
        &mut self,
        row: u32,
        feature: Feature,
        seen: &TriangleView<P>,
    ) -> Result<SideOfPlane, QueryError> {
        match feature {
            Feature::Face => Ok(seen.is_above().ok_or(NoSide::BelowAccuracy)),
            Feature::Edge(edge) => {
                let Some((other, _)) = self.tree.across(row, edge) else {
                    return Ok(Err(NoSide::OpenBoundary));
                };
                if !self.spend(P::RING_COST) {
                    return Ok(Err(NoSide::CutShort));
                }
                Ok(seen.above_edge(&self.see(other)?))
            }
            Feature::Vertex(corner) => {
                let around = match self.first_around(row, corner) {
                    Ok(around) => around,
                    Err(reason) => return Ok(Err(reason)),
                };
                let vertex = self.tree.triangle(row).map(|rows| turned(rows, corner)[0]);
                let vertex = vertex.ok_or(QueryError::Corrupt { row })?;
                match self.vertex {
                    Some((same, first, above)) if same == vertex && first == around => Ok(above),
                    _ => {
                        let above = self.above_vertex(row, corner, seen)?;
                        let above = self.unless_cut(above, row, corner, vertex);
                        self.vertex = Some((vertex, around, above));
                        Ok(above)
                    }
                }
            }
        }
    }

    /// Around a vertex whose triangles intersect each other, the angle-weighted pseudonormal (f32, where it is clear)
    /// may disagree with the nearest triangle. Then no side is certain.
    fn unless_cut(&self, above: SideOfPlane, row: u32, corner: u32, vertex: u32) -> SideOfPlane {
        let Some(centre) = self.vertices.position(vertex) else { return above };
        let towards = (self.at.start - centre) + self.at.span * self.at.parameter;
        let normal = Feature::Vertex(corner).pseudonormal(self.tree, self.vertices, row);
        let Ok(normal) = normal else { return above };
        let height = towards.dot(normal.vector);
        let is_clear = height.abs() > NORMAL * normal.weight * sqrt(towards.length_squared());
        match above {
            Ok(is_above) if is_clear && is_above != (height > 0.0) => Err(NoSide::BelowAccuracy),
            _ => above,
        }
    }

    fn first_around(&self, row: u32, corner: u32) -> Result<u32, NoSide> {
        let (mut first, mut at, mut corner) = (row, row, corner);
        for _ in 0..MAX_RING {
            (at, corner) = self.tree.next_around(at, corner).ok_or(NoSide::OpenBoundary)?;
            if at == row {
                return Ok(first);
            }
            if at < first {
                first = at;
            }
        }
        Err(NoSide::Degenerate)
    }

    /// Whether the point is above a vertex: by the edge that makes the least angle with it.
    fn above_vertex(
        &mut self,
        first: u32,
        mut corner: u32,
        seen: &TriangleView<P>,
    ) -> Result<SideOfPlane, QueryError> {
        let (mut row, mut seen) = (first, *seen);
        // The square of the cosine, with its sign, times the square of the distance.
        let mut largest = P::from(f32::NEG_INFINITY);
        let mut above = Err(NoSide::Degenerate);
        for _ in 0..MAX_RING {
            let Some((next, next_corner)) = self.tree.next_around(row, corner) else {
                return Ok(Err(NoSide::OpenBoundary));
            };
            if !self.spend(P::RING_COST) {
                return Ok(Err(NoSide::CutShort));
            }
            let other = self.see(next)?;
            let [edge, ..] = turned(seen.edges, corner);
            let [to_centre, ..] = turned(seen.to, corner);
            let cosine = -P::dot(to_centre, edge);
            let cosine = cosine / P::dot(edge, edge) * cosine.absolute();
            if cosine.is_not_a_number() {
                return Ok(Err(NoSide::Degenerate));
            }
            let size = P::size(to_centre);
            // The coordinates of the difference are no larger than `size` and the axis.
            let far = P::from(2.0) * (size + P::size(self.along));
            let doubt = P::from(8.0) * P::ROUNDING * size * far;
            if cosine > largest + doubt {
                above = seen.above_edge(&other);
            } else if cosine >= largest - doubt {
                let this = seen.above_edge(&other);
                above = if above == this { above } else { Err(NoSide::BelowAccuracy) };
            }
            if cosine > largest {
                largest = cosine;
            }
            if next == first {
                return Ok(above);
            }
            (row, corner, seen) = (next, next_corner, other);
        }
        Ok(Err(NoSide::Degenerate))
    }
}

impl<P: Precision> TriangleView<P> {
    #[inline(always)]
    fn new(corners: [P::Vector; 3], start: P::Vector, along: P::Vector) -> Self {
        let [a, b, c] = corners;
        let to = [a, b, c].map(|corner| (corner - start) - along);
        let edges = [b - a, c - b, a - c];
        let ([to_a, ..], [ab, _, ca]) = (to, edges);
        let normal = P::cross(ca, ab);
        let square = P::dot(normal, normal);
        let limit = P::FLAT * P::dot(ab, ab) * P::dot(ca, ca);
        let far = P::size(a - start) + P::size(along);
        let terms = P::size(ab) * P::size(ca) * P::size(to_a) + P::size(normal) * far;
        let is_told = far + P::size(ab) + P::size(ca) < P::MOST;
        Self {
            to,
            edges,
            normal,
            square,
            height: -P::dot(normal, to_a),
            doubt: P::from(4.0) * P::ROUNDING * terms,
            is_flat: !(square > limit && square > P::TINY && is_told),
            far,
        }
    }

    /// The square of the distance, and the closest feature. Of a flat triangle only the edges count.
    fn closest(&self) -> (P, Feature) {
        let (mut least, mut closest) = (P::from(f32::INFINITY), Feature::Face);
        let zero = P::from(0.0);
        let mut is_over = !self.is_flat;
        let ([a, b, c], [ab, bc, ca]) = (self.to, self.edges);
        for (edge, along, from, to) in [(0, ab, a, b), (1, bc, b, c), (2, ca, c, a)] {
            let across = P::cross(from, along);
            if !self.is_flat && P::dot(self.normal, across) > zero {
                continue;
            }
            is_over = false;
            let (whole, part) = (P::dot(along, along), -P::dot(from, along));
            let (square, feature) = if !(part > zero) {
                (P::dot(from, from), Feature::Vertex(edge))
            } else if part >= whole {
                (P::dot(to, to), Feature::Vertex(after(edge)))
            } else {
                (P::dot(across * (P::from(1.0) / whole), across), Feature::Edge(edge))
            };
            if square < least {
                (least, closest) = (square, feature);
            }
        }
        if is_over {
            (self.height / self.square * self.height, Feature::Face)
        } else {
            (least, closest)
        }
    }

    const fn reason(&self) -> NoSide {
        if self.is_flat { NoSide::Degenerate } else { NoSide::BelowAccuracy }
    }

    /// The tilt of the plane by rounding.
    fn tilt(&self) -> P {
        let [ab, _, ca] = self.edges;
        (P::dot(ab, ab) / self.square * P::dot(ca, ca)).root()
    }

    /// Whether the point is above the plane. The error covers flat triangles, too.
    #[inline(always)]
    fn is_above(&self) -> Option<bool> {
        let is_clear = self.height.absolute() > self.doubt;
        is_clear.then_some(self.height > P::from(0.0))
    }

    /// Whether the point's sine to this plane is certainly larger than to `other`'s, despite rounding.
    fn has_larger_sine_than(&self, other: &Self) -> bool {
        let least = self.height.absolute() - self.doubt;
        let most = other.height.absolute() + other.doubt;
        let (least, most) = (least / self.square * least, most / other.square * most);
        let are_clear = !self.is_flat && !other.is_flat && self.is_above().is_some();
        are_clear && least > P::SINES * most
    }

    /// Whether the point is above the edge between this triangle and `other`.
    fn above_edge(&self, other: &Self) -> SideOfPlane {
        let (one, two) = (self.is_above(), other.is_above());
        if let Some(above) = one
            && (one == two || self.has_larger_sine_than(other))
        {
            Ok(above)
        } else if let Some(above) = two
            && other.has_larger_sine_than(self)
        {
            Ok(above)
        } else {
            Err(if self.is_flat { self.reason() } else { other.reason() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_f64_tells_the_plane_of_a_triangle_whose_area_squared_leaves_f32() {
        fn seen<P: Precision>(size: f32) -> TriangleView<P> {
            let corners = [[1.0, 1.0, 1.0], [-2.0, 1.0, 1.0], [1.0, -2.0, 1.0]];
            let corners = corners.map(|at| P::vector(glam::Vec3::from(at) * size));
            TriangleView::new(corners, P::vector(glam::Vec3::ZERO), P::vector(glam::Vec3::ZERO))
        }
        for (size, is_told) in [(1e-14, false), (1.0, true), (1e8, true), (1e10, false)] {
            let (rough, fine) = (seen::<f32>(size), seen::<f64>(size));
            assert!(rough.is_flat != is_told && !fine.is_flat, "{size:e}");
            let (square, feature) = fine.closest();
            let square = square / f64::from(size) / f64::from(size);
            assert!((square - 1.0).abs() < 1e-6 && feature == Feature::Face, "{size:e}");
        }
    }
}
