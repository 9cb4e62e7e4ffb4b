//! What must never run: the panic and fault handlers.

use cortex_m_rt::exception;

/// Links only if the optimiser has removed every call: a surviving panic path is a link error that
/// names this symbol. Debug builds keep overflow checks and bounds checks, so they stop instead.
#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    #[cfg(not(debug_assertions))]
    {
        unsafe extern "C" {
            fn a_panic_path_survived_in_the_firmware() -> !;
        }
        // SAFETY: never reached: the symbol is defined nowhere.
        unsafe { a_panic_path_survived_in_the_firmware() }
    }
    #[cfg(debug_assertions)]
    crate::semihosting::exit(false)
}

/// A fault means broken hardware or an unsound `unsafe`: stop, so that a test sees it.
#[exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    crate::semihosting::exit(false)
}
