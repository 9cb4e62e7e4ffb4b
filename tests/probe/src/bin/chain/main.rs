//! As `track`, with ticks of any kind.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use probe::rows::Vertices;

probe::follow!(Vertices, u32::MAX);
