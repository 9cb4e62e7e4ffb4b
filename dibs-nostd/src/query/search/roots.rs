//! The roots besides the first, in a tree over surfaces that share no vertex.
//!
//! No sphere around several such surfaces can be invariant, because nothing bounds how far they move apart. So every
//! search begins with the spheres of all roots.

// Requirement: A-08

use super::{NearestPin, WaitingNode};
use crate::math::sqrt::sqrt;
use crate::tool::Tool;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tree, VertexTable};

/// The roots seen so far. It is passed by value: a search whose address is taken does not stay in registers.
pub(super) struct Roots {
    /// Entries on the stack.
    pub waiting: usize,
    /// Distance from the axis to the farthest point of a sphere.
    pub reach: f32,
    /// The largest coordinate of a pin.
    pub coordinate: f32,
    pub nearest: NearestPin,
}

impl Roots {
    /// Adds the other roots of a set to its first, and pushes them, nearest on top.
    #[cold]
    #[inline(never)]
    pub fn with_others<I: Index, V: VertexTable + ?Sized, T: Tool>(
        mut self,
        tree: &Tree<'_, I>,
        stack: &mut [WaitingNode],
        vertices: &V,
        tool: &T,
        radius_scale: f32,
        roots: RootSet,
    ) -> Result<Self, QueryError> {
        let others = roots.first().saturating_add(1)..=tree.header().other_roots;
        for row in others.filter(|&row| roots.contains(row)) {
            let root = tree.record(row).ok_or(QueryError::Corrupt { row })?;
            let pin = vertices.position(root.pin).ok_or(QueryError::Corrupt { row: root.pin })?;
            let distance = sqrt(tool.axis_distance_squared(pin));
            let radius = root.radius_code as f32 * radius_scale;
            let (reach, coordinate) = (distance + radius, pin.abs().max_element());
            // NaN is rejected here, since the comparisons below would drop it.
            if !(reach + coordinate < 1e18) {
                return Err(QueryError::Position { vertex: root.pin });
            }
            if reach > self.reach {
                self.reach = reach;
            }
            if coordinate > self.coordinate {
                self.coordinate = coordinate;
            }
            if distance < self.nearest.distance {
                self.nearest = NearestPin { row: root.pin, distance };
            }
            let subtree = WaitingNode { lower: distance - radius, link: root.link };
            self.push(stack, subtree).ok_or(QueryError::Corrupt { row })?;
        }
        Ok(self)
    }

    fn push(&mut self, stack: &mut [WaitingNode], subtree: WaitingNode) -> Option<()> {
        let mut at = self.waiting;
        while let Some(below) = at.checked_sub(1)
            && let Some(&nearer) = stack.get(below)
            && nearer.lower < subtree.lower
        {
            *stack.get_mut(at)? = nearer;
            at = below;
        }
        *stack.get_mut(at)? = subtree;
        self.waiting += 1;
        Some(())
    }
}
