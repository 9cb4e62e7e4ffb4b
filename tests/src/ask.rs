//! Unsigned queries on a tree of either index width, with the oracle's instrument as the tool.

use dibs_nostd::{Capsule, Index, Options, Proximity, Query, QueryError, Sphere, VertexTable};

use crate::oracle::Instrument;

/// The closest pair of the instrument: a sphere if its ends coincide, else a capsule.
///
/// # Errors
/// The query's.
///
/// # Panics
/// If the instrument is not a valid tool.
pub fn closest<I: Index, const D: usize>(
    query: &mut Query<'_, I, D>,
    vertices: &(impl VertexTable + ?Sized),
    tool: &Instrument,
    options: &Options,
) -> Result<Proximity, QueryError> {
    if tool.start == tool.end {
        query.closest(vertices, &sphere(tool), &options.unsigned())
    } else {
        query.closest(vertices, &capsule(tool), &options.unsigned())
    }
}

/// The same with the batched search.
///
/// # Errors
/// The query's.
///
/// # Panics
/// If the instrument is not a valid tool.
pub fn closest_batched<I: Index, const D: usize>(
    query: &mut Query<'_, I, D>,
    vertices: &(impl VertexTable + ?Sized),
    tool: &Instrument,
    options: &Options,
) -> Result<Proximity, QueryError> {
    if tool.start == tool.end {
        query.closest_batched(vertices, &sphere(tool), &options.unsigned())
    } else {
        query.closest_batched(vertices, &capsule(tool), &options.unsigned())
    }
}

fn sphere(tool: &Instrument) -> Sphere {
    Sphere::new(tool.start, tool.radius).expect("a valid sphere")
}

fn capsule(tool: &Instrument) -> Capsule {
    Capsule::new(tool.start, tool.end, tool.radius).expect("a valid capsule")
}
