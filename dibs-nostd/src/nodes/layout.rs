//! The nodes' bytes: section 11 of `docs/format.md`, and its validation.

// Requirements: F-07, M-01

use glam::{Mat4, Vec3, Vec4};

use super::{MAX_ELEMENTS, MAX_NODES, NodesError};
use crate::tree::format::u32_at;

/// Bytes of the section's header.
pub const HEADER_BYTES: usize = 32;
/// Bytes of one node's rest position.
pub const NODE_BYTES: usize = 12;
/// Bytes of one element's record.
pub const ELEMENT_BYTES: usize = 36;
/// Bytes of one vertex's binding.
pub const BINDING_BYTES: usize = 8;
/// Nodes in a word of marks: a bit is set where the node carries a vertex.
pub const MARKS: u32 = u32::BITS;
/// The sum of a vertex's four weights.
pub const WHOLE: u32 = 1 << 16;
/// The stored number of a weight of zero if vertices may lie outside of their elements: weights are then signed, in
/// units of [`STEP`] parts of 65,536.
pub const SIGNED_ZERO: u32 = 1 << 15;
/// The unit of a signed weight, in parts of 65,536.
pub const STEP: u32 = 4;
/// The absolute values of a vertex's signed weights sum up to less than this.
pub const MOST_SIZES: u32 = 3 * WHOLE;

/// The header, and the tables of nodes, elements and bindings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts<'a> {
    /// Longest path through elements from the first element's first node to any other, at rest (mm).
    pub extent: f32,
    /// Longest edge at rest (mm).
    pub edge: f32,
    pub scale: Scale,
    /// The largest sum of absolute weights of a vertex: no vertex moves farther than this times its farthest node.
    pub amplification: f32,
    pub nodes: &'a [[u8; NODE_BYTES]],
    pub elements: &'a [[u8; ELEMENT_BYTES]],
    pub bindings: &'a [[u8; BINDING_BYTES]],
    /// A bit for each node that carries a vertex.
    pub marks: &'a [[u8; 4]],
}

impl Parts<'_> {
    /// Whether a vertex has a weight other than 0 for this node.
    #[inline(always)]
    pub fn carries(&self, node: u32) -> bool {
        let word = self.marks.get((node / MARKS) as usize);
        word.is_some_and(|&word| u32::from_le_bytes(word) >> (node % MARKS) & 1 != 0)
    }
}

/// How weights are stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// The stored number of a weight of 0.
    zero: u32,
    /// The unit, as a fraction of the whole.
    pub unit: f32,
    /// The whole in units.
    pub whole: u32,
}

impl Scale {
    const fn of(zero: u32) -> Self {
        let whole = if zero == 0 { WHOLE } else { WHOLE / STEP };
        Self { zero, unit: 1.0 / whole as f32, whole }
    }

    /// A weight in units.
    #[inline(always)]
    pub const fn weight(&self, stored: u32) -> i32 {
        stored.wrapping_sub(self.zero) as i32
    }

    /// The four weights in units, from the three stored ones.
    #[inline(always)]
    pub const fn weights(&self, [u, v, w]: [u32; 3]) -> [i32; 4] {
        let (u, v, w) = (self.weight(u), self.weight(v), self.weight(w));
        // Each has 17 bits at most.
        let sum = u.wrapping_add(v).wrapping_add(w);
        [u, v, w, (self.whole as i32).wrapping_sub(sum)]
    }

    /// The parts of 65,536 in this many units.
    pub const fn parts(&self, units: u32) -> u32 {
        units.saturating_mul(if self.zero == 0 { 1 } else { STEP })
    }
}

/// An element: its nodes, and its shape at rest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Element {
    pub corners: [u32; 4],
    pub rest: RestElement<f32>,
}

/// The constants of an element's check, or those of four.
#[derive(Clone, Copy, Debug)]
pub(super) struct RestElement<T> {
    /// The products of the edges along the path through the four nodes: 11, 12, 13, 22, 23, 33.
    pub products: [T; 6],
    /// The least edge volume that is certainly positive (mm³).
    pub least: T,
}

/// A vertex's element, and the stored weights of its first three nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Binding {
    pub element: u32,
    pub weights: [u32; 3],
}

/// Finds and checks the tables of a surface with this many vertices.
pub(super) fn parts(bytes: &[u8], vertices: u32) -> Result<Parts<'_>, NodesError> {
    let wrong_length = |expected| NodesError::Length { expected, found: bytes.len() as u64 };
    let Some((header, tables)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
        return Err(wrong_length(HEADER_BYTES as u64));
    };
    let word = |at| u32_at(header, at).unwrap_or(u32::MAX);
    let (nodes, elements) = (word(0), word(4));
    let (extent, edge) = (f32::from_bits(word(8)), f32::from_bits(word(12)));
    // Written so that NaN is rejected.
    let is_length = |length: f32| length > 0.0 && length <= 1e18;
    let is_wrong = |offset: u8| match offset {
        0 => !(4..=MAX_NODES).contains(&nodes),
        4 => !(1..=MAX_ELEMENTS).contains(&elements),
        8 => !is_length(extent),
        12 => !is_length(edge),
        16 => word(16) != 0 && word(16) != SIGNED_ZERO,
        _ => word(offset.into()) != 0,
    };
    let mut fields = [0, 4, 8, 12, 16, 20, 24, 28].into_iter();
    if let Some(offset) = fields.find(|&offset| is_wrong(offset)) {
        return Err(NodesError::Field { offset, value: word(offset.into()) });
    }
    let sizes = [
        (nodes, NODE_BYTES),
        (elements, ELEMENT_BYTES),
        (vertices, BINDING_BYTES),
        (nodes.div_ceil(MARKS), size_of::<u32>()),
    ];
    let lengths = sizes.map(|(rows, stride)| u64::from(rows) * stride as u64);
    let expected = HEADER_BYTES as u64 + lengths.iter().sum::<u64>();
    if bytes.len() as u64 != expected {
        return Err(wrong_length(expected));
    }
    let [of_nodes, of_elements, of_bindings, _] = lengths.map(|length| length as usize);
    let (nodes, tables) = tables.split_at_checked(of_nodes).unwrap_or_default();
    let (elements, tables) = tables.split_at_checked(of_elements).unwrap_or_default();
    let (bindings, marks) = tables.split_at_checked(of_bindings).unwrap_or_default();
    let mut parts = Parts {
        extent,
        edge,
        scale: Scale::of(word(16)),
        amplification: 1.0,
        nodes: nodes.as_chunks().0,
        elements: elements.as_chunks().0,
        bindings: bindings.as_chunks().0,
        marks: marks.as_chunks().0,
    };
    parts.amplification = check(&parts)?;
    Ok(parts)
}

/// Checks every row, and returns the amplification, rounded up.
fn check(parts: &Parts<'_>) -> Result<f32, NodesError> {
    for (node, row) in (0..).zip(parts.nodes) {
        let Vec3 { x, y, z } = position(row).abs();
        // So that products of lengths do not overflow. Written so that NaN is rejected.
        if !((x <= 1e9) & (y <= 1e9) & (z <= 1e9)) {
            return Err(NodesError::Node { node });
        }
    }
    let nodes = parts.nodes.len() as u32;
    let mut last = 0;
    for (row, record) in (0..).zip(parts.elements) {
        let Element { corners, rest } = element(record);
        if let Some(&node) = corners.iter().find(|&&node| node >= nodes) {
            return Err(NodesError::Corner { element: row, node, nodes });
        }
        let is_number = |x: &f32| x.abs() < 1e18;
        let [first, .., third] = rest.products;
        let is_sound = rest.products.iter().all(is_number)
            && first > 0.0
            && third > 0.0
            && rest.least > 0.0
            && rest.least < 1e27;
        let latest = corners.into_iter().fold(0, u32::max);
        if !is_sound || latest < last {
            return Err(NodesError::Element { element: row });
        }
        last = latest;
        let at = |node: u32| parts.nodes.get(node as usize).map_or(Vec3::NAN, position);
        let [a, b, c, d] = corners.map(at);
        // Written so that NaN is rejected.
        if !((b - a).dot((c - b).cross(d - c)) > rest.least) {
            return Err(NodesError::Inverted { element: row });
        }
    }
    let elements = parts.elements.len() as u32;
    let mut largest = WHOLE;
    for (vertex, row) in (0..).zip(parts.bindings) {
        let binding = binding(row);
        if binding.element >= elements {
            return Err(NodesError::Binding { vertex, element: binding.element, elements });
        }
        let weights = parts.scale.weights(binding.weights);
        let sum = parts.scale.parts(weights.into_iter().map(i32::unsigned_abs).sum());
        let is_possible = if parts.scale.zero == 0 { sum == WHOLE } else { sum < MOST_SIZES };
        if !is_possible {
            return Err(NodesError::Weights { vertex, sum });
        }
        largest = largest.max(sum);
        // A node without its mark would move the vertex unseen.
        let record = parts.elements.get(binding.element as usize);
        let corners = record.map_or([0; 4], corners);
        let unmarked = |&(node, weight): &(u32, i32)| weight != 0 && !parts.carries(node);
        if let Some((node, _)) = corners.into_iter().zip(weights).find(unmarked) {
            return Err(NodesError::Unmarked { vertex, node });
        }
    }
    if let Some(node) = (nodes..nodes.next_multiple_of(MARKS)).find(|&node| parts.carries(node)) {
        return Err(NodesError::Marked { node, nodes });
    }
    // The sum itself is exact: the factor covers the rounding of products with it.
    let above = if largest > WHOLE { 1.0 + 1.0 / 65_536.0 } else { 1.0 };
    Ok(largest as f32 * (above / WHOLE as f32))
}

#[inline(always)]
pub(super) fn position(
    &[x0, x1, x2, x3, y0, y1, y2, y3, z0, z1, z2, z3]: &[u8; NODE_BYTES],
) -> Vec3 {
    Vec3::new(
        f32::from_le_bytes([x0, x1, x2, x3]),
        f32::from_le_bytes([y0, y1, y2, y3]),
        f32::from_le_bytes([z0, z1, z2, z3]),
    )
}

#[inline(always)]
pub(super) fn element(record: &[u8; ELEMENT_BYTES]) -> Element {
    let (words, _) = record.as_chunks::<4>();
    let &[ab, cd, m11, m12, m13, m22, m23, m33, least] = words else {
        let rest = RestElement { products: [0.0; 6], least: f32::NAN };
        return Element { corners: [u32::MAX; 4], rest };
    };
    let float = f32::from_le_bytes;
    let products = [float(m11), float(m12), float(m13), float(m22), float(m23), float(m33)];
    let rest = RestElement { products, least: float(least) };
    let (ab, cd) = (u32::from_le_bytes(ab), u32::from_le_bytes(cd));
    let corners = [ab & 0xFFFF, ab >> 16, cd & 0xFFFF, cd >> 16];
    Element { corners, rest }
}

/// The records of four elements: all first nodes, all second nodes and so on; and their shapes at rest.
#[inline(always)]
pub(super) fn four([a, b, c, d]: &[[u8; ELEMENT_BYTES]; 4]) -> ([[u32; 4]; 4], RestElement<Vec4>) {
    let (a, b, c, d) = (element(a), element(b), element(c), element(d));
    let [a0, a1, a2, a3] = a.corners;
    let [b0, b1, b2, b3] = b.corners;
    let [c0, c1, c2, c3] = c.corners;
    let [d0, d1, d2, d3] = d.corners;
    let corners = [[a0, b0, c0, d0], [a1, b1, c1, d1], [a2, b2, c2, d2], [a3, b3, c3, d3]];
    let first = |Element { rest, .. }: &Element| {
        let [m11, m12, m13, m22, ..] = rest.products;
        Vec4::new(m11, m12, m13, m22)
    };
    let last = |Element { rest, .. }: &Element| {
        let [.., m23, m33] = rest.products;
        Vec4::new(m23, m33, rest.least, 0.0)
    };
    // A transpose takes fewer instructions than gathering each number.
    let first = Mat4::from_cols(first(&a), first(&b), first(&c), first(&d)).transpose();
    let last = Mat4::from_cols(last(&a), last(&b), last(&c), last(&d)).transpose();
    let Mat4 { x_axis: m11, y_axis: m12, z_axis: m13, w_axis: m22 } = first;
    let products = [m11, m12, m13, m22, last.x_axis, last.y_axis];
    (corners, RestElement { products, least: last.z_axis })
}

#[inline(always)]
pub(super) fn corners(record: &[u8; ELEMENT_BYTES]) -> [u32; 4] {
    element(record).corners
}

#[inline(always)]
pub(super) fn binding(row: &[u8; BINDING_BYTES]) -> Binding {
    let low = u64::from_le_bytes(*row);
    let half = |at: u32| (low >> at) as u32 & 0xFFFF;
    Binding { element: half(0), weights: [half(16), half(32), half(48)] }
}
