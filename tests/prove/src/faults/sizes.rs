//! Bytes of a frame of a beating heart, by the way of sending.

use std::collections::BTreeSet;
use std::fmt;

use anyhow::Result;
use dibs_build::modes::ModalFit;
use dibs_build::{Builder, Mesh, Motion, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::modes::MAX_MODES;
use dibs_stream::{Sender, Settings, SurfaceOrder};
use serde::Serialize;

use crate::data::real;

/// Triangles of the generated heart: those of the real one.
const TRIANGLES: u32 = 10_272;
/// Largest packet on a serial line or in a datagram.
const MTU: usize = 1024;
/// Tolerances of partial frames, in mm.
const TOLERANCES: [f32; 4] = [0.01, 0.05, 0.1, 0.5];
/// Numbers of displacement modes.
const MODES: [usize; 4] = [2, 8, 16, 64];
/// Ticks of a control loop a second.
const TICKS: f32 = 1_000.0;
/// Seconds of a heartbeat: both motions are one.
const BEAT: f32 = 1.0;

/// One heart, sent in one way.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub heart: &'static str,
    pub vertices: usize,
    /// The way of sending.
    pub frames: String,
    /// Frames a second: those of the recording, or interpolated ones, one in each control tick.
    pub rate: f32,
    pub bytes_per_frame: f64,
    pub bytes_max: usize,
    pub packets_per_frame: f64,
    /// Largest distance of a vertex from the receiver's, in mm; for modes, over all recorded frames.
    pub error_mm: f32,
    pub bytes_per_second: f64,
}

impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} heart, {:<26} at {:>5.0} Hz: {:>7.0} bytes a frame ({} at most), {:.1} packets, \
             error {:.4} mm, {:.2} MB/s",
            self.heart,
            self.frames,
            self.rate,
            self.bytes_per_frame,
            self.bytes_max,
            self.packets_per_frame,
            self.error_mm,
            self.bytes_per_second / 1e6
        )
    }
}

/// The generated heart, and the real one if present.
pub fn run() -> Result<Vec<Row>> {
    let generate::MovingMesh { mesh, motion } = generate::heart(TRIANGLES)?;
    let mut rows = heart("generated", &mesh, &motion)?;
    let data = real().unwrap_or_default();
    let (mesh, motion) = (data.join("heart_10272.ply"), data.join("heart_10272.pc2"));
    if mesh.is_file() && motion.is_file() {
        let (mesh, motion) = (dibs_build::read(&mesh)?.mesh, Motion::read_pc2(&motion)?);
        rows.extend(heart("real", &mesh, &motion)?);
    } else {
        println!("skipped: the real heart's files are not there");
    }
    Ok(rows)
}

fn heart(name: &'static str, mesh: &Mesh, motion: &Motion) -> Result<Vec<Row>> {
    // The packets do not depend on the limit.
    let tree = Builder::new().stretch(4.0).build(mesh)?;
    let order = SurfaceOrder::of(&tree.tree::<u16>()?);
    let recorded = motion.frames.len() as f32 / BEAT;
    let whole = |quantised| Settings { quantised, heartbeat: None, ..Settings::default() };
    let partial =
        |tolerance| Settings { partial: Some(tolerance), whole_every: u32::MAX, ..whole(true) };
    let mut ways = vec![
        ("whole, float".to_owned(), whole(false), recorded),
        ("whole, quantised".to_owned(), whole(true), recorded),
    ];
    for rate in [recorded, TICKS] {
        for tolerance in TOLERANCES {
            ways.push((format!("partial beyond {tolerance} mm"), partial(tolerance), rate));
        }
    }
    let row = |(frames, settings, rate)| {
        let mut sender = Sender::<_, MTU>::new(Vec::new(), order.clone(), settings);
        let (mut bytes, mut packets, mut error) = (Vec::new(), 0, 0.0_f32);
        // One beat, after a first frame, which is always whole.
        let steps = (motion.frames.len() as f32 * rate / recorded) as u32;
        for step in 0..=steps {
            let sent = sender.send(&at(motion, step as f32 / rate * recorded))?;
            sender.transport().clear();
            if step > 0 {
                bytes.push(sent.bytes);
                packets += sent.packets;
                error = error.max(sent.error);
            }
        }
        let count = bytes.len().max(1) as f64;
        let mean = bytes.iter().sum::<usize>() as f64 / count;
        Ok(Row {
            heart: name,
            vertices: order.rows(),
            frames,
            rate,
            bytes_per_frame: mean,
            bytes_max: bytes.iter().copied().max().unwrap_or(0),
            packets_per_frame: packets as f64 / count,
            error_mm: error,
            bytes_per_second: mean * f64::from(rate),
        })
    };
    let mut rows = ways.into_iter().map(row).collect::<Result<Vec<Row>>>()?;
    rows.extend(modal(name, mesh, motion, &order)?);
    Ok(rows)
}

/// Modal frames: only the weights, one frame in each control tick.
fn modal(
    heart: &'static str,
    mesh: &Mesh,
    motion: &Motion,
    order: &SurfaceOrder,
) -> Result<Vec<Row>> {
    let fit = ModalFit::new(mesh, motion)?;
    let numbers = MODES.into_iter().filter(|&modes| modes <= fit.available());
    let last = fit.available().min(MAX_MODES).min(MODES[MODES.len() - 1]);
    let numbers: BTreeSet<usize> = numbers.chain([last]).collect();
    numbers
        .into_iter()
        .map(|modes| {
            let settings = Settings { heartbeat: None, ..Settings::default() };
            let mut sender = Sender::<_, MTU>::new(Vec::new(), order.clone(), settings);
            let frame = sender.prepare_weights(&vec![1.0; modes])?;
            let sent = sender.transmit(frame)?;
            Ok(Row {
                heart,
                vertices: order.rows(),
                frames: format!("modal, {modes} modes"),
                rate: TICKS,
                bytes_per_frame: sent.bytes as f64,
                bytes_max: sent.bytes,
                packets_per_frame: sent.packets as f64,
                error_mm: fit.errors()[modes - 1].max as f32,
                bytes_per_second: sent.bytes as f64 * f64::from(TICKS),
            })
        })
        .collect()
}

/// The motion at a time in frames: interpolated between two frames.
fn at(motion: &Motion, moment: f32) -> Vec<Vec3> {
    let frames = &motion.frames;
    let (first, share) = (moment as usize % frames.len(), moment.fract());
    let second = (first + 1) % frames.len();
    frames[first].iter().zip(&frames[second]).map(|(&a, &b)| a + (b - a) * share).collect()
}
