//! The rate of change of the depth at a deepest point.
//!
//! Along an axis the depth is the least of the distances to the triangles, each of which is convex. So it is largest
//! inside the axis where two triangles are equally far: along the axis one approaches and the other recedes. As tool
//! and surface move, the largest depth changes at the mean rate of the two distances whose weights cancel the motion
//! along the axis.
//!
//! The closest triangle is known. The other one is found by searches at a few points of the axis in the direction in
//! which the closest recedes: first at a point beyond the largest depth that the answer allows, then at the points
//! where both would be equally far, until the depth there is at least the expected one. All these points are nearer to
//! the deepest point than the surface is, so they are inside, too.

// Requirement: S-06

use glam::Vec3;

use super::Contact;
use super::add::{NO_DIRECTION, Pair};
use crate::math::order::{larger, smaller};
use crate::math::sqrt::sqrt;
use crate::query::corners::positions;
use crate::query::made::Tests;
use crate::query::search::{Search, WHOLE, WaitingNode};
use crate::query::{Options, Proximity};
use crate::tool::AxisPoint;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Budget, Index, Tool, Tree, VertexTable};

/// Most points of the axis searched.
const MOST_SAMPLES: u32 = 5;

/// The work for a point outside of its search, in node tests.
const SAMPLE_COST: u32 = 16;

/// Largest step along the axis, as a fraction of the depth.
const STEP: f32 = 0.75;

/// The second triangle at a deepest point inside the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct AcrossPoint {
    /// Its weight in the rate of the depth; 0 if there is none. The closest triangle has the remaining weight.
    pub weight: f32,
    /// Unit vector that leads out through it.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub normal: Vec3,
    /// The axis' point that is equally far from both triangles.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub on_axis: Vec3,
    /// Its corners, as rows of the vertex table.
    pub corners: [u32; 3],
    /// Weights of the corners at its closest point.
    pub barycentric: [f32; 3],
    /// Velocity of that point along the normal (mm/s).
    pub speed: f32,
}

impl AcrossPoint {
    pub const NONE: Self = Self {
        weight: 0.0,
        normal: Vec3::ZERO,
        on_axis: Vec3::ZERO,
        corners: [0; 3],
        barycentric: [0.0; 3],
        speed: 0.0,
    };
}

#[derive(Clone, Copy)]
struct ProfilePoint {
    /// Its distance (mm) from the deepest point, in the direction in which the deepest point's triangle recedes.
    along: f32,
    depth: f32,
    /// Rate at which its triangle's distance grows along the axis.
    slope: f32,
}

impl ProfilePoint {
    /// The position at which the distances to the triangles of two points are equal, if they grow linearly; and that
    /// distance.
    fn meeting(&self, far: &Self) -> (f32, f32) {
        let between = far.along - self.along;
        let step = (far.depth - self.depth - far.slope * between) / (self.slope - far.slope);
        let step = larger(0.0, step);
        let step = smaller(between, step);
        (self.along + step, self.depth + self.slope * step)
    }
}

/// A search for a point's closest triangle.
struct Sampler<'a, 't, I, V: ?Sized> {
    tree: &'a Tree<'t, I>,
    vertices: &'a V,
    roots: RootSet,
    options: Options,
    spent: Tests,
}

impl<I: Index, V: VertexTable + ?Sized> Sampler<'_, '_, I, V> {
    /// The closest triangle; `None` if the budget ends.
    #[cold]
    #[inline(never)]
    fn at(
        &mut self,
        stack: &mut [WaitingNode],
        point: Vec3,
    ) -> Result<Option<Proximity>, QueryError> {
        let Self { tree, vertices, roots, options, spent } = self;
        let left = options.after(*spent).budget.tests().checked_sub(1 + SAMPLE_COST);
        let Some(left) = left else { return Ok(None) };
        let options = options.within(Budget::new(left));
        let (point, first) = (AxisPoint(point), options.first(None));
        let search = Search::start(*roots, tree, stack, *vertices, &point, &options, first, None)?;
        let found = search.run::<WHOLE>(f32::INFINITY)?;
        *spent = spent.and(found.tests());
        spent.node_tests = spent.node_tests.saturating_add(SAMPLE_COST);
        Ok(Some(found).filter(|found| !found.is_cut_short()))
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Pair<'_, I, V, T> {
    /// The second triangle at the deepest point of a tool that is inside or crosses, whose contact is `own`; and the
    /// tests made. There is none if the point is an end of the axis, or if the budget ends.
    #[cold]
    #[inline(never)]
    pub(super) fn across(
        &self,
        own: &Contact,
        stack: &mut [WaitingNode],
        options: &Options,
    ) -> Result<(AcrossPoint, Tests), QueryError> {
        let &Self { tree, vertices, tool, closest, .. } = self;
        let mut sampler = Sampler {
            tree,
            vertices,
            roots: tree.shells_of(tree.root_of(own.triangle.0)),
            options: options.warm_start(Some(own.triangle)),
            spent: Tests::NONE,
        };
        let accuracy = self.search_accuracy();
        let length = tool.axis_length();
        let direction = tool.axis_span() / length;
        let on_axis = tool.axis_point(own.axis_parameter);
        let before = own.axis_parameter * length;
        let growth = -own.normal.dot(direction);
        let (inward, mut end) =
            if growth > 0.0 { (direction, length - before) } else { (-direction, before) };
        let depth = -closest.separation - tool.radius();
        let first = ProfilePoint { along: 0.0, depth, slope: growth.abs() };
        let has_inward = first.slope * end > accuracy && depth > NO_DIRECTION * accuracy;
        if !has_inward {
            return Ok((AcrossPoint::NONE, sampler.spent));
        }
        // Upper bound on the depth of any point of the axis.
        let most = -closest.lower - tool.radius() + accuracy;
        let (mut near, mut far) = (first, None);
        for _ in 0..MOST_SAMPLES {
            let (along, expected) = match &far {
                Some((far, _)) => near.meeting(far),
                None => {
                    let mut along = near.along + (most - near.depth) / near.slope;
                    for least in [near.along + STEP * near.depth, end] {
                        along = smaller(least, along);
                    }
                    (along, f32::INFINITY)
                }
            };
            let is_known = |far: &ProfilePoint| {
                let deepest = larger(near.depth, far.depth);
                expected <= deepest + accuracy
            };
            if far.as_ref().is_some_and(|(far, _)| is_known(far)) {
                break;
            }
            let point = on_axis + inward * along;
            let Some(found) = sampler.at(stack, point)? else { break };
            // From the point inside to the surface.
            let slope = found.direction.dot(inward);
            let sample = ProfilePoint { along, depth: found.axis_distance, slope };
            if far.is_some() && sample.depth >= expected - accuracy {
                break;
            }
            if !(slope > 0.0) {
                far = Some((sample, found));
            } else if sample.depth > near.depth {
                near = sample;
                if !(along < end) && far.is_none() {
                    break;
                }
            } else {
                // The depth falls and rises again between them.
                end = (near.along + along) * 0.5;
                far = None;
            }
        }
        let Some((far, other)) = far else { return Ok((AcrossPoint::NONE, sampler.spent)) };
        let (along, _) = near.meeting(&far);
        let point = on_axis + inward * along;
        let corners = positions(vertices, other.corners)?;
        let pair = AxisPoint(point).closest_on_triangle(&corners, f32::INFINITY);
        let Some(pair) = pair else { return Ok((AcrossPoint::NONE, sampler.spent)) };
        let outward = pair.on_surface - point;
        let normal = outward / sqrt(outward.length_squared());
        let fall = normal.dot(inward);
        let weight = first.slope / (first.slope + fall);
        if !(fall > 0.0 && weight < 1.0) {
            return Ok((AcrossPoint::NONE, sampler.spent));
        }
        let barycentric = pair.barycentric;
        let (on_axis, corners) = (point, other.corners);
        let across = AcrossPoint { weight, normal, on_axis, corners, barycentric, speed: 0.0 };
        Ok((across, sampler.spent))
    }
}
