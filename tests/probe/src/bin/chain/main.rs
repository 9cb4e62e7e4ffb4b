//! As `track`, with ticks of any kind.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use probe::rows::Vertices;
use probe::track::tick;

probe::follow!(Vertices, !tick::APART);
