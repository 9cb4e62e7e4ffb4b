//! Heights: the squares of vertices' distances from the axis.
//!
//! A vertex is a corner of several triangles, of one leaf and of the leaves around it. A small table keeps the vertices
//! seen last, each until another takes its place.

use glam::Vec3;

use super::Search;
use crate::unavailable::QueryError;
use crate::{Index, Tool, VertexTable};

/// Places of the table. Neighbouring vertices have rows close together, and the last bits of a row are its place.
const PLACES: usize = 32;

/// No vertex has this row.
const NONE: u32 = u32::MAX;

/// A vertex seen from the axis.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    row: u32,
    /// The square of its distance.
    pub square: f32,
    pub position: Vec3,
    /// Whether a lower vertex is known to be next to it, or a triangle around it was visited.
    is_settled: bool,
}

/// The vertices seen last.
pub(super) struct Heights([Vertex; PLACES]);

impl Heights {
    pub const fn new() -> Self {
        let none = Vertex { row: NONE, square: 0.0, position: Vec3::ZERO, is_settled: false };
        Self([none; PLACES])
    }

    #[inline(always)]
    fn place(&mut self, row: u32) -> &mut Vertex {
        let Self(places) = self;
        &mut places[row as usize % PLACES]
    }

    /// Whether a vertex is known to have a lower one next to it, or a triangle around it was visited.
    #[inline(always)]
    pub fn is_settled(&mut self, row: u32) -> bool {
        let vertex = self.place(row);
        vertex.row == row && vertex.is_settled
    }

    #[inline(always)]
    pub fn settle(&mut self, row: u32) {
        let vertex = self.place(row);
        if vertex.row == row {
            vertex.is_settled = true;
        }
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// A vertex's height and position.
    #[inline(always)]
    pub(super) fn height(
        &self,
        heights: &mut Heights,
        row: u32,
    ) -> Result<(f32, Vec3), QueryError> {
        let vertex = heights.place(row);
        if vertex.row != row {
            let position = self.position(row)?;
            let towards = self.tool.axis_to(position);
            let square = towards.dot(towards);
            // Written so that NaN is refused.
            let is_finite = square <= f32::MAX;
            if !is_finite {
                return Err(QueryError::Position { vertex: row });
            }
            *vertex = Vertex { row, square, position, is_settled: false };
        }
        Ok((vertex.square, vertex.position))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_known_of_a_vertex_is_not_taken_for_another() {
        let mut heights = Heights::new();
        let (one, other) = (5, 5 + PLACES as u32);
        heights.place(one).row = one;
        heights.settle(other);
        assert!(!heights.is_settled(one));
        heights.settle(one);
        assert!(heights.is_settled(one) && !heights.is_settled(other));
    }
}
