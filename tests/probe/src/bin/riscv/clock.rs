//! The counter of retired instructions.

use core::arch::asm;

/// The counter always runs.
pub fn start() {}

/// The counter's lower half.
pub fn now() -> u32 {
    let count: u32;
    // SAFETY: reads a counter.
    unsafe { asm!("rdinstret {0}", out(reg) count, options(nomem, nostack)) };
    count
}
