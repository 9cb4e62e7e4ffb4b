//! The imaging side: sends one frame after the other over the bus.

use std::collections::HashMap;
use std::io;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use controller::{MTU, TICK_RATE};
use dibs_build::stream::{Line, SendError, Sender, Settings, SurfaceOrder, Transport};
use glam::Vec3;

use super::scene::Scene;

/// Packets on their way that the controller has not counted yet: enough to keep the line busy, few
/// enough that a frame is young when it arrives.
const WINDOW: u32 = 4;

/// Between two looks at the telemetry.
const PAUSE: Duration = Duration::from_micros(300);

/// Real time in which a packet arrives, unless it was lost.
const ARRIVAL: Duration = Duration::from_millis(500);

/// What sender and listener tell each other.
#[derive(Default)]
pub struct Link {
    /// Packets that the controller has counted.
    pub packets: AtomicU32,
    /// The controller's tick.
    pub tick: AtomicU32,
    /// Frames sent to the last byte.
    pub frames_sent: AtomicU32,
    /// Set when the controller is gone.
    pub over: AtomicBool,
    /// The vertices of every frame, exactly as the controller decodes them.
    frames: Mutex<HashMap<u32, Arc<Vec<Vec3>>>>,
}

impl Link {
    /// The vertices of a frame.
    pub fn frame(&self, epoch: u32) -> Option<Arc<Vec<Vec3>>> {
        self.lock().get(&epoch).cloned()
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, HashMap<u32, Arc<Vec<Vec3>>>> {
        self.frames.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

/// A line that takes no packet before most of those before have arrived: an emulated serial line lets
/// the computer run seconds ahead.
struct Paced<'l> {
    line: Line,
    link: &'l Link,
    sent: u32,
}

impl Transport for Paced<'_> {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        let mut start = Instant::now();
        let mut arrived = self.link.packets.load(Ordering::Relaxed);
        while self.sent.wrapping_sub(arrived) >= WINDOW {
            if self.link.over.load(Ordering::Relaxed) {
                return Err(io::ErrorKind::BrokenPipe.into());
            }
            thread::sleep(PAUSE);
            let now = self.link.packets.load(Ordering::Relaxed);
            if now != arrived {
                (arrived, start) = (now, Instant::now());
            } else if start.elapsed() > ARRIVAL {
                // What has not come by now was lost on the way.
                self.sent = arrived;
            }
        }
        self.line.send(packet)?;
        self.sent = self.sent.wrapping_add(1);
        Ok(())
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        self.line.receive()
    }
}

/// Sends the motion, over and over, until the controller is gone: at the recorded rate, or as fast
/// as the line allows.
pub fn send(scene: &Scene, link: &Link, bus: UnixStream) -> Result<()> {
    let interval = (TICK_RATE as f32 / scene.rate) as u32;
    let line = Paced { line: Line::unix(bus)?, link, sent: 0 };
    let order = match scene.tree.index_bits() {
        16 => SurfaceOrder::of(&scene.tree.tree::<u16>()?),
        _ => SurfaceOrder::of(&scene.tree.tree::<u32>()?),
    };
    let settings = Settings { heartbeat: None, session: 1, ..Settings::default() };
    let mut sender = Sender::<_, MTU>::new(line, order, settings);
    for positions in scene.motion.frames.iter().cycle() {
        let start = link.tick.load(Ordering::Relaxed);
        let frame = sender.prepare(positions).context("the motion cannot be sent")?;
        if let Some((epoch, held)) = sender.held() {
            link.lock().insert(epoch, Arc::new(held.to_vec()));
        }
        match sender.transmit(frame) {
            Ok(_) => (),
            // The controller has ended its run; the listener tells whether it should have.
            Err(SendError::Line(_)) => return Ok(()),
            Err(error) => return Err(error.into()),
        }
        link.frames_sent.fetch_add(1, Ordering::Relaxed);
        while link.tick.load(Ordering::Relaxed) < start + interval {
            if link.over.load(Ordering::Relaxed) {
                return Ok(());
            }
            thread::sleep(PAUSE);
        }
    }
    Ok(())
}
