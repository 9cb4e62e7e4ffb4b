//! Memory-mapped registers.

use core::ptr::{read_volatile, without_provenance_mut, write_volatile};

/// One 32-bit register of a peripheral of the board.
#[derive(Clone, Copy)]
pub struct Register(usize);

impl Register {
    /// # Safety
    /// `address` must be that of a 32-bit register that tolerates any read and write.
    pub const unsafe fn at(address: usize) -> Self {
        Self(address)
    }

    pub fn read(self) -> u32 {
        // SAFETY: the caller of `at` promised it.
        unsafe { read_volatile(without_provenance_mut(self.0)) }
    }

    pub fn write(self, value: u32) {
        // SAFETY: the caller of `at` promised it.
        unsafe { write_volatile(without_provenance_mut(self.0), value) }
    }
}
