//! One search: its start, its loop, and the best pair so far.

// Requirements

#[cfg(feature = "batched")]
mod batched;
mod finish;
mod heights;
mod leaf;
mod leaves;
mod low;
mod meter;
mod near;
mod node;
mod range;
mod roots;
mod slack;
mod tick;
mod ties;

pub(super) use super::memory::waiting::WaitingNode;
#[cfg(feature = "batched")]
pub(super) use batched::BatchedSearch;
#[cfg(feature = "control")]
pub(crate) use near::LabelDistance;
pub(super) use tick::{Outcome, Tick};
pub(super) use ties::Ties;

use meter::Meter;
use node::CLOSEST;
use roots::Roots;
use slack::{COORDINATES, FLOOR, SLACK, TILT};

use super::{Budget, Options};
use crate::math::order::larger;
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPair, Tool};
use crate::tree::RootSet;
use crate::tree::format::NodeLink;
use crate::unavailable::QueryError;
use crate::{Index, MeasuredStretch, Proximity, Tree, TriangleRow, VertexTable};

/// A search without a distance limit.
pub(super) const WHOLE: u8 = 0;
/// A search whose cutoff starts at its limit, which bounds the subtrees that it never visits.
pub(super) const WITHIN: u8 = 1;
/// A search that ends once it finds a point of the surface within its limit.
pub(super) const UNTIL: u8 = 2;

/// The outcome of a visit to a subtree.
enum Expansion {
    /// Finished; any remaining children are on the stack.
    Done,
    /// Unfinished: the budget ran out.
    OutOfBudget,
}

/// The nearest pin so far: a pin is a point of the surface, so it gives an upper bound from the first node on.
#[derive(Clone, Copy)]
struct NearestPin {
    row: u32,
    /// Its distance from the tool's axis.
    distance: f32,
}

pub(super) struct Search<'s, 't, I, V: ?Sized, T> {
    tree: &'s Tree<'t, I>,
    vertices: &'s V,
    tool: &'s T,
    stack: &'s mut [WaitingNode],
    waiting: usize,
    meter: Meter,
    /// Converts a radius code into the sphere's radius under the current stretch.
    radius_scale: f32,
    scale: f32,
    slack: f32,
    /// Added to the cutoff for comparison with a plane.
    coordinate_slack: f32,
    tilt_slack: f32,
    /// Upper bound plus rounding slack: the distance of the nearest surface point known, beyond which nothing
    /// can be closer.
    cutoff: f32,
    cutoff_squared: f32,
    nearest_pin: NearestPin,
    best: Option<AxisPair>,
    best_squared: f32,
    best_triangle: u32,
    /// Triangles up to this squared distance from the axis are collected as ties. NaN if ties are not needed.
    tie_squared: f32,
    /// The triangles that may be the closest, once the search has ended.
    ties: Option<&'s mut Ties>,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Search<'s, 't, I, V, T> {
    /// A search below some roots, which first tests the triangle `first`; this must be below one of the roots. If the
    /// side is asked for, `ties` receives the triangles that may be the closest.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub fn start(
        roots: RootSet,
        tree: &'s Tree<'t, I>,
        stack: &'s mut [WaitingNode],
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
        first: Option<TriangleRow>,
        mut ties: Option<&'s mut Ties>,
    ) -> Result<Self, QueryError> {
        let header = tree.header();
        if vertices.len() != header.vertices as usize {
            return Err(QueryError::VertexCount {
                expected: header.vertices,
                found: vertices.len() as u32,
            });
        }
        let sigma = |measured: &MeasuredStretch| {
            let (expected, found) = (header.checksum, measured.tree());
            if expected != found {
                return Err(QueryError::OtherTree { expected, found });
            }
            if let (Some(expected), Some(found)) = (vertices.epoch(), measured.epoch())
                && expected != found
            {
                return Err(QueryError::OtherFrame { expected, found });
            }
            Ok(measured.sigma())
        };
        let stretch = match (&options.stretch, vertices.stretch()) {
            (Some(measured), _) => sigma(measured)?,
            (None, Some(measured)) => sigma(&measured)?,
            (None, None) => header.stretch,
        };
        let row = roots.first();
        let root = tree.record(row).ok_or(QueryError::Corrupt { row })?;
        let radius_scale = header.radius_unit * stretch;
        let radius = root.radius_code as f32 * radius_scale;
        let pin = vertices.position(root.pin).ok_or(QueryError::Corrupt { row: root.pin })?;
        let distance = sqrt(tool.axis_distance_squared(pin));
        let mut all = Roots {
            waiting: 0,
            reach: distance + radius,
            coordinate: pin.abs().max_element(),
            nearest: NearestPin { row: root.pin, distance },
        };
        if header.other_roots > 0 {
            all = all.with_others(tree, stack, vertices, tool, radius_scale, roots)?;
        }
        let scale = all.reach + 2.0 * tool.axis_length() + tool.radius();
        let coordinates = 2.0 * all.coordinate + scale;
        if !(coordinates < 1e18) {
            return Err(QueryError::Position { vertex: root.pin });
        }
        // The closest pair in a sound tree takes at most one test of each node's sphere, two of each leaf's plane and
        // two of each triangle (plane and exact), besides the warm start's. If corrupt bytes form a loop, this bound
        // ends the search. Other kinds of search have their own bounds.
        let triangles = header.triangles.saturating_add(1).saturating_mul(1 + Budget::TRIANGLE);
        let most = header.nodes.saturating_mul(3).saturating_add(triangles);
        ties = ties.filter(|_| options.is_signed && tree.has_adjacency());
        if let Some(ties) = &mut ties {
            ties.reset(scale, tree.is_closed() && tool.axis_length() > 0.0);
        }
        let mut search = Self {
            tree,
            vertices,
            tool,
            stack,
            waiting: all.waiting,
            meter: Meter::new(options.budget.at_most(most)),
            radius_scale,
            scale,
            slack: SLACK * scale + FLOOR,
            coordinate_slack: COORDINATES * coordinates,
            tilt_slack: TILT * scale * scale,
            cutoff: f32::INFINITY,
            cutoff_squared: f32::INFINITY,
            nearest_pin: NearestPin { row: root.pin, distance: f32::INFINITY },
            best: None,
            best_squared: f32::INFINITY,
            best_triangle: u32::MAX,
            tie_squared: f32::NAN,
            ties,
        };
        search.lower_cutoff_to_pin(all.nearest.row, all.nearest.distance);
        if let Some(TriangleRow(triangle)) = first
            && triangle < header.triangles
            && search.meter.warm_triangle().is_some()
        {
            let corners = search.corners(triangle)?;
            search.test_triangle(triangle, &corners);
        }
        let subtree = WaitingNode { lower: distance - radius, link: root.link };
        search.push(0, subtree).ok_or(QueryError::Corrupt { row: 0 })?;
        Ok(search)
    }

    /// Visits subtrees, nearest first, until none is below the cutoff or the budget runs out.
    ///
    /// Each kind is a function with one caller, into which it is inlined: this keeps the plain query's loop in
    /// registers.
    pub fn run<const KIND: u8>(mut self, limit: f32) -> Result<Proximity, QueryError> {
        while let Some(WaitingNode { lower, link }) = self.pop() {
            if lower > self.cutoff {
                continue;
            }
            if KIND == UNTIL && self.cutoff <= limit {
                return self.finish(0.0);
            }
            let step = match NodeLink::decode(link) {
                NodeLink::Children { first, count } => match self.meter.nodes(count) {
                    Some(()) => {
                        self.expand::<CLOSEST>(lower, first, count, 0.0)?;
                        Expansion::Done
                    }
                    None => Expansion::OutOfBudget,
                },
                NodeLink::Leaf { first, count } => self.leaf(first, count)?,
            };
            if matches!(step, Expansion::OutOfBudget) {
                if KIND == UNTIL {
                    return self.finish(0.0);
                }
                self.leave_unfinished();
                let least = self.least_waiting(lower);
                let is_beyond = KIND == WITHIN && self.is_beyond(limit) && limit < least;
                return self.finish(if is_beyond { limit } else { least });
            }
        }
        self.finish(if KIND == WITHIN && self.is_beyond(limit) { limit } else { f32::INFINITY })
    }

    /// Lowers the cutoff to `separation` (mm) from the tool. Returns the limit on the distance from its axis, with
    /// rounding slack, so that an axis that touches the surface is always within it.
    pub fn limit_to(&mut self, separation: f32) -> f32 {
        let distance = separation + self.tool.radius();
        let rounding = self.slack + self.tree.position_error();
        let limit = rounding + larger(distance, 0.0);
        self.lower_cutoff(limit);
        limit
    }

    /// No triangle was found within `limit` of the axis. NaN sets no limit.
    fn is_beyond(&self, limit: f32) -> bool {
        self.best.is_none_or(|pair| pair.distance_squared > limit * limit)
    }

    /// Lowers the cutoff to a pin's distance: a pin is a point of the surface.
    #[inline(always)]
    fn lower_cutoff_to_pin(&mut self, row: u32, distance: f32) {
        if distance < self.nearest_pin.distance {
            self.nearest_pin = NearestPin { row, distance };
            self.lower_cutoff(distance);
        }
    }

    #[inline(always)]
    fn lower_cutoff(&mut self, distance: f32) {
        let cutoff = distance + self.slack;
        if cutoff < self.cutoff {
            self.cutoff = cutoff;
            self.cutoff_squared = cutoff * cutoff;
        }
    }

    /// In unsearched parts the surface may be as close as the closest triangle found.
    fn leave_unfinished(&mut self) {
        if let Some(ties) = &mut self.ties {
            ties.lose();
        }
    }
}
