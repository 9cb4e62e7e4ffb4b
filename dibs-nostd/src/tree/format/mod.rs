//! The tree's bytes: little-endian records at fixed offsets, read from flash without a parsing pass.
//!
//! `docs/format.md` is the specification, this module its only reader, and [`field`] the table of the header. Most
//! functions are `const`, so that a tree can be validated in a constant; a generated tree is validated at start-up.
//!
//! One file, because no other file reads the bytes.

// Requirement: M-01

mod metric;
#[cfg(feature = "batched")]
pub(crate) mod several;

pub use super::unit::Unit;
pub use metric::{Join, Metric};
pub(crate) use metric::{metric, metric_row};

use super::Index;

/// First bytes of every tree.
#[doc(hidden)]
pub const MAGIC: [u8; 4] = *b"DIBS";
/// Version of the layout that this crate reads.
pub const VERSION: u16 = 5;
/// Bytes of the fixed header; the section table follows it.
#[doc(hidden)]
pub const HEADER_BYTES: usize = 80;
/// Bytes of one row of the section table: kind, offset, length.
#[doc(hidden)]
pub const SECTION_BYTES: usize = 12;
/// Every section starts at a multiple of this.
#[doc(hidden)]
pub const SECTION_ALIGN: usize = 16;
/// Most stack entries that a traversal of any tree may need.
pub const MAX_STACK: usize = 512;
/// Most roots of a tree: surfaces that share no vertex.
pub const MAX_ROOTS: u32 = 64;
/// Most children of one node.
pub const MAX_CHILDREN: u32 = 8;
/// Most triangles in one leaf.
pub const MAX_LEAF_TRIANGLES: u32 = 8;

/// Bytes of one row of the metric section.
#[doc(hidden)]
pub const METRIC_BYTES: usize = 12;
/// Bytes of one row of the limits section.
#[doc(hidden)]
pub const LIMIT_BYTES: usize = 2;
/// The limit code of the tree's own stretch limit.
#[doc(hidden)]
pub const MAX_LIMIT_CODE: u32 = 0xFFFF;

/// Bytes of the origin section: three `f64`.
#[doc(hidden)]
pub const ORIGIN_BYTES: usize = 24;

/// Bytes of one row of the solids section: a root's first triangle, and the root of its solid's outer shell.
#[doc(hidden)]
pub const SOLID_BYTES: usize = 8;

/// Byte offsets of the header's fields. Numbers are little-endian, of four bytes unless stated otherwise.
#[doc(hidden)]
pub mod field {
    /// [`VERSION`](super::VERSION), two bytes, after the [`MAGIC`](super::MAGIC).
    pub const VERSION: usize = 4;
    /// Bytes of an index, one byte.
    pub const WIDTH: usize = 6;
    /// The [`PathKind`](super::PathKind)'s code, one byte.
    pub const PATHS: usize = 7;
    /// The mesh id.
    pub const MESH_ID: usize = 8;
    /// Number of vertices.
    pub const VERTICES: usize = 12;
    /// Number of triangles.
    pub const TRIANGLES: usize = 16;
    /// Number of nodes.
    pub const NODES: usize = 20;
    /// Entries of the traversal's stack.
    pub const STACK: usize = 24;
    /// The stretch limit, `f32`.
    pub const STRETCH: usize = 28;
    /// The length of one radius code, `f32`.
    pub const RADIUS_UNIT: usize = 32;
    /// Largest distance of a vertex from its position in the mesh's file, `f32`.
    pub const POSITION_ERROR: usize = 36;
    /// 1 if the tree has an origin section, else 0.
    pub const ORIGIN: usize = 40;
    /// Number of roots less one.
    pub const OTHER_ROOTS: usize = 44;
    /// Rows of the section table.
    pub const SECTIONS: usize = 48;
    /// Bytes of the whole tree.
    pub const LENGTH: usize = 52;
    /// The code of the file's [`Unit`](super::Unit), one byte, and three of zero.
    pub const UNIT: usize = 56;
    /// The checksum of every other byte.
    pub const CHECKSUM: usize = 60;
    /// Vertices of the mesh's file.
    pub const FILE_VERTICES: usize = 64;
    /// Triangles of the mesh's file.
    pub const FILE_TRIANGLES: usize = 68;
    /// Zero, two words.
    pub const RESERVED: [usize; 2] = [72, 76];
}

/// CRC-32 (ISO-HDLC, as in zlib and Ethernet) of trees and bus packets, by a table of 1 KiB.
///
/// Certainly detected: every burst of up to 32 bits; any 4 flipped bits in up to 2,974 data bits, any 3 in up to
/// 91,607, any 2 in a tree (Koopman, "32-bit cyclic redundancy codes for internet applications", DSN 2002). Of other
/// damage one pattern in 2^32 is missed.
///
/// A `static`, because every use of a constant would add another table.
#[doc(hidden)]
pub static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// Kinds of sections.
#[doc(hidden)]
pub mod section {
    /// One record a node, breadth first from the roots.
    pub const NODES: u32 = 1;
    /// Three vertex rows a triangle, leaf by leaf, depth first.
    pub const TRIANGLES: u32 = 2;
    /// The mesh's vertex number of every row (optional: hosts need it, a controller does not).
    pub const VERTEX_ORDER: u32 = 3;
    /// Rest position of every row, three `f32` (optional).
    pub const REST: u32 = 4;
    /// Rest metric of every triangle, three `f32` (optional: the stretch measurement needs it).
    pub const METRIC: u32 = 5;
    /// Stretch limit of every triangle, a 16-bit fraction of the tree's (optional: without it the tree's limit applies
    /// to each).
    pub const LIMITS: u32 = 6;
    /// Displacement modes (optional).
    pub const MODES: u32 = 7;
    /// Three neighbours of every triangle (optional: sides and contacts need them).
    pub const ADJACENCY: u32 = 8;
    /// The tree's origin in the mesh's file, three `f64` (if the header says so).
    pub const ORIGIN: u32 = 9;
    /// A label of every triangle, one byte (optional).
    pub const LABELS: u32 = 10;
    /// Coarse nodes, their elements, and the vertices that they move (in a tree with volume paths).
    pub const COARSE_NODES: u32 = 11;
    /// The first triangle and the solid of every root (in a tree with several roots and adjacency).
    pub const SOLIDS: u32 = 12;
    /// The flag of kinds that a reader may skip if unknown.
    pub const SKIPPABLE: u32 = 1 << 31;
}

/// How geodesic radii were measured, and so which stretch bounds their growth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PathKind {
    /// Along mesh edges: coverage holds while no edge is longer than `s` times its rest length.
    EdgePath,
    /// Across triangle interiors: coverage holds while no triangle's largest singular value (of the deformation
    /// gradient from the rest shape, whose height has a minimum: see [`measure_stretch`](crate::measure_stretch))
    /// exceeds `s`.
    Surface,
    /// Through the elements of a volume that moves the surface: coverage holds while no element's largest singular
    /// value exceeds `s`.
    Volume,
}

impl PathKind {
    /// The code of this kind in the header.
    #[must_use]
    pub const fn code(self) -> u8 {
        match self {
            Self::EdgePath => 0,
            Self::Surface => 1,
            Self::Volume => 2,
        }
    }

    pub(crate) const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::EdgePath),
            1 => Some(Self::Surface),
            2 => Some(Self::Volume),
            _ => None,
        }
    }
}

/// A node's children, or a leaf's triangles, as a range of rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeLink {
    /// Rows `first..first + count` of the node table.
    Children {
        /// First row.
        first: u32,
        /// 1 to [`MAX_CHILDREN`].
        count: u32,
    },
    /// Rows `first..first + count` of the triangle table.
    Leaf {
        /// First row.
        first: u32,
        /// 1 to [`MAX_LEAF_TRIANGLES`].
        count: u32,
    },
}

const LEAF_BIT: u32 = 1 << 31;
const COUNT_SHIFT: u32 = 28;
const FIRST_MASK: u32 = (1 << COUNT_SHIFT) - 1;

impl NodeLink {
    /// The stored link: bit 31 marks a leaf, bits 28 to 30 hold `count - 1`, bits 0 to 27 `first`.
    #[must_use]
    pub const fn encode(self) -> u32 {
        let (mark, first, count) = match self {
            Self::Children { first, count } => (0, first, count),
            Self::Leaf { first, count } => (LEAF_BIT, first, count),
        };
        mark | ((count.wrapping_sub(1) & 7) << COUNT_SHIFT) | (first & FIRST_MASK)
    }

    /// The inverse of [`NodeLink::encode`].
    #[inline(always)]
    #[must_use]
    pub const fn decode(word: u32) -> Self {
        let (first, count) = (word & FIRST_MASK, ((word >> COUNT_SHIFT) & 7) + 1);
        if word & LEAF_BIT == 0 {
            Self::Children { first, count }
        } else {
            Self::Leaf { first, count }
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub pin: u32,
    pub radius_code: u32,
    pub link: u32,
}

/// Bytes of one node record.
#[doc(hidden)]
#[must_use]
pub const fn node_bytes<I: Index>() -> usize {
    2 * I::BYTES + 4
}

/// Bytes of one triangle row.
#[doc(hidden)]
#[must_use]
pub const fn triangle_bytes<I: Index>() -> usize {
    3 * I::BYTES
}

/// The bytes from row `row` of `stride` bytes onwards; `None` beyond the end.
#[inline(always)]
const fn rows_from(bytes: &[u8], row: u32, stride: usize) -> Option<&[u8]> {
    let Some(at) = (row as usize).checked_mul(stride) else { return None };
    match bytes.split_at_checked(at) {
        Some((_, tail)) => Some(tail),
        None => None,
    }
}

/// `count` rows of `stride` bytes from row `first` on; `None` unless all exist.
#[inline(always)]
pub(crate) fn run(bytes: &[u8], first: u32, count: u32, stride: usize) -> Option<&[u8]> {
    let start = (first as usize).checked_mul(stride)?;
    let end = start.checked_add((count as usize).checked_mul(stride)?)?;
    bytes.get(start..end)
}

/// The node at the start of these bytes, and the bytes after it. (Each field is read in one load.)
#[inline(always)]
pub(crate) const fn split_node<I: Index>(rows: &[u8]) -> Option<(Node, &[u8])> {
    if I::BYTES == 2 {
        let Some((pin, rest)) = rows.split_first_chunk() else { return None };
        let Some((radius, rest)) = rest.split_first_chunk() else { return None };
        let Some((link, rest)) = rest.split_first_chunk() else { return None };
        let (pin, radius) = (u16::from_le_bytes(*pin), u16::from_le_bytes(*radius));
        let link = u32::from_le_bytes(*link);
        Some((Node { pin: pin as u32, radius_code: radius as u32, link }, rest))
    } else {
        let Some((pin, rest)) = rows.split_first_chunk() else { return None };
        let Some((radius, rest)) = rest.split_first_chunk() else { return None };
        let Some((link, rest)) = rest.split_first_chunk() else { return None };
        let (pin, radius_code) = (u32::from_le_bytes(*pin), u32::from_le_bytes(*radius));
        Some((Node { pin, radius_code, link: u32::from_le_bytes(*link) }, rest))
    }
}

#[inline(always)]
pub(crate) const fn node<I: Index>(nodes: &[u8], row: u32) -> Option<Node> {
    let Some(rows) = rows_from(nodes, row, node_bytes::<I>()) else { return None };
    match split_node::<I>(rows) {
        Some((node, _)) => Some(node),
        None => None,
    }
}

/// As [`node`], but with one bounds check for the record instead of one for each field. (Compile-time validation would
/// take longer with it.)
#[inline(always)]
pub(crate) fn whole_node<I: Index>(nodes: &[u8], row: u32) -> Option<Node> {
    let record: &[u8] = if I::BYTES == 2 {
        nodes.as_chunks::<8>().0.get(row as usize)?
    } else {
        nodes.as_chunks::<12>().0.get(row as usize)?
    };
    split_node::<I>(record).map(|(node, _)| node)
}

/// The corners at the start of these bytes, and the bytes after them.
#[inline(always)]
pub(crate) const fn split_triangle<I: Index>(rows: &[u8]) -> Option<([u32; 3], &[u8])> {
    if I::BYTES == 2 {
        let Some((r, rest)) = rows.split_first_chunk::<6>() else { return None };
        Some(([short(r[0], r[1]), short(r[2], r[3]), short(r[4], r[5])], rest))
    } else {
        let Some((a, rest)) = rows.split_first_chunk() else { return None };
        let Some((b, rest)) = rest.split_first_chunk() else { return None };
        let Some((c, rest)) = rest.split_first_chunk() else { return None };
        let corners = [u32::from_le_bytes(*a), u32::from_le_bytes(*b), u32::from_le_bytes(*c)];
        Some((corners, rest))
    }
}

#[inline(always)]
pub(crate) const fn triangle<I: Index>(triangles: &[u8], row: u32) -> Option<[u32; 3]> {
    let Some(rows) = rows_from(triangles, row, triangle_bytes::<I>()) else { return None };
    match split_triangle::<I>(rows) {
        Some((corners, _)) => Some(corners),
        None => None,
    }
}

#[inline(always)]
pub(crate) const fn vertex_number<I: Index>(order: &[u8], row: u32) -> Option<u32> {
    let Some(tail) = rows_from(order, row, I::BYTES) else { return None };
    if I::BYTES == 2 {
        let Some(number) = tail.first_chunk::<2>() else { return None };
        Some(u16::from_le_bytes(*number) as u32)
    } else {
        u32_at(tail, 0)
    }
}

/// The code of a triangle's neighbour across one of its three edges.
#[inline(always)]
pub(crate) const fn neighbour_code<I: Index>(adjacency: &[u8], row: u32, edge: u32) -> Option<u32> {
    match triangle::<I>(adjacency, row) {
        Some([first, second, third]) => match edge {
            0 => Some(first),
            1 => Some(second),
            2 => Some(third),
            _ => None,
        },
        None => None,
    }
}

/// The code of a border edge.
#[doc(hidden)]
#[must_use]
pub const fn no_neighbour<I: Index>() -> u32 {
    if I::BYTES == 2 { 0xFFFF } else { u32::MAX }
}

#[inline(always)]
pub(crate) const fn rest_position(rest: &[u8], row: u32) -> Option<glam::Vec3> {
    let Some(tail) = rows_from(rest, row, 12) else { return None };
    let Some(r) = tail.first_chunk::<12>() else { return None };
    Some(glam::Vec3::new(
        f32::from_le_bytes([r[0], r[1], r[2], r[3]]),
        f32::from_le_bytes([r[4], r[5], r[6], r[7]]),
        f32::from_le_bytes([r[8], r[9], r[10], r[11]]),
    ))
}

/// The origin's coordinates; zeros if the section is absent.
pub(crate) const fn origin(section: &[u8]) -> [f64; 3] {
    let (numbers, _) = section.as_chunks::<8>();
    match numbers {
        [x, y, z] => [f64::from_le_bytes(*x), f64::from_le_bytes(*y), f64::from_le_bytes(*z)],
        _ => [0.0; 3],
    }
}

#[inline(always)]
pub(crate) const fn limit_code(limits: &[u8], row: u32) -> Option<u32> {
    let Some(tail) = rows_from(limits, row, LIMIT_BYTES) else { return None };
    let Some(r) = tail.first_chunk::<LIMIT_BYTES>() else { return None };
    Some(short(r[0], r[1]))
}

#[inline(always)]
const fn short(low: u8, high: u8) -> u32 {
    u16::from_le_bytes([low, high]) as u32
}

pub(crate) const fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    match bytes.split_at_checked(at) {
        Some((_, tail)) => match tail.first_chunk::<4>() {
            Some(r) => Some(u32::from_le_bytes(*r)),
            None => None,
        },
        None => None,
    }
}

/// The part of `bytes` to which a section table row points.
pub(crate) const fn range(bytes: &[u8], offset: u32, length: u32) -> Option<&[u8]> {
    match bytes.split_at_checked(offset as usize) {
        Some((_, tail)) => match tail.split_at_checked(length as usize) {
            Some((part, _)) => Some(part),
            None => None,
        },
        None => None,
    }
}
