//! Moving surfaces: frames, stretch, modes, and refused frames.

mod as_configured;
mod embedded;
mod embedded_climbed;
mod embedded_contacts;
mod embedded_damaged;
mod embedded_limits;
mod embedded_marks;
mod embedded_outside;
mod embedded_radii;
mod facts;
mod frames;
mod inside_out;
mod memory;
mod modes;
mod modes_bound;
mod modes_speed;
mod plausible;
mod stretch;
mod stretch_sliced;
mod tables;
