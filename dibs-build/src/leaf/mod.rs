//! Leaves: the sets of triangles that form them, and their order.

mod order;
mod patch;

pub(crate) use order::{StoredTriangle, ill_conditioned, order};
pub(crate) use patch::connected_by_edges;
