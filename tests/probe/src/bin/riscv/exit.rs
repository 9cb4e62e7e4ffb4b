//! Ends a program with an exit code for the emulator.

use crate::semihosting::{nr, syscall_value};

/// Reasons of `SYS_EXIT`: `ADP_Stopped_ApplicationExit`, and `ADP_Stopped_RunTimeErrorUnknown`.
const SUCCESS: usize = 0x2_0026;
const FAILURE: usize = 0x2_0023;

pub fn exit(success: bool) -> ! {
    // SAFETY: SYS_EXIT takes a reason.
    unsafe { syscall_value(nr::EXIT, if success { SUCCESS } else { FAILURE }) };
    loop {}
}

#[panic_handler]
fn panic(_info: &core::panic::PanicInfo) -> ! {
    exit(false)
}
