//! The debugger's services: the length of a run, and its end. Without a debugger a `bkpt` is a fault, so leave this
//! module out on silicon.

use cortex_m_semihosting::{debug, nr, syscall};

/// Ends the emulation with exit code 0 or 1.
pub fn exit(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

/// Ticks to run: the last word of the command line (`-semihosting-config ...,arg=board,arg=5000`). 0, for ever, if that
/// is not a number.
pub fn run_length() -> u32 {
    let mut line = [0_u8; 80];
    let place = [line.as_mut_ptr().expose_provenance(), line.len()];
    // SAFETY: SYS_GET_CMDLINE takes the address and the size of a buffer, and writes a string that
    // fits, ended by a zero.
    if unsafe { syscall(nr::GET_CMDLINE, &place) } != 0 {
        return 0;
    }
    let words = line.split(|&byte| byte == 0).next().unwrap_or_default();
    let last = words.rsplit(|&byte| byte == b' ').next().unwrap_or_default();
    let digit = |sum: Option<u32>, &byte: &u8| {
        let value = u32::from(byte).checked_sub(u32::from(b'0')).filter(|&value| value < 10)?;
        sum?.checked_mul(10)?.checked_add(value)
    };
    last.iter().fold(Some(0), digit).unwrap_or(0)
}
