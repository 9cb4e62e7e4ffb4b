//! The imaging side: sends one frame after the other over the bus.

use std::collections::HashMap;
use std::io::Write;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result};
use controller::{MTU, TICK_RATE};
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, QuantisedBox, enframe, framed_bytes};
use glam::Vec3;

use super::scene::Scene;

/// Packets on their way that the controller has not counted yet: enough to keep the line busy, few
/// enough that a frame is young when it arrives.
const WINDOW: u32 = 4;

/// Between two looks at the telemetry.
const PAUSE: Duration = Duration::from_micros(300);

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

/// Sends the motion, over and over, until the controller is gone: at the recorded rate, or as fast
/// as the line allows.
pub fn send(scene: &Scene, link: &Link, mut bus: UnixStream) -> Result<()> {
    let interval = (TICK_RATE as f32 / scene.rate) as u32;
    let mut packets = 0_u32;
    for (epoch, exact) in (1_u32..).zip(scene.frames.iter().cycle()) {
        let grid = QuantisedBox::covering(exact)
            .with_context(|| format!("frame {epoch} has a position that is not finite"))?;
        let decode = |&position: &Vec3| grid.quantise(position).map(|row| grid.position(row));
        let decoded: Option<Vec<Vec3>> = exact.iter().map(decode).collect();
        link.lock().insert(epoch, Arc::new(decoded.context("a vertex outside its box")?));

        let start = link.tick.load(Ordering::Relaxed);
        let encoding = Encoding::Quantised(grid);
        let id = FrameId { mesh_id: scene.tree.summary().mesh_id, session: 1, epoch };
        let mut encoder = FrameEncoder::<_, MTU>::new(id, encoding, &exact[..])?;
        let mut packet = [0; MTU];
        let mut line = [0; framed_bytes(MTU)];
        while let Some(packet) = encoder.next_packet(&mut packet) {
            while packets.wrapping_sub(link.packets.load(Ordering::Relaxed)) >= WINDOW {
                if link.over.load(Ordering::Relaxed) {
                    return Ok(());
                }
                thread::sleep(PAUSE);
            }
            let bytes = enframe(packet, &mut line).context("a packet larger than the bus takes")?;
            if bus.write_all(bytes).is_err() {
                // The controller has ended its run; the listener tells whether it should have.
                return Ok(());
            }
            packets = packets.wrapping_add(1);
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
