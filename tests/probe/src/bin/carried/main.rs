//! Follows the ticks of the script `script.bin` on the emulated board, of any kind, on a surface that nodes carry, and
//! writes `answers.bin`. With `-icount shift=6` an instruction takes 64 ns, or 1.6 counts of the 25 MHz clock.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use cortex_m_rt::entry;
use dibs_nostd::nodes::Nodes;
use probe::track::{Memory, Trackers, run, tick};

#[entry]
fn main() -> ! {
    static mut MEMORY: Memory = Memory::new();
    static mut TRACKERS: Trackers = Trackers::new();
    board::answer(|board| run::<Nodes, { !tick::APART }>(MEMORY, TRACKERS, board))
}
