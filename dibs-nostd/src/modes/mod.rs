//! Surfaces that a few weights move: a rest shape plus displacement modes, in flash.
//!
//! A vertex is at `rest + sum of weight_k * mode_k`, computed only when a query reads it (Bowyer & Rodriguez y Baena
//! 2014 name this "lazy evaluation" as future work). So a frame is at most [`MAX_MODES`] weights, and no tick touches
//! all vertices.
//!
//! | | |
//! |---|---|
//! | [`Modes`] | the builder's fit, read from the tree's bytes and validated once |
//! | [`ModalSurface`] | the surface at some weights: a [`VertexTable`](crate::VertexTable) |
//! | [`Modes::stretch_bound`] | a bound on its stretch, in time that does not depend on the vertices |
//! | [`ModalAdmissionCheck`], [`ModalReader`] | both ends of a bus that carries weights |
//! | [`Memo`] | remembers positions, for the length of a query |

// Requirement: F-06

mod admission;
mod bound;
mod error;
mod frame;
mod layout;
mod memo;
mod reach;
mod reader;
mod surface;
#[cfg(test)]
mod tests;

use layout::Header;

pub use admission::ModalAdmissionCheck;
pub use error::{ModesError, WeightsError};
pub use frame::ModalFrame;
/// The layout of the modes' bytes, for their builder.
#[doc(hidden)]
pub use layout::{ANCHOR_TAIL_BYTES, HEADER_BYTES, MAX_ANCHORS, MODE_BYTES, VERTEX_MODE_BYTES};
pub use memo::Memo;
pub use reader::ModalReader;
pub use surface::ModalSurface;

use glam::Vec3;

use crate::surface::MotionUnit;
use crate::tree::{Index, PathKind, Tree, format};

/// Most modes of a surface.
#[doc(hidden)]
pub const MAX_MODES: usize = 64;

/// Fraction bits of a weight times a displacement, relative to the unit of their sum.
#[doc(hidden)]
pub const FRACTION_BITS: u32 = 16;

/// Largest sum over the modes of largest weight times gain: a displacement sum then fits in 29 bits.
#[doc(hidden)]
pub const MAX_GAIN: f32 = 536_870_912.0;

/// The displacement modes in a tree, validated once: a view of bytes in flash.
///
/// ```
/// use dibs_build::{Builder, generate, modes::ModalFit};
/// use dibs_nostd::modes::Modes;
/// use dibs_nostd::{Options, Query, Sphere, Tree, glam::Vec3};
///
/// // On a host: two modes are all that this motion has.
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
/// let fit = ModalFit::new(&heart, &motion)?;
/// let built = Builder::new().stretch(1.5).build(&heart)?.with_modes(&fit, 2)?;
///
/// // On the target: the tree and its modes, each validated once.
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let modes = Modes::of(&tree)?;
/// let mut query = Query::<_, 32>::new(&tree)?;
///
/// // At each tick: two weights come over the bus instead of 502 vertices.
/// let weights = [0.5, -0.1];
/// let stretch = modes.stretch_bound(&weights)?;
/// assert!(stretch.sigma() <= tree.stretch());
/// let surface = modes.surface::<2>(&weights)?;
/// let tool = Sphere::new(Vec3::new(0.0, 0.0, 150.0), 5.0)?;
/// let closest = query.closest(&surface, &tool, &Options::new().stretch(stretch))?;
/// assert!(closest.accuracy > modes.position_error() && closest.accuracy < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Modes<'a> {
    header: Header,
    /// One record a mode.
    records: &'a [u8],
    anchors: &'a [u8],
    /// One row a vertex, all of its modes side by side.
    rows: &'a [u8],
    rest: &'a [u8],
    vertices: u32,
    mesh_id: u32,
    /// The unit of the surface's motion, with the tree's checksum.
    motion: MotionUnit,
    limit: f32,
}

impl<'a> Modes<'a> {
    /// Validates the modes in a tree (section 7 of `docs/format.md`).
    ///
    /// Cost: O(modes times anchors). The rows need no check, since any bits are displacements.
    ///
    /// # Errors
    /// [`ModesError`] names the first defect and its value.
    pub const fn of<I: Index>(tree: &Tree<'a, I>) -> Result<Self, ModesError> {
        let sections = tree.sections();
        // In a tree with volume paths the section holds nodes.
        if sections.coarse.is_empty() || matches!(tree.paths(), PathKind::Volume) {
            return Err(ModesError::Absent);
        }
        if sections.rest.is_empty() {
            return Err(ModesError::NoRestShape);
        }
        let vertices = tree.vertex_count();
        match layout::parts(sections.coarse, vertices, tree.triangle_count()) {
            Ok((header, [records, anchors, rows])) => Ok(Self {
                header,
                records,
                anchors,
                rows,
                rest: sections.rest,
                vertices,
                mesh_id: tree.mesh_id(),
                motion: MotionUnit::of(tree),
                limit: tree.stretch(),
            }),
            Err(error) => Err(error),
        }
    }

    /// Number of modes, 1 to [`MAX_MODES`].
    #[must_use]
    pub const fn count(&self) -> usize {
        self.header.modes as usize
    }

    /// Number of vertices of the surface.
    #[must_use]
    pub const fn vertex_count(&self) -> u32 {
        self.vertices
    }

    /// Number of recorded shapes from which [`stretch_bound`](Self::stretch_bound) starts, including the rest shape.
    #[must_use]
    pub const fn anchor_count(&self) -> usize {
        self.header.anchors as usize
    }

    /// The mesh that the modes displace.
    #[must_use]
    pub const fn mesh_id(&self) -> u32 {
        self.mesh_id
    }

    /// The stretch limit of the tree, which [`stretch_bound`](Self::stretch_bound) must not exceed.
    #[must_use]
    pub const fn stretch_limit(&self) -> f32 {
        self.limit
    }

    /// Largest distance (mm) between a recorded vertex and the modal surface's, over the motion to which the modes were
    /// fitted: from omitted modes, quantisation and arithmetic. For the answer's accuracy:
    /// [`Proximity::widened`](crate::Proximity::widened).
    ///
    /// It does not hold for other motions.
    #[must_use]
    pub const fn position_error(&self) -> f32 {
        self.header.position_error
    }

    /// Root mean square of the same distance (mm).
    #[must_use]
    pub const fn rms_error(&self) -> f32 {
        self.header.rms_error
    }

    /// Fraction of the recorded range by which [`range`](Self::range) exceeds it.
    #[must_use]
    pub const fn margin(&self) -> f32 {
        self.header.margin
    }

    /// Bytes of the modes in flash, without the rest shape.
    #[must_use]
    pub const fn flash_bytes(&self) -> usize {
        HEADER_BYTES + self.records.len() + self.anchors.len() + self.rows.len()
    }

    /// Smallest and largest weight of a mode that [`check`](Self::check) admits; `None` if there is no such mode.
    #[must_use]
    pub const fn range(&self, mode: usize) -> Option<[f32; 2]> {
        match layout::mode(self.records, mode) {
            Some(mode) => Some([mode.low, mode.high]),
            None => None,
        }
    }

    /// Position of a vertex at rest (mm), with all weights 0. `None` outside the table.
    #[must_use]
    pub const fn rest_position(&self, vertex: u32) -> Option<Vec3> {
        format::rest_position(self.rest, vertex)
    }

    /// Size of one step of a mode's displacements at weight 1 (mm); `None` if there is no such mode.
    #[must_use]
    pub const fn step(&self, mode: usize) -> Option<f32> {
        match layout::mode(self.records, mode) {
            // Exact: the builder's unit is a power of two.
            Some(mode) => Some(mode.gain * self.header.unit / (1 << FRACTION_BITS) as f32),
            None => None,
        }
    }

    /// Displacement of a vertex by one mode, in the mode's [`step`](Self::step)s; `None` outside the tables. For host
    /// programs: a query reads all modes at once.
    #[must_use]
    pub fn displacement(&self, mode: usize, vertex: u32) -> Option<[i16; 3]> {
        let &[x0, x1, y0, y1, z0, z1] = self.row(vertex)?.get(mode)?;
        Some([[x0, x1], [y0, y1], [z0, z1]].map(i16::from_le_bytes))
    }

    /// Checks that there is one weight for each mode, finite and in the mode's range. O(modes).
    ///
    /// # Errors
    /// [`WeightsError`] for the first invalid weight.
    pub fn check(&self, weights: &[f32]) -> Result<(), WeightsError> {
        if weights.len() != self.count() {
            return Err(WeightsError::Count {
                expected: self.count() as u32,
                found: weights.len() as u32,
            });
        }
        for (mode, (&weight, record)) in weights.iter().zip(self.modes()).enumerate() {
            let mode = mode as u32;
            if !weight.is_finite() {
                return Err(WeightsError::NotFinite { mode });
            }
            if weight < record.low || weight > record.high {
                return Err(WeightsError::OutOfRange { mode, weight });
            }
        }
        Ok(())
    }

    /// The surface at these weights. O(modes): no vertex is computed yet.
    ///
    /// # Errors
    /// [`WeightsError`] as from [`check`](Self::check), or for more modes than `K`.
    pub fn surface<const K: usize>(
        &self,
        weights: &[f32],
    ) -> Result<ModalSurface<'a, K>, WeightsError> {
        if self.count() > K {
            return Err(WeightsError::Capacity {
                needed: self.count() as u32,
                available: K as u32,
            });
        }
        self.check(weights)?;
        Ok(ModalSurface::new(self, weights.iter().copied()))
    }

    /// The checksum of the tree that has these modes.
    #[cfg(all(feature = "bus", feature = "control"))]
    pub(crate) const fn tree_checksum(&self) -> u32 {
        self.motion.tree
    }

    fn modes(&self) -> impl Iterator<Item = layout::Mode> {
        self.records.as_chunks::<MODE_BYTES>().0.iter().map(layout::decode)
    }

    /// A vertex's stored displacements by all modes.
    #[inline(always)]
    fn row(&self, vertex: u32) -> Option<&'a [[u8; VERTEX_MODE_BYTES]]> {
        layout::row(self.rows, vertex, self.count())
    }
}
