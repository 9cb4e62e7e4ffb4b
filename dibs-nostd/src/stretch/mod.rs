//! Measured stretch: the deformation of the current surface from its rest shape.

// Requirements: F-02, F-03

mod admission;
mod kernel;
mod limits;
mod monitor;
mod motion;
mod pass;
mod regions;
mod rows;
mod volume;

use core::fmt;

use crate::surface::{MeasuredStretch, REGIONS, VertexTable};
use crate::tree::{Index, Tree, TriangleRow};

pub use admission::{
    Admission, AdmissionCheck, Comparison, FrameExtent, IncomingSurface, NoAdmissionCheck,
};
use kernel::Worst;
#[cfg(feature = "nodes")]
pub(crate) use kernel::{LEAST, root_up, squared_limit};
pub use limits::SurfaceLimits;
pub use monitor::StretchMonitor;
#[cfg(feature = "bus")]
pub(crate) use motion::largest_change;
#[cfg(any(feature = "bus", feature = "nodes"))]
pub(crate) use motion::largest_step;
#[cfg(feature = "nodes")]
pub(crate) use motion::{farthest, too_fast};
use regions::{of_regions, region_rows};

/// Why a stretch could not be measured, or the limit that it exceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StretchError {
    /// The tree was emitted without its metric section.
    NoMetric,
    /// The table does not have one row for each of the tree's vertices or nodes.
    VertexCount {
        /// Rows that the tree needs.
        expected: u32,
        /// Rows of the table.
        found: u32,
    },
    /// A triangle is stretched beyond its limit: distances on this frame would be wrong.
    Exceeded {
        /// The triangle.
        triangle: TriangleRow,
        /// Its stretch; NaN or infinite if a position is, or if the triangle at rest is too small to be measured.
        stretch: f32,
        /// Its limit.
        limit: f32,
    },
    /// An element is stretched beyond its limit: distances on this frame would be wrong.
    ElementExceeded {
        /// The element.
        element: u32,
        /// Its stretch; infinite if a node is not finite. If elements have their own limits, it is divided by the
        /// element's and multiplied by the tree's.
        stretch: f32,
        /// The tree's limit.
        limit: f32,
    },
    /// An element is turned inside out, or flat.
    Inverted {
        /// The element.
        element: u32,
    },
    /// A range of elements has shrunk below its limit: collapsed, or in another unit.
    ElementsShrunk {
        /// The first element of the range.
        element: u32,
        /// The least size allowed.
        limit: f32,
    },
    /// A region of the surface has shrunk below its limit: collapsed, or in another unit.
    Shrunk {
        /// Its first triangle.
        triangle: TriangleRow,
        /// The least size allowed.
        limit: f32,
    },
    /// A closed surface encloses a volume of the other sign: it is mirrored, or inside out.
    InsideOut {
        /// Its volume (mm³): positive where triangles wind counterclockwise as seen from outside.
        volume: f32,
        /// The volume of the rest shape, or of the first frame if the tree has none.
        reference: f32,
    },
    /// A vertex moved farther since the published frame than the limits on speed and recovery allow.
    TooFast {
        /// Row of the vertex.
        vertex: u32,
        /// The distance moved (mm).
        step: f32,
        /// The distance allowed (mm).
        limit: f32,
    },
    /// A row outside its table: the tree's bytes changed after they were validated.
    Corrupt {
        /// The row that is missing.
        row: u32,
    },
}

impl fmt::Display for StretchError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoMetric => write!(f, "the tree was emitted without its rest metric"),
            Self::VertexCount { expected, found } => {
                write!(f, "the tree needs a table of {expected} rows, this one has {found}")
            }
            Self::Exceeded { triangle, stretch, limit } => {
                write!(f, "triangle {triangle} is stretched by {stretch}, the tree allows {limit}")
            }
            Self::ElementExceeded { element, stretch, limit } => {
                write!(f, "element {element} is stretched by {stretch}, the tree allows {limit}")
            }
            Self::Inverted { element } => write!(f, "element {element} is inverted or flat"),
            Self::ElementsShrunk { element, limit } => {
                write!(f, "the elements from {element} on shrank below {limit} of their size")
            }
            Self::Shrunk { triangle, limit } => {
                write!(f, "the region of triangle {triangle} shrank below {limit} of its size")
            }
            Self::InsideOut { volume, reference } => {
                write!(f, "the surface is inside out: its volume is {volume}, expected {reference}")
            }
            Self::TooFast { vertex, step, limit } => {
                write!(
                    f,
                    "vertex {vertex} moved by {step} since the last frame, {limit} is allowed"
                )
            }
            Self::Corrupt { row } => write!(f, "row {row} is missing: the tree's bytes changed"),
        }
    }
}

impl core::error::Error for StretchError {}

/// Measures the stretch of a whole frame at once, by the tree's [`PathKind`](crate::PathKind) for every triangle,
/// rounded up by the error of the f32 arithmetic and 2^-17 of itself. [`StretchMonitor`] measures the same in slices.
///
/// The result is never below the true stretch of a triangle. It exceeds the largest by some ten parts in a million, and
/// by more only for triangles nearly flat at rest (twice as much at an angle of 120 degrees, a thousandth at most). The
/// rest shape of a triangle lower than 1/64 of its longest edge counts as that high, here and in the tree's radii.
///
/// Cost: linear in the triangles, about 35 floating point operations each, without root or division except for a
/// triangle stretched more than all before it.
///
/// # Errors
/// [`StretchError::Exceeded`] for the first triangle beyond its limit; other errors give the cause of a missing
/// measurement.
pub fn measure_stretch<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
) -> Result<MeasuredStretch, StretchError> {
    check_tables(tree, vertices)?;
    let (triangles, rows) = (tree.triangle_count(), region_rows(tree));
    let mut regions = [Worst::none(0); REGIONS];
    let mut first = 0;
    for worst in &mut regions {
        let end = triangles.min(first + rows);
        *worst = Worst::none(first);
        rows::scan(tree, vertices, first..end, tree.vertex_count(), worst, &mut 0.0)?;
        first = end;
    }
    Ok(of_regions(tree, &regions, vertices.epoch()))
}

/// Checks that the tree has a metric, and the table the right size.
fn check_tables<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
) -> Result<(), StretchError> {
    if tree.sections().metric.is_empty() {
        return Err(StretchError::NoMetric);
    }
    let (expected, found) = (tree.vertex_count(), vertices.len());
    if found != expected as usize {
        return Err(StretchError::VertexCount { expected, found: found as u32 });
    }
    Ok(())
}
