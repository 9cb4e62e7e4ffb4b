//! The interrupts, and the monitoring of the control tick's deadline.

// Requirement: P-03

use core::sync::atomic::{AtomicU32, Ordering};

use controller::telemetry::Summary;
use controller::{Control, Either, Receiver, STATUS_MTU};
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, Peripherals, SYST};
use cortex_m_rt::exception;
use dibs_nostd::wire::Event;
use dibs_nostd::{Millis, Ticks};
use heapless::spsc::Producer;

use crate::exclusive::Exclusive;
use crate::vectors::BusInterrupt;
use crate::{QUEUE, Records, clock, semihosting, uart};

/// Priorities of the interrupts: only the upper bits count, and a lower value is more urgent.
const CONTROL_PRIORITY: u8 = 0x00;
const BUS_PRIORITY: u8 = 0x80;

static TIMELINE: Exclusive<Option<Timeline>> = Exclusive::new(None);
static RECEIVER: Exclusive<Option<Receiver>> = Exclusive::new(None);
/// Control ticks run so far.
static TICKS: AtomicU32 = AtomicU32::new(0);
/// Clock counts of these ticks.
static CONTROL_COUNTS: AtomicU32 = AtomicU32::new(0);
/// Longest section with all interrupts disabled, in clock counts; the only one is at start-up.
static MASKED: AtomicU32 = AtomicU32::new(0);
/// Longest section with the bus interrupt disabled, in clock counts.
static BUS_MASKED: AtomicU32 = AtomicU32::new(0);

/// The control interrupt's state.
struct Timeline {
    control: Control<Either>,
    records: Producer<'static, Records>,
    /// When the running tick was due, on the clock; `None` before the first tick.
    due: Option<u32>,
    deadline_misses: u32,
    latency: u32,
    longest: u32,
    dropped: u32,
}

/// Starts the clock and the control tick; and the bus interrupt, if the bus is the serial line.
pub fn start(
    control: Control<Either>,
    records: Producer<'static, Records>,
    receiver: Receiver,
    is_serial: bool,
) {
    clock::start();
    // The one place where this program disables all interrupts: inside `take`.
    let before = clock::now();
    let core = Peripherals::take();
    MASKED.store(clock::now().wrapping_sub(before), Ordering::Relaxed);
    let Some(mut core) = core else { semihosting::exit(false) };
    TIMELINE.with(|timeline| {
        *timeline = Some(Timeline {
            control,
            records,
            due: None,
            deadline_misses: 0,
            latency: 0,
            longest: 0,
            dropped: 0,
        });
    });
    RECEIVER.with(|place| *place = Some(receiver));
    if is_serial {
        uart::BUS.start_receiving();
    }
    // SAFETY: no critical section relies on priorities, and the handlers' state is initialised.
    unsafe {
        core.SCB.set_priority(SystemHandler::SysTick, CONTROL_PRIORITY);
        core.NVIC.set_priority(BusInterrupt, BUS_PRIORITY);
        NVIC::unmask(BusInterrupt);
    }
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(clock::TICK - 1);
    core.SYST.clear_current();
    core.SYST.enable_counter();
    core.SYST.enable_interrupt();
}

/// Does a slice of work on complete frames. Returns the status to send, if one is due. It masks the bus interrupt: for
/// some microseconds no byte is received.
pub fn background(packet: &mut [u8; STATUS_MTU]) -> Option<&[u8]> {
    NVIC::mask(BusInterrupt);
    let before = own_time();
    let status = RECEIVER.with(|receiver| {
        let receiver = receiver.as_mut()?;
        receiver.work();
        receiver.status(now(), packet)
    });
    if let (Some(before), Some(after)) = (before, own_time()) {
        BUS_MASKED.fetch_max(after.wrapping_sub(before), Ordering::Relaxed);
    }
    // SAFETY: the handler's state is initialised and not in use.
    unsafe { NVIC::unmask(BusInterrupt) };
    status.flatten()
}

/// Receives a packet from the network, in the idle loop. Returns whether it was a good packet.
pub fn take(packet: &[u8]) -> bool {
    let taken = RECEIVER.with(|receiver| Some(receiver.as_mut()?.packet(packet, now())));
    taken.flatten().unwrap_or(false)
}

/// Clock counts since a time, without the control ticks; 0 if a tick occurred during one of the two readings.
pub fn since(start: Option<u32>) -> u32 {
    start.and_then(|start| Some(own_time()?.wrapping_sub(start))).unwrap_or(0)
}

/// The clock minus the control ticks, which delay the bus anyway; `None` if a tick occurred during the reading.
pub fn own_time() -> Option<u32> {
    let control = CONTROL_COUNTS.load(Ordering::Relaxed);
    let now = clock::now();
    (control == CONTROL_COUNTS.load(Ordering::Relaxed)).then_some(now.wrapping_sub(control))
}

/// Stops both interrupts.
pub fn stop() {
    NVIC::mask(BusInterrupt);
    // SAFETY: SysTick belongs to this module; one write of its control register.
    unsafe { (*SYST::PTR).csr.write(0) };
}

/// The receiver's clock: the number of control ticks so far.
fn now() -> Millis {
    controller::time_of(Ticks(ticks().into()))
}

/// Control ticks run so far.
pub fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

/// The summary so far; after `stop`, of the whole run.
pub fn summary(stack_bytes: u32) -> Summary {
    let mut summary = Summary {
        kind: Summary::KIND,
        ticks: ticks(),
        deadline_misses: 0,
        latency_counts: 0,
        tick_counts: 0,
        records_dropped: 0,
        bus_overrun: u32::from(uart::BUS.has_overrun()),
        stack_bytes,
        masked_counts: MASKED.load(Ordering::Relaxed),
        bus_masked_counts: BUS_MASKED.load(Ordering::Relaxed),
        scrub_rounds: 0,
        events: [0; Event::ALL.len()],
    };
    RECEIVER.with(|receiver| {
        if let Some(receiver) = receiver {
            summary.events = Event::ALL.map(|event| receiver.counters().of(event));
            summary.scrub_rounds = receiver.rounds();
        }
    });
    TIMELINE.with(|timeline| {
        if let Some(timeline) = timeline {
            summary.deadline_misses = timeline.deadline_misses;
            summary.latency_counts = timeline.latency;
            summary.tick_counts = timeline.longest;
            summary.records_dropped = timeline.dropped;
        }
    });
    summary
}

/// The control tick.
#[exception]
fn SysTick() {
    let now = clock::now();
    // The latency of this tick: counts since SysTick reached 0 and requested this interrupt.
    let late = clock::TICK.wrapping_sub(SYST::get_current()) % clock::TICK;
    TIMELINE.with(|timeline| {
        if let Some(timeline) = timeline {
            timeline.run(now, late);
        }
    });
    TICKS.fetch_add(1, Ordering::Relaxed);
    CONTROL_COUNTS.fetch_add(clock::now().wrapping_sub(now), Ordering::Relaxed);
}

impl Timeline {
    fn run(&mut self, now: u32, late: u32) {
        // Later due times are computed from the first one, so that a tick that never ran is noticed.
        let due = match self.due {
            None => now.wrapping_sub(late),
            Some(before) => {
                let next = before.wrapping_add(clock::TICK);
                let skipped = now.wrapping_sub(next) / clock::TICK;
                self.deadline_misses = self.deadline_misses.saturating_add(skipped);
                next.wrapping_add(skipped.wrapping_mul(clock::TICK))
            }
        };
        self.due = Some(due);
        self.latency = self.latency.max(now.wrapping_sub(due));

        let tick = self.control.tick(clock::now);
        let records = (tick, self.control.push());
        // This check tells the optimiser that the queue's length, by which `heapless` divides, is positive; otherwise a
        // panic path would remain.
        if self.records.capacity() >= QUEUE || self.records.enqueue(records).is_err() {
            self.dropped = self.dropped.saturating_add(1);
        }

        let taken = clock::now().wrapping_sub(due);
        self.longest = self.longest.max(taken);
        if taken > clock::TICK {
            self.deadline_misses = self.deadline_misses.saturating_add(1);
        }
    }
}

/// UART 0 has a byte.
pub extern "C" fn bus_interrupt() {
    uart::BUS.acknowledge();
    RECEIVER.with(|receiver| {
        while let Some(byte) = uart::BUS.read() {
            if let Some(receiver) = receiver {
                receiver.bytes(&[byte], now());
            }
        }
    });
}
