//! The panic and fault handlers, which never run unless there is a defect.

// Requirement: P-01

use cortex_m_rt::exception;

/// Links only if the optimiser has removed every call: a remaining panic path is a link error that names this symbol.
/// Debug builds have overflow and bounds checks, so they stop instead.
#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    #[cfg(not(debug_assertions))]
    {
        unsafe extern "C" {
            fn a_panic_path_survived_in_the_firmware() -> !;
        }
        // SAFETY: never called: the symbol is not defined anywhere.
        unsafe { a_panic_path_survived_in_the_firmware() }
    }
    #[cfg(debug_assertions)]
    crate::semihosting::exit(false)
}

unsafe extern "C" {
    // Defined by memory.x.
    static _stack_start: u32;
}

/// A fault means broken hardware, an unsound `unsafe`, or a stack overflow: stop, so that a test notices. The stack
/// pointer may be invalid, so it is reset.
#[exception(trampoline = false)]
unsafe fn HardFault() -> ! {
    // SAFETY: nothing on the old stack is used again.
    unsafe {
        core::arch::asm!(
            "movw r0, #:lower16:{start}",
            "movt r0, #:upper16:{start}",
            "mov sp, r0",
            "b {stop}",
            start = sym _stack_start,
            stop = sym stop,
            options(noreturn)
        )
    }
}

extern "C" fn stop() -> ! {
    crate::semihosting::exit(false)
}
