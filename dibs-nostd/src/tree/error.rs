//! Why bytes are not a tree.

use core::fmt;

use crate::tree::format::VERSION;

/// Why bytes are not a tree that this crate can search.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FormatError {
    /// Fewer bytes than a header, or than the header states.
    Length {
        /// Bytes needed.
        expected: u32,
        /// Bytes given.
        found: u32,
    },
    /// The first four bytes are not `DIBS`.
    Magic {
        /// The four bytes.
        found: [u8; 4],
    },
    /// A layout version that this crate does not read.
    Version {
        /// The version.
        found: u16,
    },
    /// The index width is not that of the tree type.
    Width {
        /// Bytes of an index in the tree type.
        expected: u8,
        /// Bytes of an index in these bytes.
        found: u8,
    },
    /// The checksum does not match: the bytes changed since they were written.
    Checksum {
        /// The checksum in the header.
        stated: u32,
        /// The checksum of the bytes.
        computed: u32,
    },
    /// A header field has a value that no builder writes.
    Field {
        /// Offset of the field in the header.
        offset: u8,
        /// Its value.
        value: u32,
    },
    /// A section is missing, misplaced, or not as long as the counts require.
    Section {
        /// The section's kind, see [`crate::format::section`].
        kind: u32,
    },
    /// A section of an unknown kind that must not be skipped.
    Kind {
        /// The section's kind.
        kind: u32,
    },
    /// A node's children do not follow those of the previous node.
    NodeOrder {
        /// Row of the first child that is out of place.
        node: u32,
    },
    /// A pin is not a vertex of the mesh.
    Pin {
        /// Row of the node record.
        node: u32,
        /// The pin.
        pin: u32,
    },
    /// A radius code is larger than its width's largest.
    Radius {
        /// Row of the node record.
        node: u32,
        /// The radius code.
        code: u32,
    },
    /// A leaf's triangles do not follow the previous leaf's, or extend beyond the table.
    Leaf {
        /// First triangle of the leaf.
        first: u32,
    },
    /// The first or second corner of a triangle (other than a leaf's first) is new to the leaf.
    Patch {
        /// Row of the triangle.
        triangle: u32,
        /// The corner.
        vertex: u32,
    },
    /// A triangle's corner is not a vertex of the mesh.
    Corner {
        /// Row of the triangle.
        triangle: u32,
        /// The corner.
        vertex: u32,
    },
    /// A row of the vertex order is not a vertex of the mesh.
    Order {
        /// Row of the vertex order.
        row: u32,
    },
    /// A triangle's rest metric is not finite, is negative, or continues an edge that the previous row does not have.
    Metric {
        /// Row of the triangle.
        triangle: u32,
    },
    /// A triangle's stretch limit is zero.
    Limit {
        /// Row of the triangle.
        triangle: u32,
    },
    /// A triangle's neighbour across an edge does not exist, or has another neighbour there.
    Neighbour {
        /// Row of the triangle.
        triangle: u32,
        /// The edge: 0 from the first corner to the second, 1 to the third, 2 back to the first.
        edge: u32,
    },
    /// A coordinate of the origin is not finite.
    Origin {
        /// The axis: 0 is x.
        axis: u8,
    },
    /// A traversal needs more or fewer stack entries than the header states.
    Stack {
        /// Entries in the header.
        stated: u32,
        /// Entries needed.
        found: u32,
    },
}

impl fmt::Display for FormatError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Length { expected, found } => {
                write!(f, "a tree of {expected} bytes expected, {found} bytes found")
            }
            Self::Magic { found } => write!(f, "not a tree: starts with {found:02x?}, not DIBS"),
            Self::Version { found } => {
                write!(f, "tree format version {found}, this library reads version {VERSION}")
            }
            Self::Width { expected, found } => {
                write!(f, "indices of {found} bytes, the tree type has {expected}")
            }
            Self::Checksum { stated, computed } => {
                write!(f, "checksum {computed:08x}, the header states {stated:08x}")
            }
            Self::Field { offset, value } => {
                write!(f, "header field at {offset} holds {value:#x}, which is not valid")
            }
            Self::Section { kind } => write!(f, "section {kind} is missing or has a wrong size"),
            Self::Kind { kind } => {
                write!(
                    f,
                    "section {kind} is of a kind that this library does not read: use a newer one"
                )
            }
            Self::NodeOrder { node } => write!(f, "node {node} is out of order"),
            Self::Pin { node, pin } => write!(f, "node {node} is pinned to missing vertex {pin}"),
            Self::Radius { node, code } => write!(f, "node {node} has radius code {code}"),
            Self::Leaf { first } => write!(f, "the leaf at triangle {first} is out of order"),
            Self::Patch { triangle, vertex } => {
                write!(
                    f,
                    "corner {vertex} of triangle {triangle} is new to its leaf, but not third"
                )
            }
            Self::Corner { triangle, vertex } => {
                write!(f, "triangle {triangle} uses missing vertex {vertex}")
            }
            Self::Order { row } => write!(f, "vertex order row {row} is not a vertex"),
            Self::Metric { triangle } => write!(f, "triangle {triangle} has an impossible metric"),
            Self::Limit { triangle } => write!(f, "triangle {triangle} has no stretch limit"),
            Self::Neighbour { triangle, edge } => {
                write!(f, "triangle {triangle} has a wrong neighbour across its edge {edge}")
            }
            Self::Origin { axis } => write!(f, "coordinate {axis} of the origin is not finite"),
            Self::Stack { stated, found } => {
                write!(f, "{found} stack entries are needed, the header states {stated}")
            }
        }
    }
}

impl core::error::Error for FormatError {}
