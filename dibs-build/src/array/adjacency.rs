//! The triangles across each triangle's edges, in the order of the tree's rows.

use std::collections::HashMap;

use dibs_nostd::Index;
use dibs_nostd::format::no_neighbour;

use super::flatten::put;
use crate::leaf::StoredTriangle;

/// The adjacency section; `None` for a surface without sides, with an edge of more than two triangles, or of two that
/// run along it in the same direction.
pub(super) fn adjacency<I: Index>(triangles: &[StoredTriangle]) -> Option<Vec<u8>> {
    let mut row_of = HashMap::with_capacity(3 * triangles.len());
    for (row, placed) in (0..).zip(triangles) {
        for edge in edges(placed.corners) {
            if row_of.insert(edge, row).is_some() {
                return None;
            }
        }
    }
    let mut bytes = Vec::with_capacity(3 * I::BYTES * triangles.len());
    for placed in triangles {
        for (from, to) in edges(placed.corners) {
            put::<I>(&mut bytes, row_of.get(&(to, from)).copied().unwrap_or(no_neighbour::<I>()));
        }
    }
    Some(bytes)
}

/// The directed edges of a triangle.
fn edges([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}
