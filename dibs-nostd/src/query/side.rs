//! On which side of the surface a point is.

// Requirement: S-01

use glam::Vec3;

use super::exact::{Exact, SideOfPlane};
use super::normal::{Feature, NORMAL, NoNormal, corners};
use super::search::{Search, Ties, WaitingNode};
use super::sides::{NoSide, Side};
use super::{Options, Proximity};
use crate::math::sqrt::sqrt;
use crate::tool::AxisPoint;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tool, Tree, TriangleRow, VertexTable};

/// Rounding of a coordinate and of a few operations on it, relative to its size.
pub(super) const COORDINATES: f32 = 4.0 / 16_777_216.0;

/// If a corner's weight is above this, the point is not on the opposite edge.
const AWAY: f32 = 1e-3;

/// Within this many accuracies the difference of two points is a poor direction, so the pseudonormal is used.
const NEAR: f32 = 8.0;

/// A point's side, and the unit vector that leads out; zero if no normal is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct PointSide {
    pub side: Side,
    pub outward: Vec3,
    /// The f64 work, in node tests of equal time.
    pub work: u32,
}

/// A point of an axis. Start and offset are kept apart, so that far from the origin their sum is not rounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisPlace {
    pub start: Vec3,
    pub span: Vec3,
    pub parameter: f32,
    point: Vec3,
}

impl AxisPlace {
    pub fn new(tool: &impl Tool, parameter: f32) -> Self {
        let (start, span) = (tool.axis_start(), tool.axis_span());
        Self { start, span, parameter, point: tool.axis_point(parameter) }
    }
}

/// The side of an axis' point whose closest surface point is known, with at most `left` node tests.
///
/// # Why no side is wrong
/// `ties` holds every triangle that may be the closest, so it holds all triangles that meet in the true closest point.
/// A point above the planes of all of these is above any pseudonormal there, and outside; a point below all of them is
/// inside. So if the point is above all of `ties`, or below all, it does not matter which is the closest. Otherwise
/// [`Exact`] compares their distances. If there are too many, `many` is the answer of [`of_many`].
#[inline(never)] // So that a tick's code fits the tightly coupled memory of small controllers.
pub(super) fn of_point<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
    pair: &Proximity,
    at: &AxisPlace,
    ties: &Ties,
    many: Option<SideOfPlane>,
    left: u32,
) -> Result<PointSide, QueryError> {
    if pair.triangle.is_none() {
        let side = Side::Undefined(NoSide::CutShort);
        return Ok(PointSide { side, outward: Vec3::ZERO, work: 0 });
    }
    let distance = pair.axis_distance;
    let error = pair.accuracy + COORDINATES * pair.point_on_surface.abs().max_element();
    let mut normal = None;
    if !(distance > NEAR * error) {
        normal = match outward(tree, vertices, pair)? {
            Ok(unit) => Some(unit).filter(|&unit| unit != Vec3::ZERO),
            Err(reason) if !(distance > 2.0 * pair.accuracy) => {
                let is_cut = reason == NoSide::OpenBoundary && is_crowded(tree, ties);
                let side = Side::Undefined(if is_cut { NoSide::NonManifold } else { reason });
                return Ok(PointSide { side, outward: Vec3::ZERO, work: 0 });
            }
            Err(_) => None,
        };
    }
    let undefined = |reason, work| {
        let outward = normal.unwrap_or_default();
        Ok(PointSide { side: Side::Undefined(reason), outward, work })
    };
    if !(distance > 2.0 * pair.accuracy) {
        return undefined(NoSide::BelowAccuracy, 0);
    }
    let rough = Exact::<_, _, f32>::new(tree, vertices, at, left);
    let (is_above, work) = match clearly_above(tree, pair, &rough, ties)? {
        Some(is_above) => (is_above, 0),
        None => match decided(rough, ties, many)? {
            (Ok(is_above), work) => (is_above, work),
            (Err(NoSide::OpenBoundary), work) if is_crowded(tree, ties) => {
                return undefined(NoSide::NonManifold, work);
            }
            (Err(reason), work) => return undefined(reason, work),
        },
    };
    let towards = at.point - pair.point_on_surface;
    let apart = sqrt(towards.length_squared());
    let outward = match normal {
        Some(unit) => unit,
        None if !(apart > 0.0) => Vec3::ZERO,
        None if is_above => towards / apart,
        None => -towards / apart,
    };
    Ok(PointSide { side: if is_above { Side::Outside } else { Side::Inside }, outward, work })
}

/// Whether the point is above the closest of the deciding triangles, in f32 if that suffices, else in f64; and the cost
/// in node tests.
#[cold]
#[inline(never)]
fn decided<I: Index, V: VertexTable + ?Sized>(
    mut rough: Exact<'_, '_, I, V, f32>,
    ties: &Ties,
    many: Option<SideOfPlane>,
) -> Result<(SideOfPlane, u32), QueryError> {
    let (Some(rows), Some(again)) = (ties.deciding(), ties.deciding()) else {
        return Ok((many.unwrap_or(Err(NoSide::BelowAccuracy)), 0));
    };
    let above = rough.of(rows)?;
    if above.is_ok() {
        return Ok((above, rough.work));
    }
    let mut fine = rough.finer();
    let above = fine.of(again)?;
    Ok((above, rough.work.saturating_add(fine.work)))
}

/// The side of a point with more ties than fit in memory: searches for them again, starting at the closest pair.
#[cold]
#[inline(never)]
pub(super) fn of_many<I: Index, V: VertexTable + ?Sized>(
    roots: RootSet,
    tree: &Tree<'_, I>,
    stack: &mut [WaitingNode],
    vertices: &V,
    pair: &mut Proximity,
    point: Vec3,
    options: &Options,
) -> Result<SideOfPlane, QueryError> {
    let (tool, first) = (AxisPoint(point), pair.triangle);
    let at = AxisPlace::new(&tool, 0.0);
    let rest = |pair: &Proximity| options.after(pair.tests());
    let rough = Exact::<_, _, f32>::new(tree, vertices, &at, 0);
    if tree.is_closed() {
        let search = Search::start(roots, tree, stack, vertices, &tool, &rest(pair), first, None)?;
        let mut side = None;
        let (is_clear, made) = search.each_tie(|row| {
            let this = rough.is_above_plane(row)?;
            Ok(this.is_some() && *side.get_or_insert(this) == this)
        })?;
        pair.add_tests(made);
        if let Some(Some(is_above)) = side
            && is_clear
        {
            return Ok(Ok(is_above));
        }
    }
    let options = rest(pair);
    let left = options.budget.tests() / 2;
    let mut exact = Exact::<_, _, f64>::new(tree, vertices, &at, left);
    let options = options.within(options.budget.less(left));
    let search = Search::start(roots, tree, stack, vertices, &tool, &options, first, None)?;
    let (is_complete, made) = search.each_tie(|row| exact.add(row))?;
    pair.add_tests(made);
    pair.node_tests = pair.node_tests.saturating_add(exact.work);
    Ok(if is_complete { exact.answer() } else { Err(NoSide::CutShort) })
}

/// Whether a point is above all tied triangles, or below all, as far as f32 can tell. A triangle at an open boundary
/// counts only if the closest point is not on the boundary.
fn clearly_above<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    pair: &Proximity,
    rough: &Exact<'_, '_, I, V, f32>,
    ties: &Ties,
) -> Result<Option<bool>, QueryError> {
    let Some(rows) = ties.rows() else { return Ok(None) };
    let mut side = None;
    for row in rows {
        let this = rough.is_above_plane(row)?;
        if this.is_none() || *side.get_or_insert(this) != this {
            return Ok(None);
        }
        if !tree.is_closed() {
            for (edge, opposite) in [(0, 2), (1, 0), (2, 1)] {
                let is_away = pair.triangle == Some(TriangleRow(row))
                    && pair.barycentric.get(opposite).is_some_and(|&weight| weight > AWAY);
                if !is_away && tree.across(row, edge).is_none() {
                    return Ok(None);
                }
            }
        }
    }
    Ok(side.flatten())
}

/// Whether tied triangles meet in an edge without a neighbour.
#[cold]
fn is_crowded<I: Index>(tree: &Tree<'_, I>, ties: &Ties) -> bool {
    ties.deciding().into_iter().flatten().any(|row| {
        let [a, b, c] = tree.triangle(row).unwrap_or_default();
        [(0, a, b), (1, b, c), (2, c, a)].into_iter().any(|(edge, from, to)| {
            let shares = |other: u32| {
                let corners = tree.triangle(other).unwrap_or_default();
                other != row && corners.contains(&from) && corners.contains(&to)
            };
            tree.across(row, edge).is_none() && ties.deciding().into_iter().flatten().any(shares)
        })
    })
}

/// The triangles that meet in a pair's surface point, which alone decide the side.
pub(super) fn star<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
    pair: &Proximity,
) -> Result<Ties, QueryError> {
    let mut star = Ties::star();
    let Some(TriangleRow(triangle)) = pair.triangle else { return Ok(star) };
    star.add(triangle);
    match corners(tree, vertices, triangle) {
        Ok(corners) => {
            let error = pair.accuracy + COORDINATES * pair.point_on_surface.abs().max_element();
            let feature = Feature::of(&corners, pair.point_on_surface, error);
            feature.each_other(tree, triangle, |row| star.add(row));
            Ok(star)
        }
        Err(NoNormal::Corrupt(row)) => Err(QueryError::Corrupt { row }),
        Err(_) => Ok(star),
    }
}

/// The unit pseudonormal at a pair's surface point; zero if rounding hides it.
pub(super) fn outward<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
    pair: &Proximity,
) -> Result<Result<Vec3, NoSide>, QueryError> {
    let Some(TriangleRow(triangle)) = pair.triangle else { return Ok(Err(NoSide::CutShort)) };
    let point = pair.point_on_surface;
    let error = pair.accuracy + COORDINATES * point.abs().max_element();
    let found = corners(tree, vertices, triangle).and_then(|corners| {
        Feature::of(&corners, point, error).pseudonormal(tree, vertices, triangle)
    });
    match found {
        Ok(normal) => {
            let length = sqrt(normal.vector.length_squared());
            let is_known = length > NORMAL * normal.weight;
            Ok(Ok(if is_known { normal.vector / length } else { Vec3::ZERO }))
        }
        Err(NoNormal::Open) => Ok(Err(NoSide::OpenBoundary)),
        Err(NoNormal::Unclear) => Ok(Err(NoSide::Degenerate)),
        Err(NoNormal::Corrupt(row)) => Err(QueryError::Corrupt { row }),
    }
}
