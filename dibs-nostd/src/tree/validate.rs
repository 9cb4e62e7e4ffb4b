//! Whether bytes are a tree: the well-formedness checker, separate from everything that uses trees.

use core::fmt;

use crate::Index;
use crate::tree::format::{
    CHECKSUM_AT, CRC, HEADER_BYTES, Join, Link, MAGIC, MAX_LEAF_TRIANGLES, MAX_STACK, PathKind,
    VERSION, limit_code, u32_at,
};
use crate::tree::{Header, Tree};

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
        /// Bytes an index takes in the tree type.
        expected: u8,
        /// Bytes an index takes in these bytes.
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
    /// A node's children do not follow those of the node before it.
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
    /// A leaf's triangles do not follow the leaf before it, or run beyond the table.
    Leaf {
        /// First triangle of the leaf.
        first: u32,
    },
    /// The first or second corner of a triangle, not a leaf's first, is new to the leaf.
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
    /// A triangle's rest metric is not finite, is negative, or goes on from an edge that is not there.
    Metric {
        /// Row of the triangle.
        triangle: u32,
    },
    /// A triangle's stretch limit is zero.
    Limit {
        /// Row of the triangle.
        triangle: u32,
    },
    /// A traversal's stack needs more or fewer entries than the header states.
    Stack {
        /// Entries in the header.
        stated: u32,
        /// Entries found.
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
            Self::NodeOrder { node } => write!(f, "node {node} is out of order"),
            Self::Pin { node, pin } => write!(f, "node {node} is pinned to missing vertex {pin}"),
            Self::Radius { node, code } => write!(f, "node {node} has radius code {code}"),
            Self::Leaf { first } => write!(f, "the leaf at triangle {first} is out of order"),
            Self::Patch { triangle, vertex } => {
                write!(f, "corner {vertex} of triangle {triangle} is not where its leaf needs it")
            }
            Self::Corner { triangle, vertex } => {
                write!(f, "triangle {triangle} uses missing vertex {vertex}")
            }
            Self::Order { row } => write!(f, "vertex order row {row} is not a vertex"),
            Self::Metric { triangle } => write!(f, "triangle {triangle} has an impossible metric"),
            Self::Limit { triangle } => write!(f, "triangle {triangle} has no stretch limit"),
            Self::Stack { stated, found } => {
                write!(f, "{found} stack entries are needed, the header states {stated}")
            }
        }
    }
}

impl core::error::Error for FormatError {}

/// A header field that every builder writes and this read cannot miss, since the length was checked.
const fn field(bytes: &[u8], offset: usize) -> Result<u32, FormatError> {
    match u32_at(bytes, offset) {
        Some(value) => Ok(value),
        None => {
            Err(FormatError::Length { expected: HEADER_BYTES as u32, found: bytes.len() as u32 })
        }
    }
}

macro_rules! tri {
    ($result:expr) => {
        match $result {
            Ok(value) => value,
            Err(error) => return Err(error),
        }
    };
}

pub(crate) const fn header<I: Index>(bytes: &[u8]) -> Result<Header, FormatError> {
    let Some(start) = bytes.first_chunk::<HEADER_BYTES>() else {
        return Err(FormatError::Length {
            expected: HEADER_BYTES as u32,
            found: bytes.len() as u32,
        });
    };
    let magic = [start[0], start[1], start[2], start[3]];
    if u32::from_le_bytes(magic) != u32::from_le_bytes(MAGIC) {
        return Err(FormatError::Magic { found: magic });
    }
    let version = u16::from_le_bytes([start[4], start[5]]);
    if version != VERSION {
        return Err(FormatError::Version { found: version });
    }
    let (width, path_code) = (start[6], start[7]);
    if width as usize != I::BYTES {
        return Err(FormatError::Width { expected: I::BYTES as u8, found: width });
    }
    let Some(paths) = PathKind::from_code(path_code) else {
        return Err(FormatError::Field { offset: 7, value: path_code as u32 });
    };
    let length = tri!(field(bytes, 52));
    if length as usize != bytes.len() {
        return Err(FormatError::Length { expected: length, found: bytes.len() as u32 });
    }
    tri!(checksum(bytes));
    let header = Header {
        paths,
        mesh_id: tri!(field(bytes, 8)),
        vertices: tri!(field(bytes, 12)),
        triangles: tri!(field(bytes, 16)),
        nodes: tri!(field(bytes, 20)),
        stack: tri!(field(bytes, 24)),
        stretch: f32::from_bits(tri!(field(bytes, 28))),
        radius_unit: f32::from_bits(tri!(field(bytes, 32))),
        position_error: f32::from_bits(tri!(field(bytes, 36))),
        sections: tri!(field(bytes, 48)),
        checksum: tri!(field(bytes, CHECKSUM_AT)),
    };
    let mut reserved = 40;
    while reserved < 48 {
        let value = tri!(field(bytes, reserved));
        if value != 0 {
            return Err(FormatError::Field { offset: reserved as u8, value });
        }
        reserved += 4;
    }
    let last = tri!(field(bytes, 56));
    let wrong = if header.vertices == 0 || header.vertices > I::MAX_VERTICES {
        Some((12, header.vertices))
    } else if header.triangles == 0 || header.triangles >= 1 << 28 {
        Some((16, header.triangles))
    } else if header.nodes == 0 || header.nodes >= 1 << 28 {
        Some((20, header.nodes))
    } else if header.stack as usize > MAX_STACK {
        Some((24, header.stack))
    } else if !(header.stretch >= 1.0 && header.stretch <= 1e6) {
        Some((28, header.stretch.to_bits()))
    } else if !(header.position_error >= 0.0 && header.position_error <= 1e18) {
        Some((36, header.position_error.to_bits()))
    } else if !(header.radius_unit >= 0.0 && header.radius_unit <= 1e18) {
        Some((32, header.radius_unit.to_bits()))
    } else if last != 0 {
        Some((56, last))
    } else {
        None
    };
    match wrong {
        Some((offset, value)) => Err(FormatError::Field { offset, value }),
        None => Ok(header),
    }
}

const fn checksum(bytes: &[u8]) -> Result<(), FormatError> {
    let stated = tri!(field(bytes, CHECKSUM_AT));
    let Some((before, rest)) = bytes.split_at_checked(CHECKSUM_AT) else { return Ok(()) };
    let Some((_, after)) = rest.split_at_checked(4) else { return Ok(()) };
    let mut digest = CRC.digest();
    digest.update(before);
    digest.update(after);
    let computed = digest.finalize();
    if computed == stated { Ok(()) } else { Err(FormatError::Checksum { stated, computed }) }
}

pub(crate) const fn well_formed<I: Index>(tree: &Tree<'_, I>) -> Result<(), FormatError> {
    tri!(nodes(tree));
    tri!(tables(tree));
    leaves(tree)
}

/// Reads every node once, in order. Since they stand breadth first, each link to children must point
/// to exactly the rows that no link before it has: that proves a tree, with nothing left over.
const fn nodes<I: Index>(tree: &Tree<'_, I>) -> Result<(), FormatError> {
    let header = tree.header();
    // The root is a level of its own.
    let (mut level_end, mut next_node) = (1, 1);
    let (mut stack, mut most_siblings) = (1, 1);
    let mut row = 0;
    while row < header.nodes {
        if row >= next_node {
            return Err(FormatError::NodeOrder { node: row });
        }
        if row == level_end {
            stack += most_siblings - 1;
            most_siblings = 1;
            level_end = next_node;
        }
        let Some(node) = tree.record(row) else {
            return Err(FormatError::NodeOrder { node: row });
        };
        if node.pin >= header.vertices {
            return Err(FormatError::Pin { node: row, pin: node.pin });
        }
        if node.radius_code > I::MAX_RADIUS_CODE {
            return Err(FormatError::Radius { node: row, code: node.radius_code });
        }
        if let Link::Children { first, count } = Link::decode(node.link) {
            if first != next_node || count > header.nodes - next_node {
                return Err(FormatError::NodeOrder { node: first });
            }
            next_node += count;
            if count > most_siblings {
                most_siblings = count;
            }
        }
        row += 1;
    }
    let stack = stack + most_siblings - 1;
    if stack == header.stack {
        Ok(())
    } else {
        Err(FormatError::Stack { stated: header.stack, found: stack })
    }
}

/// Walks the tree once, depth first: the leaves' triangles must come as 0, 1, 2, ..., so that every
/// triangle is in one leaf. `nodes` has proven that it is a tree and how many entries may wait.
const fn leaves<I: Index>(tree: &Tree<'_, I>) -> Result<(), FormatError> {
    let header = tree.header();
    // The mask is there so that no index can panic.
    const MASK: usize = MAX_STACK - 1;
    let mut stack = [0u32; MAX_STACK];
    let mut waiting = 1;
    let mut next_triangle = 0;
    while waiting > 0 {
        waiting -= 1;
        let row = stack[waiting & MASK];
        let Some(node) = tree.record(row) else {
            return Err(FormatError::NodeOrder { node: row });
        };
        match Link::decode(node.link) {
            Link::Children { first, count } => {
                let mut child = count;
                while child > 0 {
                    child -= 1;
                    stack[waiting & MASK] = first + child;
                    waiting += 1;
                }
            }
            Link::Leaf { first, count } => {
                if first != next_triangle || count > header.triangles - next_triangle {
                    return Err(FormatError::Leaf { first });
                }
                tri!(patch(tree, first, count));
                next_triangle += count;
            }
        }
    }
    if next_triangle == header.triangles {
        Ok(())
    } else {
        Err(FormatError::Leaf { first: next_triangle })
    }
}

const _: () = assert!(MAX_STACK.is_power_of_two() && MAX_LEAF_TRIANGLES.is_power_of_two());

/// Whether only the third corner of a leaf's triangle is new to the leaf, but for its first triangle: a
/// query looks at no others to reject the triangles up to there.
const fn patch<I: Index>(tree: &Tree<'_, I>, first: u32, count: u32) -> Result<(), FormatError> {
    // Third corners of the leaf's triangles; the mask is there so that no index can panic.
    const MASK: usize = MAX_LEAF_TRIANGLES as usize - 1;
    let mut thirds = [u32::MAX; MASK + 1];
    let [a, b, third] = corners(tree, first);
    thirds[0] = third;
    let mut at = 1;
    while at < count {
        let [mut vertex, second, third] = corners(tree, first + at);
        let mut corner = 0;
        while corner < 2 {
            let mut found = vertex == a || vertex == b;
            let mut before = 0;
            while before < at && !found {
                found = vertex == thirds[before as usize & MASK];
                before += 1;
            }
            if !found {
                return Err(FormatError::Patch { triangle: first + at, vertex });
            }
            vertex = second;
            corner += 1;
        }
        thirds[at as usize & MASK] = third;
        at += 1;
    }
    Ok(())
}

const fn corners<I: Index>(tree: &Tree<'_, I>, triangle: u32) -> [u32; 3] {
    match tree.triangle(triangle) {
        Some(corners) => corners,
        None => [u32::MAX; 3],
    }
}

/// Whether every index in the triangle and vertex order tables is a vertex.
const fn tables<I: Index>(tree: &Tree<'_, I>) -> Result<(), FormatError> {
    let header = tree.header();
    let mut row = 0;
    while row < header.triangles {
        let Some(corners) = tree.triangle(row) else {
            return Err(FormatError::Corner { triangle: row, vertex: 0 });
        };
        let mut corner = 0;
        while corner < 3 {
            if corners[corner] >= header.vertices {
                return Err(FormatError::Corner { triangle: row, vertex: corners[corner] });
            }
            corner += 1;
        }
        row += 1;
    }
    let sections = tree.sections();
    let mut row = 0;
    while row < header.vertices && !sections.order.is_empty() {
        match tree.vertex_number(row) {
            Some(_) => row += 1,
            None => return Err(FormatError::Order { row }),
        }
    }
    let mut row = 0;
    while row < header.triangles && !sections.metric.is_empty() {
        if !is_metric(tree, row) {
            return Err(FormatError::Metric { triangle: row });
        }
        row += 1;
    }
    let mut row = 0;
    while row < header.triangles && !sections.limits.is_empty() {
        if let None | Some(0) = limit_code(sections.limits, row) {
            return Err(FormatError::Limit { triangle: row });
        }
        row += 1;
    }
    Ok(())
}

/// Whether a triangle's metric is one, and the edge that it goes on from is there.
const fn is_metric<I: Index>(tree: &Tree<'_, I>, row: u32) -> bool {
    let Some(metric) = tree.metric(row) else { return false };
    let [first, second, third] = metric.squares;
    let is_joined = match (metric.join, row.checked_sub(1)) {
        (Join::Start, _) => !metric.is_reversed,
        (join, Some(before)) => match (centre_first(tree, before), centre_first(tree, row)) {
            (Some(before), Some(corners)) => join.is_between(before, corners),
            _ => false,
        },
        _ => false,
    };
    // A value that is not a number is in no range.
    first < f32::INFINITY
        && second.abs() < f32::INFINITY
        && third >= 0.0
        && third < f32::INFINITY
        && is_joined
}

/// The corners of a triangle, its centre first.
const fn centre_first<I: Index>(tree: &Tree<'_, I>, row: u32) -> Option<[u32; 3]> {
    match (tree.metric(row), tree.triangle(row)) {
        (Some(metric), Some(corners)) => Some(metric.centre_first(corners)),
        _ => None,
    }
}
