//! Follows the ticks in the file `script.bin` on the emulated board, and writes into the file `answers.bin`. With
//! `-icount shift=6` the clock counts 1.6 to an instruction.
#![no_std]
#![no_main]

#[path = "../board/clock.rs"]
mod clock;
#[path = "../board/exit.rs"]
mod exit;
#[path = "../board/files.rs"]
mod files;

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex};
use cortex_m_rt::entry;
use exit::exit;
use probe::track::{Memory, run};
use probe::{Fault, Machine};

static MEMORY: Mutex<RefCell<Memory>> = Mutex::new(RefCell::new(Memory::new()));

struct Board {
    script: files::Input,
    answers: files::Output,
}

impl Machine for Board {
    fn read(&mut self, buffer: &mut [u8]) -> Result<(), Fault> {
        self.script.read(buffer).ok_or(Fault)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        self.answers.write(bytes).ok_or(Fault)
    }

    fn clock(&self) -> u32 {
        clock::now()
    }
}

#[entry]
fn main() -> ! {
    clock::start();
    let done = interrupt::free(|section| {
        let mut memory = MEMORY.borrow(section).try_borrow_mut().ok()?;
        let (script, answers) = (files::Input::open()?, files::Output::create()?);
        let mut board = Board { script, answers };
        run(&mut memory, &mut board).ok()?;
        board.answers.flush()
    });
    exit(done.is_some())
}
