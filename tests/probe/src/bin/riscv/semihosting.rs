//! Calls to the emulator, as `cortex-m-semihosting` makes them on ARM.

use core::arch::asm;

/// Numbers of the calls.
pub mod nr {
    pub const OPEN: usize = 0x01;
    pub const WRITE: usize = 0x05;
    pub const READ: usize = 0x06;
    pub const EXIT: usize = 0x18;
}

/// A call with the address of its arguments.
///
/// # Safety
/// The arguments must be those of the call, and addresses among them valid.
pub unsafe fn syscall<const N: usize>(number: usize, arguments: &[usize; N]) -> usize {
    // SAFETY: as of this function.
    unsafe { syscall_value(number, arguments.as_ptr().expose_provenance()) }
}

/// A call with one value.
///
/// # Safety
/// As of [`syscall`].
pub unsafe fn syscall_value(number: usize, value: usize) -> usize {
    let answer;
    // SAFETY: the emulator knows the call by these three instructions, which must be four bytes each and on one page.
    unsafe {
        asm!(
            ".balign 16",
            ".option push",
            ".option norvc",
            "slli x0, x0, 0x1f",
            "ebreak",
            "srai x0, x0, 7",
            ".option pop",
            inlateout("a0") number => answer,
            in("a1") value,
            options(nostack),
        );
    }
    answer
}
