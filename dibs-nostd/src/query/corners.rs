//! The current positions of a triangle's corners.

use glam::Vec3;

use crate::tree::Tree;
use crate::unavailable::QueryError;
use crate::{Index, VertexTable};

/// The vertex rows of a triangle's corners, and their positions.
#[inline(always)]
pub(super) fn corners<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
    triangle: u32,
) -> Result<([u32; 3], [Vec3; 3]), QueryError> {
    let rows = tree.triangle(triangle).ok_or(QueryError::Corrupt { row: triangle })?;
    Ok((rows, positions(vertices, rows)?))
}

#[inline(always)]
pub(super) fn positions<V: VertexTable + ?Sized>(
    vertices: &V,
    [a, b, c]: [u32; 3],
) -> Result<[Vec3; 3], QueryError> {
    let position = |row| vertices.position(row).ok_or(QueryError::Corrupt { row });
    Ok([position(a)?, position(b)?, position(c)?])
}
