//! One search: the tests of nodes, leaves and triangles, and what is known so far.

use glam::Vec3;

use super::{Budget, Options, QueryError};
use crate::sqrt::sqrt;
use crate::tool::{AxisPair, Tool};
use crate::{Index, Proximity, Tree, VertexTable};

/// A subtree that waits for its turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Waiting {
    /// No point of the subtree is closer to the tool's axis than this.
    pub lower: f32,
    pub link: u32,
}

/// Slack of the pruning comparison, in units of the query's scale: the f32 rounding of both sides.
///
/// With `u = 2^-24`, all lengths in a query are at most the scale `S` (distance to the farthest point
/// of the root sphere, plus twice the axis). A pin's distance is off by at most `8 u S`, a bound
/// `d - R` by `12 u S`, a triangle's distance by the kernel's [`crate::ACCURACY`]` S`, `16 u S`: a
/// comparison of any two by at most `28 u S`.
const SLACK: f32 = 48.0 / 16_777_216.0;

/// What [`Proximity::accuracy`] promises, in units of the scale: the kernel's error plus that of the
/// pair's last operations.
const ACCURACY: f32 = 24.0 / 16_777_216.0;

/// Share of the coordinates that counts into the scale: a computed centroid is off by up to three `u`
/// of them, and the distances to it by a few `u` of that. It shows only where a whole surface lies
/// within rounding of the tool.
const CENTROID: f32 = 1.0 / 1_048_576.0;

/// Lengths that the kernels count as zero, times a few: what is left of slack and accuracy where tool
/// and surface are one point.
const FLOOR: f32 = 1e-14;

/// Centres of elastic spheres are centroids: a third of the corners' sum.
const THIRD: f32 = 1.0 / 3.0;

/// What to do after a subtree was looked at.
pub(super) enum Step {
    /// Nothing of it is left.
    Done,
    One(Waiting),
    /// The nearer first.
    Two(Waiting, Waiting),
    OutOfBudget,
}

/// The state of one search besides the stack.
pub(super) struct Search<'s, 't, I, V: ?Sized, T> {
    tree: &'s Tree<'t, I>,
    vertices: &'s V,
    tool: &'s T,
    budget: Budget,
    /// Turns a radius code into the sphere's radius under the stretch in use.
    radius_scale: f32,
    scale: f32,
    slack: f32,
    pub root_lower: f32,
    /// Distance of the nearest surface point known, plus the slack: what is farther cannot win.
    pub reach: f32,
    reach_squared: f32,
    pin: (u32, f32),
    best: Option<AxisPair>,
    best_squared: f32,
    best_triangle: u32,
    /// Besides the root's.
    node_tests: u32,
    triangle_tests: u32,
}

impl<'s, 't, I: Index, V: VertexTable + ?Sized, T: Tool> Search<'s, 't, I, V, T> {
    pub fn start(
        tree: &'s Tree<'t, I>,
        vertices: &'s V,
        tool: &'s T,
        options: &Options,
    ) -> Result<Self, QueryError> {
        let header = tree.header();
        if vertices.len() != header.vertices as usize {
            return Err(QueryError::VertexCount {
                expected: header.vertices,
                found: vertices.len() as u32,
            });
        }
        let stretch = match options.stretch {
            None => header.stretch,
            Some(measured) => {
                let (expected, found) = (header.checksum, measured.tree());
                if expected != found {
                    return Err(QueryError::OtherTree { expected, found });
                }
                if let (Some(expected), Some(found)) = (vertices.epoch(), measured.epoch())
                    && expected != found
                {
                    return Err(QueryError::OtherFrame { expected, found });
                }
                measured.sigma()
            }
        };
        let radius_scale = header.radius_unit * stretch;
        let radius = header.root_radius_code as f32 * radius_scale;
        let pin = vertices
            .position(header.root_pin)
            .ok_or(QueryError::Corrupt { row: header.root_pin })?;
        let distance = sqrt(tool.axis_distance_squared(pin));
        let far_out = pin.abs().max_element() * CENTROID;
        let scale = distance + radius + 2.0 * tool.axis_length() + tool.radius() + far_out;
        if !(scale < 1e18) {
            return Err(QueryError::Position { vertex: header.root_pin });
        }
        let slack = SLACK * scale + FLOOR;
        // A sound tree visits each record once. If its bytes rot into a loop, this ends the search
        // with an interval that is still right.
        let most = header.nodes.saturating_mul(2).saturating_add(header.triangles);
        let mut search = Self {
            tree,
            vertices,
            tool,
            budget: Budget {
                node_tests: if options.budget.node_tests < most {
                    options.budget.node_tests
                } else {
                    most
                },
                triangle_tests: options.budget.triangle_tests,
            },
            radius_scale,
            scale,
            slack,
            root_lower: distance - radius,
            reach: f32::INFINITY,
            reach_squared: f32::INFINITY,
            pin: (header.root_pin, f32::INFINITY),
            best: None,
            best_squared: f32::INFINITY,
            best_triangle: u32::MAX,
            node_tests: 0,
            triangle_tests: 0,
        };
        search.pull_in(header.root_pin, distance);
        if let Some(triangle) = options.warm_start
            && triangle < header.triangles
            && options.budget.triangle_tests > 0
        {
            let corners = search.corners(triangle)?;
            search.test_triangle(triangle, &corners);
        }
        Ok(search)
    }

    /// A pin at this distance is a point of the surface: nothing farther can win.
    #[inline(always)]
    fn pull_in(&mut self, pin: u32, distance: f32) {
        if distance < self.pin.1 {
            self.pin = (pin, distance);
            self.tighten(distance);
        }
    }

    #[inline(always)]
    fn tighten(&mut self, distance: f32) {
        let reach = distance + self.slack;
        if reach < self.reach {
            self.reach = reach;
            self.reach_squared = reach * reach;
        }
    }

    /// Tests both children of an inner node.
    #[inline(always)]
    pub fn expand(&mut self, row: u32, parent_lower: f32) -> Result<Step, QueryError> {
        if self.budget.node_tests.saturating_sub(self.node_tests) < 2 {
            return Ok(Step::OutOfBudget);
        }
        self.node_tests += 2;
        let node = self.tree.node(row).ok_or(QueryError::Corrupt { row })?;
        let [left_pin, right_pin] = node.pin;
        let [left_code, right_code] = node.radius_code;
        let [left_link, right_link] = node.link;
        let left = self.child(left_pin, left_code, left_link, parent_lower)?;
        let right = self.child(right_pin, right_code, right_link, parent_lower)?;
        Ok(match (left, right) {
            (Some(left), Some(right)) if right.lower < left.lower => Step::Two(right, left),
            (Some(left), Some(right)) => Step::Two(left, right),
            (Some(one), None) | (None, Some(one)) => Step::One(one),
            (None, None) => Step::Done,
        })
    }

    /// A child that may hold the closest point, or `None`.
    #[inline(always)]
    fn child(
        &mut self,
        pin: u32,
        radius_code: u32,
        link: u32,
        parent_lower: f32,
    ) -> Result<Option<Waiting>, QueryError> {
        let position = self.vertices.position(pin).ok_or(QueryError::Corrupt { row: pin })?;
        let radius = radius_code as f32 * self.radius_scale;
        let squared = self.tool.axis_distance_squared(position);
        let far = self.reach + radius;
        if squared > far * far {
            return Ok(None);
        }
        if squared.is_nan() {
            return Err(QueryError::Position { vertex: pin });
        }
        let distance = sqrt(squared);
        self.pull_in(pin, distance);
        let own = distance - radius;
        // A child lies inside its parent, whatever its own sphere says.
        let lower = if own > parent_lower { own } else { parent_lower };
        Ok(Some(Waiting { lower, link }))
    }

    /// Tests a leaf's triangles, each behind its elastic sphere.
    #[inline(always)]
    pub fn leaf(&mut self, first: u32, count: u32) -> Result<Step, QueryError> {
        for triangle in first..first + count {
            if triangle == self.best_triangle {
                continue;
            }
            let spent = self.node_tests >= self.budget.node_tests
                || self.triangle_tests >= self.budget.triangle_tests;
            if spent {
                return Ok(Step::OutOfBudget);
            }
            self.node_tests += 1;
            let corners = self.corners(triangle)?;
            let [a, b, c] = corners;
            let centre = (a + b + c) * THIRD;
            let (to_a, to_b, to_c) = (a - centre, b - centre, c - centre);
            let larger = |x: f32, y: f32| if x > y { x } else { y };
            let elastic =
                larger(larger(to_a.length_squared(), to_b.length_squared()), to_c.length_squared());
            let far = self.reach + sqrt(elastic);
            let squared = self.tool.axis_distance_squared(centre);
            if squared > far * far {
                continue;
            }
            // One corner that is not a number makes the centre none.
            if squared.is_nan() {
                return Err(QueryError::Position { vertex: self.not_a_number(triangle) });
            }
            self.test_triangle(triangle, &corners);
        }
        Ok(Step::Done)
    }

    #[inline(always)]
    fn corners(&self, triangle: u32) -> Result<[Vec3; 3], QueryError> {
        let rows = self.tree.triangle(triangle).ok_or(QueryError::Corrupt { row: triangle })?;
        let [a, b, c] = rows;
        let at = |row| self.vertices.position(row).ok_or(QueryError::Corrupt { row });
        Ok([at(a)?, at(b)?, at(c)?])
    }

    #[inline(always)]
    fn test_triangle(&mut self, triangle: u32, corners: &[Vec3; 3]) {
        self.triangle_tests += 1;
        if let Some(pair) = self.tool.closest_on_triangle(corners, self.reach_squared)
            && pair.distance_squared < self.best_squared
        {
            self.best_squared = pair.distance_squared;
            self.best_triangle = triangle;
            self.best = Some(pair);
            self.tighten(sqrt(pair.distance_squared));
        }
    }

    /// Which corner of a triangle is not a number; the first where none is.
    #[cold]
    fn not_a_number(&self, triangle: u32) -> u32 {
        let rows = self.tree.triangle(triangle).unwrap_or_default();
        let is_nan = |&row: &u32| self.vertices.position(row).is_none_or(Vec3::is_nan);
        rows.into_iter().find(is_nan).unwrap_or_default()
    }

    /// The answer, where `lower` bounds what was left unexplored.
    pub fn finish(&self, lower: f32) -> Result<Proximity, QueryError> {
        let (pin, pin_distance) = self.pin;
        let radius = self.tool.radius();
        let cut_short = lower < f32::INFINITY;
        let (pair, triangle, corners) = match self.best {
            Some(pair) if !cut_short || sqrt(pair.distance_squared) <= pin_distance => {
                let row = self.best_triangle;
                let corners = self.tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
                (pair, Some(row), corners)
            }
            _ if cut_short => {
                let position =
                    self.vertices.position(pin).ok_or(QueryError::Corrupt { row: pin })?;
                let point = self.tool.closest_on_triangle(&[position; 3], f32::INFINITY);
                (point.ok_or(QueryError::Position { vertex: pin })?, None, [pin; 3])
            }
            _ => return Err(QueryError::Uncovered { pin }),
        };
        let axis_distance = sqrt(pair.distance_squared);
        let above_zero = |x: f32| if x > 0.0 { x } else { 0.0 };
        let separation = above_zero(axis_distance - radius);
        let left = above_zero(lower - radius);
        // By its own length: next to contact the points' rounding is not that of the distance.
        let towards = pair.on_axis - pair.on_surface;
        let length = sqrt(towards.length_squared());
        let touches = axis_distance <= 0.0 || length <= 0.0;
        let direction = if touches { Vec3::ZERO } else { towards / length };
        Ok(Proximity {
            separation,
            lower: if left < separation { left } else { separation },
            accuracy: ACCURACY * self.scale + FLOOR,
            axis_distance,
            point_on_surface: pair.on_surface,
            point_on_tool: pair.on_axis - direction * radius,
            direction,
            axis_parameter: pair.axis_parameter,
            triangle,
            corners,
            barycentric: pair.barycentric,
            node_tests: self.node_tests.saturating_add(1),
            triangle_tests: self.triangle_tests,
        })
    }
}
