//! Defects of the nodes that a tree carries.

use core::fmt;

/// Why a tree's nodes cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum NodesError {
    /// The tree was built without nodes.
    Absent,
    /// The section is not as long as its counts require.
    Length {
        /// Bytes that the counts require.
        expected: u64,
        /// Bytes of the section.
        found: u64,
    },
    /// A header field has a value that no builder writes.
    Field {
        /// Offset of the field in the section.
        offset: u8,
        /// Its value.
        value: u32,
    },
    /// A node's rest position is not finite, or too far away.
    Node {
        /// The node.
        node: u32,
    },
    /// An element has a node that does not exist.
    Corner {
        /// The element.
        element: u32,
        /// The number of its node.
        node: u32,
        /// Nodes of the surface.
        nodes: u32,
    },
    /// The constants of an element's check are not valid, or elements are not sorted by their latest node.
    Element {
        /// The element.
        element: u32,
    },
    /// An element is inverted or flat at rest.
    Inverted {
        /// The element.
        element: u32,
    },
    /// A vertex is bound to an element that does not exist.
    Binding {
        /// Row of the vertex.
        vertex: u32,
        /// The number of its element.
        element: u32,
        /// Elements of the surface.
        elements: u32,
    },
    /// A vertex is outside of its element, in a tree where none may be, or too far outside.
    Weights {
        /// Row of the vertex.
        vertex: u32,
        /// The sum of the absolute values of its weights, in units of 1/65,536: 65,536 if inside; three times that is
        /// too large.
        sum: u32,
    },
    /// A vertex has a weight for a node that is not marked as carrying one.
    Unmarked {
        /// Row of the vertex.
        vertex: u32,
        /// The node.
        node: u32,
    },
    /// A node that does not exist is marked as carrying a vertex.
    Marked {
        /// The number of the node.
        node: u32,
        /// Nodes of the surface.
        nodes: u32,
    },
}

impl fmt::Display for NodesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Absent => write!(f, "the tree was built without nodes"),
            Self::Length { expected, found } => {
                write!(f, "nodes of {expected} bytes expected, {found} bytes found")
            }
            Self::Field { offset, value } => {
                write!(f, "field at {offset} of the nodes holds {value:#x}, which is not valid")
            }
            Self::Node { node } => write!(f, "the rest position of node {node} is not valid"),
            Self::Corner { element, node, nodes } => {
                write!(f, "element {element} has node {node}, there are {nodes}")
            }
            Self::Element { element } => write!(f, "the record of element {element} is not valid"),
            Self::Inverted { element } => {
                write!(f, "element {element} is inverted or flat at rest")
            }
            Self::Binding { vertex, element, elements } => {
                write!(f, "vertex {vertex} is bound to element {element}, there are {elements}")
            }
            Self::Unmarked { vertex, node } => {
                write!(f, "node {node} carries vertex {vertex} without a mark")
            }
            Self::Marked { node, nodes } => {
                write!(f, "node {node} is marked as carrying a vertex, there are {nodes}")
            }
            Self::Weights { vertex, sum } => {
                write!(f, "the absolute weights of vertex {vertex} sum up to {sum} parts of 65536")
            }
        }
    }
}

impl core::error::Error for NodesError {}
