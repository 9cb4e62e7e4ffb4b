//! Validation: whether header and sections form a tree.

// Requirement: M-01

use core::marker::PhantomData;

use crate::tree::format::{
    self, Join, MAX_LEAF_TRIANGLES, MAX_STACK, Metric, Node, NodeLink, limit_code,
};
use crate::tree::header::Header;
use crate::tree::sections::Sections;
use crate::tree::{FormatError, Index};

/// The parts of a tree, not yet checked.
struct Parts<'a, I> {
    header: &'a Header,
    sections: &'a Sections<'a>,
    width: PhantomData<I>,
}

impl<I: Index> Parts<'_, I> {
    const fn node(&self, row: u32) -> Option<Node> {
        format::node::<I>(self.sections.nodes, row)
    }

    const fn triangle(&self, row: u32) -> Option<[u32; 3]> {
        format::triangle::<I>(self.sections.triangles, row)
    }

    const fn metric(&self, row: u32) -> Option<Metric> {
        format::metric(self.sections.metric, row)
    }
}

pub(super) const fn well_formed<I: Index>(
    header: &Header,
    sections: &Sections<'_>,
) -> Result<(), FormatError> {
    let parts = Parts::<I> { header, sections, width: PhantomData };
    tri!(nodes(&parts));
    tri!(tables(&parts));
    leaves(&parts)
}

/// Reads every node once, in order. Nodes are in breadth-first order, so each link to children must point to the first
/// rows to which no earlier link points. This proves a tree that includes every node.
const fn nodes<I: Index>(parts: &Parts<'_, I>) -> Result<(), FormatError> {
    let header = parts.header;
    let roots = header.other_roots + 1;
    let (mut level_end, mut next_node) = (roots, roots);
    let (mut stack, mut most_siblings) = (roots, 1);
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
        let Some(node) = parts.node(row) else {
            return Err(FormatError::NodeOrder { node: row });
        };
        if node.pin >= header.vertices {
            return Err(FormatError::Pin { node: row, pin: node.pin });
        }
        if node.radius_code > I::MAX_RADIUS_CODE {
            return Err(FormatError::Radius { node: row, code: node.radius_code });
        }
        if let NodeLink::Children { first, count } = NodeLink::decode(node.link) {
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

/// Walks the tree once, depth first: the leaves' triangles must be 0, 1, 2, ..., so that every triangle is in one leaf.
/// `nodes` has proven that it is a tree, and the number of stack entries.
const fn leaves<I: Index>(parts: &Parts<'_, I>) -> Result<(), FormatError> {
    let header = parts.header;
    // The mask keeps the index from panicking.
    const MASK: usize = MAX_STACK - 1;
    let mut stack = [0u32; MAX_STACK];
    let mut waiting = 0;
    while waiting <= header.other_roots as usize {
        stack[waiting & MASK] = header.other_roots - waiting as u32;
        waiting += 1;
    }
    let mut next_triangle = 0;
    while waiting > 0 {
        waiting -= 1;
        let row = stack[waiting & MASK];
        let Some(node) = parts.node(row) else {
            return Err(FormatError::NodeOrder { node: row });
        };
        match NodeLink::decode(node.link) {
            NodeLink::Children { first, count } => {
                let mut child = count;
                while child > 0 {
                    child -= 1;
                    stack[waiting & MASK] = first + child;
                    waiting += 1;
                }
            }
            NodeLink::Leaf { first, count } => {
                if first != next_triangle || count > header.triangles - next_triangle {
                    return Err(FormatError::Leaf { first });
                }
                tri!(patch(parts, first, count));
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

/// Checks that, after a leaf's first triangle, only a triangle's third corner is new to the leaf: to reject a leaf, a
/// query tests only those.
const fn patch<I: Index>(parts: &Parts<'_, I>, first: u32, count: u32) -> Result<(), FormatError> {
    // Third corners of the leaf's triangles; the mask keeps the index from panicking.
    const MASK: usize = MAX_LEAF_TRIANGLES as usize - 1;
    let mut thirds = [u32::MAX; MASK + 1];
    let [a, b, third] = corners(parts, first);
    thirds[0] = third;
    let mut at = 1;
    while at < count {
        let [mut vertex, second, third] = corners(parts, first + at);
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

const fn corners<I: Index>(parts: &Parts<'_, I>, triangle: u32) -> [u32; 3] {
    match parts.triangle(triangle) {
        Some(corners) => corners,
        None => [u32::MAX; 3],
    }
}

/// Checks the rows of all tables: that every index in the triangle and vertex order tables is a vertex, and that every
/// number is possible.
const fn tables<I: Index>(parts: &Parts<'_, I>) -> Result<(), FormatError> {
    let header = parts.header;
    let mut row = 0;
    while row < header.triangles {
        let Some(corners) = parts.triangle(row) else {
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
    let sections = parts.sections;
    let origin = format::origin(sections.origin);
    let mut axis = 0;
    while axis < 3 {
        // By its bits: the processor may have no f64 instructions.
        if (origin[axis].to_bits() >> 52) & 0x7FF == 0x7FF {
            return Err(FormatError::Origin { axis: axis as u8 });
        }
        axis += 1;
    }
    let mut row = 0;
    while row < header.vertices && !sections.order.is_empty() {
        match format::vertex_number::<I>(sections.order, row) {
            Some(_) => row += 1,
            None => return Err(FormatError::Order { row }),
        }
    }
    let mut row = 0;
    while row < header.triangles && !sections.metric.is_empty() {
        if !is_metric(parts, row) {
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

/// Whether a triangle's metric is valid, and the previous row has the edge that it continues.
const fn is_metric<I: Index>(parts: &Parts<'_, I>, row: u32) -> bool {
    let Some(metric) = parts.metric(row) else { return false };
    let [first, second, third] = metric.squares;
    let is_joined = match (metric.join, row.checked_sub(1)) {
        (Join::Start, _) => !metric.is_reversed,
        (join, Some(before)) => match (centre_first(parts, before), centre_first(parts, row)) {
            (Some(before), Some(corners)) => join.is_between(before, corners),
            _ => false,
        },
        _ => false,
    };
    // NaN is in no range.
    first < f32::INFINITY
        && second.abs() < f32::INFINITY
        && third >= 0.0
        && third < f32::INFINITY
        && is_joined
}

const fn centre_first<I: Index>(parts: &Parts<'_, I>, row: u32) -> Option<[u32; 3]> {
    match (parts.metric(row), parts.triangle(row)) {
        (Some(metric), Some(corners)) => Some(metric.centre_first(corners)),
        _ => None,
    }
}
