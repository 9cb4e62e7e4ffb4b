//! The control tick: `SysTick`, 1 kHz, with the highest priority of all interrupts.

use core::sync::atomic::{AtomicU32, Ordering};

use controller::{Control, Script, TICK_RATE, time_of};
use cortex_m::Peripherals;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DWT, SYST};
use dibs_nostd::{Millis, Ticks};

use crate::clocks;
use crate::exclusive::Exclusive;

/// Cycles between two ticks.
const PERIOD: u32 = clocks::HERTZ / TICK_RATE;

#[unsafe(link_section = ".dtcm.control")]
static CONTROL: Exclusive<Option<Control<Script>>> = Exclusive::new(None);

/// Values for a debugger, in words. In the TCM, which is not cached.
#[repr(C)]
pub struct Watch {
    /// Control ticks run so far.
    ticks: AtomicU32,
    /// Most cycles from a tick's due time to its first instruction.
    latest_start: AtomicU32,
    /// Most cycles from a tick's due time to its end.
    latest_end: AtomicU32,
    /// Ticks that were due before the previous one had ended.
    deadlines_missed: AtomicU32,
    /// The force on the instrument in N, as bits of `f32`. A real robot has its actuators here.
    force: [AtomicU32; 3],
}

/// The values of the run so far.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".dtcm.watch")]
pub static WATCH: Watch = Watch {
    ticks: AtomicU32::new(0),
    latest_start: AtomicU32::new(0),
    latest_end: AtomicU32::new(0),
    deadlines_missed: AtomicU32::new(0),
    force: [const { AtomicU32::new(0) }; 3],
};

/// The controller's clock: the number of ticks so far.
pub fn now() -> Millis {
    time_of(Ticks(WATCH.ticks.load(Ordering::Relaxed).into()))
}

/// Starts the ticks.
pub fn start(core: &mut Peripherals, control: Control<Script>) {
    CONTROL.with(|place| *place = Some(control));
    core.DCB.enable_trace();
    DWT::unlock(); // the M7's lock access register
    core.DWT.enable_cycle_counter();
    // SAFETY: no critical section relies on priorities, and the handler's state is initialised.
    unsafe { core.SCB.set_priority(SystemHandler::SysTick, 0) };
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(PERIOD - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();
}

/// The vector table points here directly, so that no code in flash is executed.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".itcm.tick")]
extern "C" fn SysTick() {
    // The timer has counted down since this tick was due.
    let late = PERIOD.wrapping_sub(SYST::get_current()) % PERIOD;
    let start = DWT::cycle_count();
    let record = CONTROL.with(|control| Some(control.as_mut()?.tick(DWT::cycle_count))).flatten();
    if let Some(record) = record {
        for (part, newton) in WATCH.force.iter().zip(record.force) {
            part.store(newton.to_bits(), Ordering::Relaxed);
        }
    }
    WATCH.ticks.fetch_add(1, Ordering::Relaxed);
    let end = late.wrapping_add(DWT::cycle_count().wrapping_sub(start));
    WATCH.latest_start.fetch_max(late, Ordering::Relaxed);
    WATCH.latest_end.fetch_max(end, Ordering::Relaxed);
    WATCH.deadlines_missed.fetch_add(end / PERIOD, Ordering::Relaxed);
}
