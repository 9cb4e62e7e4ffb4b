//! The board: MPS2-AN500, a Cortex-M7 that QEMU emulates as `mps2-an500`.
//!
//! Three priorities share the core. The control tick (`SysTick`, 1 kHz) is the highest: nothing
//! delays it but its own last run. Bus reception (UART 0) is one below. What is left, the idle
//! loop, sends telemetry over UART 1.
#![no_std]
#![no_main]

mod clock;
mod log;
mod panic;
mod registers;
mod shared;
mod stack;
mod uart;
mod vectors;

use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use heapless::mpmc::Queue;
use shared::Exclusive;
use vectors::BusInterrupt;

static TICKS: AtomicU32 = AtomicU32::new(0);
static ECHO: Queue<u8, 64> = Queue::new();

#[entry]
fn main() -> ! {
    clock::start();
    uart::TELEMETRY.start_sending();
    uart::BUS.start_receiving();
    if let Some(mut core) = cortex_m::Peripherals::take() {
        // SAFETY: priorities are set before the interrupts are enabled.
        unsafe {
            core.SCB.set_priority(SystemHandler::SysTick, 0x00);
            core.NVIC.set_priority(BusInterrupt, 0x80);
            cortex_m::peripheral::NVIC::unmask(BusInterrupt);
        }
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(clock::TICK - 1);
        core.SYST.clear_current();
        core.SYST.enable_interrupt();
        core.SYST.enable_counter();
    }
    defmt::info!("hello {}", clock::now());
    while TICKS.load(Ordering::Relaxed) < 2000 {
        while let Some(b) = ECHO.dequeue() {
            uart::TELEMETRY.write(b);
        }
    }
    defmt::info!("bye {} {}", clock::now(), stack::high_water());
    log::exit(true)
}

#[exception]
fn SysTick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}

/// UART 0 has a byte.
pub extern "C" fn bus_interrupt() {
    uart::BUS.acknowledge();
    while let Some(b) = uart::BUS.read() {
        let _ = ECHO.enqueue(b);
    }
}
