//! As `track`, with each tick in a function of its own.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use probe::rows::Vertices;
use probe::track::tick;

probe::follow!(Vertices, tick::INTERPOLATED | tick::SIGNED | tick::APART);
