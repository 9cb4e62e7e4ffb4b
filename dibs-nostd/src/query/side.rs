//! On which side of the surface a point is.

use core::fmt;

use glam::Vec3;

use super::Proximity;
use super::normal::{Feature, NoNormal, Off, corners};
use crate::math::sqrt::sqrt;
use crate::unavailable::QueryError;
use crate::{Index, Tree, TriangleRow, VertexTable};

/// On which side of the surface a tool's axis is. The outer side is where the triangles' corners are seen counter-
/// clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Side {
    /// The axis is outside, of all solids.
    Outside,
    /// The whole axis is inside, of the solid with the least separation.
    Inside,
    /// The axis crosses the surface of that solid.
    Crossing,
    /// Not known. Separations are then those of a tool outside.
    Undefined(NoSide),
}

/// Why a tool is on no side of the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NoSide {
    /// [`Options::unsigned`](crate::Options::unsigned): the query left it out.
    NotAsked,
    /// The tree has no adjacency: it was built without, or from a surface that has no sides.
    NoAdjacency,
    /// The closest point is on an open boundary of the surface.
    OpenBoundary,
    /// The axis is closer to the surface, or to a tie between its features, than the accuracy tells apart.
    BelowAccuracy,
    /// A triangle at the closest point has no area, or more than 256 meet there.
    Degenerate,
    /// The budget ran out before the closest point was certain, or no point is as close as asked for
    /// ([`Query::closest_within`](crate::Query::closest_within)).
    CutShort,
}

impl fmt::Display for NoSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotAsked => "no side was asked for",
            Self::NoAdjacency => "the tree has no adjacency",
            Self::OpenBoundary => "the closest point is on an open boundary",
            Self::BelowAccuracy => "the sides are closer than the accuracy",
            Self::Degenerate => "the triangles at the closest point have no clear normal",
            Self::CutShort => "the budget ran out",
        })
    }
}

/// Rounding of a coordinate and of a few operations on it, relative to its size.
const COORDINATES: f32 = 4.0 / 16_777_216.0;

/// Rounding of a pseudonormal, relative to the sum of its weights.
const NORMAL: f32 = 1e-5;

/// Within this many accuracies the difference of two points gives a poor direction, so the pseudonormal is used.
const NEAR: f32 = 8.0;

/// A point's side, and the unit vector that leads out; zero where no normal is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointSide {
    pub side: Side,
    pub outward: Vec3,
}

/// The side of an axis' point whose closest point of the surface is known.
///
/// # Why a near tie is no wrong side
/// Let the distance `d` be within `e` of the truth. A ball of radius `d - e` around the point holds no point of the
/// surface, so along any straight line of the surface from the closest point found, the direction to the point is
/// within an angle of `sqrt(2 e / d)` of being perpendicular.
///
/// On a face or an edge it is then within that angle of the normal cone, and a pseudonormal has no negative product with
/// any direction of its feature's normal cone: a product farther from zero than that angle's has the right sign.
///
/// A vertex may have no normal cone (a saddle). It is then never the closest point, only nearly. If a triangle at the
/// vertex is closer, the point leans over one of that triangle's edges. If the closest point is inside the triangle, the
/// triangle's normal has the right sign; if it is on the edge, the normal of one of the edge's two triangles has. So the
/// pseudonormal's sign counts only if no triangle that the point leans over has the other one.
///
/// Any other product leaves the side undefined.
///
/// A point that is clearly above all triangles of its feature is above their pseudonormal, whatever their weights: then
/// none is needed.
#[inline(never)] // So that a tick's code fits the tightly coupled memory of small controllers.
pub(super) fn of_point<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
    pair: &Proximity,
    on_axis: Vec3,
) -> Result<PointSide, QueryError> {
    let undefined = |reason, outward| Ok(PointSide { side: Side::Undefined(reason), outward });
    let Some(TriangleRow(triangle)) = pair.triangle else {
        return undefined(NoSide::CutShort, Vec3::ZERO);
    };
    let point = pair.point_on_surface;
    let error = pair.accuracy + COORDINATES * point.abs().max_element();
    let (distance, towards) = (pair.axis_distance, on_axis - point);
    let corners = corners(tree, vertices, triangle);
    let feature = corners.map(|corners| Feature::of(&corners, point, error));
    if let (Ok(corners), Ok(feature)) = (&corners, &feature)
        && distance > NEAR * error
    {
        let least = sqrt(4.0 * error / distance) + NORMAL;
        if let Some(is_above) =
            feature.clear_side(tree, vertices, triangle, corners, towards, least)
        {
            let outward = towards / sqrt(towards.length_squared());
            return Ok(if is_above {
                PointSide { side: Side::Outside, outward }
            } else {
                PointSide { side: Side::Inside, outward: -outward }
            });
        }
    }
    let off = Off { point: on_axis, error };
    let found = feature.and_then(|feature| feature.pseudonormal(tree, vertices, triangle, off));
    let normal = match found {
        Ok(normal) => normal,
        Err(NoNormal::Open) => return undefined(NoSide::OpenBoundary, Vec3::ZERO),
        Err(NoNormal::Unclear) => return undefined(NoSide::Degenerate, Vec3::ZERO),
        Err(NoNormal::Corrupt(row)) => return Err(QueryError::Corrupt { row }),
    };
    let length = sqrt(normal.vector.length_squared());
    let unit = normal.vector / length;
    let is_known = length > NORMAL * normal.weight;
    let unit = if is_known { unit } else { Vec3::ZERO };
    if !(distance > 2.0 * error) {
        return undefined(NoSide::BelowAccuracy, unit);
    }
    let height = towards.dot(normal.vector);
    let doubt = sqrt(2.0 * error * distance) * length + NORMAL * distance * normal.weight;
    let side = if height > doubt && !normal.is_below {
        Side::Outside
    } else if height < -doubt && !normal.is_above {
        Side::Inside
    } else {
        return undefined(NoSide::BelowAccuracy, unit);
    };
    let is_near = distance <= NEAR * error && is_known;
    let apart = sqrt(towards.length_squared());
    let outward = match side {
        _ if is_near || !(apart > 0.0) => unit,
        Side::Inside => -towards / apart,
        _ => towards / apart,
    };
    Ok(PointSide { side, outward })
}
