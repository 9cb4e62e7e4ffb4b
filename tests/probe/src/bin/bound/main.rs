//! As `track`, with each tick in a function of its own. With `-icount shift=6` an instruction takes 64 ns, or 1.6 counts of
//! the 25 MHz clock.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use cortex_m_rt::entry;
use probe::rows::Vertices;
use probe::track::{Memory, Trackers, run, tick};

#[entry]
fn main() -> ! {
    static mut MEMORY: Memory = Memory::new();
    static mut TRACKERS: Trackers = Trackers::new();
    board::answer(|board| {
        run::<Vertices, { tick::INTERPOLATED | tick::SIGNED | tick::APART }>(
            MEMORY, TRACKERS, board,
        )
    })
}
