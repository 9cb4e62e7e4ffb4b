//! Measured stretch: how far the surface as it is now departs from its rest shape.

use core::fmt;

use glam::Vec3;

use crate::format::PathKind;
use crate::sqrt::sqrt;
use crate::{Index, Tree, VertexTable};

/// The largest stretch `sigma` of one frame, measured on every triangle.
///
/// Only a measurement makes one, so a query cannot be given a stretch below the true one by mistake.
/// It belongs to the frame that it was measured on: a query on another frame needs another.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MeasuredStretch {
    pub(crate) sigma: f32,
    pub(crate) mesh_id: u32,
    pub(crate) triangle: u32,
}

impl MeasuredStretch {
    /// The stretch, rounded up: at least 1 where anything kept its length.
    #[must_use]
    pub const fn sigma(&self) -> f32 {
        self.sigma
    }

    /// The triangle that is stretched most.
    #[must_use]
    pub const fn triangle(&self) -> u32 {
        self.triangle
    }

    /// The mesh that it was measured on.
    #[must_use]
    pub const fn mesh_id(&self) -> u32 {
        self.mesh_id
    }
}

/// Why a stretch could not be measured, or what it is beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StretchError {
    /// The tree was emitted without its rest shape.
    NoRestShape,
    /// The vertex table does not have one row for each of the tree's vertices.
    VertexCount {
        /// Rows that the tree needs.
        expected: u32,
        /// Rows of the table.
        found: u32,
    },
    /// A triangle is stretched beyond the tree's limit: distances on this frame would be wrong.
    Exceeded {
        /// Row of the triangle.
        triangle: u32,
        /// Its stretch; not a number where a position is not one.
        stretch: f32,
        /// The tree's limit.
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
            Self::NoRestShape => write!(f, "the tree was emitted without its rest shape"),
            Self::VertexCount { expected, found } => {
                write!(f, "the tree has {expected} vertices, the table {found}")
            }
            Self::Exceeded { triangle, stretch, limit } => {
                write!(f, "triangle {triangle} is stretched by {stretch}, the tree allows {limit}")
            }
            Self::Corrupt { row } => write!(f, "row {row} is missing: the tree's bytes changed"),
        }
    }
}

impl core::error::Error for StretchError {}

/// Measures the stretch of a whole frame: the largest over all triangles of what the tree's
/// [`PathKind`] asks for, rounded up by the error of the f32 arithmetic.
///
/// Cost: linear in the triangles, about 70 floating point operations and two roots each.
///
/// # Errors
/// [`StretchError::Exceeded`] names the first triangle beyond the tree's limit; the others say why
/// nothing could be measured.
pub fn measure_stretch<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
) -> Result<MeasuredStretch, StretchError> {
    if tree.rest_position(0).is_none() {
        return Err(StretchError::NoRestShape);
    }
    if vertices.len() != tree.vertex_count() as usize {
        return Err(StretchError::VertexCount {
            expected: tree.vertex_count(),
            found: vertices.len() as u32,
        });
    }
    let limit = tree.stretch();
    let mut worst = MeasuredStretch { sigma: 0.0, mesh_id: tree.mesh_id(), triangle: 0 };
    for triangle in 0..tree.triangle_count() {
        let [a, b, c] = tree.triangle(triangle).ok_or(StretchError::Corrupt { row: triangle })?;
        let at = |row| {
            let rest = tree.rest_position(row).ok_or(StretchError::Corrupt { row })?;
            let now = vertices.position(row).ok_or(StretchError::Corrupt { row })?;
            Ok((rest, now))
        };
        let ((ra, na), (rb, nb), (rc, nc)) = (at(a)?, at(b)?, at(c)?);
        let rest = [rb - ra, rc - ra];
        let now = [nb - na, nc - na];
        let stretch = match tree.paths() {
            PathKind::EdgePath => edge_stretch(rest, now),
            PathKind::Surface => surface_stretch(rest, now),
        };
        // Written so that NaN is beyond the limit.
        if !(stretch <= limit) {
            return Err(StretchError::Exceeded { triangle, stretch, limit });
        }
        if stretch > worst.sigma {
            worst = MeasuredStretch { sigma: stretch, triangle, ..worst };
        }
    }
    Ok(worst)
}

/// Half a unit in the last place of 1.
const U: f32 = 1.0 / 16_777_216.0;

/// Largest ratio of an edge's length to its rest length.
fn edge_stretch(rest: [Vec3; 2], now: [Vec3; 2]) -> f32 {
    let edges = |[e, f]: [Vec3; 2]| [e, f, f - e].map(Vec3::length_squared);
    let mut worst = 0.0;
    for (rest, now) in edges(rest).into_iter().zip(edges(now)) {
        let ratio = now / rest;
        // Written so that NaN wins.
        if !(ratio <= worst) {
            worst = ratio;
        }
    }
    sqrt(worst) * (1.0 + 16.0 * U)
}

/// Largest singular value of the deformation gradient that takes the rest edges to the current ones.
///
/// With an orthonormal frame of the rest triangle, `F` has the columns `p = f1 / x1` and
/// `q = (f2 - p * x2) / y2`; the largest eigenvalue of `F^T F` has a closed form. The rounding of
/// `y2` grows with the inverse sine of the corner's angle, and the result is raised by as much.
fn surface_stretch([e1, e2]: [Vec3; 2], [f1, f2]: [Vec3; 2]) -> f32 {
    let x1 = sqrt(e1.length_squared());
    let x2 = e1.dot(e2) / x1;
    let y2 = sqrt(e1.cross(e2).length_squared()) / x1;
    let p = f1 / x1;
    let q = (f2 - p * x2) / y2;
    let (pp, pq, qq) = (p.length_squared(), p.dot(q), q.length_squared());
    let (mean, half) = (0.5 * (pp + qq), 0.5 * (pp - qq));
    let sigma = sqrt(mean + sqrt(half * half + pq * pq));
    let inverse_sine = sqrt(e2.length_squared()) / y2;
    sigma * (1.0 + 32.0 * U * inverse_sine)
}
