//! Distances along the surface: the graph of its paths, and shortest paths in it.

// Requirement: A-02

mod graph;
mod search;
mod topology;

pub(crate) use graph::Graph;
pub(crate) use search::{Distances, Farthest};
pub(crate) use topology::Topology;
