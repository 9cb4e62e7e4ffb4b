//! `dibs stream`: a recorded motion, sent to a controller.

mod key;
mod report;

use crate::modes;
use crate::tree_file::{self, AnyTree};
use anyhow::{Context, Result, anyhow, bail};
use dibs_build::stream::{Line, Sender, Settings, SurfaceOrder, Target};
use dibs_build::{Builder, Motion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{AesCmac, Mac};
use report::Display;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A receiver that reports at all reports this often.
const SILENT: Duration = Duration::from_secs(2);

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs stream heart.dibs heart.pc2 --to serial:/dev/ttyUSB0@921600 --quantise --partial 0.05 --loop
  dibs stream heart.dibs heart.pc2 --to tcp:192.168.1.20:5000 --rate 40
  dibs stream heart.dibs heart.pc2 --to udp:192.168.1.20:5000 --rate 1000 --modes
  dibs stream heart.ply heart.pc2 --to unix:/tmp/uart --frames 100 --json
  dibs stream heart.dibs heart.pc2 --to serial:/dev/ttyUSB0 --key heart.key

An emulated serial line is a server for this: qemu-system-arm -serial unix:/tmp/uart,server=on,wait=off")]
pub struct Args {
    /// The tree that the receiver has (NAME.dibs), or its mesh, of which `dibs build` with default
    /// options makes the same tree
    surface: PathBuf,
    /// The motion: a PC2 file with a position for each of the mesh's vertices in every frame
    motion: PathBuf,
    /// Where to: serial:PORT or serial:PORT@BAUD, tcp:HOST:PORT, udp:HOST:PORT or unix:PATH
    #[arg(long)]
    to: Target,
    /// Frames a second; by default the motion's own rate
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// 6 bytes a vertex instead of 12, in a box around each frame
    #[arg(long)]
    quantise: bool,
    /// Send only the vertices that moved by more than this (in the mesh's unit)
    #[arg(long, value_name = "TOLERANCE")]
    partial: Option<f32>,
    /// Send the weights of the displacement modes that the tree was built with, instead of positions
    #[arg(long, conflicts_with_all = ["quantise", "partial"])]
    modes: bool,
    /// Put a tag on every packet, by the 128-bit key in this file: 32 hexadecimal digits. Waits for the
    /// receiver's challenge
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// The receiver's challenge, where it has no way to report one: 0, if it was made with none
    #[arg(long, value_name = "NUMBER", requires = "key")]
    challenge: Option<u32>,
    /// Largest packet, in bytes: no more than the receiver takes. 64 is a CAN-FD message
    #[arg(long, value_name = "BYTES", default_value = "1024", value_parser = ["64", "1024"])]
    mtu: String,
    /// Start over at the end of the motion
    #[arg(long = "loop")]
    repeat: bool,
    /// Stop after this many frames
    #[arg(long)]
    frames: Option<u64>,
    /// Frames that may be on their way before the next one waits, where the receiver reports
    #[arg(long, default_value_t = 2)]
    window: u32,
    /// Print the totals as a JSON object
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    let key = args.key.as_deref().map(key::read).transpose()?;
    let order = order(&args.surface)?;
    let motion = Motion::read_pc2(&args.motion)?;
    let name = args.motion.display();
    if motion.frames.is_empty() {
        bail!("{name}: the motion has no frame");
    }
    let rate = match (args.rate, motion.rate) {
        (Some(rate), _) => rate,
        (None, recorded) if recorded > 0.0 => f64::from(recorded),
        _ => bail!("{name}: the file does not say how fast it was recorded; give --rate"),
    };
    if !(rate > 0.0 && rate <= 1e5) {
        bail!("--rate {rate}: a rate is above 0 and at most 100000 frames a second");
    }
    if args.partial.is_some_and(|tolerance| !(tolerance >= 0.0 && tolerance.is_finite())) {
        bail!("--partial: a tolerance is a length of at least 0");
    }
    let weights =
        if args.modes { Some(modes::weights(&args.surface, &order, &motion)?) } else { None };
    let recording = Recording { frames: motion.frames, weights, rate };
    if args.mtu == "64" {
        connect::<64>(args, key, order, &recording)
    } else {
        connect::<1024>(args, key, order, &recording)
    }
}

/// What is sent.
struct Recording {
    /// Positions, in the mesh's order.
    frames: Vec<Vec<Vec3>>,
    /// The weights of each frame, where these are sent instead.
    weights: Option<Vec<Vec<f32>>>,
    /// Frames a second.
    rate: f64,
}

/// Makes the sender: without tags, or with them once the receiver's challenge is known.
fn connect<const MTU: usize>(
    args: &Args,
    key: Option<[u8; 16]>,
    order: SurfaceOrder,
    recording: &Recording,
) -> Result<()> {
    let settings =
        Settings { quantised: args.quantise, partial: args.partial, ..Settings::default() };
    let line = args.to.open()?;
    let Some(key) = key else {
        return play(args, recording, Sender::<_, MTU>::new(line, order, settings));
    };
    let mac_of = move |challenge| AesCmac::new(&key, challenge);
    let mut sender = Sender::<_, MTU, _>::with_mac(line, order, settings, mac_of);
    match args.challenge {
        Some(challenge) => sender.challenge(challenge),
        None => await_challenge(&mut sender, &args.to)?,
    }
    play(args, recording, sender)
}

/// Until the receiver has reported its challenge.
fn await_challenge<M: Mac, const MTU: usize>(
    sender: &mut Sender<Line, MTU, M>,
    to: &Target,
) -> Result<()> {
    let start = Instant::now();
    while !sender.is_ready() {
        if start.elapsed() > SILENT {
            bail!(
                "{to}: no genuine status came within {} s: is the receiver on, and has it the same \
                 key? One that cannot report needs --challenge",
                SILENT.as_secs()
            );
        }
        sender.poll()?;
        std::thread::sleep(Duration::from_millis(2));
    }
    Ok(())
}

/// Sends the frames, each when it is due.
fn play<M: Mac, const MTU: usize>(
    args: &Args,
    recording: &Recording,
    mut sender: Sender<Line, MTU, M>,
) -> Result<()> {
    let name = args.motion.display();
    let mut display = Display::new();
    let interval = Duration::from_secs_f64(1.0 / recording.rate);
    let mut due = Instant::now();
    let mut late = 0_u64;
    let recorded = recording.frames.len() as u64;
    let end = args.frames.unwrap_or(if args.repeat { u64::MAX } else { recorded });
    for number in 0..end {
        wait(&mut sender, due, args.window)?;
        let now = Instant::now();
        if now > due + interval {
            // The line is slower than the motion: go on from here, do not pile up.
            late += 1;
            due = now;
        }
        due += interval;
        let frame = (number % recorded) as usize;
        let sent = match &recording.weights {
            Some(weights) => {
                sender.prepare_weights(&weights[frame]).and_then(|frame| sender.transmit(frame))
            }
            None => sender.send(&recording.frames[frame]),
        };
        let sent = sent.map_err(|error| anyhow!("{name}: {error}"))?;
        display.show(&sender, &sent);
    }
    // What is on its way is to be acknowledged, where anybody does.
    let end = Instant::now();
    while sender.in_flight() > 0 && sender.status().is_some() && end.elapsed() < SILENT {
        sender.poll()?;
        std::thread::sleep(Duration::from_millis(2));
    }
    display.finish();
    report::print(&sender, late, args.json);
    Ok(())
}

/// The order of the vertices: the tree's, or that of the tree that the mesh gives.
fn order(path: &Path) -> Result<SurfaceOrder> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("dibs")) {
        let bytes = tree_file::load(path)?;
        return Ok(match tree_file::validate(&bytes, path)? {
            AnyTree::Narrow(tree) => SurfaceOrder::of(&tree),
            AnyTree::Wide(tree) => SurfaceOrder::of(&tree),
        });
    }
    let mesh = dibs_build::read(path)?.mesh;
    let name = path.display();
    let built = Builder::new()
        .build(&mesh)
        .map_err(|error| anyhow!("{name}: no tree can be built: {error}"))?;
    Ok(match built.index_bits() {
        16 => SurfaceOrder::of(&built.tree::<u16>().context("the tree just built")?),
        _ => SurfaceOrder::of(&built.tree::<u32>().context("the tree just built")?),
    })
}

/// Heartbeats and statuses until the next frame is due, and has room.
fn wait<M: Mac, const MTU: usize>(
    sender: &mut Sender<Line, MTU, M>,
    due: Instant,
    window: u32,
) -> Result<()> {
    let mut heard = (sender.totals().statuses, Instant::now());
    loop {
        sender.poll()?;
        let statuses = sender.totals().statuses;
        if statuses != heard.0 {
            heard = (statuses, Instant::now());
        }
        let now = Instant::now();
        let reports = statuses > 0 && now < heard.1 + SILENT;
        if now >= due && !(reports && sender.in_flight() >= window) {
            return Ok(());
        }
        std::thread::sleep(
            Duration::from_millis(1)
                .min(due.saturating_duration_since(now))
                .max(Duration::from_micros(100)),
        );
    }
}
