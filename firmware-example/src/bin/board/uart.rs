//! The CMSDK UART: one byte deep in each direction.

use crate::registers::Register;

const TRANSMIT_FULL: u32 = 1 << 0;
const RECEIVE_FULL: u32 = 1 << 1;
const RECEIVE_OVERRUN: u32 = 1 << 3;
const TRANSMIT_ENABLE: u32 = 1 << 0;
const RECEIVE_ENABLE: u32 = 1 << 1;
const RECEIVE_INTERRUPT_ENABLE: u32 = 1 << 3;
const RECEIVE_INTERRUPT: u32 = 1 << 1;
/// 25 MHz / 16, the highest rate. An emulated UART ignores it.
const DIVISOR: u32 = 16;

pub struct Uart {
    data: Register,
    state: Register,
    control: Register,
    interrupt: Register,
    divisor: Register,
}

/// UART 0: vertices arrive here, interrupt 0; statuses leave, polled.
pub const BUS: Uart = Uart::at(0x4000_4000);
/// UART 1: telemetry leaves here, polled.
pub const TELEMETRY: Uart = Uart::at(0x4000_5000);

impl Uart {
    const fn at(base: usize) -> Self {
        // SAFETY: called with the addresses of the board's CMSDK UARTs only.
        unsafe {
            Self {
                data: Register::at(base),
                state: Register::at(base + 4),
                control: Register::at(base + 8),
                interrupt: Register::at(base + 12),
                divisor: Register::at(base + 16),
            }
        }
    }

    /// Enables both directions: an arriving byte requests an interrupt, sending is polled.
    pub fn start_receiving(&self) {
        self.divisor.write(DIVISOR);
        self.control.write(TRANSMIT_ENABLE | RECEIVE_ENABLE | RECEIVE_INTERRUPT_ENABLE);
    }

    pub fn start_sending(&self) {
        self.divisor.write(DIVISOR);
        self.control.write(TRANSMIT_ENABLE);
    }

    /// Acknowledges the receive interrupt. Call it before `read`: otherwise interrupts are lost.
    pub fn acknowledge(&self) {
        self.interrupt.write(RECEIVE_INTERRUPT);
    }

    /// The received byte, if any.
    pub fn read(&self) -> Option<u8> {
        if self.state.read() & RECEIVE_FULL == 0 {
            return None;
        }
        let [byte, ..] = self.data.read().to_le_bytes();
        Some(byte)
    }

    /// Whether a byte was ever lost because the previous one was not read in time.
    pub fn has_overrun(&self) -> bool {
        self.state.read() & RECEIVE_OVERRUN != 0
    }

    /// Sends one byte, and waits until it is sent: an emulator that ends would lose a waiting byte.
    pub fn write(&self, byte: u8) {
        self.data.write(u32::from(byte));
        while self.state.read() & TRANSMIT_FULL != 0 {}
    }
}
