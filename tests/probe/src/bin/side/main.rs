//! As `track`, with the side of each tick.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use probe::rows::Vertices;
use probe::track::tick;

probe::follow!(Vertices, tick::INTERPOLATED | tick::SIDE);
