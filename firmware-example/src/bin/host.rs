//! The controller as a program on a host computer: the same logic as on the board, with a thread as the bus interrupt.
//! It guarantees no deadline.
//!
//! `host BUS TELEMETRY TICKS [hand]`: two Unix sockets to connect to, the length of the run, and whether a simulated hand
//! pushes the instrument.

use std::io::{BufWriter, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{env, thread};

use anyhow::{Context, Result};
use controller::telemetry::{MAX_FRAMED, Summary, frame};
use controller::{BusStatus, ContactList, Either, STATUS_FRAMED, TICK_RATE, Trust, start, surface};
use dibs_nostd::Millis;
use dibs_nostd::wire::{Counters, Event};

/// Slices of background work between two polls of the bus.
const SLICES: u32 = 1_000;

static SURFACE: surface::Surface = surface::Surface::new();
static BUS: BusStatus = BusStatus::new();
static NOW: AtomicU32 = AtomicU32::new(0);
static COUNTERS: Mutex<Counters> = Mutex::new(Counters::new());

fn main() -> Result<()> {
    let mut arguments = env::args_os().skip(1);
    let mut argument = |name| arguments.next().with_context(|| format!("{name} is missing"));
    let mut bus = UnixStream::connect(argument("BUS")?)?;
    let telemetry = UnixStream::connect(argument("TELEMETRY")?)?;
    let ticks: u32 = argument("TICKS")?.to_str().and_then(|t| t.parse().ok()).context("TICKS")?;
    let robot = Either::new(arguments.next().is_some_and(|word| word == "hand"));

    let contacts = Box::leak(Box::new(ContactList::new()));
    let (mut receiver, mut control) = start(&SURFACE, &BUS, &Trust::HOST, robot, contacts)?;
    bus.set_read_timeout(Some(Duration::from_millis(1)))?;
    thread::spawn(move || {
        let (mut buffer, mut line) = ([0; 1024], [0; STATUS_FRAMED]);
        loop {
            let now = Millis(NOW.load(Ordering::Relaxed));
            match bus.read(&mut buffer) {
                Ok(0) => return,
                Ok(bytes) => {
                    for byte in buffer[..bytes].chunks(1) {
                        receiver.bytes(byte, now);
                        while receiver.work() {}
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                Err(_) => return,
            }
            // The work of the board's idle loop.
            for _ in 0..SLICES {
                receiver.work();
            }
            *counters() = *receiver.counters();
            let status = receiver.report(now, &mut line).unwrap_or_default();
            if bus.write_all(status).is_err() {
                return;
            }
        }
    });

    let mut out = BufWriter::new(telemetry);
    let mut line = [0; MAX_FRAMED];
    let period = Duration::from_secs(1) / TICK_RATE;
    let begun = Instant::now();
    for tick in 0..ticks {
        thread::sleep((begun + period * tick).saturating_duration_since(Instant::now()));
        let record = control.tick(|| 0);
        NOW.store(control.now().0, Ordering::Relaxed);
        out.write_all(frame(&record, &mut line).context("a record fits its line")?)?;
        if let Some(push) = control.push() {
            out.write_all(frame(&push, &mut line).context("a record fits its line")?)?;
        }
        out.flush()?;
    }
    let mut summary = Summary { kind: Summary::KIND, ticks, ..bytemuck::Zeroable::zeroed() };
    summary.events = Event::ALL.map(|event| counters().of(event));
    out.write_all(frame(&summary, &mut line).context("a summary fits its line")?)?;
    out.flush()?;
    Ok(())
}

fn counters() -> MutexGuard<'static, Counters> {
    COUNTERS.lock().unwrap_or_else(PoisonError::into_inner)
}
