//! TIMER 0 of the board: 25 MHz, 32 bits.

use core::ptr::{read_volatile, with_exposed_provenance_mut, write_volatile};

const BASE: usize = 0x4000_0000;
const CONTROL: usize = BASE;
const VALUE: usize = BASE + 4;
const RELOAD: usize = BASE + 8;

/// Starts the timer.
pub fn start() {
    for (register, value) in [(RELOAD, u32::MAX), (VALUE, u32::MAX), (CONTROL, 1)] {
        // SAFETY: registers of TIMER 0, which tolerate any write.
        unsafe { write_volatile(with_exposed_provenance_mut::<u32>(register), value) }
    }
}

/// The timer's counts since `start`.
pub fn now() -> u32 {
    // SAFETY: a register of TIMER 0, which tolerates any read.
    !unsafe { read_volatile(with_exposed_provenance_mut::<u32>(VALUE)) }
}
