//! Answers the file `script.bin` on the emulated board, into the file `answers.bin`, both in the folder
//! that the emulator was started in. With `-icount shift=6` the clock counts 1.6 to an instruction.
#![no_std]
#![no_main]

mod clock;
mod exit;
mod files;

use core::cell::RefCell;

use cortex_m::interrupt::{self, Mutex};
use cortex_m_rt::entry;
use exit::exit;
use probe::{Fault, Machine, Memory, run};

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
