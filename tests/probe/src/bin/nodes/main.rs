//! Runs a guard on frames of nodes as the script `script.bin` says, on the emulated board, and writes `answers.bin`.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use cortex_m_rt::entry;
use probe::nodes::{HEART, Memory, TREE_BYTES, run};

#[entry]
fn main() -> ! {
    static mut TREE: [u8; TREE_BYTES] = [0; TREE_BYTES];
    static mut MEMORY: Memory = Memory::new();
    board::answer(|board| run(TREE, &HEART, MEMORY, board))
}
