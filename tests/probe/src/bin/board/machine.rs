//! The board as a script's [`Machine`]: the script, the file of answers, and a clock.

use probe::{Fault, Machine};

use super::exit::exit;
use super::{clock, files};

pub struct Board {
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

/// Answers the whole script and ends the program.
pub fn answer(run: impl FnOnce(&mut Board) -> Result<(), Fault>) -> ! {
    clock::start();
    let done = files::Input::open().zip(files::Output::create()).and_then(|(script, answers)| {
        let mut board = Board { script, answers };
        run(&mut board).ok()?;
        board.answers.flush()
    });
    exit(done.is_some())
}
