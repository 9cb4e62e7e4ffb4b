//! The emulated board (MPS2-AN500), as far as the examples use it: UART 0, `SysTick`, and the end of a run.

use core::ptr::{read_volatile, without_provenance_mut, write_volatile};

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_semihosting::debug;
use dibs_nostd::Millis;

const DATA: usize = 0x4000_4000;
const STATE: usize = DATA + 4;
const CONTROL: usize = DATA + 8;
const ACKNOWLEDGE: usize = DATA + 12;
const DIVISOR: usize = DATA + 16;

const RECEIVE_FULL: u32 = 1 << 1;
const RECEIVE_INTERRUPT: u32 = 1 << 1;
const RECEIVE_ENABLE: u32 = 1 << 1 | 1 << 3;

/// Bits of an interrupt's priority.
#[allow(dead_code, reason = "only RTIC asks")]
pub const NVIC_PRIO_BITS: u8 = 3;

/// Time without a surface after which an example ends with an error.
pub const PATIENCE: Millis = Millis(20_000);

/// Counts of `SysTick` in a tick of 1 ms.
const TICK: u32 = 25_000;

/// Interrupts in use; the second stands for any unused one of the part.
#[allow(dead_code, reason = "RTIC needs no spare one")]
#[derive(Clone, Copy)]
pub enum Interrupt {
    /// A byte has arrived at UART 0.
    UART0,
    /// Spare.
    Spare,
}

/// Its name in a peripheral access crate.
#[allow(unused_imports, reason = "only RTIC asks")]
pub use Interrupt as interrupt;

// SAFETY: the numbers are those of the vectors in `main.rs`, and constant.
unsafe impl InterruptNumber for Interrupt {
    fn number(self) -> u16 {
        self as u16
    }
}

/// Enables reception: an arriving byte requests an interrupt.
pub fn start_bus() {
    write(DIVISOR, 16);
    write(CONTROL, RECEIVE_ENABLE);
}

/// Requests `SysTick` every millisecond.
pub fn start_ticks(timer: &mut SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(TICK - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Ends the emulation.
pub fn end(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    end(false)
}

/// Acknowledges the interrupt. Call it before `byte`: otherwise interrupts are lost.
pub fn acknowledge() {
    write(ACKNOWLEDGE, RECEIVE_INTERRUPT);
}

/// The received byte, if any.
pub fn byte() -> Option<u8> {
    (read(STATE) & RECEIVE_FULL != 0).then(|| read(DATA).to_le_bytes()[0])
}

fn read(register: usize) -> u32 {
    // SAFETY: called with the UART's registers only, which tolerate any read.
    unsafe { read_volatile(without_provenance_mut(register)) }
}

fn write(register: usize, value: u32) {
    // SAFETY: called with the UART's registers only, which tolerate any write.
    unsafe { write_volatile(without_provenance_mut(register), value) }
}
