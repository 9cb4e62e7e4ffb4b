//! The sections of a tree: their kinds, lengths and offsets.
//!
//! To add one: its kind in [`section`], a row in [`rules`], a field of [`Sections`] and of its `all`.

use crate::tree::format::{
    self, HEADER_BYTES, LIMIT_BYTES, METRIC_BYTES, ORIGIN_BYTES, PathKind, SECTION_ALIGN,
    SECTION_BYTES, SOLID_BYTES, node_bytes, section, triangle_bytes,
};
use crate::tree::header::Header;
use crate::tree::{FormatError, Index};

/// The parts of a tree's bytes; an absent optional part is empty.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sections<'a> {
    pub nodes: &'a [u8],
    pub triangles: &'a [u8],
    pub order: &'a [u8],
    pub rest: &'a [u8],
    pub metric: &'a [u8],
    pub limits: &'a [u8],
    /// The coarse model that moves the surface: modes, or the nodes of a tree with volume paths.
    pub coarse: &'a [u8],
    pub adjacency: &'a [u8],
    pub origin: &'a [u8],
    pub labels: &'a [u8],
    pub solids: &'a [u8],
}

/// A section's length, and whether it is required.
#[derive(Clone, Copy)]
struct Rule {
    kind: u32,
    /// Its bytes; `None` if a later check decides.
    length: Option<u64>,
    required: bool,
}

impl Rule {
    const fn required(kind: u32, rows: u32, stride: usize) -> Self {
        Self { required: true, ..Self::optional(kind, rows, stride) }
    }

    const fn optional(kind: u32, rows: u32, stride: usize) -> Self {
        Self { kind, length: Some(rows as u64 * stride as u64), required: false }
    }
}

const COUNT: usize = 11;

/// In the order of [`Sections`]' fields.
const fn rules<I: Index>(header: &Header) -> [Rule; COUNT] {
    let Header { vertices, triangles, nodes, origin, other_roots, .. } = *header;
    let is_volume = matches!(header.paths, PathKind::Volume);
    [
        Rule::required(section::NODES, nodes, node_bytes::<I>()),
        Rule::required(section::TRIANGLES, triangles, triangle_bytes::<I>()),
        Rule::optional(section::VERTEX_ORDER, vertices, I::BYTES),
        Rule::optional(section::REST, vertices, 12),
        // Volumes have elements instead.
        Rule::optional(section::METRIC, if is_volume { 0 } else { triangles }, METRIC_BYTES),
        Rule::optional(section::LIMITS, if is_volume { 0 } else { triangles }, LIMIT_BYTES),
        // `Modes::of` and `Nodes::of` check it.
        Rule {
            kind: if is_volume { section::COARSE_NODES } else { section::MODES },
            length: None,
            required: is_volume,
        },
        Rule::optional(section::ADJACENCY, triangles, triangle_bytes::<I>()),
        // If the header has no origin, the section must be absent or empty.
        Rule { required: origin == 1, ..Rule::optional(section::ORIGIN, origin, ORIGIN_BYTES) },
        Rule::optional(section::LABELS, triangles, 1),
        // `shells::check` checks it.
        Rule::optional(section::SOLIDS, other_roots.saturating_add(1), SOLID_BYTES),
    ]
}

/// Finds the sections of a tree with this header.
pub(crate) const fn find<'a, I: Index>(
    bytes: &'a [u8],
    header: &Header,
) -> Result<Sections<'a>, FormatError> {
    let rules = rules::<I>(header);
    let mut found: [Option<&[u8]>; COUNT] = [None; COUNT];
    let mut row = 0;
    while row < header.sections {
        let at = HEADER_BYTES.saturating_add((row as usize).saturating_mul(SECTION_BYTES));
        let (Some(kind), Some(offset), Some(length)) = (
            format::u32_at(bytes, at),
            format::u32_at(bytes, at.saturating_add(4)),
            format::u32_at(bytes, at.saturating_add(8)),
        ) else {
            return Err(FormatError::Length {
                expected: at.saturating_add(SECTION_BYTES) as u32,
                found: bytes.len() as u32,
            });
        };
        let mut slot = 0;
        let mut is_known = kind & section::SKIPPABLE != 0;
        while slot < COUNT {
            let rule = rules[slot];
            if rule.kind == kind {
                is_known = true;
                let part = format::range(bytes, offset, length);
                let is_valid = (offset as usize).is_multiple_of(SECTION_ALIGN)
                    && offset as usize >= HEADER_BYTES
                    && match rule.length {
                        Some(expected) => length as u64 == expected,
                        None => true,
                    };
                if part.is_none() || !is_valid || found[slot].is_some() {
                    return Err(FormatError::Section { kind });
                }
                found[slot] = part;
            }
            slot += 1;
        }
        if !is_known {
            return Err(FormatError::Kind { kind });
        }
        row += 1;
    }
    let mut parts: [&[u8]; COUNT] = [&[]; COUNT];
    let mut slot = 0;
    while slot < COUNT {
        match found[slot] {
            Some(part) => parts[slot] = part,
            None if rules[slot].required => {
                return Err(FormatError::Section { kind: rules[slot].kind });
            }
            None => (),
        }
        slot += 1;
    }
    let [nodes, triangles, order, rest, metric, limits, coarse, adjacency, origin, labels, solids] =
        parts;
    Ok(Sections {
        nodes,
        triangles,
        order,
        rest,
        metric,
        limits,
        coarse,
        adjacency,
        origin,
        labels,
        solids,
    })
}

impl<'a> Sections<'a> {
    /// All sections, in the order of [`rules`].
    const fn all(&self) -> [&'a [u8]; COUNT] {
        let Self {
            nodes,
            triangles,
            order,
            rest,
            metric,
            limits,
            coarse,
            adjacency,
            origin,
            labels,
            solids,
        } = *self;
        [nodes, triangles, order, rest, metric, limits, coarse, adjacency, origin, labels, solids]
    }

    /// Checks that each section is still at its offset in the bytes.
    pub fn check<I: Index>(&self, bytes: &[u8], header: &Header) -> Result<(), FormatError> {
        let found = find::<I>(bytes, header)?;
        let sections = self.all().into_iter().zip(found.all());
        for (rule, (here, there)) in rules::<I>(header).into_iter().zip(sections) {
            let is_elsewhere = !here.is_empty() && !core::ptr::eq(here, there);
            if here.len() != there.len() || is_elsewhere {
                return Err(FormatError::Section { kind: rule.kind });
            }
        }
        Ok(())
    }

    /// Whether each section is as long as its counterpart.
    pub const fn matches(&self, other: &Sections<'_>) -> bool {
        let (these, others) = (self.all(), other.all());
        let mut slot = 0;
        while slot < COUNT {
            if these[slot].len() != others[slot].len() {
                return false;
            }
            slot += 1;
        }
        true
    }
}
