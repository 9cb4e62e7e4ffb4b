//! One search: the tests of nodes, leaves and triangles, and the best pair so far.

mod finish;
mod heights;
mod leaves;
mod low;
mod near;
mod range;
mod roots;
mod slack;
mod tick;
mod ties;
#[cfg(feature = "wide")]
mod wide;

use glam::Vec3;

pub(super) use tick::{Outcome, Tick};
pub(super) use ties::Ties;
#[cfg(feature = "wide")]
pub(super) use wide::WideSearch;

use roots::Roots;
use slack::{COORDINATES, FLOOR, SLACK, TILT};

use super::plane::Plane;
use super::{Budget, Options};
use crate::math::sqrt::sqrt;
use crate::tool::{AxisPair, Tool};
use crate::tree::RootSet;
use crate::tree::format::Link;
use crate::unavailable::QueryError;
use crate::{Index, MeasuredStretch, Proximity, Tree, TriangleRow, VertexTable};

/// A subtree that waits for its turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    /// Lower bound on its distance from the tool's axis.
    pub lower: f32,
    /// Link of its node.
    pub link: u32,
}

/// Weight of each corner in the mean that a triangle's plane faces.
const THIRD: f32 = 1.0 / 3.0;

/// A search with its limit at infinity.
pub(super) const WHOLE: u8 = 0;
/// A search that began with the cutoff at its limit, which bounds the subtrees that it never visited.
pub(super) const WITHIN: u8 = 1;
/// A search that ends once a point of the surface is found within its limit.
pub(super) const UNTIL: u8 = 2;

/// The outcome of a visit to a subtree.
enum Step {
    /// Finished; any children that remain wait on the stack.
    Done,
    /// Unfinished: the budget ran out.
    OutOfBudget,
}

/// The nearest pin so far: a point of the surface, and so an upper bound from the first node on.
#[derive(Clone, Copy)]
struct NearestPin {
    /// Its row in the vertex table.
    row: u32,
    /// Its distance from the tool's axis.
    distance: f32,
}

/// The state of one search.
pub(super) struct Search<'s, 't, I, V: ?Sized, T> {
    tree: &'s Tree<'t, I>,
    vertices: &'s V,
    tool: &'s T,
    stack: &'s mut [Waiting],
    waiting: usize,
    budget: Budget,
    /// Turns a radius code into the sphere's radius under the stretch in use.
    radius_scale: f32,
    scale: f32,
    slack: f32,
    /// Added to the cutoff where a plane is compared.
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
    /// The rest of the budget.
    left: Budget,
    /// A triangle no farther from the axis is collected. Not a number if nobody asks.
    tie_squared: f32,
    /// The triangles that may be the closest, once the search has ended.
    ties: Option<&'s mut Ties>,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Search<'s, 't, I, V, T> {
    /// A search that tests the triangle `first` before anything else. If the side is asked for, `ties` will have
    /// the triangles that may be the closest, once the search has ended.
    #[inline(always)]
    pub fn start(
        tree: &'s Tree<'t, I>,
        stack: &'s mut [Waiting],
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
        first: Option<TriangleRow>,
        ties: Option<&'s mut Ties>,
    ) -> Result<Self, QueryError> {
        Self::start_in(RootSet::ALL, tree, stack, vertices, tool, options, first, ties)
    }

    /// A search below some roots; the triangle `first` must be below one of them.
    #[inline(always)]
    #[allow(clippy::too_many_arguments)]
    pub fn start_in(
        roots: RootSet,
        tree: &'s Tree<'t, I>,
        stack: &'s mut [Waiting],
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
        // The closest pair in a sound tree takes one test of each node's sphere, two of each leaf's plane and one of each
        // triangle. If corrupt bytes form a loop, this bound ends the search. Other kinds have bounds of their own.
        let most = header.nodes.saturating_mul(3).saturating_add(header.triangles);
        let budget = options.budget.nodes_at_most(most);
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
            budget,
            left: budget,
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
            && let Some(left) = search.left.triangle_tests.checked_sub(1)
        {
            search.left.triangle_tests = left;
            let corners = search.corners(triangle)?;
            search.test_triangle(triangle, &corners);
        }
        let subtree = Waiting { lower: distance - radius, link: root.link };
        search.push(0, subtree).ok_or(QueryError::Corrupt { row: 0 })?;
        Ok(search)
    }

    /// Visits subtrees, near ones first, until none below the cutoff is left or the budget runs out.
    ///
    /// Each kind is a function with one caller, into which it is inlined: this keeps the plain query's loop in
    /// registers.
    pub fn run<const KIND: u8>(mut self, limit: f32) -> Result<Proximity, QueryError> {
        while let Some(top) = self.waiting.checked_sub(1) {
            self.waiting = top;
            let &Waiting { lower, link } =
                self.stack.get(top).ok_or(QueryError::Corrupt { row: top as u32 })?;
            if lower > self.cutoff {
                continue;
            }
            if KIND == UNTIL && self.cutoff <= limit {
                return self.finish(0.0);
            }
            let step = match Link::decode(link) {
                Link::Children { first, count } => self.expand(lower, first, count)?,
                Link::Leaf { first, count } => self.leaf(first, count)?,
            };
            if matches!(step, Step::OutOfBudget) {
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
    /// rounding to spare, so that an axis that touches the surface is always within.
    pub fn limit_to(&mut self, separation: f32) -> f32 {
        let distance = separation + self.tool.radius();
        let rounding = self.slack + self.tree.position_error();
        let limit = rounding + if distance < 0.0 { 0.0 } else { distance };
        self.lower_cutoff(limit);
        limit
    }

    /// No triangle was found within `limit` of the axis. A limit that is not a number limits nothing.
    fn is_beyond(&self, limit: f32) -> bool {
        self.best.is_none_or(|pair| pair.distance_squared > limit * limit)
    }

    /// The least lower bound of the waiting subtrees and of one that was not finished.
    #[inline(always)]
    fn least_waiting(&self, lower: f32) -> f32 {
        let waiting = self.stack.iter().take(self.waiting).map(|left| left.lower);
        // The distance of a pin that is not a number gives no bound.
        let known = |lower: f32| if lower.is_nan() { 0.0 } else { lower };
        let least = |least, lower| if known(lower) < least { known(lower) } else { least };
        waiting.fold(known(lower), least)
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

    /// Inserts a subtree into the part of the stack from `base` on, nearest on top; `None` if the stack is full.
    #[inline(always)]
    fn push(&mut self, base: usize, subtree: Waiting) -> Option<()> {
        let mut at = self.waiting;
        while at > base
            && let Some(&below) = self.stack.get(at - 1)
            && below.lower < subtree.lower
        {
            *self.stack.get_mut(at)? = below;
            at -= 1;
        }
        *self.stack.get_mut(at)? = subtree;
        self.waiting += 1;
        Some(())
    }

    /// Tests the spheres of a node's children, and the planes of those that are leaves; pushes the rest. Each child's
    /// bound is at least its parent's, so the certified bound never falls.
    #[inline(always)]
    fn expand(&mut self, parent: f32, first: u32, count: u32) -> Result<Step, QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let Some(left) = self.left.node_tests.checked_sub(count) else {
            return Ok(Step::OutOfBudget);
        };
        self.left.node_tests = left;
        let base = self.waiting;
        let tree = self.tree;
        for node in tree.records(first, count).ok_or(corrupt)? {
            let position = self.position(node.pin)?;
            let radius = node.radius_code as f32 * self.radius_scale;
            let normal = self.tool.axis_to(position);
            let squared = normal.dot(normal);
            let far = self.cutoff + radius;
            // A NaN counts as near: the leaves below name the vertex that it comes from.
            if squared > far * far {
                continue;
            }
            let distance = sqrt(squared);
            self.lower_cutoff_to_pin(node.pin, distance);
            // The plane test needs the vector to the leaf's pin, which is at hand here.
            if let Link::Leaf { first, count } = Link::decode(node.link)
                && let Some(left) = self.left.node_tests.checked_sub(1)
            {
                self.left.node_tests = left;
                let plane = self.plane_across(normal, position, distance);
                let beyond = plane.beyond(tree, self.vertices, first, count).ok_or(corrupt)?;
                if beyond == count {
                    continue;
                }
            }
            let own = distance - radius;
            let lower = if own > parent { own } else { parent };
            self.push(base, Waiting { lower, link: node.link }).ok_or(corrupt)?;
        }
        Ok(Step::Done)
    }

    /// Tests a leaf that no waiting subtree is nearer than: its vertices against one plane; then each triangle, from
    /// the first that the plane does not reject, against the same plane and a plane of its own.
    #[inline(always)]
    fn leaf(&mut self, first: u32, count: u32) -> Result<Step, QueryError> {
        let Some(left) = self.left.node_tests.checked_sub(1) else {
            return Ok(Step::OutOfBudget);
        };
        self.left.node_tests = left;
        let corrupt = QueryError::Corrupt { row: first };
        let [corner, ..] = self.tree.triangle(first).ok_or(corrupt)?;
        let position = self.position(corner)?;
        let normal = self.tool.axis_to(position);
        let length = sqrt(normal.dot(normal));
        let patch_plane = self.plane_across(normal, position, length);
        let beyond = patch_plane.beyond(self.tree, self.vertices, first, count).ok_or(corrupt)?;
        if beyond == count {
            return Ok(Step::Done);
        }
        let tree = self.tree;
        let (first, count) = (first + beyond, count - beyond);
        let triangles = tree.triangles(first, count).ok_or(corrupt)?;
        for (triangle, corners) in (first..).zip(triangles) {
            if triangle == self.best_triangle {
                continue;
            }
            let (Some(left), Some(triangles_left)) =
                (self.left.node_tests.checked_sub(1), self.left.triangle_tests.checked_sub(1))
            else {
                return Ok(Step::OutOfBudget);
            };
            self.left.node_tests = left;
            let [a, b, c] = corners;
            let [a, b, c] = [self.position(a)?, self.position(b)?, self.position(c)?];
            if patch_plane.has_beyond(a) && patch_plane.has_beyond(b) && patch_plane.has_beyond(c) {
                continue;
            }
            let plane = self.plane_towards((a + b + c) * THIRD);
            if plane.has_beyond(a) && plane.has_beyond(b) && plane.has_beyond(c) {
                continue;
            }
            // A corner that is not finite makes the limit NaN.
            if plane.limit.is_nan() {
                return Err(QueryError::Position { vertex: self.not_finite(triangle) });
            }
            self.left.triangle_tests = triangles_left;
            self.test_triangle(triangle, &[a, b, c]);
        }
        Ok(Step::Done)
    }

    #[inline(always)]
    fn plane_towards(&self, point: Vec3) -> Plane {
        let normal = self.tool.axis_to(point);
        self.plane_across(normal, point, sqrt(normal.dot(normal)))
    }

    /// The plane perpendicular to the shortest vector from the axis to a point, of this length.
    #[inline(always)]
    fn plane_across(&self, normal: Vec3, point: Vec3, length: f32) -> Plane {
        let on_axis = point - normal;
        let beyond = (self.cutoff + self.coordinate_slack) * length;
        Plane { normal, limit: normal.dot(on_axis) + beyond + self.tilt_slack }
    }

    #[inline(always)]
    fn position(&self, row: u32) -> Result<Vec3, QueryError> {
        self.vertices.position(row).ok_or(QueryError::Corrupt { row })
    }

    #[inline(always)]
    fn corners(&self, triangle: u32) -> Result<[Vec3; 3], QueryError> {
        let rows = self.tree.triangle(triangle).ok_or(QueryError::Corrupt { row: triangle })?;
        let [a, b, c] = rows;
        Ok([self.position(a)?, self.position(b)?, self.position(c)?])
    }

    /// The exact test; the caller has counted it.
    #[inline(always)]
    fn test_triangle(&mut self, triangle: u32, corners: &[Vec3; 3]) {
        if let Some(pair) = self.tool.closest_on_triangle(corners, self.cutoff_squared) {
            if pair.distance_squared < self.best_squared {
                self.improve(triangle, pair, sqrt(pair.distance_squared));
            }
            self.add_tie(triangle, pair.distance_squared);
        }
    }

    /// A triangle is the closest so far.
    #[inline(always)]
    fn improve(&mut self, triangle: u32, pair: AxisPair, distance: f32) {
        self.best_squared = pair.distance_squared;
        self.best_triangle = triangle;
        self.best = Some(pair);
        self.lower_cutoff(distance);
        if self.ties.is_some() {
            self.tie_squared = ties::limit_of(distance, self.scale);
        }
    }

    /// Collects a triangle if it may be the closest; `square` bounds the square of its distance.
    #[inline(always)]
    fn add_tie(&mut self, triangle: u32, square: f32) {
        if square <= self.tie_squared
            && let Some(ties) = &mut self.ties
        {
            ties.push(triangle, square, self.tie_squared);
        }
    }

    /// Where it was not searched, the surface may be as close as the closest triangle.
    fn leave_unfinished(&mut self) {
        if let Some(ties) = &mut self.ties {
            ties.lose();
        }
    }

    /// The corner of a triangle that is not finite; the first where all are finite.
    #[cold]
    fn not_finite(&self, triangle: u32) -> u32 {
        let rows = self.tree.triangle(triangle).unwrap_or_default();
        let is_finite = |row| self.vertices.position(row).is_some_and(Vec3::is_finite);
        rows.into_iter().find(|&row| !is_finite(row)).unwrap_or(rows[0])
    }
}
