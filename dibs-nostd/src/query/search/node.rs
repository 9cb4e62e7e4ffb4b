//! The stack of waiting subtrees, and the tests of a node's children.

// Requirement: A-04

use glam::Vec3;

use super::{Search, WaitingNode};
use crate::math::sqrt::sqrt;
use crate::tree::format::{Node, NodeLink};
use crate::unavailable::QueryError;
use crate::{Index, Tool, VertexTable};

/// For the closest pair: a pin lowers the cutoff.
pub(super) const CLOSEST: u8 = 0;
/// For everything within the cutoff.
pub(super) const RANGE: u8 = 1;
/// For the closest pair and the leaves up to a distance beyond it; their planes are tested when they are popped.
pub(super) const AROUND: u8 = 2;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// Removes the nearest subtree from the stack.
    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<WaitingNode> {
        let top = self.waiting.checked_sub(1)?;
        let &subtree = self.stack.get(top)?;
        self.waiting = top;
        Some(subtree)
    }

    /// Inserts a subtree into the part of the stack from `base` on, nearest on top; `None` if the stack is full.
    #[inline(always)]
    pub(super) fn push(&mut self, base: usize, subtree: WaitingNode) -> Option<()> {
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

    /// The least lower bound of the waiting subtrees and an unfinished one.
    #[inline(always)]
    pub(super) fn least_waiting(&self, lower: f32) -> f32 {
        let waiting = self.stack.iter().take(self.waiting).map(|left| left.lower);
        // A pin at a distance of NaN gives no bound.
        let known = |lower: f32| if lower.is_nan() { 0.0 } else { lower };
        let least = |least, lower| if known(lower) < least { known(lower) } else { least };
        waiting.fold(known(lower), least)
    }

    /// A child's pin, the vector from it to the axis, its length, and the lower bound of the child's sphere.
    #[inline(always)]
    pub(super) fn child(&self, child: &Node) -> Result<(Vec3, Vec3, f32, f32), QueryError> {
        let position = self.position(child.pin)?;
        let normal = self.tool.axis_to(position);
        let distance = sqrt(normal.dot(normal));
        Ok((position, normal, distance, distance - child.radius_code as f32 * self.radius_scale))
    }

    /// Tests the spheres of a node's children, and the planes of its leaves, up to `wider` (mm) beyond the cutoff;
    /// pushes the rest. The caller has counted the spheres. Each child's bound is at least its parent's, so the
    /// certified bound never falls. Not by [`Self::child`]: most children are rejected before the root of their distance.
    #[inline(always)]
    pub(super) fn expand<const KIND: u8>(
        &mut self,
        parent: f32,
        first: u32,
        count: u32,
        wider: f32,
    ) -> Result<(), QueryError> {
        let corrupt = QueryError::Corrupt { row: first };
        let base = self.waiting;
        let tree = self.tree;
        for node in tree.records(first, count).ok_or(corrupt)? {
            let position = self.position(node.pin)?;
            let radius = node.radius_code as f32 * self.radius_scale;
            let normal = self.tool.axis_to(position);
            let squared = normal.dot(normal);
            let far = if KIND == AROUND { self.cutoff + wider } else { self.cutoff } + radius;
            // NaN counts as near: the leaves below report the vertex that it comes from.
            if squared > far * far {
                continue;
            }
            let distance = sqrt(squared);
            if KIND != RANGE {
                self.lower_cutoff_to_pin(node.pin, distance);
            }
            // The plane test needs the vector to the leaf's pin, which is known here. The plane goes through the pin:
            // it rejects no leaf whose pin is within the range.
            if KIND != AROUND
                && (KIND == CLOSEST || squared > self.cutoff_squared)
                && let NodeLink::Leaf { first, count } = NodeLink::decode(node.link)
                && (KIND == RANGE || self.meter.node().is_some())
            {
                let plane = self.plane_across(normal, position, distance);
                let beyond = plane.beyond(tree, self.vertices, first, count).ok_or(corrupt)?;
                if beyond == count {
                    continue;
                }
            }
            let own = distance - radius;
            let lower = if own > parent { own } else { parent };
            self.push(base, WaitingNode { lower, link: node.link }).ok_or(corrupt)?;
        }
        Ok(())
    }
}
