//! The board's free-running time: TIMER 0, 25 MHz, 32 bits.

use crate::registers::Register;

/// Counts a second, of this timer and of `SysTick`.
pub const HERTZ: u32 = 25_000_000;
/// Counts between two control ticks: 1 ms.
pub const TICK: u32 = HERTZ / 1_000;

const BASE: usize = 0x4000_0000;
// SAFETY: TIMER 0 of the CMSDK peripherals: CTRL, VALUE and RELOAD.
const CONTROL: Register = unsafe { Register::at(BASE) };
// SAFETY: as above.
const VALUE: Register = unsafe { Register::at(BASE + 4) };
// SAFETY: as above.
const RELOAD: Register = unsafe { Register::at(BASE + 8) };

/// Starts the timer; until then `now` is constant.
pub fn start() {
    RELOAD.write(u32::MAX);
    VALUE.write(u32::MAX);
    CONTROL.write(1);
}

/// Counts since `start`, wrapping after 171 s. Under QEMU with `-icount shift=1` the processor executes 20 instructions
/// a count: all figures in instructions are measured by this clock.
pub fn now() -> u32 {
    !VALUE.read()
}
