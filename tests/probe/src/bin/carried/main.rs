//! As `track`, with ticks of any kind, on a surface that nodes carry.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use dibs_nostd::nodes::Nodes;

probe::follow!(Nodes, u32::MAX);
