//! Files of the computer that runs the emulator, by semihosting.

#[cfg(target_arch = "riscv32")]
use crate::semihosting::{nr, syscall};
#[cfg(target_arch = "arm")]
use cortex_m_semihosting::{nr, syscall};

const BUFFER: usize = 2 * 1024;
/// Modes of `fopen`: "rb" and "wb".
const READ: usize = 1;
const WRITE: usize = 5;

/// The script: a file to read.
pub struct Input {
    handle: usize,
    buffer: [u8; BUFFER],
    next: usize,
    end: usize,
}

/// The answers: a file to write.
pub struct Output {
    handle: usize,
    buffer: [u8; BUFFER],
    used: usize,
}

fn open(name: &[u8], mode: usize) -> Option<usize> {
    // The name's length does not count the zero that ends it.
    let arguments = [name.as_ptr().expose_provenance(), mode, name.len().checked_sub(1)?];
    // SAFETY: SYS_OPEN takes a string ended by a zero, a mode, and the string's length.
    let handle = unsafe { syscall(nr::OPEN, &arguments) };
    (handle != usize::MAX).then_some(handle)
}

impl Input {
    /// Opens the script.
    pub fn open() -> Option<Self> {
        Some(Self { handle: open(b"script.bin\0", READ)?, buffer: [0; BUFFER], next: 0, end: 0 })
    }

    /// Fills all of `bytes`; `None` if the file ends too early.
    pub fn read(&mut self, bytes: &mut [u8]) -> Option<()> {
        for byte in bytes {
            if self.next == self.end {
                self.refill()?;
            }
            *byte = *self.buffer.get(self.next)?;
            self.next += 1;
        }
        Some(())
    }

    fn refill(&mut self) -> Option<()> {
        let arguments = [self.handle, self.buffer.as_mut_ptr().expose_provenance(), BUFFER];
        // SAFETY: SYS_READ takes a handle, and the address and size of a buffer.
        let missing = unsafe { syscall(nr::READ, &arguments) };
        self.next = 0;
        self.end = BUFFER.checked_sub(missing)?;
        (self.end > 0).then_some(())
    }
}

impl Output {
    /// Creates the file of the answers.
    pub fn create() -> Option<Self> {
        Some(Self { handle: open(b"answers.bin\0", WRITE)?, buffer: [0; BUFFER], used: 0 })
    }

    /// Appends.
    pub fn write(&mut self, bytes: &[u8]) -> Option<()> {
        for &byte in bytes {
            if self.used == BUFFER {
                self.flush()?;
            }
            *self.buffer.get_mut(self.used)? = byte;
            self.used += 1;
        }
        Some(())
    }

    /// Writes the buffered bytes.
    pub fn flush(&mut self) -> Option<()> {
        let arguments = [self.handle, self.buffer.as_ptr().expose_provenance(), self.used];
        // SAFETY: SYS_WRITE takes a handle, and the address and size of a buffer.
        let missing = unsafe { syscall(nr::WRITE, &arguments) };
        self.used = 0;
        (missing == 0).then_some(())
    }
}
