//! Runs a guard on frames of nodes as the script `script.bin` says, on the emulated board, and writes `answers.bin`.
#![no_std]
#![no_main]

#[path = "../board/clock.rs"]
mod clock;
#[path = "../board/exit.rs"]
mod exit;
#[path = "../board/files.rs"]
mod files;
#[path = "../board/machine.rs"]
mod machine;

use cortex_m_rt::entry;
use probe::nodes::{HEART, Memory, TREE_BYTES, run};

#[entry]
fn main() -> ! {
    static mut TREE: [u8; TREE_BYTES] = [0; TREE_BYTES];
    static mut MEMORY: Memory = Memory::new();
    machine::answer(|board| run(TREE, &HEART, MEMORY, board))
}
