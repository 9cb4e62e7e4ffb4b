//! Adversarial ticks of a filter of commands, judged in f64.

mod asked;
mod beat;
mod glide;
mod medial;
mod truth;
mod walk;
mod world;

pub use asked::{Asked, Listener, Settings};
pub use beat::{Beat, Moment};
pub use glide::{Glided, fastest, glide, glide_told};
pub use walk::{Episode, Tally, walk, walk_by_label, walk_told};
pub use world::{Course, Scene, labelled_scenes, scenes};
