//! The imaging side: sends frames over the bus.

use std::collections::HashMap;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use controller::{MTU, TICK_RATE};
use dibs_nostd::failsafe::State;
use dibs_stream::faults::{Fault, FaultyLine};
use dibs_stream::transport::Line;
use dibs_stream::{SendError, Sender, Settings, SurfaceOrder};
use glam::Vec3;

use super::bus::Bus;
use super::faults::Plan;
use super::scene::Scene;

/// Time between two polls of the telemetry.
pub const PAUSE: Duration = Duration::from_micros(300);

/// Real time in which a byte arrives, unless it was lost.
const ARRIVAL: Duration = Duration::from_millis(500);

/// State shared by sender and listener.
#[derive(Default)]
pub struct Link {
    /// Number of bytes that the controller has counted.
    pub bytes: AtomicU32,
    /// The controller's tick.
    pub tick: AtomicU32,
    /// Number of completely sent frames.
    pub frames_sent: AtomicU32,
    /// Set when the controller has ended.
    pub over: AtomicBool,
    frames: Mutex<HashMap<u32, Sent>>,
}

/// A frame that was sent.
#[derive(Clone)]
pub struct Sent {
    /// The vertices, or nodes, exactly as the controller decodes them.
    pub rows: Arc<Vec<Vec3>>,
    /// The controller's tick at which the frame was captured.
    pub captured: u32,
}

impl Link {
    /// The rows of a frame.
    pub fn frame(&self, epoch: u32) -> Option<Arc<Vec<Vec3>>> {
        self.lock().get(&epoch).map(|sent| Arc::clone(&sent.rows))
    }

    /// All frames, in no order.
    pub fn all(&self) -> Vec<Sent> {
        self.lock().values().cloned().collect()
    }

    /// Takes a frame that is about to be sent.
    pub fn record(&self, epoch: u32, rows: Vec<Vec3>, captured: u32) {
        self.lock().insert(epoch, Sent { rows: Arc::new(rows), captured });
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<u32, Sent>> {
        self.frames.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Whether the controller has ended.
    pub fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    /// The controller's tick.
    pub fn now(&self) -> u32 {
        self.tick.load(Ordering::Relaxed)
    }
}

/// A writer that waits at a flush until most bytes have arrived: an emulated serial line lets the host run seconds
/// ahead, and an Ethernet controller drops packets that do not fit in its buffer.
pub struct Paced<W> {
    writer: W,
    link: Arc<Link>,
    /// Bytes that may be in flight after a flush.
    window: u32,
    sent: u32,
}

/// Paces a writer by the bytes that the controller has counted.
pub fn paced<W: Write>(writer: W, link: &Arc<Link>, window: u32) -> Paced<W> {
    Paced { writer, link: Arc::clone(link), window, sent: 0 }
}

impl<W: Write> Write for Paced<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = self.writer.write(bytes)?;
        self.sent = self.sent.wrapping_add(taken as u32);
        Ok(taken)
    }

    fn flush(&mut self) -> io::Result<()> {
        let mut start = Instant::now();
        let mut arrived = self.link.bytes.load(Ordering::Relaxed);
        while self.sent.wrapping_sub(arrived) > self.window {
            if self.link.is_over() {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            thread::sleep(PAUSE);
            let now = self.link.bytes.load(Ordering::Relaxed);
            if now != arrived {
                (arrived, start) = (now, Instant::now());
            } else if start.elapsed() > ARRIVAL {
                // A frame that has not arrived by now was lost.
                self.sent = arrived;
            }
        }
        Ok(())
    }
}

/// Sends the motion repeatedly until the controller ends: at the recorded rate, or as fast as the line and the
/// controller's acknowledgements allow.
///
/// Returns the count of each fault.
pub fn send(
    scene: &Scene,
    bus: Bus,
    link: &Arc<Link>,
    line: Line,
    faults: Option<&Plan>,
) -> Result<Vec<(Fault, u64)>> {
    let order = order(scene)?;
    let settings = Settings { session: 1, ..Settings::default() };
    let line = match faults {
        Some(plan) => FaultyLine::new(line, plan.seed, Plan::KINDS, Plan::RATE),
        None => FaultyLine::new(line, 0, &[], 0.0),
    };
    // The emulated board's time is slower than the host's: a frame's age and the heartbeats use the board's time.
    let clock = Arc::clone(link);
    let sender = Sender::<_, MTU>::new(line, order, settings);
    let mut sender = sender.with_clock(move || Duration::from_millis(clock.now().into()));
    send_all(scene, bus, link, &mut sender, faults)?;
    Ok(sender.transport().counts().to_vec())
}

/// The order of the surface's rows.
pub fn order(scene: &Scene) -> Result<SurfaceOrder> {
    Ok(match scene.tree.index_bits() {
        16 => SurfaceOrder::of(&scene.tree.tree::<u16>()?),
        _ => SurfaceOrder::of(&scene.tree.tree::<u32>()?),
    })
}

fn send_all(
    scene: &Scene,
    bus: Bus,
    link: &Link,
    sender: &mut Sender<FaultyLine, MTU>,
    faults: Option<&Plan>,
) -> Result<()> {
    let (frames, frame_rate) = bus.frames(&scene.motion, scene.rate);
    let interval = (TICK_RATE as f32 / frame_rate) as u32;
    let rate = if faults.is_some() { Plan::RATE } else { 0.0 };
    let mut silence = faults.map(Plan::silence_at);
    let mut is_recovering = false;
    // A board that is starting has no network yet: the emulator would report that the first packet cannot be delivered.
    while link.now() == 0 {
        if link.is_over() {
            return Ok(());
        }
        thread::sleep(PAUSE);
    }
    // Every frame must echo a status: the controller does not trust a frame with unknown transit time.
    while sender.status().is_none() {
        if !rest(link, sender) {
            return Ok(());
        }
    }
    let mut start = link.now();
    for positions in frames.iter().cycle() {
        // Before the silence, and after it until the controller is nominal, no frame has faults, so that only the
        // silence is measured: faults would delay a fresh surface.
        if silence.is_some_and(|at| link.now() >= at) {
            sender.transport().set_rate(0.0);
        }
        let captured = link.now();
        let frame = sender.prepare(positions).context("the motion cannot be sent")?;
        if let Some((epoch, held)) = sender.held() {
            link.record(epoch, held.to_vec(), captured);
        }
        match sender.transmit(frame) {
            Ok(_) => (),
            // The controller has ended its run; the listener decides whether that is correct.
            Err(SendError::Line(_)) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
        link.frames_sent.fetch_add(1, Ordering::Relaxed);
        let sent = link.now();
        // A frame that begins while the previous one is being checked would be refused.
        let is_waiting = |in_flight: u32| {
            let now = link.now();
            now < start + interval || in_flight > 0 && now < sent + bus.answer()
        };
        while is_waiting(sender.in_flight()) {
            if !rest(link, sender) {
                return Ok(());
            }
        }
        // After a late frame the next one may start earlier, but by at most one interval.
        start = (start + interval).max(link.now().saturating_sub(interval));
        if sender.in_flight() > 0 {
            start = link.now();
            continue;
        }
        let nominal = State::Nominal as u8 + 1;
        let is_nominal = sender.status().is_some_and(|status| status.safety == nominal);
        is_recovering &= !is_nominal;
        let is_due = silence.is_some_and(|at| link.now() >= at);
        if !is_due && !is_recovering {
            sender.transport().set_rate(rate);
        }
        if is_due && is_nominal {
            (silence, is_recovering) = (None, true);
            let line = sender.transport();
            line.set_rate(0.0);
            line.cut(true);
            let end = link.now() + Plan::silence(bus);
            while link.now() < end {
                if !rest(link, sender) {
                    return Ok(());
                }
            }
            sender.transport().cut(false);
        }
    }
    Ok(())
}

/// Pauses with heartbeats; false when the controller has ended.
fn rest(link: &Link, sender: &mut Sender<FaultyLine, MTU>) -> bool {
    thread::sleep(PAUSE);
    !link.is_over() && sender.poll().is_ok()
}
