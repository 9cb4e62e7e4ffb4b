//! A surface embedded in moving nodes: each vertex is computed when it is read.

use glam::Vec3;

use super::Nodes;
use super::layout::WHOLE;
use crate::surface::motion::sealed::Sealed;
use crate::surface::{MeasuredStretch, MotionReading, MovingSurface, VertexTable};

/// The surface that a table of nodes carries: [`Nodes::surface`] makes one.
///
/// It is as the nodes are: between frames where they are interpolated, beyond the last where they are extrapolated, with
/// their stretch and their motion. No vertex moves farther than a node of its element, because weights are not negative
/// and sum up to one.
///
/// A vertex is the fourth node of its element plus weighted edges from there to the other three, which rounds less than
/// a sum of weighted positions.
#[derive(Clone, Copy, Debug)]
pub struct EmbeddedSurface<'n, 'a, V: ?Sized> {
    nodes: &'n Nodes<'a>,
    table: &'n V,
}

impl<'n, 'a, V: VertexTable + ?Sized> EmbeddedSurface<'n, 'a, V> {
    pub(super) const fn new(nodes: &'n Nodes<'a>, table: &'n V) -> Self {
        Self { nodes, table }
    }

    /// The positions of the nodes.
    #[must_use]
    pub const fn table(&self) -> &'n V {
        self.table
    }

    /// Largest distance (mm) by which f32 arithmetic may misplace a pin and a vertex to each other, and their
    /// triangle.
    fn rounding(&self) -> f32 {
        let stretch = self.nodes.limit;
        let [node, ..] = self.nodes.element(0).unwrap_or_default();
        let size = self.table.position(node).unwrap_or(Vec3::NAN).length();
        let coordinates = size + stretch * self.nodes.parts.extent;
        (3.0 * coordinates + 16.0 * stretch * self.nodes.parts.edge) * ROUNDING
    }
}

/// Half a unit in the last place of 1, and a hundredth of it for the rounding of the bound itself.
const ROUNDING: f32 = 1.01 / 16_777_216.0;

impl<V: VertexTable + ?Sized> VertexTable for EmbeddedSurface<'_, '_, V> {
    /// The tree's vertices; 0 where the table has another number of nodes.
    fn len(&self) -> usize {
        let is_whole = self.table.len() == self.nodes.parts.nodes.len();
        if is_whole { self.nodes.parts.bindings.len() } else { 0 }
    }

    /// Cost: 16 bytes of flash, four nodes and some 30 floating point operations.
    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let ([a, b, c, d], weights) = self.nodes.binding(vertex)?;
        let d = self.table.position(d)?;
        let [u, v, w] = weights.map(|weight| weight as f32);
        let sum = (self.table.position(a)? - d) * u
            + (self.table.position(b)? - d) * v
            + (self.table.position(c)? - d) * w;
        Some(d + sum * (1.0 / WHOLE as f32))
    }

    fn epoch(&self) -> Option<u32> {
        self.table.epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.table.stretch()
    }

    /// That of the nodes, and the rounding of f32.
    fn position_error(&self) -> f32 {
        self.table.position_error() + self.rounding()
    }
}

impl<V: MovingSurface + ?Sized> Sealed for EmbeddedSurface<'_, '_, V> {}

impl<V: MovingSurface + ?Sized> MovingSurface for EmbeddedSurface<'_, '_, V> {
    fn motion(&self) -> Option<MotionReading> {
        self.table.motion()
    }
}
