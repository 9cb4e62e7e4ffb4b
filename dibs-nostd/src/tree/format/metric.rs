//! Rows of the metric section.

// Requirement: F-02

use super::{METRIC_BYTES, rows_from};

/// The rest shape of a triangle, to which its stretch refers.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    /// The Gram matrix of the edges from the centre to the other of the first two corners and to the third corner, or
    /// the three squared lengths: see `docs/format.md`.
    pub squares: [f32; 3],
    /// How the triangle joins the one in the previous row.
    pub join: Join,
    /// Whether the centre is its second corner, not its first.
    pub is_reversed: bool,
}

impl Metric {
    /// The metric in one row.
    #[inline(always)]
    pub(crate) const fn new([first, between, second]: [f32; 3]) -> Self {
        Self {
            squares: [first.abs(), between, second],
            join: Join::marked(first),
            is_reversed: between.to_bits() & 1 != 0,
        }
    }

    /// The corners of a triangle, its centre first.
    #[must_use]
    pub const fn centre_first<T: Copy>(&self, [a, b, c]: [T; 3]) -> [T; 3] {
        if self.is_reversed { [b, a, c] } else { [a, b, c] }
    }
}

/// The role of a triangle's first edge, from its centre to the other of its first two corners, in the triangle of the
/// previous row.
#[doc(hidden)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Join {
    /// No known role. The centre is the first corner.
    Start,
    /// The edge from the centre to the third corner.
    Fan,
    /// The same edge reversed: that triangle's third corner is this one's centre.
    Flip,
}

impl Join {
    /// Decodes the first number of a row: the sign marks a fan; without it, the lowest bit marks a flip.
    #[inline(always)]
    pub(crate) const fn marked(first: f32) -> Self {
        let bits = first.to_bits();
        if bits >> 31 != 0 {
            Self::Fan
        } else if bits & 1 != 0 {
            Self::Flip
        } else {
            Self::Start
        }
    }

    /// Whether a triangle continues the previous one in this way, by the corners of both, the centre first.
    #[must_use]
    pub const fn is_between(self, [a, _, c]: [u32; 3], [centre, other, _]: [u32; 3]) -> bool {
        match self {
            Self::Start => true,
            Self::Fan => centre == a && other == c,
            Self::Flip => centre == c && other == a,
        }
    }
}

/// The rest metric of a triangle.
#[inline(always)]
pub(crate) const fn metric(metric: &[u8], row: u32) -> Option<Metric> {
    let Some(tail) = rows_from(metric, row, METRIC_BYTES) else { return None };
    match tail.first_chunk::<METRIC_BYTES>() {
        Some(row) => Some(Metric::new(metric_row(row))),
        None => None,
    }
}

/// The numbers in a row of the metric section.
#[inline(always)]
pub(crate) const fn metric_row(row: &[u8; METRIC_BYTES]) -> [f32; 3] {
    let ([first, between, second], _) = row.as_chunks() else { return [0.0; 3] };
    [f32::from_le_bytes(*first), f32::from_le_bytes(*between), f32::from_le_bytes(*second)]
}
