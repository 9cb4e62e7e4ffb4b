//! The side of a point in f64, where f32 cannot tell.
//!
//! The triangles of a tie are put in order by their distances in f64. Of those that are the closest, each has a feature
//! with the closest point, and the feature decides the side. The side is certain where all agree.
//!
//! # The side at a feature
//! Seen from the closest point, the surface is a cone, and the point is on the side of the cone's element that makes the
//! least angle with it.
//! - *Face*: the triangle.
//! - *Edge*: all its triangles make an angle of at least 90 degrees with the point. So the least angle is that of the
//!   triangle that sees the point at the largest sine.
//! - *Vertex*: its edges make angles of at least 90 degrees, and the angle to a plane has no minimum beyond that. So the
//!   least angle is that of an edge, and then the rule of the edge holds.
//!
//! A point on an edge that is nearly a vertex may be taken for the vertex: then the edge's angle is 90 degrees, and no
//! other's is clearly less. One in a face is at a sine of 1 from it, and the edge has the face's side.

use glam::{DVec3, Vec3};

use super::NoSide;
use super::normal::{Feature, MAX_RING, NORMAL, after, turned};
use crate::math::sqrt::sqrt;
use crate::unavailable::QueryError;
use crate::{Index, Tree, VertexTable};

/// Rounding of a few operations, relative to the size of their terms.
const ROUNDING: f64 = 1e-15;

/// Square of the sine below which two edges span no plane.
const FLAT: f64 = 1e-12;

/// More than the rounding of the square of a sine, if no triangle is flat.
const SINES: f64 = 1.0 + 1e-8;

/// Node tests that take as long as the distance to a triangle, where f64 is software.
const DISTANCE_COST: u32 = 24;

/// The same for a triangle around a vertex.
const RING_COST: u32 = 12;

/// Above or not, where that is certain.
pub(super) type Above = Result<bool, NoSide>;

/// A point whose side is asked for, and the closest triangles so far.
pub(super) struct Exact<'s, 't, I, V: ?Sized> {
    tree: &'s Tree<'t, I>,
    vertices: &'s V,
    start: DVec3,
    along: DVec3,
    /// Square of the least distance; its error.
    least: f64,
    doubt: f64,
    above: Above,
    /// The vertex asked for last, by the least row of a triangle around it, and its answer.
    vertex: Option<(u32, u32, Above)>,
    /// Node tests left, and made.
    left: u32,
    pub work: u32,
}

/// A triangle's plane as seen from the point.
#[derive(Clone, Copy)]
struct Facet {
    normal: DVec3,
    /// Square of the normal's length.
    square: f64,
    /// Height of the point above the plane, times the normal's length; its error, infinite for a flat triangle.
    height: f64,
    doubt: f64,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized> Exact<'s, 't, I, V> {
    /// For the point `start + along`, with no more node tests than `left`.
    pub fn new(
        tree: &'s Tree<'t, I>,
        vertices: &'s V,
        start: Vec3,
        along: DVec3,
        left: u32,
    ) -> Self {
        Self {
            tree,
            vertices,
            start: start.as_dvec3(),
            along,
            least: f64::INFINITY,
            doubt: 0.0,
            above: Err(NoSide::BelowAccuracy),
            vertex: None,
            left,
            work: 0,
        }
    }

    /// Whether the point is above the closest of the triangles.
    #[cold]
    #[inline(never)]
    pub fn of(&mut self, rows: impl Iterator<Item = u32>) -> Result<Above, QueryError> {
        for row in rows {
            if !self.add(row)? {
                break;
            }
        }
        Ok(self.above)
    }

    /// Whether the point is above the closest of the triangles added.
    pub const fn answer(&self) -> Above {
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

    /// Adds a triangle. Returns whether the tests left were enough.
    pub fn add(&mut self, row: u32) -> Result<bool, QueryError> {
        if !self.spend(DISTANCE_COST) {
            self.above = Err(NoSide::CutShort);
            return Ok(false);
        }
        let corners = self.corners(row)?;
        let facet = self.facet(&corners);
        let (square, feature) = self.closest(&corners, &facet);
        let tilt = if feature == Feature::Face { facet.tilt(&corners) } else { 1.0 };
        let size = (corners[0] - self.start).abs().element_sum() + self.along.abs().element_sum();
        let doubt = 8.0 * ROUNDING * (square * tilt + size * root(square));
        if !(square - doubt <= self.least + self.doubt) {
            return Ok(true);
        }
        let above = self.above(row, &corners, feature, &facet)?;
        if square + doubt < self.least - self.doubt {
            self.above = above;
        } else if self.above != above {
            let reason = |above: Above| above.err().unwrap_or(NoSide::BelowAccuracy);
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

    fn corners(&self, row: u32) -> Result<[DVec3; 3], QueryError> {
        let [a, b, c] = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
        let position = |row| {
            let position = self.vertices.position(row).ok_or(QueryError::Corrupt { row })?;
            Ok(position.as_dvec3())
        };
        Ok([position(a)?, position(b)?, position(c)?])
    }

    /// From the point to another one.
    fn to(&self, other: DVec3) -> DVec3 {
        (other - self.start) - self.along
    }

    fn facet(&self, &[a, b, c]: &[DVec3; 3]) -> Facet {
        let (ab, ac, to_a) = (b - a, c - a, self.to(a));
        let normal = ab.cross(ac);
        let square = normal.length_squared();
        let size = |v: DVec3| v.abs().element_sum();
        let far = size(a - self.start) + size(self.along);
        let is_clear = square > FLAT * ab.length_squared() * ac.length_squared();
        let doubt = 4.0 * ROUNDING * (size(ab) * size(ac) * size(to_a) + size(normal) * far);
        Facet {
            normal,
            square,
            height: -normal.dot(to_a),
            doubt: if is_clear { doubt } else { f64::INFINITY },
        }
    }

    /// The square of the distance to a triangle, and the feature with its closest point. A flat triangle is its edges.
    fn closest(&self, corners: &[DVec3; 3], facet: &Facet) -> (f64, Feature) {
        let [a, b, c] = *corners;
        let (mut least, mut closest) = (f64::INFINITY, Feature::Face);
        let mut is_over = !facet.is_flat();
        for (edge, from, to) in [(0, a, b), (1, b, c), (2, c, a)] {
            let (along, to_from) = (to - from, self.to(from));
            if !facet.is_flat() && facet.normal.dot(to_from.cross(along)) > 0.0 {
                continue;
            }
            is_over = false;
            let whole = along.length_squared();
            let part = -to_from.dot(along);
            let (square, feature) = if !(part > 0.0) {
                (to_from.length_squared(), Feature::Vertex(edge))
            } else if part >= whole {
                (self.to(to).length_squared(), Feature::Vertex(after(edge)))
            } else {
                (to_from.cross(along).length_squared() / whole, Feature::Edge(edge))
            };
            if square < least {
                (least, closest) = (square, feature);
            }
        }
        if is_over {
            (facet.height * facet.height / facet.square, Feature::Face)
        } else {
            (least, closest)
        }
    }

    /// Whether the point is above a triangle's feature.
    fn above(
        &mut self,
        row: u32,
        corners: &[DVec3; 3],
        feature: Feature,
        facet: &Facet,
    ) -> Result<Above, QueryError> {
        match feature {
            Feature::Face => Ok(facet.is_above().ok_or(facet.reason())),
            Feature::Edge(edge) => {
                let Some((other, _)) = self.tree.across(row, edge) else {
                    return Ok(Err(NoSide::OpenBoundary));
                };
                if !self.spend(RING_COST) {
                    return Ok(Err(NoSide::CutShort));
                }
                let other = self.corners(other)?;
                Ok(facet.above_edge(&self.facet(&other)))
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
                        let above = self.above_vertex(row, corner, corners, facet)?;
                        let above = self.unless_cut(above, row, corner, corners);
                        self.vertex = Some((vertex, around, above));
                        Ok(above)
                    }
                }
            }
        }
    }

    /// Around a vertex whose triangles cut each other the angle-weighted pseudonormal (f32, as far as that is clear) may
    /// differ from the nearest triangle. Then no side is certain.
    fn unless_cut(&self, above: Above, row: u32, corner: u32, corners: &[DVec3; 3]) -> Above {
        let [centre, ..] = turned(*corners, corner);
        let towards = -self.to(centre).as_vec3();
        let normal = Feature::Vertex(corner).pseudonormal(self.tree, self.vertices, row);
        let Ok(normal) = normal else { return above };
        let height = towards.dot(normal.vector);
        let is_clear = height.abs() > NORMAL * normal.weight * sqrt(towards.length_squared());
        match above {
            Ok(is_above) if is_clear && is_above != (height > 0.0) => Err(NoSide::BelowAccuracy),
            _ => above,
        }
    }

    /// The least row of the triangles around a corner.
    fn first_around(&self, row: u32, corner: u32) -> Result<u32, NoSide> {
        let (mut first, mut at, mut corner) = (row, row, corner);
        for _ in 0..MAX_RING {
            let (next, back) = self.tree.across(at, corner).ok_or(NoSide::OpenBoundary)?;
            if next == row {
                return Ok(first);
            }
            (at, corner) = (next, after(back));
            if next < first {
                first = next;
            }
        }
        Err(NoSide::Degenerate)
    }

    /// Whether the point is above a vertex: by the edge that makes the least angle with it.
    fn above_vertex(
        &mut self,
        first: u32,
        mut corner: u32,
        corners: &[DVec3; 3],
        facet: &Facet,
    ) -> Result<Above, QueryError> {
        let (mut row, mut corners, mut facet) = (first, *corners, *facet);
        // The cosine's square, with its sign, times the square of the distance.
        let (mut largest, mut above) = (f64::NEG_INFINITY, Err(NoSide::Degenerate));
        for _ in 0..MAX_RING {
            let [centre, end, _] = turned(corners, corner);
            let Some((next, back)) = self.tree.across(row, corner) else {
                return Ok(Err(NoSide::OpenBoundary));
            };
            if !self.spend(RING_COST) {
                return Ok(Err(NoSide::CutShort));
            }
            let other = self.corners(next)?;
            let next_facet = self.facet(&other);
            let (edge, towards) = (end - centre, -self.to(centre));
            let cosine = towards.dot(edge);
            let cosine = cosine * cosine.abs() / edge.length_squared();
            if cosine.is_nan() {
                return Ok(Err(NoSide::Degenerate));
            }
            let far = (centre - self.start).abs().element_sum() + self.along.abs().element_sum();
            let size = towards.abs().element_sum();
            let doubt = 8.0 * ROUNDING * size * (size + far);
            if cosine > largest + doubt {
                above = facet.above_edge(&next_facet);
            } else if cosine >= largest - doubt {
                let this = facet.above_edge(&next_facet);
                above = if above == this { above } else { Err(NoSide::BelowAccuracy) };
            }
            if cosine > largest {
                largest = cosine;
            }
            if next == first {
                return Ok(above);
            }
            (row, corner, corners, facet) = (next, after(back), other, next_facet);
        }
        Ok(Err(NoSide::Degenerate))
    }
}

impl Facet {
    fn is_flat(&self) -> bool {
        !(self.doubt < f64::INFINITY)
    }

    const fn reason(&self) -> NoSide {
        if self.doubt < f64::INFINITY { NoSide::BelowAccuracy } else { NoSide::Degenerate }
    }

    /// How much rounding tilts the plane.
    fn tilt(&self, &[a, b, c]: &[DVec3; 3]) -> f64 {
        root((b - a).length_squared() / self.square * (c - a).length_squared())
    }

    fn is_above(&self) -> Option<bool> {
        (self.height.abs() > self.doubt).then_some(self.height > 0.0)
    }

    /// Whether the point is at a larger sine from this plane than from another one, whatever the rounding.
    fn has_larger_sine_than(&self, other: &Self) -> bool {
        let least = self.height.abs() - self.doubt;
        let most = other.height.abs() + other.doubt;
        least > 0.0 && least * least * other.square > SINES * (most * most * self.square)
    }

    /// Whether the point is above the edge of this triangle and another one.
    fn above_edge(&self, other: &Self) -> Above {
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
            Err(if self.is_flat() { self.reason() } else { other.reason() })
        }
    }
}

/// The square root, within 1e-6 of its size.
fn root(square: f64) -> f64 {
    f64::from(sqrt(square as f32))
}
