//! Proximity queries on a deforming mesh, for hard real-time controllers.
#![no_std]
#![deny(unsafe_code)]

mod answer;

pub use answer::Proximity;
