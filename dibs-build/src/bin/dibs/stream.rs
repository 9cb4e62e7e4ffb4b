//! `dibs stream`: a recorded motion, sent to a controller.

use crate::modes;
use crate::tree_file::{self, AnyTree};
use anyhow::{Context, Result, anyhow, bail};
use dibs_build::stream::{Line, Sender, Sent, Settings, SurfaceOrder, Target};
use dibs_build::{Builder, Motion};
use dibs_nostd::wire::{Content, Counters, Event};
use indicatif::{ProgressBar, ProgressStyle};
use std::fmt::Write;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Largest packet: must be what the receiver was built for.
const MTU: usize = 1024;

/// A receiver that reports at all reports this often.
const SILENT: Duration = Duration::from_secs(2);

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs stream heart.dibs heart.pc2 --to serial:/dev/ttyUSB0@921600 --quantise --partial 0.05 --loop
  dibs stream heart.dibs heart.pc2 --to tcp:192.168.1.20:5000 --rate 40
  dibs stream heart.dibs heart.pc2 --to udp:192.168.1.20:5000 --rate 1000 --modes
  dibs stream heart.ply heart.pc2 --to unix:/tmp/uart --frames 100 --json

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
    let settings =
        Settings { quantised: args.quantise, partial: args.partial, ..Settings::default() };
    let line = args.to.open().map_err(|error| anyhow!("{error}"))?;
    let mut sender = Sender::<Line, MTU>::new(line, order, settings);

    let mut display = Display::new();
    let interval = Duration::from_secs_f64(1.0 / rate);
    let mut due = Instant::now();
    let mut late = 0_u64;
    let ends = if args.repeat { u64::MAX } else { motion.frames.len() as u64 };
    for number in
        0..args.frames.unwrap_or(ends).min(if args.frames.is_some() { u64::MAX } else { ends })
    {
        wait(&mut sender, due, args.window)?;
        let now = Instant::now();
        if now > due + interval {
            // The line is slower than the motion: go on from here, do not pile up.
            late += 1;
            due = now;
        }
        due += interval;
        let frame = (number % motion.frames.len() as u64) as usize;
        let sent = match &weights {
            Some(weights) => {
                sender.prepare_weights(&weights[frame]).and_then(|frame| sender.transmit(frame))
            }
            None => sender.send(&motion.frames[frame]),
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
    print(&sender, late, args.json);
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
fn wait(sender: &mut Sender<Line, MTU>, due: Instant, window: u32) -> Result<()> {
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

/// What happens, as it happens: one line on a terminal, a line a second elsewhere.
struct Display {
    bar: ProgressBar,
    last: Instant,
}

impl Display {
    fn new() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{spinner} {wide_msg}") {
            bar.set_style(style);
        }
        Self { bar, last: Instant::now() }
    }

    fn show(&mut self, sender: &Sender<Line, MTU>, sent: &Sent) {
        let pause = Duration::from_millis(if std::io::stderr().is_terminal() { 100 } else { 1000 });
        if self.last.elapsed() < pause {
            return;
        }
        self.last = Instant::now();
        let text = line(sender, sent);
        if std::io::stderr().is_terminal() {
            self.bar.set_message(text);
            self.bar.tick();
        } else {
            eprintln!("{text}");
        }
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

fn line(sender: &Sender<Line, MTU>, sent: &Sent) -> String {
    let kind = match sent.content {
        Content::Whole => "whole, of vertices:",
        Content::Modal => "modal, of weights:",
        _ => "partial, of vertices:",
    };
    let Sent { epoch, bytes, rows, .. } = sent;
    let mut text = format!("frame {epoch}: {bytes} bytes, {kind} {rows}");
    match (sender.status(), sender.acknowledged()) {
        (None, _) => text += "; no status from the receiver yet",
        (Some(_), None) => text += "; nothing published yet",
        (Some(status), Some(newest)) => {
            let published = status.published;
            let age = published.map_or(0, |p| p.age_ms);
            let _ = write!(text, "; published {newest}, {age} ms old");
            if let Some(stretch) = published.and_then(|p| p.stretch) {
                let _ = write!(text, ", stretch {stretch:.3}");
            }
        }
    }
    let safety = sender.status().map_or("", |status| match status.safety {
        1 => ", nominal",
        2 => ", degraded",
        3 => ", SAFE",
        _ => "",
    });
    text += safety;
    let rejected = sender.counters().rejected();
    if rejected > 0 {
        let _ = write!(text, "; {rejected} rejected: {}", causes(sender.counters()).join(", "));
    }
    text
}

/// The causes of rejection that have occurred, with their counts.
fn causes(counters: &Counters) -> Vec<String> {
    Event::ALL
        .into_iter()
        .filter(|&event| event.is_rejection() && counters.of(event) > 0)
        .map(|event| format!("{} {event}", counters.of(event)))
        .collect()
}

fn print(sender: &Sender<Line, MTU>, late: u64, json: bool) {
    let totals = sender.totals();
    let per_frame = totals.bytes as f64 / totals.frames.max(1) as f64;
    let (published, rejected) =
        (sender.counters().of(Event::Published), sender.counters().rejected());
    if json {
        let causes: serde_json::Map<String, serde_json::Value> = Event::ALL
            .into_iter()
            .filter(|event| event.is_rejection())
            .map(|event| (event.name().to_owned(), sender.counters().of(event).into()))
            .collect();
        println!(
            "{:#}",
            serde_json::json!({
                "frames": totals.frames,
                "partial": totals.partial,
                "packets": totals.packets,
                "bytes": totals.bytes,
                "bytes_per_frame": per_frame,
                "late": late,
                "statuses": totals.statuses,
                "acknowledged": sender.acknowledged(),
                "published": published,
                "rejected": causes,
            })
        );
        return;
    }
    println!(
        "sent      {} frames, {} of them partial; {} packets, {per_frame:.0} bytes a frame",
        totals.frames, totals.partial, totals.packets
    );
    if late > 0 {
        println!("late      {late} frames: the line is slower than the motion");
    }
    if totals.statuses == 0 {
        println!("receiver  no status came back");
        return;
    }
    let newest = sender.acknowledged().map_or("none of these".to_owned(), |n| n.to_string());
    println!("receiver  published {published} since its start, the newest {newest}");
    if rejected > 0 {
        println!("rejected  {rejected}: {}", causes(sender.counters()).join(", "));
    }
}
