//! Leaves: which triangles make one, and the order in which it stores them.

mod order;
mod patch;

pub(crate) use order::{StoredTriangle, ill_conditioned, openness, order};
pub(crate) use patch::connected_by_edges;
