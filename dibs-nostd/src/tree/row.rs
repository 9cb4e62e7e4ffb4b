//! Two kinds of numbers that are easily taken for one another, and for rows of a vertex table.

use core::fmt;

/// A triangle, by its row in the tree's table. Not its number in the mesh's file: the tree has an order of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TriangleRow(pub u32);

impl fmt::Display for TriangleRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A vertex, by the mesh's own number, counted from 0: for reports to people, and for data in the mesh's order. Not its
/// row in a vertex table: [`Tree::vertex_number`](crate::Tree::vertex_number) leads from one to the other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VertexNumber(pub u32);

impl fmt::Display for VertexNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
