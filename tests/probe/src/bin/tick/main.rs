//! Measures the firmware's control tick on adversarial frames: its receiver and its tick run on the emulated board, fed
//! from a script instead of a line.
//!
//! Reads commands from `script.bin`, in little-endian words ([`probe::tick`]), and writes an answer for each tick to
//! `answers.bin`. With `-icount shift=6` an instruction takes 64 ns, or 1.6 counts of the 25 MHz clock.
#![no_std]
#![no_main]

#[path = "../board/clock.rs"]
mod clock;
#[path = "../board/exit.rs"]
mod exit;
#[path = "../board/files.rs"]
mod files;

use controller::surface::Surface;
use controller::{BusStatus, ContactList, Control, Script, Trust};
use cortex_m_rt::entry;
use dibs_nostd::Ticks;
use exit::exit;
use probe::tick::{ANSWER_WORDS, BYTES, END, REGISTER, SKIP, TICK};

static SURFACE: Surface = Surface::new();
static BUS: BusStatus = BusStatus::new();

#[entry]
fn main() -> ! {
    static mut CONTACTS: ContactList = ContactList::new();
    clock::start();
    exit(run(CONTACTS).is_some());
}

fn run(contacts: &'static mut ContactList) -> Option<()> {
    let (mut receiver, mut control) =
        controller::start(&SURFACE, &BUS, &Trust::SERIAL, Script, contacts).ok()?;
    let mut script = files::Input::open()?;
    let mut answers = files::Output::create()?;
    loop {
        match word(&mut script)? {
            SKIP => control.skip(Ticks(word(&mut script)?.into())),
            BYTES => {
                let count = word(&mut script)?;
                for _ in 0..count {
                    let mut byte = [0];
                    script.read(&mut byte)?;
                    receiver.bytes(&byte, control.now());
                }
                while receiver.work() {}
                let padding = count.wrapping_neg() as usize % 4;
                script.read([0; 3].get_mut(..padding)?)?;
            }
            REGISTER => receiver.register(),
            TICK => {
                for _ in 0..word(&mut script)? {
                    for word in tick(&mut control) {
                        answers.write(&word.to_le_bytes())?;
                    }
                }
            }
            END => return answers.flush(),
            _ => return None,
        }
    }
}

fn tick(control: &mut Control<Script>) -> [u32; ANSWER_WORDS] {
    let start = clock::now();
    let record = control.tick(clock::now);
    let took = clock::now().wrapping_sub(start);
    let epoch = if record.is_answered() { record.epoch } else { 0 };
    [took, record.node_tests, record.triangle_tests, epoch]
}

fn word(script: &mut files::Input) -> Option<u32> {
    let mut bytes = [0; 4];
    script.read(&mut bytes)?;
    Some(u32::from_le_bytes(bytes))
}
