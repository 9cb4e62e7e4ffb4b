//! The interrupt vectors of the board that are in use.

use crate::schedule::bus_interrupt;

/// Number of UART 0's receive interrupt.
#[derive(Clone, Copy)]
pub struct BusInterrupt;

// SAFETY: the number is that of a vector below, and constant.
unsafe impl cortex_m::interrupt::InterruptNumber for BusInterrupt {
    fn number(self) -> u16 {
        0
    }
}

/// Placed after the exceptions in the vector table; only interrupts listed here are ever enabled.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
pub static __INTERRUPTS: [unsafe extern "C" fn(); 1] = [bus_interrupt];
