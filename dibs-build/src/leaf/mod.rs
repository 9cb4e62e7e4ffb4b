//! Leaves: the sets of triangles that form them, and the order of their triangles.

mod order;
mod patch;

pub(crate) use order::{StoredTriangle, ill_conditioned, order};
pub(crate) use patch::connected_by_edges;
