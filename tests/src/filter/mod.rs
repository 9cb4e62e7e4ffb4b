//! Adversarial ticks of a filter of commands, judged in f64.

mod glide;
mod walk;
mod world;

pub use glide::{Glided, glide};
pub use walk::{Episode, Tally, walk};
pub use world::{Course, Scene, scenes};
