//! Adjacency: the three neighbours of each triangle.
//!
//! A row holds the low 16 bits of each neighbour's row. An orientable surface has every directed edge once, so among
//! the few rows with those bits the neighbour is the one with the reversed edge. A border edge has the largest code,
//! and no such row.

// Requirements: M-01, S-01

use super::{FormatError, Tree, TriangleRow, format};
use crate::Index;

/// Most triangles visited around a vertex.
pub(crate) const MAX_RING: u32 = 256;

impl<I: Index> Tree<'_, I> {
    /// Whether the tree has adjacency, so that its surface has sides.
    #[must_use]
    pub const fn has_adjacency(&self) -> bool {
        !self.sections.adjacency.is_empty()
    }

    /// Whether every edge has a triangle on each side.
    pub(crate) const fn is_closed(&self) -> bool {
        self.closed == self.header.checksum
    }

    /// The triangle across an edge: 0 leads from the first corner to the second, 1 to the third, 2 back to the
    /// first. `None` at a border, outside the table, or where the tree has no adjacency.
    /// Cost: one read of a table row for up to 65,535 triangles; beyond, also at most four triangle rows.
    #[must_use]
    pub const fn neighbour(&self, triangle: TriangleRow, edge: u32) -> Option<TriangleRow> {
        match self.row_across(triangle.0, edge) {
            Some(row) => Some(TriangleRow(row)),
            None => None,
        }
    }

    #[inline]
    pub(crate) const fn row_across(&self, triangle: u32, edge: u32) -> Option<u32> {
        // If no two rows share a code, it is the row itself.
        if self.header.triangles <= u16::MAX as u32 {
            return match format::neighbour_code::<I>(self.sections.adjacency, triangle, edge) {
                Some(row) if row < self.header.triangles => Some(row),
                _ => None,
            };
        }
        match self.across(triangle, edge) {
            Some((row, _)) => Some(row),
            None => None,
        }
    }

    #[inline]
    pub(crate) const fn across(&self, triangle: u32, edge: u32) -> Option<(u32, u32)> {
        let Some(code) = format::neighbour_code::<I>(self.sections.adjacency, triangle, edge)
        else {
            return None;
        };
        let Some(corners) = self.triangle(triangle) else { return None };
        let (from, to) = edge_of(corners, edge);
        let mut row = code;
        while row < self.header.triangles {
            if let Some(other) = self.triangle(row)
                && let Some(back) = edge_between(other, to, from)
            {
                return Some((row, back));
            }
            // A 32-bit code is the row itself.
            if I::BYTES > 2 {
                return None;
            }
            row += 1 << 16;
        }
        None
    }

    /// The next triangle around the vertex at a corner, and the vertex's corner there: across the edge that begins at
    /// the corner. A walk ends where it is back at its first triangle, or after [`MAX_RING`] triangles.
    #[inline]
    pub(crate) const fn next_around(&self, triangle: u32, corner: u32) -> Option<(u32, u32)> {
        match self.across(triangle, corner) {
            Some((next, back)) => Some((next, after(back))),
            None => None,
        }
    }
}

/// The corner after this one. Edge `e` leads from corner `e` to it.
pub(crate) const fn after(corner: u32) -> u32 {
    if corner == 2 { 0 } else { corner + 1 }
}

pub(crate) const fn before(corner: u32) -> u32 {
    if corner == 0 { 2 } else { corner - 1 }
}

/// Both end vertices of a triangle's edge.
const fn edge_of([a, b, c]: [u32; 3], edge: u32) -> (u32, u32) {
    match edge {
        0 => (a, b),
        1 => (b, c),
        _ => (c, a),
    }
}

/// The edge of a triangle that leads from one vertex to another.
const fn edge_between([a, b, c]: [u32; 3], from: u32, to: u32) -> Option<u32> {
    if a == from && b == to {
        Some(0)
    } else if b == from && c == to {
        Some(1)
    } else if c == from && a == to {
        Some(2)
    } else {
        None
    }
}

/// Checks that every neighbour exists and has this triangle as its neighbour. A walk around a vertex then closes, or
/// ends at a border. Returns whether every edge has a neighbour.
pub(super) const fn check<I: Index>(tree: &Tree<'_, I>) -> Result<bool, FormatError> {
    let triangles = tree.header.triangles;
    if !tree.has_adjacency() {
        return Ok(false);
    }
    if triangles > I::MAX_ADJACENT_TRIANGLES {
        return Err(FormatError::Section { kind: format::section::ADJACENCY });
    }
    let (mut triangle, mut is_closed) = (0, true);
    while triangle < triangles {
        let mut edge = 0;
        while edge < 3 {
            let is_right = match tree.across(triangle, edge) {
                Some((row, back)) => match tree.across(row, back) {
                    Some((this, _)) => this == triangle && row != triangle,
                    None => false,
                },
                None => {
                    is_closed = false;
                    match format::neighbour_code::<I>(tree.sections.adjacency, triangle, edge) {
                        Some(code) => code == format::no_neighbour::<I>(),
                        None => false,
                    }
                }
            };
            if !is_right {
                return Err(FormatError::Neighbour { triangle, edge });
            }
            edge += 1;
        }
        triangle += 1;
    }
    Ok(is_closed)
}

#[cfg(test)]
mod tests {
    use dibs_build::{Builder, IndexWidth, generate};

    use super::*;

    /// Why a tree whose header states this many triangles is refused; it has the rows of 320.
    fn refusal<I: Index>(width: IndexWidth, triangles: u32) -> FormatError {
        let mesh = generate::heart(320).expect("a valid size").mesh;
        let built = Builder::new().index(width).build(&mesh).expect("a valid mesh");
        let mut tree = Tree::<I>::from_bytes(built.blob()).expect("valid");
        assert_eq!(check(&tree), Ok(true));
        tree.header.triangles = triangles;
        check(&tree).expect_err("rows are missing")
    }

    #[test]
    fn a_walk_around_a_vertex_keeps_to_it_and_closes() {
        let mesh = generate::heart(320).expect("a valid size").mesh;
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let vertex = |(row, corner)| tree.triangle(row).expect("a row")[corner as usize];
        for first in (0..320).flat_map(|row| (0..3).map(move |corner| (row, corner))) {
            let (mut at, mut triangles) = (first, 1);
            loop {
                let next = tree.next_around(at.0, at.1).expect("a closed surface");
                assert_eq!(vertex(next), vertex(first));
                assert_eq!(tree.across(next.0, before(next.1)), Some(at), "the way back");
                if next == first {
                    break;
                }
                (at, triangles) = (next, triangles + 1);
                assert!(next.0 != first.0 && triangles < MAX_RING);
            }
            assert!(triangles > 2);
        }
    }

    /// More than four rows with the same low 16 bits are too many, and a row without neighbours is refused.
    #[test]
    fn a_narrow_tree_has_at_most_four_rows_alike() {
        let missing = FormatError::Neighbour { triangle: 320, edge: 0 };
        let (most, more) = (u16::MAX_ADJACENT_TRIANGLES, u16::MAX_ADJACENT_TRIANGLES + 1);
        let too_many = FormatError::Section { kind: format::section::ADJACENCY };
        assert_eq!(refusal::<u16>(IndexWidth::Bits16, most), missing);
        assert_eq!(refusal::<u16>(IndexWidth::Bits16, more), too_many);
        assert_eq!(refusal::<u32>(IndexWidth::Bits32, more), missing);
    }
}
