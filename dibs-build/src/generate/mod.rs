//! Procedural test surfaces with the shape that makes proximity queries hard: walls that are close in space and far
//! apart along the surface.
//!
//! [`heart`] and [`brain`] have exactly the requested number of triangles, are closed, manifold, of genus 0 and face
//! outwards. They have the same bits on every machine, because they use only IEEE arithmetic, square roots and the
//! `libm` crate.

mod beat;
mod brain;
mod contour;
mod half_edge;
mod heart;
mod noise;
mod remesh;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;

use crate::{Mesh, Motion};

pub use beat::beat;
pub use brain::brain;
pub use heart::heart;

/// A surface and its motion.
#[derive(Clone, Debug)]
pub struct MovingMesh {
    /// The surface at rest.
    pub mesh: Mesh,
    /// Its motion: frame 0 is the mesh itself.
    pub motion: Motion,
}

/// Why a surface could not be generated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// The number is odd (a closed triangle mesh has an even number of triangles), or outside the range in which the
    /// shape is recognisable.
    #[error(
        "a generated {surface} cannot have {asked} triangles: \
         ask for an even number from {least} to {most}, the nearest is {nearest}"
    )]
    TriangleCount {
        /// "heart" or "brain".
        surface: &'static str,
        /// The number requested.
        asked: u32,
        /// The nearest valid number; of two, the smaller.
        nearest: u32,
        /// The smallest valid number.
        least: u32,
        /// The largest valid number.
        most: u32,
    },
    /// The mesh could not be brought to the requested number without a fold.
    #[error(
        "the generated {surface} got stuck at {reached} triangles instead of {asked}: \
         ask for a slightly different number"
    )]
    Stuck {
        /// "heart" or "brain".
        surface: &'static str,
        /// The number requested.
        asked: u32,
        /// The number reached.
        reached: usize,
    },
}

/// Fails unless `asked` is even and within `range`, whose ends are even.
fn check(
    surface: &'static str,
    asked: u32,
    range: RangeInclusive<u32>,
) -> Result<(), GenerateError> {
    let (least, most) = range.into_inner();
    let nearest = asked.clamp(least, most) & !1;
    if nearest == asked {
        Ok(())
    } else {
        Err(GenerateError::TriangleCount { surface, asked, nearest, least, most })
    }
}
