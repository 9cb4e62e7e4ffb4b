//! Heights: the squares of vertices' distances from the axis.
//!
//! A vertex is a corner of several triangles, in one leaf and in the leaves around it. A small direct-mapped cache
//! keeps recently seen vertices until another vertex evicts them.

// Requirement: S-04

use glam::Vec3;
use heapless::Vec;

use super::Search;
use crate::math::order::smaller;
use crate::query::Options;
use crate::query::prices::{LEAF, SEEN};
use crate::unavailable::QueryError;
use crate::{Index, Tool, Tree, TriangleRow, VertexTable};

/// Slots of the cache. Neighbouring vertices have rows close together; the last bits of a row select the slot.
const SLOTS: usize = 128;

/// No vertex has this row.
const NO_VERTEX: u32 = u32::MAX;
/// No triangle represents the vertex yet.
const NO_TRIANGLE: u32 = u32::MAX;
/// The vertex needs no representative triangle: a lower vertex is next to it.
const NOT_LOWEST: u32 = u32::MAX - 1;

/// A vertex as seen from the axis.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    pub row: u32,
    /// The square of its distance.
    pub square: f32,
    pub position: Vec3,
    /// The shortest vector from the axis.
    pub towards: Vec3,
    /// The candidate: a triangle whose lowest corner it is, or [`NO_TRIANGLE`], or [`NOT_LOWEST`].
    candidate: u32,
}

impl Vertex {
    const UNSEEN: Self = Self {
        row: NO_VERTEX,
        square: f32::INFINITY,
        position: Vec3::ZERO,
        towards: Vec3::ZERO,
        candidate: NO_TRIANGLE,
    };

    /// The triangle that represents the vertex, until a lower vertex is seen next to it.
    #[inline(always)]
    pub const fn candidate(&self) -> Option<u32> {
        if self.candidate < NOT_LOWEST { Some(self.candidate) } else { None }
    }
}

/// A vertex's slot in the cache.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct CacheSlot(usize);

impl CacheSlot {
    /// The slot of a vertex, unless another corner of its triangle occupies it.
    const fn of(row: u32) -> Self {
        Self(row as usize % SLOTS)
    }

    const fn next(self) -> Self {
        Self((self.0 + 1) % SLOTS)
    }

    /// Three different slots for a triangle's corners.
    #[inline(always)]
    fn of_corners([a, b, c]: [u32; 3]) -> [Self; 3] {
        let (first, mut second, mut third) = (Self::of(a), Self::of(b), Self::of(c));
        if second == first {
            second = second.next();
        }
        let is_taken = |slot| slot == first || slot == second;
        if is_taken(third) {
            third = third.next();
            if is_taken(third) {
                third = third.next();
            }
        }
        [first, second, third]
    }

    pub fn all() -> impl Iterator<Item = Self> {
        (0..SLOTS).map(Self)
    }
}

/// The cache of recently seen vertices.
pub(super) struct Heights {
    /// Only triangles with this label are considered.
    part: Option<u8>,
    /// Whether the search's [work besides tests](crate::query::prices) counts.
    pub is_priced: bool,
    slots: [Vertex; SLOTS],
    /// Vertices evicted while a triangle represented them: at most one for each corner of a triangle.
    evicted: Vec<Vertex, 3>,
}

impl Heights {
    pub const fn new(&Options { part, is_priced, .. }: &Options) -> Self {
        Self { part, is_priced, slots: [Vertex::UNSEEN; SLOTS], evicted: Vec::new() }
    }

    /// The price of a leaf's triangles, in node tests.
    #[inline(always)]
    pub const fn price_of(&self, triangles: u32) -> u32 {
        if self.is_priced { LEAF + (1 + SEEN) * triangles } else { triangles }
    }

    /// Whether triangles are left out.
    #[inline(always)]
    pub const fn is_of_part(&self) -> bool {
        self.part.is_some()
    }

    /// Whether a triangle is left out.
    #[inline(always)]
    pub fn leaves_out<I: Index>(&self, tree: &Tree<'_, I>, triangle: u32) -> bool {
        self.part.is_some() && tree.label(TriangleRow(triangle)) != self.part
    }

    #[inline(always)]
    pub const fn at(&self, CacheSlot(at): CacheSlot) -> &Vertex {
        &self.slots[at % SLOTS]
    }

    /// Notes that a lower vertex is next to this one.
    #[inline(always)]
    pub fn resolve(&mut self, CacheSlot(at): CacheSlot) {
        self.slots[at % SLOTS].candidate = NOT_LOWEST;
    }

    /// Makes a triangle represent this vertex, its lowest corner, if none does.
    #[inline(always)]
    pub fn add_candidate(&mut self, CacheSlot(at): CacheSlot, triangle: u32) {
        let vertex = &mut self.slots[at % SLOTS];
        if vertex.candidate == NO_TRIANGLE {
            vertex.candidate = triangle;
        }
    }

    /// The last evicted vertex.
    #[inline(always)]
    pub fn evicted(&self) -> Option<&Vertex> {
        self.evicted.last()
    }

    /// Removes the last evicted vertex.
    pub fn drop_evicted(&mut self) {
        self.evicted.pop();
    }

    /// The least squared distance of a vertex that a triangle represents.
    pub fn least_candidate(&self) -> f32 {
        let candidates =
            self.slots.iter().chain(&self.evicted).filter(|vertex| vertex.candidate().is_some());
        candidates.fold(f32::INFINITY, |least, vertex| smaller(least, vertex.square))
    }
}

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Search<'_, '_, I, V, T> {
    /// The slots of a triangle's corners, which are loaded if missing.
    #[inline(always)]
    pub(super) fn slots(
        &self,
        heights: &mut Heights,
        [a, b, c]: [u32; 3],
    ) -> Result<[CacheSlot; 3], QueryError> {
        let [first, second, third] = CacheSlot::of_corners([a, b, c]);
        self.measure(heights, first, a)?;
        self.measure(heights, second, b)?;
        self.measure(heights, third, c)?;
        Ok([first, second, third])
    }

    /// Loads a vertex, unless it is in its slot.
    #[inline(always)]
    fn measure(
        &self,
        heights: &mut Heights,
        CacheSlot(at): CacheSlot,
        row: u32,
    ) -> Result<(), QueryError> {
        let vertex = &mut heights.slots[at % SLOTS];
        if vertex.row == row {
            return Ok(());
        }
        if vertex.candidate().is_some() {
            let _ = heights.evicted.push(*vertex);
        }
        let position = self.position(row)?;
        let towards = self.tool.axis_to(position);
        let square = finite(row, towards.dot(towards))?;
        *vertex = Vertex { row, square, position, towards, candidate: NO_TRIANGLE };
        Ok(())
    }

    /// The distance of a vertex from the axis.
    #[inline(always)]
    pub(super) fn height(&self, heights: &Heights, row: u32) -> Result<f32, QueryError> {
        let vertex = heights.at(CacheSlot::of(row));
        if vertex.row == row {
            return Ok(vertex.square);
        }
        finite(row, self.tool.axis_distance_squared(self.position(row)?))
    }
}

/// The square of a vertex's distance. Written so that NaN is rejected.
#[inline(always)]
fn finite(vertex: u32, square: f32) -> Result<f32, QueryError> {
    if square <= f32::MAX { Ok(square) } else { Err(QueryError::Position { vertex }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_corners_of_a_triangle_have_one_slot() {
        let near = || (0..6).chain(SLOTS as u32 - 3..SLOTS as u32 + 3);
        for (a, b) in near().flat_map(|a| near().map(move |b| (a, b))) {
            for c in near() {
                let [first, second, third] = CacheSlot::of_corners([a, b, c]);
                assert!(first != second && second != third && third != first, "{a} {b} {c}");
            }
        }
    }
}
