//! The contacts of one tool and one surface, whose closest pair is known.

use glam::Vec3;

use super::activation::TriangleTester;
use super::basins::{Basins, ClosestPoint, NearTriangle};
use super::low::SearchExtent;
use super::{Contact, Contacts};
use crate::math::order::smaller;
use crate::math::sqrt::sqrt;
use crate::query::corners::corners;
use crate::query::made::Tests;
use crate::query::prices::LIST;
use crate::query::search::{Search, WaitingNode};
use crate::query::side::{self, AxisPlace};
use crate::query::sides::Side;
use crate::query::{NoSide, Options, Proximity};
use crate::tool::AxisPair;
use crate::unavailable::QueryError;
use crate::{Coverage, Index, Tool, Tree, TriangleRow, VertexTable};

/// A contact's prominence is examined up to this fraction of the margin: the largest for an activation of 1.
const PROMINENCE: f32 = 1.0 / 64.0;

/// Within this many accuracies two points are too close to give a direction.
pub(super) const NO_DIRECTION: f32 = 16.0;

/// A tool and a surface, with their indices in a scene.
pub(in crate::query) struct Pair<'a, I, V: ?Sized, T> {
    pub tree: &'a Tree<'a, I>,
    pub vertices: &'a V,
    pub tool: &'a T,
    pub closest: &'a Proximity,
    pub surface: usize,
    /// The tool's index.
    pub number: usize,
}

impl<const N: usize, const NEAR: usize> Contacts<N, NEAR> {
    /// Empties the list for the contacts within `margin` (mm).
    pub(in crate::query) fn begin(
        &mut self,
        margin: f32,
        has_adjacency: bool,
    ) -> Result<(), QueryError> {
        self.found.clear();
        if N == 0 || NEAR == 0 || NEAR >= usize::from(u16::MAX) {
            return Err(QueryError::Contacts { capacity: N as u32, near: NEAR as u32 });
        }
        // Written so that NaN fails.
        let is_possible = margin >= 0.0 && margin.is_finite();
        if !is_possible {
            return Err(QueryError::Margin { bits: margin.to_bits() });
        }
        if !has_adjacency {
            return Err(QueryError::NoAdjacency);
        }
        self.found.begin(margin);
        Ok(())
    }

    /// Contacts beyond `bound` may be missing.
    pub(in crate::query) fn lower_bound(&mut self, bound: f32) {
        self.found.lower_bound(bound);
    }

    /// The result; the list is emptied if it is an error.
    pub(in crate::query) fn unless_failed<R>(
        &mut self,
        result: Result<R, QueryError>,
    ) -> Result<R, QueryError> {
        if result.is_err() {
            self.found.clear();
        }
        result
    }

    /// Adds the contacts of a pair, from the low triangles that `find` collects. Returns the tests made.
    #[inline(always)]
    pub(super) fn add_from<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        pair: &Pair<'_, I, V, T>,
        stack: &mut [WaitingNode],
        options: &Options,
        find: impl FnOnce(
            &mut Basins<NEAR>,
            Search<'_, '_, I, V, T>,
            &Options,
            (f32, f32),
        ) -> Result<SearchExtent, QueryError>,
    ) -> Result<Tests, QueryError> {
        let Self { found, basins } = self;
        let &Pair { tree, vertices, tool, closest, .. } = pair;
        let margin = found.margin;
        if closest.accuracy > found.accuracy {
            found.accuracy = closest.accuracy;
        }
        let is_side_searched = closest.side != Side::Undefined(NoSide::CutShort);
        found.has_no_side |= may_be_inside(closest);
        let is_of = |row| options.part.is_none() || tree.label(row) == options.part;
        let mut own =
            pair.contact(closest).filter(|at| at.separation <= margin && is_of(at.triangle));
        let mut spent = Tests::NONE;
        if closest.side.has_depth()
            && let Some(contact) = &mut own
        {
            (contact.across, spent) = pair.across(contact, stack, options)?;
        }
        if closest.side == Side::Inside || (closest.lower > margin && is_side_searched) {
            if let Some(contact) = own {
                found.insert(contact);
            }
            return Ok(spent);
        }
        let options = &options.after(spent);
        let is_begun = options.covers(LIST);
        let accuracy = pair.search_accuracy();
        // How triangles lie to each other depends on the error of their distances only: a tracker's pair is less exact.
        let mut error = accuracy;
        let extent = |error: f32| {
            let prominence = (margin * PROMINENCE) + 2.0 * error;
            (tool.radius() + margin + prominence, prominence)
        };
        let SearchExtent { complete, beyond, tests: mut made } = if is_begun {
            let search = pair.over_range(stack, options)?;
            error = search.accuracy();
            find(basins, search, options, extent(error))?
        } else {
            SearchExtent::NOT_BEGUN
        };
        let (limit, prominence) = extent(error);
        let is_crossing = matches!(closest.side, Side::Crossing | Side::Either);
        let has_crossing = is_crossing && own.is_some();
        if let Some(contact) = own.filter(|_| is_crossing) {
            found.insert(contact);
        }
        let left = options.after(made).budget.tests();
        let (limit_above, is_priced) = (limit + prominence, options.is_priced);
        let mut tester = TriangleTester {
            pair,
            limit: limit_above,
            accuracy: error,
            left,
            made: Tests::NONE,
            is_priced,
        };
        let (mut least, mut inner, mut meets) = (f32::INFINITY, f32::INFINITY, 0_u32);
        let is_left_out = |row| !is_of(TriangleRow(row));
        let prominences = (0.5 * PROMINENCE * margin, 2.0 * error);
        let visit = |near: NearTriangle| {
            let is_on = sqrt(near.square) <= accuracy;
            meets += u32::from(is_on);
            // The crossing pair, inserted above, represents these triangles.
            if has_crossing && is_on {
                return Ok(());
            }
            let mut other = pair_at(tree, vertices, tool, near, accuracy)?;
            // For a label's part only the distance matters: the surface continues at its border.
            let is_outside = closest.side == Side::Outside || closest.is_at_surface();
            if options.part.is_none() || !is_outside {
                other.add_side(tree, vertices, tool)?;
            }
            if other.side == Side::Inside {
                inner = smaller(inner, other.separation);
            } else if other.separation <= margin
                && let Some(contact) = pair.contact(&other)
            {
                if contact.separation < least {
                    least = contact.separation;
                }
                found.insert(contact);
            }
            Ok(())
        };
        // A search that was not begun has left an earlier one's triangles.
        let missing = if is_begun {
            basins.each_basin(tree, prominences, is_left_out, &mut tester, visit)?
        } else {
            None
        };
        let mut from = smaller(complete, beyond);
        if let Some(missing) = missing.map(sqrt).filter(|&missing| missing < from) {
            from = missing;
        }
        // A basin's lowest triangle is less than the prominence below the visited low triangle.
        let bound = if from < limit { from - prominence - tool.radius() } else { f32::INFINITY };
        let is_met = is_crossing || closest.is_at_surface();
        let is_certain = is_met || !closest.is_cut_short();
        // No missing contact is deeper than the deepest one found, or none is missing.
        let is_found = from >= limit || least < bound && least <= inner;
        let own_least = own.filter(|_| is_certain || !is_found).map(|own| own.separation);
        let deepest = own_least.map_or(least, |own| smaller(least, own));
        for contact in &mut found.list {
            let is_own = (contact.surface, contact.tool) == (pair.surface, pair.number);
            if is_own && contact.separation > deepest {
                let row = contact.triangle.0;
                contact.activation =
                    basins.activation(tree, row, prominences, is_left_out, &mut tester)?;
            }
        }
        made = made.and(tester.made);
        let is_known = is_side_searched && (is_certain || is_found || own.is_some());
        if is_known
            && !is_crossing
            && let Some(contact) = own
        {
            if is_certain && !(least <= contact.separation + 2.0 * accuracy) {
                found.insert(contact);
            } else if !is_certain && !is_found {
                // Nothing is deeper than the least separation that an uncertain pair may have.
                let is_same = |at: &Contact| {
                    let apart = at.point_on_surface.distance_squared(contact.point_on_surface);
                    (at.surface, at.tool) == (contact.surface, contact.tool)
                        && (at.triangle == contact.triangle || apart <= accuracy * accuracy)
                };
                found.list.retain(|other| !is_same(other));
                found.insert(contact);
            }
        }
        let is_own_crossing = is_crossing && options.part.is_none();
        found.is_open |= !is_known || !(own.is_some() || is_found || is_own_crossing);
        // If the axis meets the surface at several places, another part of the axis may be inside, less deep.
        if is_crossing && meets > 1 {
            found.lower_bound(closest.lower);
        }
        // The budget ended before the side was known: the tool may be inside, deeper than every pair seen.
        if !is_side_searched {
            found.lower_bound(f32::NEG_INFINITY);
        } else {
            found.lower_bound(bound);
        }
        Ok(made.and(spent))
    }
}

impl<I, V: VertexTable + ?Sized, T> Pair<'_, I, V, T> {
    /// Accuracy (mm) of a search that treats the positions as exact: the answer's accuracy includes their error.
    pub(super) fn search_accuracy(&self) -> f32 {
        self.closest.accuracy - self.vertices.position_error()
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Pair<'_, I, V, T> {
    /// A triangle, and the square of its distance from the axis; infinite if beyond the limit.
    pub(super) fn near(
        &self,
        row: u32,
        limit: f32,
        accuracy: f32,
    ) -> Result<NearTriangle, QueryError> {
        let (rows, corners) = corners(self.tree, self.vertices, row)?;
        match self.tool.closest_on_triangle(&corners, limit * limit) {
            Some(found) => Ok(near(row, &found, accuracy)),
            None => match rows.into_iter().zip(corners).find(|(_, corner)| !corner.is_finite()) {
                Some((vertex, _)) => Err(QueryError::Position { vertex }),
                None => Ok(NearTriangle { square: f32::INFINITY, row, point: ClosestPoint::NONE }),
            },
        }
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Pair<'_, I, V, T> {
    /// The distance of a triangle's edge from the axis; infinite if beyond the limit.
    pub(super) fn edge_distance(&self, row: u32, edge: u32, limit: f32) -> Result<f32, QueryError> {
        let (_, [a, b, c]) = corners(self.tree, self.vertices, row)?;
        let ends = match edge {
            0 => [a, b, b],
            1 => [b, c, c],
            _ => [c, a, a],
        };
        let found = self.tool.closest_on_triangle(&ends, limit * limit);
        Ok(found.map_or(f32::INFINITY, |found| sqrt(found.distance_squared)))
    }
}

impl<I, V: ?Sized, T> Pair<'_, I, V, T> {
    fn contact(&self, at: &Proximity) -> Option<Contact> {
        let contact = contact(at)?;
        Some(Contact { surface: self.surface, tool: self.number, ..contact })
    }
}

/// The contact of two points, if they have a direction that leads out.
pub(super) fn contact(at: &Proximity) -> Option<Contact> {
    let is_unit = (at.direction.length_squared() - 1.0).abs() < 1e-3;
    let triangle = at.triangle.filter(|_| is_unit)?;
    // At the surface the axis may be as far inside as its distance outside.
    let separation = if at.is_at_surface() { at.lower - 2.0 * at.axis_distance } else { at.lower };
    Some(Contact {
        separation,
        normal: at.direction,
        point_on_surface: at.point_on_surface,
        point_on_tool: at.point_on_tool,
        axis_parameter: at.axis_parameter,
        triangle,
        corners: at.corners,
        barycentric: at.barycentric,
        ..Contact::NONE
    })
}

/// Whether the tool may be inside without a contact that tells so: the pair has no side, though one was asked for, or
/// no direction out. If the budget ended, the list's bound tells it already.
fn may_be_inside(closest: &Proximity) -> bool {
    match closest.side {
        Side::Undefined(NoSide::NotAsked | NoSide::NoAdjacency | NoSide::CutShort)
        | Side::Outside => false,
        Side::Undefined(_) if !closest.is_at_surface() => true,
        _ => contact(closest).is_none(),
    }
}

/// A triangle at this pair. Within some accuracies it has no direction.
pub(super) fn near(row: u32, pair: &AxisPair, accuracy: f32) -> NearTriangle {
    let point = ClosestPoint::of(pair, NO_DIRECTION * accuracy);
    NearTriangle { square: pair.distance_squared, row, point }
}

/// The pair of a tool and the lowest triangle of a basin.
fn pair_at<I: Index, V: VertexTable + ?Sized, T: Tool>(
    tree: &Tree<'_, I>,
    vertices: &V,
    tool: &T,
    near: NearTriangle,
    accuracy: f32,
) -> Result<Proximity, QueryError> {
    let row = near.row;
    let (corners, positions) = corners(tree, vertices, row)?;
    let found = tool.closest_on_triangle(&positions, f32::INFINITY);
    let found = found.ok_or(QueryError::Position { vertex: corners[0] })?;
    let axis_distance = sqrt(found.distance_squared);
    let towards = found.on_axis - found.on_surface;
    let length = sqrt(towards.length_squared());
    let direction = if length > 0.0 { towards / length } else { Vec3::ZERO };
    let separation = axis_distance - tool.radius();
    Ok(Proximity {
        separation,
        lower: separation,
        accuracy,
        side: Side::Undefined(NoSide::NotAsked),
        coverage: Coverage::Assumed,
        axis_distance,
        point_on_surface: found.on_surface,
        point_on_tool: found.on_axis - direction * tool.radius(),
        direction,
        axis_parameter: found.axis_parameter,
        triangle: Some(TriangleRow(row)),
        corners,
        barycentric: found.barycentric,
        node_tests: 0,
        triangle_tests: 0,
    })
}

impl Proximity {
    /// Adds the side of the axis' point, and the direction that leads out of the surface there.
    fn add_side<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        tree: &Tree<'_, I>,
        vertices: &V,
        tool: &T,
    ) -> Result<(), QueryError> {
        let on_axis = tool.axis_point(self.axis_parameter);
        let (at, star) =
            (AxisPlace::new(tool, self.axis_parameter), side::star(tree, vertices, self)?);
        let at = side::of_point(tree, vertices, self, &at, &star, None, u32::MAX)?;
        self.side = at.side;
        if at.outward != Vec3::ZERO {
            self.direction = at.outward;
        }
        self.point_on_tool = on_axis - self.direction * tool.radius();
        Ok(())
    }
}
