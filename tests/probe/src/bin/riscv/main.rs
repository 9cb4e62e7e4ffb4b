//! Answers the script `script.bin` on an emulated RISC-V processor, as `board` does on ARM: QEMU's `virt`, by
//! semihosting. With `-icount shift=0` its clock counts instructions.
#![no_std]
#![no_main]

mod clock;
mod exit;
#[path = "../board/files.rs"]
mod files;
#[path = "../board/machine.rs"]
mod machine;
mod semihosting;

use core::arch::global_asm;
use core::cell::UnsafeCell;

use probe::{Memory, run};

/// Memory of the one call of `main`.
struct Only(UnsafeCell<Memory>);

// SAFETY: one hart runs, and `main` runs once.
unsafe impl Sync for Only {}

static MEMORY: Only = Only(UnsafeCell::new(Memory::new()));

// A stack, and the floating-point unit: on, rounding to nearest.
global_asm!(
    ".section .init, \"ax\"",
    ".globl _start",
    "_start:",
    "la sp, _stack_start",
    "li t0, 0x2000",
    "csrs mstatus, t0",
    "csrw fcsr, zero",
    "call main",
);

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    machine::answer(|board| {
        // SAFETY: `main` is called once, by the start-up code.
        run(unsafe { &mut *MEMORY.0.get() }, board)
    })
}
