//! The board: MPS2-AN500, a Cortex-M7 that QEMU emulates as `mps2-an500`.
//!
//! Three priorities share the core. The control tick (`SysTick`, 1 kHz) has the highest: it is only delayed by its
//! previous run. Reception over a serial line (UART 0) is one below. The idle loop polls Ethernet frames if the bus is
//! Ethernet, checks complete frames and the tree in flash in slices, and sends statuses over the bus and telemetry over
//! UART 1.
#![no_std]
#![no_main]

mod clock;
mod exclusive;
mod lan9118;
mod log;
mod network;
mod panic;
mod registers;
mod schedule;
mod semihosting;
mod stack;
mod uart;
mod vectors;

use controller::telemetry::{MAX_FRAMED, Push, Tick, frame};
use controller::{
    BusStatus, ContactList, Either, STATUS_FRAMED, STATUS_MTU, Trust, start, surface,
};
use cortex_m_rt::entry;
use dibs_nostd::wire::enframe;
use heapless::spsc::{Consumer, Queue};
use network::Network;
use semihosting::Arguments;

/// Records that can wait for the telemetry line.
const QUEUE: usize = 64;

type Records = (Tick, Option<Push>);

static SURFACE: surface::Surface = surface::Surface::new();
static BUS: BusStatus = BusStatus::new();

#[entry]
fn main() -> ! {
    static mut RECORDS: Queue<Records, QUEUE> = Queue::new();
    static mut NETWORK: Option<Network> = None;
    static mut CONTACTS: ContactList = ContactList::new();
    let (producer, consumer) = RECORDS.split();

    let arguments = Arguments::read();
    if arguments.is_ethernet {
        *NETWORK = Network::start();
        if NETWORK.is_none() {
            defmt::error!("the board has no LAN9118");
            semihosting::exit(false)
        }
    }
    let trust = if arguments.is_ethernet { &Trust::ETHERNET } else { &Trust::SERIAL };
    let robot = Either::new(arguments.is_pushed);
    let (receiver, control) = match start(&SURFACE, &BUS, trust, robot, CONTACTS) {
        Ok(ends) => ends,
        Err(_) => {
            defmt::error!("the tree in flash is damaged, or a constant out of range");
            semihosting::exit(false)
        }
    };
    let tree = control.tree();
    defmt::info!(
        "{} triangles, {} vertices, mesh {=u32:08x}, stretch limit {}",
        tree.triangle_count(),
        tree.vertex_count(),
        tree.mesh_id(),
        tree.stretch()
    );
    schedule::start(control, producer, receiver, !arguments.is_ethernet);
    uart::TELEMETRY.start_sending();
    idle(consumer, NETWORK.as_mut(), arguments.ticks)
}

/// Sends records and polls frames until the run is over; a run length of 0 means for ever.
fn idle(
    mut records: Consumer<'static, Records>,
    mut network: Option<&'static mut Network>,
    ticks: u32,
) -> ! {
    let mut line = [0; MAX_FRAMED];
    #[cfg(feature = "planted-overflow")]
    line.fill(overflow(1));
    let mut status = [0; STATUS_MTU];
    #[cfg(feature = "batched")]
    core::hint::black_box(batched());
    #[cfg(feature = "filter")]
    core::hint::black_box(filtered());
    #[cfg(feature = "planted-panic")]
    core::hint::black_box([0; 4][core::hint::black_box(0_usize)]);
    loop {
        // `heapless` divides by the queue's length, which the compiler does not know to be positive: without this check
        // a panic path would remain.
        let record = if records.capacity() < QUEUE { records.dequeue() } else { None };
        match record {
            Some(records) => send_records(&records, &mut line),
            None if ticks != 0 && schedule::ticks() >= ticks => break,
            None => (),
        }
        // There is always work, so the loop does not sleep. To save power, execute `wfi` after each round of the tree's
        // check; but an emulated processor that sleeps loses its exact time.
        if let Some(network) = &mut network {
            network.poll();
        }
        match (schedule::background(&mut status), &mut network) {
            (Some(status), Some(network)) => network.send(status),
            (Some(status), None) => send_serial(status),
            (None, _) => (),
        }
    }
    schedule::stop();
    while let Some(records) = records.dequeue() {
        send_records(&records, &mut line);
    }
    if let Some(network) = network {
        send(frame(network.record(), &mut line));
    }
    let summary = schedule::summary(stack::high_water());
    send(frame(&summary, &mut line));
    defmt::info!(
        "{} ticks, {} deadlines missed, {} frames published, {} bytes of stack",
        summary.ticks,
        summary.deadline_misses,
        BUS.published(),
        summary.stack_bytes
    );
    semihosting::exit(summary.deadline_misses == 0)
}

/// Recurses until the stack is used up.
#[cfg(feature = "planted-overflow")]
#[inline(never)]
fn overflow(depth: u8) -> u8 {
    let below = core::hint::black_box([depth; 64]);
    if core::hint::black_box(depth) == 0 {
        return 0;
    }
    overflow(depth | 1).wrapping_add(below.iter().fold(0, |sum, byte| sum ^ byte))
}

/// A batched query, to prove that it has no panic path either.
#[cfg(feature = "batched")]
fn batched() -> Option<f32> {
    let tree = surface::TREE.validate().ok()?;
    let mut query = surface::BatchedQuery::new(&tree).ok()?;
    let rows = core::hint::black_box([glam::Vec3::ZERO; 4]);
    let tool = controller::instrument(core::hint::black_box(0)).ok()?;
    Some(query.closest_batched(&rows[..], &tool, &dibs_nostd::Options::new()).ok()?.separation)
}

/// A filter's tick with rows of the caller, to prove that it has no panic path either.
#[cfg(feature = "filter")]
fn filtered() -> Option<f32> {
    use core::hint::black_box;
    use dibs_nostd::filter::{Filter, MotionRow, RigidMotion, Uncertainty};

    let tree = surface::TREE.validate().ok()?;
    let mut tracker = surface::Tracker::<64>::new(&tree).ok()?;
    let rows = black_box([glam::Vec3::ZERO; 4]);
    let mut odometer = dibs_nostd::Odometer::new(&tree);
    let table = odometer.start(&rows[..]);
    let tool = controller::instrument(black_box(0)).ok()?;
    let filter = Filter::new(black_box(1.0), black_box(200.0)).ok()?;
    let command = black_box(RigidMotion::translation(glam::Vec3::X));
    let own = black_box([MotionRow::along(glam::Vec3::X, 0.0); 2]);
    let mut pairs = [(&mut tracker, &table, &tool)];
    let admitted =
        filter.admit(&mut pairs, &command, black_box(1e-3), &Uncertainty::new(100.0), &own);
    Some(admitted.ok()?.least_separation)
}

/// Sends a status over the serial bus.
fn send_serial(status: &[u8]) {
    let mut line = [0; STATUS_FRAMED];
    for &byte in enframe(status, &mut line).unwrap_or_default() {
        uart::BUS.write(byte);
    }
}

/// Sends a tick's records as telemetry.
fn send_records((tick, push): &Records, line: &mut [u8; MAX_FRAMED]) {
    send(frame(tick, line));
    if let Some(push) = push {
        send(frame(push, line));
    }
}

/// Sends a record as telemetry.
fn send(bytes: Option<&[u8]>) {
    for &byte in bytes.unwrap_or_default() {
        uart::TELEMETRY.write(byte);
    }
}
