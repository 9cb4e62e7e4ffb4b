//! Answers the script `script.bin` on the emulated board, and writes `answers.bin`; both are in the emulator's working
//! folder. With `-icount shift=6` an instruction takes 64 ns, or 1.6 counts of the 25 MHz clock.
#![no_std]
#![no_main]

#[path = "mod.rs"]
mod board;

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex};
use cortex_m_rt::entry;
use probe::{Fault, Memory, run};

// SAFETY: m55.x places this section in memory that nothing else uses.
#[cfg_attr(m55, unsafe(link_section = ".sram"))]
static MEMORY: Mutex<RefCell<Memory>> = Mutex::new(RefCell::new(Memory::new()));

#[entry]
fn main() -> ! {
    board::answer(|board| {
        interrupt::free(|section| {
            let mut memory = MEMORY.borrow(section).try_borrow_mut().map_err(|_| Fault)?;
            run(&mut memory, board)
        })
    })
}
