//! The signed separation: the least signed distance of any point of the tool's axis, less the radius.
//!
//! The signed distance of a point is negative inside. It changes by at most the motion of point and surface, and so
//! does its minimum over an axis. That minimum is at the closest pair if the axis is outside, and at the deepest point
//! if it crosses or is inside.

// Requirements: A-03, S-02

use glam::Vec3;

use super::depth::Depth;
use super::memory::depth::KnownDepthMut;
use super::search::{Ties, WaitingNode};
use super::side::{self, AxisPlace};
use super::sides::{NoSide, Side};
use super::{Options, Proximity, solids};
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tool, Tree, VertexTable};

pub(super) struct Request<'a, 't, I, V: ?Sized, T> {
    pub tree: &'a Tree<'t, I>,
    pub vertices: &'a V,
    pub tool: &'a T,
    pub options: &'a Options,
}

/// Adds the side and the signed separation that follows from it, for exact positions. `ties` are the triangles that may
/// be the closest, `known` is a tracker's memory of the last tick's depth.
#[inline(never)]
pub(super) fn signed<I: Index, V: VertexTable + ?Sized, T: Tool>(
    tree: &Tree<'_, I>,
    stack: &mut [WaitingNode],
    vertices: &V,
    tool: &T,
    options: &Options,
    found: &mut Proximity,
    memory: (&mut Ties, Option<KnownDepthMut<'_>>),
) -> Result<(), QueryError> {
    let asked = Request { tree, vertices, tool, options };
    if !options.is_signed {
        found.side = Side::Undefined(NoSide::NotAsked);
    } else if !tree.has_adjacency() {
        found.side = Side::Undefined(NoSide::NoAdjacency);
    } else if tree.header().other_roots > 0 {
        solids::signed(&asked, stack, found, memory)?;
    } else {
        asked.signed(stack, found, memory, RootSet::ALL)?;
    }
    found.coverage = options.coverage(vertices);
    Ok(())
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Request<'_, '_, I, V, T> {
    /// Replaces `found`, the closest pair below some roots, by their signed answer.
    #[inline(always)]
    pub fn signed(
        &self,
        stack: &mut [WaitingNode],
        found: &mut Proximity,
        (ties, known): (&mut Ties, Option<KnownDepthMut<'_>>),
        roots: RootSet,
    ) -> Result<(), QueryError> {
        let &Self { tree, vertices, tool, options } = self;
        let has_length = tool.axis_length() > 0.0;
        // No triangle is closer than one that the axis touches, so its side is certain without the remaining budget.
        let is_touching = found.triangle.is_some() && found.axis_distance <= found.accuracy;
        let is_open = found.is_cut_short() && !is_touching;
        if is_open {
            found.side = Side::Undefined(NoSide::CutShort);
            // If nothing suggests that the axis is inside, its depth is not needed.
            if !(has_length && known.as_ref().is_some_and(KnownDepthMut::may_be_inside)) {
                return Ok(());
            }
        }
        if roots != RootSet::ALL {
            ties.keep(|row| roots.contains(tree.root_of(row)));
        }
        if !(is_open || is_touching && has_length) {
            let on_axis = tool.axis_point(found.axis_parameter);
            let is_many = ties.are_missing() && !is_touching;
            let many = is_many
                .then(|| side::of_many(roots, tree, stack, vertices, found, on_axis, options))
                .transpose()?;
            let point = AxisPlace::new(tool, found.axis_parameter);
            let left = options.after(found.tests()).budget.tests();
            let at = side::of_point(tree, vertices, found, &point, ties, many, left)?;
            found.node_tests = found.node_tests.saturating_add(at.work);
            found.side = at.side;
            if at.outward != Vec3::ZERO {
                found.direction = at.outward;
                found.point_on_tool = on_axis - at.outward * tool.radius();
            }
            // Too close for a side of its own, but too far to cross: the axis is on the side of any of its points.
            let is_near = at.side == Side::Undefined(NoSide::BelowAccuracy)
                && tree.is_closed()
                && found.axis_distance <= 2.0 * found.accuracy;
            if !((at.side == Side::Inside || is_near) && has_length) {
                if let Some(known) = known {
                    known.forget();
                }
                if at.side == Side::Inside {
                    found.separation = -found.axis_distance - tool.radius();
                    found.lower = found.separation;
                }
                return Ok(());
            }
        }
        let known = known.map(|known| known.now(roots));
        let mut depth = Depth::new(tree, stack, vertices, tool, options, found, known, roots, ties);
        let answer = depth.run()?;
        *found = answer;
        Ok(())
    }
}
