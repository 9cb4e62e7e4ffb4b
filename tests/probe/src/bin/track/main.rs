//! Follows the ticks of the script `script.bin` on the emulated board, and writes `answers.bin`. With `-icount shift=6`
//! an instruction takes 64 ns, or 1.6 counts of the 25 MHz clock.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use probe::rows::Vertices;
use probe::track::tick;

probe::follow!(Vertices, tick::INTERPOLATED);
