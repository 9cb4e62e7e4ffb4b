//! A receiver of the bus on the emulated board, for the fault matrix: bytes come over UART 0, and reports go back.
//!
//! Reads from `script.bin` four words and a tree of [`VERTICES`] vertices. The words are: 1 for packets with tags, else
//! 0; the challenge; the bits of the largest coordinate; the tree's length. Whenever no byte waits and no work is due,
//! it reports, as one COBS frame: the bytes received, the frames published, the epoch of the last, the CRC-32 of its
//! positions in memory and its pose (a word each), and a status packet with every counter.
//!
//! This program polls UART 0; the firmware, which the demo runs, receives by interrupt.
#![no_std]
#![no_main]

#[path = "../board/exit.rs"]
mod exit;
// This program writes no file.
#[allow(dead_code)]
#[path = "../board/files.rs"]
mod files;

use core::ptr::{read_volatile, with_exposed_provenance_mut, write_volatile};

use cortex_m_rt::entry;
use dibs_nostd::format::CRC;
use dibs_nostd::guard::{Poses, SharedState};
use dibs_nostd::wire::{AesCmac, Deframer, Mac, NoMac, encode_status, enframe, framed_bytes};
use dibs_nostd::{Advance, Assembler, FrameReader, FrameWriter, Frames, Millis, Tree};
use exit::exit;
use probe::bus::{
    HEAD_BYTES, KEY, MTU, PoseCheck, RECEIVER, REPORT_MTU, VERTICES, WORK, admission_check,
    published_words,
};

static FRAMES: Frames<VERTICES, 3> = Frames::new();
static POSES: Poses = Poses::NEW;

#[entry]
fn main() -> ! {
    static mut BYTES: [u8; 32 * 1024] = [0; 32 * 1024];
    exit(run(BYTES).is_some());
}

fn run(bytes: &mut [u8]) -> Option<()> {
    let mut script = files::Input::open()?;
    let mut words = [[0; 4]; 4];
    script.read(words.as_flattened_mut())?;
    let [is_tagged, challenge, limit, length] = words.map(u32::from_le_bytes);
    let bytes = bytes.get_mut(..length as usize)?;
    script.read(bytes)?;
    let tree = Tree::<u16>::from_bytes(bytes).ok()?;
    let (writer, reader) = FRAMES.split().ok()?;
    let limit = f32::from_bits(limit);
    uart::start();
    if is_tagged == 0 {
        Receiver::new(&tree, writer, reader, limit, NoMac)?.receive()
    } else {
        let mac = AesCmac::new(&KEY, RECEIVER, u64::from(challenge));
        Receiver::new(&tree, writer, reader, limit, mac)?.receive()
    }
}

/// The bus on the board.
struct Receiver<'t, M> {
    mesh_id: u32,
    deframer: Deframer<MTU>,
    assembler: Assembler<'static, PoseCheck<'static, 't>, M>,
    reader: FrameReader<'static>,
    received: u32,
    published: u32,
    epoch: u32,
    digest: u32,
}

impl<'t, M: Mac> Receiver<'t, M> {
    fn new(
        tree: &'t Tree<'t, u16>,
        writer: FrameWriter<'static>,
        reader: FrameReader<'static>,
        limit: f32,
        mac: M,
    ) -> Option<Self> {
        let mesh_id = tree.mesh_id();
        let assembler =
            Assembler::with_mac(writer, admission_check(tree, &POSES)?, mesh_id, limit, mac);
        let deframer = Deframer::new();
        let [received, published, epoch, digest] = [0; 4];
        Some(Self { mesh_id, deframer, assembler, reader, received, published, epoch, digest })
    }

    /// Receives until the emulator is stopped.
    fn receive(&mut self) -> ! {
        let (mut has_work, mut reported) = (false, None);
        loop {
            if let Some(byte) = uart::read() {
                self.received = self.received.wrapping_add(1);
                let now = self.now();
                match self.deframer.push(byte) {
                    None => continue,
                    Some(Ok(packet)) => drop(self.assembler.accept(packet, Millis(now))),
                    Some(Err(error)) => self.assembler.count_framing(&error),
                }
                has_work = true;
            } else if has_work {
                has_work = self.work();
            } else if reported != Some(self.received) {
                self.report();
                reported = Some(self.received);
            }
        }
    }

    /// A clock that counts the line's bytes, 16 to a millisecond.
    const fn now(&self) -> u32 {
        self.received / 16
    }

    /// Does a slice of checking. Returns whether more work is due.
    fn work(&mut self) -> bool {
        match self.assembler.advance(WORK) {
            Ok(Advance::Pending) => return true,
            Ok(Advance::Published { .. }) => {
                self.published = self.published.wrapping_add(1);
                // Reads the frame as a control tick would.
                if let Some(frame) = self.reader.read() {
                    let mut digest = CRC.digest();
                    for word in published_words(&frame, &POSES) {
                        digest.update(&word.to_le_bytes());
                    }
                    (self.epoch, self.digest) = (frame.label().epoch, digest.finalize());
                }
            }
            _ => (),
        }
        false
    }

    fn report(&mut self) {
        let mut record = [0; HEAD_BYTES + REPORT_MTU];
        let (head, rest) = record.split_at_mut(HEAD_BYTES);
        let words = [self.received, self.published, self.epoch, self.digest];
        for (place, word) in head.as_chunks_mut().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        let status = self.assembler.status(Millis(self.now()), 0);
        let mut packet = [0; REPORT_MTU];
        let counters = self.assembler.counters();
        let packet =
            encode_status(self.mesh_id, &status, counters, self.assembler.mac(), &mut packet);
        for (place, byte) in rest.iter_mut().zip(packet) {
            *place = *byte;
        }
        let mut line = [0; framed_bytes(HEAD_BYTES + REPORT_MTU)];
        let record = record.get(..HEAD_BYTES + packet.len()).unwrap_or_default();
        for &byte in enframe(record, &mut line).unwrap_or_default() {
            uart::write(byte);
        }
    }
}

/// UART 0 of the board: a CMSDK UART, one byte deep in each direction, polled.
mod uart {
    use super::{read_volatile, with_exposed_provenance_mut, write_volatile};

    const DATA: usize = 0x4000_4000;
    const STATE: usize = DATA + 4;
    const CONTROL: usize = DATA + 8;
    const DIVISOR: usize = DATA + 16;
    const TRANSMIT_FULL: u32 = 1;
    const RECEIVE_FULL: u32 = 2;

    fn get(register: usize) -> u32 {
        // SAFETY: only called with registers of UART 0, which tolerate any read.
        unsafe { read_volatile(with_exposed_provenance_mut::<u32>(register)) }
    }

    fn set(register: usize, value: u32) {
        // SAFETY: only called with registers of UART 0, which tolerate any write.
        unsafe { write_volatile(with_exposed_provenance_mut::<u32>(register), value) }
    }

    /// Enables both directions.
    pub fn start() {
        set(DIVISOR, 16);
        set(CONTROL, 0b11);
    }

    /// The byte that has arrived, if any.
    pub fn read() -> Option<u8> {
        (get(STATE) & RECEIVE_FULL != 0).then(|| get(DATA) as u8)
    }

    /// Sends one byte, after the previous one has left.
    pub fn write(byte: u8) {
        while get(STATE) & TRANSMIT_FULL != 0 {}
        set(DATA, byte.into());
    }
}
