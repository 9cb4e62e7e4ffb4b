//! The controller as a program on this computer: the same logic as on the board, with a thread
//! for the bus interrupt. Real time as far as the operating system gives it; no deadline is claimed.
//!
//! `host BUS TELEMETRY TICKS`: two Unix sockets to connect to, and how long to run.

use std::io::{BufWriter, Read, Write};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use std::{env, thread};

use anyhow::{Context, Result, anyhow};
use controller::surface::SurfaceFrames;
use controller::telemetry::{MAX_FRAMED, Summary, frame};
use controller::{BusStatus, Control, Receiver, TICK_RATE};

static FRAMES: SurfaceFrames = SurfaceFrames::new();
static BUS: BusStatus = BusStatus::new();
static TICKS: AtomicU32 = AtomicU32::new(0);

fn main() -> Result<()> {
    let mut arguments = env::args_os().skip(1);
    let mut argument = |name| arguments.next().with_context(|| format!("{name} is missing"));
    let mut bus = UnixStream::connect(argument("BUS")?)?;
    let telemetry = UnixStream::connect(argument("TELEMETRY")?)?;
    let ticks: u32 = argument("TICKS")?.to_str().and_then(|t| t.parse().ok()).context("TICKS")?;

    let (writer, reader) = FRAMES.split().context("the buffers are split once")?;
    let mut receiver = Receiver::new(writer, &BUS);
    thread::spawn(move || {
        let mut buffer = [0; 1024];
        while let Ok(bytes @ 1..) = bus.read(&mut buffer) {
            for &byte in &buffer[..bytes] {
                receiver.byte(byte, TICKS.load(Ordering::Relaxed));
            }
        }
    });

    let mut control = Control::new(reader, &BUS).map_err(|error| anyhow!("{error}"))?;
    let mut out = BufWriter::new(telemetry);
    let mut line = [0; MAX_FRAMED];
    let period = Duration::from_secs(1) / TICK_RATE;
    let start = Instant::now();
    for tick in 0..ticks {
        thread::sleep((start + period * tick).saturating_duration_since(Instant::now()));
        let record = control.tick(|| 0);
        TICKS.store(control.now(), Ordering::Relaxed);
        out.write_all(frame(&record, &mut line).context("a record fits its line")?)?;
        out.flush()?;
    }
    let summary = Summary { kind: Summary::KIND, ticks, ..bytemuck::Zeroable::zeroed() };
    out.write_all(frame(&summary, &mut line).context("a summary fits its line")?)?;
    out.flush()?;
    Ok(())
}
