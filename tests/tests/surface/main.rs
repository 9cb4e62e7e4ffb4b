//! Surfaces that move: stretch, frames, modes, and what is refused of them.

mod facts;
mod frames;
mod memory;
mod modes;
mod modes_bound;
mod modes_speed;
mod plausible;
mod stretch;
mod stretch_sliced;
