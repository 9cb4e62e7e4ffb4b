//! Tables of the vertices' current positions, over which a query is generic.

// Requirement: F-04

use glam::Vec3;

use super::MeasuredStretch;

/// The positions of one frame, by row. Rows are in the tree's vertex order.
///
/// A table must not change while a query reads it: one query sees one frame.
pub trait VertexTable {
    /// Number of vertices.
    fn len(&self) -> usize;

    /// Position of one vertex in mm, or `None` outside the table.
    fn position(&self, vertex: u32) -> Option<Vec3>;

    /// Number of the frame, if it has one, so that a measurement of another frame is refused.
    fn epoch(&self) -> Option<u32> {
        None
    }

    /// The stretch measured on these positions, if any: a query then searches smaller spheres than with the tree's
    /// limit.
    fn stretch(&self) -> Option<MeasuredStretch> {
        None
    }

    /// Largest error (mm) of a position in the table, for example by quantisation. Every answer's accuracy includes it.
    fn position_error(&self) -> f32 {
        0.0
    }

    /// Whether the table is empty.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl VertexTable for [Vec3] {
    fn len(&self) -> usize {
        <[Vec3]>::len(self)
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.get(vertex as usize).copied()
    }
}

impl<const N: usize> VertexTable for [Vec3; N] {
    fn len(&self) -> usize {
        N
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.get(vertex as usize).copied()
    }
}

impl<T: VertexTable + ?Sized> VertexTable for &T {
    fn len(&self) -> usize {
        (**self).len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        (**self).position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        (**self).epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        (**self).stretch()
    }

    fn position_error(&self) -> f32 {
        (**self).position_error()
    }
}

/// A table of 16-bit positions, 6 bytes a vertex: `position = origin + step * row`.
///
/// Each axis differs from the original position by at most `step / 2` plus the f32 rounding of the result. This is the
/// table's [`position_error`](VertexTable::position_error), so every answer's accuracy includes it.
///
/// ```
/// use dibs_nostd::{QuantisedVertices, VertexTable, glam::Vec3};
/// let rows = [[0, 0, 0], [100, 200, 65_535]];
/// let table = QuantisedVertices::new(&rows, Vec3::new(-10.0, 0.0, 0.0), Vec3::splat(0.01));
/// assert_eq!(table.position(1), Some(Vec3::new(-9.0, 2.0, 655.35)));
/// assert_eq!(table.position(2), None);
/// assert!(table.position_error() > 0.0086 && table.position_error() < 0.009); // half of the cells' diagonal
/// ```
#[derive(Clone, Copy, Debug)]
pub struct QuantisedVertices<'a> {
    rows: &'a [[u16; 3]],
    origin: Vec3,
    step: Vec3,
}

impl<'a> QuantisedVertices<'a> {
    /// A view of quantised rows. `origin` is the box's corner and `step` the size of one unit along
    /// each axis, both in mm.
    #[must_use]
    pub const fn new(rows: &'a [[u16; 3]], origin: Vec3, step: Vec3) -> Self {
        Self { rows, origin, step }
    }
}

impl VertexTable for QuantisedVertices<'_> {
    fn len(&self) -> usize {
        self.rows.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let &[x, y, z] = self.rows.get(vertex as usize)?;
        Some(self.origin + self.step * Vec3::new(f32::from(x), f32::from(y), f32::from(z)))
    }

    /// Half of a step on each axis, and the rounding of a product and a sum.
    fn position_error(&self) -> f32 {
        let (origin, step) = (self.origin.abs(), self.step.abs());
        let rounding = (origin + step * (2.0 * 65_535.0)) * (0.5 * f32::EPSILON);
        // The sum and the length round, too.
        (step * 0.5 + rounding).length() * (1.0 + 4.0 * f32::EPSILON)
    }
}
