//! Why a query gives no answer.

// Requirement: A-07

use core::fmt;

/// Why a query gave no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum QueryError {
    /// The query's stack is smaller than the tree needs.
    Stack {
        /// Entries that the tree needs.
        needed: u32,
        /// Entries of the query.
        available: u32,
    },
    /// The vertex table does not have one row for each of the tree's vertices.
    VertexCount {
        /// Rows that the tree needs.
        expected: u32,
        /// Rows of the table.
        found: u32,
    },
    /// A vertex's position is not a finite number, or so far away that f32 lengths overflow.
    Position {
        /// Row of the vertex.
        vertex: u32,
    },
    /// The stretch was measured with another tree.
    OtherTree {
        /// Checksum of the tree.
        expected: u32,
        /// Checksum of the measurement's tree.
        found: u32,
    },
    /// The stretch was measured on another frame.
    OtherFrame {
        /// Number of the searched frame.
        expected: u32,
        /// Number of the measured frame.
        found: u32,
    },
    /// No triangle was found as close as the nearest pin: the surface is stretched beyond the query's limit, or the
    /// tree's bytes changed after they were validated.
    Uncovered {
        /// Row of the nearest pin.
        pin: u32,
    },
    /// The tree has no adjacency, so a triangle's neighbours are unknown.
    NoAdjacency,
    /// The tree was built without its vertex order, so the row of a vertex of the mesh's file is unknown.
    NoVertexOrder,
    /// A list of contacts with capacity zero, or too large.
    Contacts {
        /// Contacts that the list holds.
        capacity: u32,
        /// Triangles that it can compare, at most 65,534.
        near: u32,
    },
    /// A margin that is not a number of at least 0.
    Margin {
        /// Its bits.
        bits: u32,
    },
    /// A time between two frames that is not in 0..=1.
    BlendTime {
        /// Its bits.
        bits: u32,
    },
    /// A row outside its table: the tree's bytes changed after they were validated.
    Corrupt {
        /// The row that is missing.
        row: u32,
    },
}

impl fmt::Display for QueryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Stack { needed, available } => {
                write!(f, "the tree needs a stack of {needed} entries, the query has {available}")
            }
            Self::VertexCount { expected, found } => {
                write!(f, "the tree has {expected} vertices, the table {found}")
            }
            Self::Position { vertex } => {
                write!(f, "the position of vertex {vertex} is not finite or too large")
            }
            Self::OtherTree { expected, found } => {
                write!(f, "stretch measured with tree {found:08x}, this is tree {expected:08x}")
            }
            Self::OtherFrame { expected, found } => {
                write!(f, "stretch measured on frame {found}, this is frame {expected}")
            }
            Self::Uncovered { pin } => {
                write!(
                    f,
                    "no triangle is as close as vertex {pin}: over-stretched or corrupt"
                )
            }
            Self::NoAdjacency => f.write_str(
                "the tree has no sides: its triangles are wound against each other (`dibs build --orient` turns them), or \
                 it was built without adjacency",
            ),
            Self::NoVertexOrder => f.write_str(
                "the tree was built without its vertex order (`with_vertex_order`): give rows, or build it with its order",
            ),
            Self::Contacts { capacity, near } => {
                write!(f, "a list cannot hold {capacity} contacts and compare {near} triangles")
            }
            Self::Margin { bits } => write!(f, "a margin cannot be {}", f32::from_bits(bits)),
            Self::BlendTime { bits } => {
                write!(f, "the time between two frames, from 0 to 1, cannot be {}", f32::from_bits(bits))
            }
            Self::Corrupt { row } => write!(f, "row {row} is missing: the tree's bytes changed"),
        }
    }
}

impl core::error::Error for QueryError {}
