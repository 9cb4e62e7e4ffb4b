//! Proximity queries on a deforming mesh, for hard real-time controllers.
#![no_std]
#![deny(unsafe_code)]

pub use glam;

mod answer;
mod index;
mod vertices;

pub use answer::Proximity;
pub use index::Index;
pub use vertices::{QuantisedVertices, VertexTable};
