//! The board's Ethernet controller, an SMSC LAN9118: frames pass through its two FIFOs, which are polled.
//!
//! Its receive FIFO holds seven of the largest frames, so nothing is lost while the idle loop is busy, and no interrupt
//! is needed.

use controller::network::MAX_FRAME;

use crate::registers::Register;

const RECEIVE_DATA: Register = at(0x00);
const TRANSMIT_DATA: Register = at(0x20);
const RECEIVE_STATUS: Register = at(0x40);
const BYTE_ORDER: Register = at(0x64);
const TRANSMIT_CONFIG: Register = at(0x70);
const HARDWARE_CONFIG: Register = at(0x74);
const RECEIVE_LEVEL: Register = at(0x7C);
const TRANSMIT_LEVEL: Register = at(0x80);
const MAC_COMMAND: Register = at(0xA4);
const MAC_DATA: Register = at(0xA8);

/// The value of `BYTE_ORDER` if bytes arrive as they were sent.
const LITTLE_ENDIAN: u32 = 0x8765_4321;

/// `HARDWARE_CONFIG`: the reset, which clears itself; store and forward; 5 KiB of the memory for sending.
const RESET: u32 = 1 << 0;
const STORE_AND_FORWARD: u32 = 1 << 20;
const TRANSMIT_FIFO: u32 = 5 << 16;

/// `TRANSMIT_CONFIG`: sending; statuses of sent frames may overrun, because they are not read.
const TRANSMIT_ON: u32 = 1 << 1;
const STATUS_OVERRUN: u32 = 1 << 2;

/// `MAC_COMMAND`, and the MAC's registers.
const MAC_BUSY: u32 = 1 << 31;
const MAC_CONTROL: u32 = 1;
const MAC_ADDRESS_HIGH: u32 = 2;
const MAC_ADDRESS_LOW: u32 = 3;
const MAC_TRANSMIT: u32 = 1 << 3;
const MAC_RECEIVE: u32 = 1 << 2;

/// `RECEIVE_STATUS`: the frame is damaged, or not for this address.
const DAMAGED: u32 = 1 << 15 | 1 << 30;

/// First words of a frame to send: it is the first and the last segment.
const WHOLE: u32 = 1 << 13 | 1 << 12;

/// Bytes of the Ethernet checksum.
const CHECKSUM: usize = 4;

/// Most reads of a register while waiting for the chip.
const PATIENCE: u32 = 100_000;

const fn at(offset: usize) -> Register {
    // SAFETY: called only with offsets of the LAN9118's registers, which are at this address on the board.
    unsafe { Register::at(0xA000_0000 + offset) }
}

/// The chip, started.
pub struct Lan9118(());

impl Lan9118 {
    /// Resets the chip and starts both directions; `None` if there is no chip.
    pub fn start([a, b, c, d, e, f]: [u8; 6]) -> Option<Self> {
        if BYTE_ORDER.read() != LITTLE_ENDIAN {
            return None;
        }
        HARDWARE_CONFIG.write(RESET);
        settle(|| HARDWARE_CONFIG.read() & RESET == 0)?;
        HARDWARE_CONFIG.write(STORE_AND_FORWARD | TRANSMIT_FIFO);
        write_mac(MAC_ADDRESS_LOW, u32::from_le_bytes([a, b, c, d]))?;
        write_mac(MAC_ADDRESS_HIGH, u32::from_le_bytes([e, f, 0, 0]))?;
        write_mac(MAC_CONTROL, MAC_TRANSMIT | MAC_RECEIVE)?;
        TRANSMIT_CONFIG.write(TRANSMIT_ON | STATUS_OVERRUN);
        Some(Self(()))
    }

    /// The next frame without its checksum; empty if it was damaged; `None` if there is none.
    pub fn receive<'b>(&mut self, buffer: &'b mut [u8; MAX_FRAME]) -> Option<&'b [u8]> {
        if RECEIVE_LEVEL.read() >> 16 & 0xFF == 0 {
            return None;
        }
        let status = RECEIVE_STATUS.read();
        let length = (status >> 16 & 0x3FFF) as usize;
        let mut places = buffer.as_chunks_mut().0.iter_mut();
        for _ in 0..length.div_ceil(4) {
            let word = RECEIVE_DATA.read().to_le_bytes();
            if let Some(place) = places.next() {
                *place = word;
            }
        }
        let frame = buffer.get(..length.saturating_sub(CHECKSUM));
        frame.filter(|_| status & DAMAGED == 0).or(Some(&[]))
    }

    /// Sends a frame, or drops it if the FIFO has no room.
    pub fn send(&mut self, frame: &[u8]) {
        let length = frame.len() as u32;
        if TRANSMIT_LEVEL.read() & 0xFFFF < length.next_multiple_of(4) + 8 {
            return;
        }
        TRANSMIT_DATA.write(WHOLE | length);
        TRANSMIT_DATA.write(length);
        let (words, rest) = frame.as_chunks();
        for word in words {
            TRANSMIT_DATA.write(u32::from_le_bytes(*word));
        }
        if !rest.is_empty() {
            let last = rest.iter().rev().fold(0, |word, &byte| word << 8 | u32::from(byte));
            TRANSMIT_DATA.write(last);
        }
    }
}

fn write_mac(register: u32, value: u32) -> Option<()> {
    MAC_DATA.write(value);
    MAC_COMMAND.write(MAC_BUSY | register);
    settle(|| MAC_COMMAND.read() & MAC_BUSY == 0)
}

fn settle(is_done: impl Fn() -> bool) -> Option<()> {
    (0..PATIENCE).any(|_| is_done()).then_some(())
}
