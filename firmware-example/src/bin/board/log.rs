//! defmt over semihosting, only for start-up and the end: one frame takes longer than a tick.
//!
//! The crate `defmt-semihosting` panics when it is entered twice. This logger drops the nested frame instead, because
//! the firmware links only without panic paths.

use cortex_m_semihosting::hio;

use crate::exclusive::Exclusive;

static ENCODER: Exclusive<defmt::Encoder> = Exclusive::new(defmt::Encoder::new());

#[defmt::global_logger]
struct Logger;

// SAFETY: only the idle priority logs, so frames do not interleave; if an interrupt logged, it would find `ENCODER`
// busy and lose its bytes.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        ENCODER.with(|encoder| encoder.start_frame(emit));
    }

    unsafe fn flush() {}

    unsafe fn release() {
        ENCODER.with(|encoder| encoder.end_frame(emit));
    }

    unsafe fn write(bytes: &[u8]) {
        ENCODER.with(|encoder| encoder.write(bytes, emit));
    }
}

fn emit(bytes: &[u8]) {
    // Without a debugger the log is lost; the robot continues.
    if let Ok(mut out) = hio::hstdout() {
        let _ = out.write_all(bytes);
    }
}
