//! As `track`, with ticks of any kind, on a surface that nodes carry.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use dibs_nostd::nodes::Nodes;
use probe::track::tick;

probe::follow!(Nodes, !tick::APART);
