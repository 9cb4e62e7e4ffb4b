//! Surfaces that a coarse model moves: vertices embedded in tetrahedra, in flash.
//!
//! Tissue models are coarse: finite elements, cages, markers. The fine surface is embedded in them: a vertex is the
//! weighted mean of the four nodes of its element, computed only when a query reads it. So a frame consists of nodes,
//! its check measures the elements, and the tree's radii are lengths of paths through them.
//!
//! | | |
//! |---|---|
//! | [`Nodes`] | the builder's elements and bindings, read from the tree's bytes and validated once |
//! | [`EmbeddedSurface`] | the surface at some nodes: a [`VertexTable`] |
//! | [`Nodes::measure`] | the elements' stretch |
//! | [`NodeMonitor`] | the check of frames of nodes, in slices, for an [`Assembler`](crate::Assembler) |
//!
//! Nodes are rows like vertices: [`Frames`](crate::Frames) hold them, an [`Assembler`](crate::Assembler) receives them,
//! and a frame's [`interpolated`](crate::FrameGuard::interpolated) and
//! [`extrapolated`](crate::FrameGuard::extrapolated) nodes move surfaces, too.

// Requirement: F-07

mod error;
mod kernel;
mod layout;
mod measure;
mod monitor;
mod surface;

use core::ops::Range;

use glam::Vec3;
use kernel::CurrentElement;
use layout::Parts;

pub use error::NodesError;
/// The layout of the nodes' bytes, for their builder.
#[doc(hidden)]
pub use layout::{
    BINDING_BYTES, ELEMENT_BYTES, HEADER_BYTES, MARKS, MOST_SIZES, NODE_BYTES, SIGNED_ZERO, STEP,
    WHOLE,
};
use measure::Pass;
pub use monitor::NodeMonitor;
pub use surface::EmbeddedSurface;

use crate::math::sqrt::sqrt;
use crate::stretch::StretchError;
use crate::surface::{MeasuredStretch, MotionUnit, Odometer, REGIONS, VertexTable};
use crate::tree::{Index, PathKind, SurfaceFacts, Tree};

/// Most nodes of a surface.
#[doc(hidden)]
pub const MAX_NODES: u32 = 1 << 16;

/// Most elements of a surface.
#[doc(hidden)]
pub const MAX_ELEMENTS: u32 = 1 << 16;

/// Relative allowance for the rounding of an element's check; divided by the least eigenvalue of its scaled rest shape.
#[doc(hidden)]
pub const MARGIN: f64 = 50.0 / 16_777_216.0;

/// The least element volume that is certainly positive, as a fraction of the product of its edges' longest lengths.
#[doc(hidden)]
pub const LEAST_VOLUME: f64 = 12.0 / 16_777_216.0;

/// The nodes, elements and bindings in a tree, validated once: a view of bytes in flash.
///
/// ```
/// use dibs_build::{Builder, Volume, generate};
/// use dibs_nostd::nodes::Nodes;
/// use dibs_nostd::{Options, Query, Sphere, Tree, glam::Vec3};
///
/// // On a host: a lattice of 4 x 4 x 4 cells around a heart.
/// let heart = generate::heart(1_000)?.mesh;
/// let lattice = Volume::lattice(&heart, [4, 4, 4])?;
/// let built = Builder::new().stretch(1.5).nodes(&lattice).build(&heart)?;
///
/// // On the target: the tree and its nodes, each validated once.
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let nodes = Nodes::of(&tree)?;
/// let mut query = Query::<_, 32>::new(&tree)?;
///
/// // At each frame: 125 nodes come over the bus instead of 502 vertices.
/// let rest = |node| nodes.rest_position(node).map(|at| at + Vec3::new(0.0, 0.0, 0.02 * at.x));
/// let frame: Vec<Vec3> = (0..nodes.count()).filter_map(rest).collect();
/// let stretch = nodes.measure(frame.as_slice())?;
/// assert!(stretch.sigma() <= tree.stretch());
///
/// let surface = nodes.surface(frame.as_slice());
/// let tool = Sphere::new(Vec3::new(0.0, 0.0, 150.0), 5.0)?;
/// let closest = query.closest(&surface, &tool, &Options::new().stretch(stretch))?;
/// assert!(closest.lower == closest.separation && closest.accuracy < 0.001);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Nodes<'a> {
    parts: Parts<'a>,
    /// The unit of the surface's motion, with the tree's checksum.
    motion: MotionUnit,
    mesh_id: u32,
    facts: SurfaceFacts,
    limit: f32,
}

impl<'a> Nodes<'a> {
    /// Validates the nodes in a tree (section 11 of `docs/format.md`). The builder proves that the radii cover the
    /// surface.
    ///
    /// Cost: linear in the section's bytes.
    ///
    /// # Errors
    /// [`NodesError`] names the first defect and its value.
    pub fn of<I: Index>(tree: &Tree<'a, I>) -> Result<Self, NodesError> {
        let section = tree.sections().coarse;
        // In other path kinds this section holds modes.
        if !matches!(tree.paths(), PathKind::Volume) {
            return Err(NodesError::Absent);
        }
        let parts = layout::parts(section, tree.vertex_count())?;
        Ok(Self {
            parts,
            motion: MotionUnit::of(tree).times(parts.amplification),
            mesh_id: tree.mesh_id(),
            facts: tree.surface_facts(),
            limit: tree.stretch(),
        })
    }

    /// Number of nodes, which is the number of rows of a frame.
    #[must_use]
    pub const fn count(&self) -> u32 {
        self.parts.nodes.len() as u32
    }

    /// Number of elements.
    #[must_use]
    pub const fn element_count(&self) -> u32 {
        self.parts.elements.len() as u32
    }

    /// Number of vertices of the surface.
    #[must_use]
    pub const fn vertex_count(&self) -> u32 {
        self.parts.bindings.len() as u32
    }

    /// The mesh that the nodes move.
    #[must_use]
    pub const fn mesh_id(&self) -> u32 {
        self.mesh_id
    }

    /// The tree's stretch limit: the largest limit of any [element](Self::element_limit).
    #[must_use]
    pub const fn stretch_limit(&self) -> f32 {
        self.limit
    }

    /// The stretch beyond which frames are refused because of an element; `None` if there is no such element. It is
    /// below the limit given to the builder, to allow for the check's rounding: by a few parts in a million, and by up
    /// to 1.6 % for a flat element.
    ///
    /// Cost: one element's check and a root.
    #[must_use]
    pub fn element_limit(&self, element: u32) -> Option<f32> {
        let record = layout::element(self.parts.elements.get(element as usize)?);
        let [a, b, c, d] = record.corners.map(|node| self.rest_position(node));
        let corners = [a?, b?, c?, d?].map(|corner| corner.to_array());
        let [own, compared] = CurrentElement::of(corners).sizes(&record.rest);
        Some(self.limit * sqrt(compared / own))
    }

    /// Bytes of the section in flash.
    #[must_use]
    pub const fn flash_bytes(&self) -> usize {
        let Parts { nodes, elements, bindings, marks, .. } = &self.parts;
        HEADER_BYTES
            + NODE_BYTES * nodes.len()
            + ELEMENT_BYTES * elements.len()
            + BINDING_BYTES * bindings.len()
            + size_of::<u32>() * marks.len()
    }

    /// Position of a node at rest (mm); `None` outside the table.
    #[must_use]
    pub fn rest_position(&self, node: u32) -> Option<Vec3> {
        self.parts.nodes.get(node as usize).map(layout::position)
    }

    /// The nodes of an element, in an order in which its volume at rest is positive; `None` outside the table.
    #[must_use]
    pub fn element(&self, element: u32) -> Option<[u32; 4]> {
        self.parts.elements.get(element as usize).map(layout::corners)
    }

    /// The nodes of a vertex and their weights, in parts of 65,536, which sum up exactly; `None` outside the table. A
    /// vertex outside of its element has negative weights.
    #[must_use]
    pub fn weights(&self, vertex: u32) -> Option<[(u32, i32); 4]> {
        let ([a, b, c, d], stored) = self.binding(vertex)?;
        let parts = self.parts.scale.parts(1) as i32;
        let [u, v, w, x] =
            self.parts.scale.weights(stored).map(|weight| weight.wrapping_mul(parts));
        Some([(a, u), (b, v), (c, w), (d, x)])
    }

    /// The most that a vertex moves for each millimetre of the farthest node of its element: 1 if no vertex is outside
    /// of its element, else the largest sum of a vertex's absolute weights, below 3.
    ///
    /// The position errors of the nodes, their motion and their extrapolation are multiplied by it.
    #[must_use]
    pub const fn amplification(&self) -> f32 {
        self.parts.amplification
    }

    /// The surface at these nodes, one row each, in the order of the volume's file. No vertex is computed yet. If the
    /// table has another length, the surface is empty, and a query refuses it.
    #[must_use]
    pub const fn surface<'n, V: VertexTable + ?Sized>(
        &'n self,
        table: &'n V,
    ) -> EmbeddedSurface<'n, 'a, V> {
        EmbeddedSurface::new(self, table)
    }

    /// Measures the stretch of all elements at once: the largest singular value of each, rounded up. The most stretched
    /// element is [`MeasuredStretch::triangle`]. [`NodeMonitor`] measures the same in slices.
    ///
    /// Cost: linear in the elements, about 90 floating point operations each, without root or division.
    ///
    /// # Errors
    /// [`StretchError::ElementExceeded`] and [`StretchError::Inverted`] for the first element beyond the limit or
    /// inverted, [`StretchError::VertexCount`] for a table of another length.
    pub fn measure<V: VertexTable + ?Sized>(
        &self,
        table: &V,
    ) -> Result<MeasuredStretch, StretchError> {
        self.check_rows(table)?;
        let mut pass = Pass::new();
        pass.advance(self, table, self.count(), 0.0, u32::MAX)?;
        Ok(pass.measured(self, table.epoch()))
    }

    /// The same in less time for a frame that follows another: its `last` frame's most stretched element is measured
    /// first. `sigma` is rounded up from another start, by less than one part in 65,536. The measurement of any other
    /// frame or tree is only a worse start: every element is still measured.
    ///
    /// # Errors
    /// As [`measure`](Self::measure).
    pub fn measure_after<V: VertexTable + ?Sized>(
        &self,
        table: &V,
        last: &MeasuredStretch,
    ) -> Result<MeasuredStretch, StretchError> {
        self.check_rows(table)?;
        let mut pass = Pass::new();
        pass.start_with(self, table, last.triangle().0);
        pass.advance(self, table, self.count(), 0.0, u32::MAX)?;
        Ok(pass.measured(self, table.epoch()))
    }

    /// An odometer of node frames, for the motion of surfaces that do not come from a bus, for a
    /// [`Tracker`](crate::Tracker).
    #[must_use]
    pub const fn odometer(&self) -> Odometer {
        Odometer::of_rows(self.motion, self.count() as usize, self.vertex_count() as usize)
    }

    fn check_rows<V: VertexTable + ?Sized>(&self, table: &V) -> Result<(), StretchError> {
        let (expected, found) = (self.count(), table.len());
        if found != expected as usize {
            return Err(StretchError::VertexCount { expected, found: found as u32 });
        }
        Ok(())
    }

    /// Whether a vertex has a weight other than 0 for this node: the motion of the others moves no part of the surface.
    fn carries(&self, node: u32) -> bool {
        self.parts.carries(node)
    }

    /// Those of these nodes that carry a vertex.
    fn carrying(&self, nodes: Range<u32>) -> impl Iterator<Item = u32> {
        nodes.filter(|&node| self.carries(node))
    }

    /// Number of elements in a range whose size is limited together.
    fn run(&self) -> u32 {
        self.element_count().div_ceil(REGIONS as u32)
    }

    /// The nodes of a vertex, and the stored weights of the first three.
    #[inline(always)]
    fn binding(&self, vertex: u32) -> Option<([u32; 4], [u32; 3])> {
        let binding = layout::binding(self.parts.bindings.get(vertex as usize)?);
        let record = self.parts.elements.get(binding.element as usize)?;
        Some((layout::corners(record), binding.weights))
    }
}
