//! `SysTick` of a Cortex-M55: 24 bits, which are the upper ones of the clock, so that its differences wrap as 32 bits do.

use cortex_m::peripheral::SYST;

/// `SysTick` counts the processor's clock: 32 MHz on the emulated board.
const PROCESSOR_CLOCK: u32 = 1 << 2;
const ENABLE: u32 = 1 << 0;
const MASK: u32 = 0x00FF_FFFF;

/// Starts the timer.
pub fn start() {
    // SAFETY: nothing else uses SysTick, and its interrupt stays disabled.
    let timer = unsafe { &*SYST::PTR };
    // SAFETY: registers of a timer, which tolerate any write.
    unsafe {
        timer.rvr.write(MASK);
        timer.cvr.write(0);
        timer.csr.write(PROCESSOR_CLOCK | ENABLE);
    }
}

/// 256 times the timer's counts since `start`.
pub fn now() -> u32 {
    (MASK - SYST::get_current()) << 8
}
