//! Filters the commands of the script `script.bin` on the emulated board, and writes `answers.bin`. With `-icount shift=6`
//! an instruction takes 64 ns, or 1.6 counts of the 25 MHz clock.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use cortex_m_rt::entry;
use probe::filter::{OPENED, Trackers, run};
use probe::track::Memory;

#[entry]
fn main() -> ! {
    static mut MEMORY: Memory = Memory::new();
    static mut SMALL: Trackers<{ OPENED[0] }> = Trackers::new();
    static mut LARGE: Trackers<{ OPENED[1] }> = Trackers::new();
    board::answer(|board| run(MEMORY, SMALL, LARGE, board))
}
