//! The debugger's services: a run's arguments and its end. Without a debugger a `bkpt` is a fault, so remove this
//! module on real hardware.

use cortex_m_semihosting::{debug, nr, syscall};

/// Ends the emulation with exit code 0 or 1.
pub fn exit(success: bool) -> ! {
    debug::exit(if success { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {
        cortex_m::asm::wfi();
    }
}

/// The command line: `-semihosting-config ...,arg=board,arg=hand,arg=ethernet,arg=5000`.
pub struct Arguments {
    /// Ticks to run: the last word; 0 (for ever) if it is not a number.
    pub ticks: u32,
    /// Whether the bus is Ethernet, by the word before the last; otherwise it is a serial line.
    pub is_ethernet: bool,
    /// Whether a simulated hand pushes the instrument, by the word before that.
    pub is_pushed: bool,
}

impl Arguments {
    /// Reads them from the debugger.
    pub fn read() -> Self {
        let mut line = [0_u8; 80];
        let place = [line.as_mut_ptr().expose_provenance(), line.len()];
        // SAFETY: SYS_GET_CMDLINE takes the address and the size of a buffer, and writes a zero-terminated string that
        // fits.
        if unsafe { syscall(nr::GET_CMDLINE, &place) } != 0 {
            return Self { ticks: 0, is_ethernet: false, is_pushed: false };
        }
        let text = line.split(|&byte| byte == 0).next().unwrap_or_default();
        let mut words = text.rsplit(|&byte| byte == b' ');
        let digit = |sum: Option<u32>, &byte: &u8| {
            let value = u32::from(byte).checked_sub(u32::from(b'0')).filter(|&value| value < 10)?;
            sum?.checked_mul(10)?.checked_add(value)
        };
        let ticks = words.next().unwrap_or_default().iter().fold(Some(0), digit).unwrap_or(0);
        let is_ethernet = words.next() == Some(b"ethernet");
        Self { ticks, is_ethernet, is_pushed: words.next() == Some(b"hand") }
    }
}
