//! Types for two kinds of numbers that are easily confused with each other and with rows of a vertex table.

// Requirement: A-12

use core::fmt;

/// A triangle, by its row in the tree's table, not its number in the mesh's file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct TriangleRow(pub u32);

impl fmt::Display for TriangleRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A vertex, by its number in the mesh, from 0: for messages to people, and for data in the mesh's order.
/// [`Tree::vertex_number`](crate::Tree::vertex_number) finds it from the row in a vertex table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct VertexNumber(pub u32);

impl fmt::Display for VertexNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
