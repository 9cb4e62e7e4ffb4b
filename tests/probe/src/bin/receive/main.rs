//! Counts the instructions of receiving and checking a frame on the board, with and without tags, packet by packet.
//!
//! Reads from `script.bin`, in little-endian words: the length of a tree of [`VERTICES`] vertices and its bytes, padded
//! to a word; then frames, each as [`UNTAGGED`] or [`TAGGED`], the number of its packets, the number of packets between
//! two advances of the check, and each packet's length and bytes, padded; then 0. Writes
//! [`ANSWER_WORDS`](probe::receive::ANSWER_WORDS) words a frame to `answers.bin`. With `-icount shift=6` an instruction
//! takes 64 ns, or 1.6 counts of the 25 MHz clock.
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
use dibs_nostd::wire::{AesCmac, Mac, NoMac};
use dibs_nostd::{Advance, Assembler, Frames, Millis, StretchMonitor, Tree};
use exit::exit;
use probe::receive::{ANSWER_WORDS, KEY, TAGGED, TREE_BYTES, UNTAGGED, VERTICES};

/// Largest packet.
const MTU: usize = 1024;
/// The work of one advance of the check.
const SLICE: u32 = 512;

static FRAMES: [Frames<VERTICES>; 2] = [const { Frames::new() }; 2];
static BYTES: Mutex<RefCell<[u8; TREE_BYTES]>> = Mutex::new(RefCell::new([0; TREE_BYTES]));

type Receiver<'t, M> = Assembler<'static, StretchMonitor<'t, u16>, M>;

#[entry]
fn main() -> ! {
    clock::start();
    exit(run().is_some());
}

fn run() -> Option<()> {
    let mut script = files::Input::open()?;
    let mut answers = files::Output::create()?;
    let length = word(&mut script)? as usize;
    interrupt::free(|section| {
        let mut bytes = BYTES.borrow(section).try_borrow_mut().ok()?;
        script.read(bytes.get_mut(..length.next_multiple_of(4))?)?;
        let tree = Tree::<u16>::from_bytes(bytes.get(..length)?).ok()?;
        let [untagged, tagged] = &FRAMES;
        let monitor = StretchMonitor::new(&tree)
            .ok()?
            .limits(dibs_nostd::SurfaceLimits::reach_mm(1e3).speed(1e3));
        let mut plain =
            Assembler::new(untagged.split().ok()?.0, monitor.clone(), tree.mesh_id(), 1e3);
        let mac = AesCmac::new(&KEY, 0, 0);
        let mut guarded =
            Assembler::with_mac(tagged.split().ok()?.0, monitor, tree.mesh_id(), 1e3, mac);
        loop {
            let counts = match word(&mut script)? {
                UNTAGGED => frame::<NoMac>(&mut plain, &mut script)?,
                TAGGED => frame::<AesCmac>(&mut guarded, &mut script)?,
                _ => return answers.flush(),
            };
            for count in counts {
                answers.write(&count.to_le_bytes())?;
            }
        }
    })
}

/// The time of some calls, in counts of the clock: their sum and the longest.
#[derive(Default)]
struct Stopwatch {
    sum: u32,
    longest: u32,
}

impl Stopwatch {
    fn time<T>(&mut self, call: impl FnOnce() -> T) -> T {
        let start = clock::now();
        let result = call();
        let took = clock::now().wrapping_sub(start);
        self.sum = self.sum.wrapping_add(took);
        self.longest = if took > self.longest { took } else { self.longest };
        result
    }
}

/// Receives a frame, and returns its answer; `None` unless it is published.
fn frame<M: Mac>(
    assembler: &mut Receiver<'_, M>,
    script: &mut files::Input,
) -> Option<[u32; ANSWER_WORDS]> {
    let (packets, every) = (word(script)?, word(script)?);
    let (mut accept, mut check) = (Stopwatch::default(), Stopwatch::default());
    let mut buffer = [0; MTU];
    for number in 1..=packets {
        let length = word(script)? as usize;
        script.read(buffer.get_mut(..length.next_multiple_of(4))?)?;
        let packet = buffer.get(..length)?;
        accept.time(|| assembler.accept(packet, Millis(0))).ok()?;
        if number < packets && number.checked_rem(every)? == 0 {
            check.time(|| assembler.advance(SLICE)).ok()?;
        }
    }
    // This many slices are enough for any frame.
    for _ in 0..1_000 {
        match check.time(|| assembler.advance(SLICE)).ok()? {
            Advance::Pending => (),
            Advance::Published { .. } => {
                return Some([packets, accept.sum, accept.longest, check.sum, check.longest]);
            }
            _ => return None,
        }
    }
    None
}

fn word(script: &mut files::Input) -> Option<u32> {
    let mut bytes = [0; 4];
    script.read(&mut bytes)?;
    Some(u32::from_le_bytes(bytes))
}
