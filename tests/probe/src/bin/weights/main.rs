//! Follows the ticks of the script `script.bin` on a surface that weights move, on the emulated board, and writes
//! `answers.bin`. The script's first word is the number of its modes.
#![no_std]
#![no_main]

#[path = "../board/mod.rs"]
mod board;

use cortex_m_rt::entry;
use probe::weights::{Memory, TREE_BYTES, run};
use probe::{Fault, Machine};

#[entry]
fn main() -> ! {
    static mut TREE: [u8; TREE_BYTES] = [0; TREE_BYTES];
    static mut EIGHT: Memory<8> = Memory::new();
    static mut TWENTY_FOUR: Memory<24> = Memory::new();
    board::answer(|board| {
        let mut modes = [0; 4];
        board.read(&mut modes)?;
        match u32::from_le_bytes(modes) {
            8 => run(TREE, EIGHT, board),
            24 => run(TREE, TWENTY_FOUR, board),
            _ => Err(Fault),
        }
    })
}
