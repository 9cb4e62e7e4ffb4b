//! Follows the ticks of the script `script.bin` on the emulated board, and writes `answers.bin`. With `-icount shift=6`
//! an instruction takes 64 ns, or 1.6 counts of the 25 MHz clock.
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

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex};
use cortex_m_rt::entry;
use probe::Fault;
use probe::track::{Memory, run};

static MEMORY: Mutex<RefCell<Memory>> = Mutex::new(RefCell::new(Memory::new()));

#[entry]
fn main() -> ! {
    machine::answer(|board| {
        interrupt::free(|section| {
            let mut memory = MEMORY.borrow(section).try_borrow_mut().map_err(|_| Fault)?;
            run(&mut memory, board)
        })
    })
}
