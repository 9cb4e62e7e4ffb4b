//! Answers a script on this computer: `answer SCRIPT ANSWERS`.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::process::ExitCode;

use probe::{Fault, Machine, Memory, run};

struct Files {
    script: BufReader<File>,
    answers: BufWriter<File>,
}

impl Machine for Files {
    fn read(&mut self, buffer: &mut [u8]) -> Result<(), Fault> {
        self.script.read_exact(buffer).map_err(|_| Fault)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Fault> {
        self.answers.write_all(bytes).map_err(|_| Fault)
    }

    fn clock(&self) -> u32 {
        0
    }
}

fn main() -> ExitCode {
    let mut names = std::env::args_os().skip(1);
    let (Some(script), Some(answers), None) = (names.next(), names.next(), names.next()) else {
        eprintln!("usage: answer SCRIPT ANSWERS");
        return ExitCode::FAILURE;
    };
    let files = File::open(&script).and_then(|script| Ok((script, File::create(&answers)?)));
    let (script, answers) = match files {
        Ok((script, answers)) => (BufReader::new(script), BufWriter::new(answers)),
        Err(error) => {
            eprintln!("error: {}: {error}", script.display());
            return ExitCode::FAILURE;
        }
    };
    let mut files = Files { script, answers };
    let mut memory: Box<Memory> = Box::default();
    if run(&mut memory, &mut files).is_err() || files.answers.flush().is_err() {
        eprintln!("error: the script cannot be followed");
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
