//! The panic handler of a board, which must never run.

use core::panic::PanicInfo;

/// Links only if the optimiser has removed every call: a remaining panic path is a link error that names this symbol.
/// Debug builds have overflow checks and bounds checks, so they stop instead.
#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    #[cfg(not(debug_assertions))]
    {
        unsafe extern "C" {
            fn dibs_a_panic_path_survived() -> !;
        }
        // SAFETY: never called: the symbol is not defined anywhere.
        unsafe { dibs_a_panic_path_survived() }
    }
    #[cfg(debug_assertions)]
    loop {
        core::hint::spin_loop();
    }
}

/// A panic path for a test: with it the library must not link.
#[cfg(feature = "planted-panic")]
#[unsafe(no_mangle)]
pub extern "C" fn dibs_planted_panic(at: usize) -> u8 {
    [1, 2, 3][at]
}
