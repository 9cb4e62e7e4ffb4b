//! The stack's high-water mark: `cortex-m-rt` paints the stack at reset, and use overwrites the paint.

// Requirement: P-02

use core::ptr::addr_of;

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    // Defined by the linker script of cortex-m-rt.
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Bytes of stack used since reset, by the idle loop and all interrupts above it.
pub fn high_water() -> u32 {
    let end = addr_of!(_stack_end);
    let start = addr_of!(_stack_start);
    let words = (start.addr() - end.addr()) / size_of::<u32>();
    let untouched = (0..words)
        // SAFETY: reads words of the stack's own memory, between two symbols of the linker.
        .take_while(|&word| unsafe { end.add(word).read_volatile() } == STACK_PAINT_VALUE)
        .count();
    u32::try_from((words - untouched) * size_of::<u32>()).unwrap_or(u32::MAX)
}
