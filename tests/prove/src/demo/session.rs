//! One run: the controller as a child process, a sender, a listener and a checker.

use std::fs::File;
use std::io::Read;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::Child;
use std::sync::atomic::Ordering;
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use controller::TICK_RATE;
use controller::telemetry::{MAX_FRAMED, Network, Push, Record, Summary, Tick};
use dibs_nostd::wire::Deframer;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;
use xtask::process::shown;
use xtask::{qemu, workspace};

use super::bridge;
use super::bus::{Bus, Feed, Opened};
use super::check::{Checked, Compared, check, compare};
use super::contacts::Touches;
use super::debugger::{Bits, flip};
use super::faults::{Faults, Plan};
use super::hand::Hand;
use super::machine::Machine;
use super::robot::Robot;
use super::scene::Scene;
use super::sender::{Link, send};
use super::steps::Steps;

/// Real time that a connected controller may be silent.
const SILENCE: Duration = Duration::from_secs(30);

/// Disturbances of a run.
#[derive(Clone, Copy)]
pub enum Harm {
    Nothing,
    /// Faults on the bus.
    Bus(Plan),
    /// Bits of the board's memory that are flipped as soon as a frame is published.
    Memory(Bits),
    /// A flood of Ethernet frames, generated from this seed.
    Flood(u64),
}

/// The results of a run.
pub struct Outcome {
    pub bus: Bus,
    /// The record of every tick.
    pub ticks: Vec<Tick>,
    /// The network's figures, if the bus is Ethernet.
    pub network: Option<Network>,
    pub summary: Summary,
    /// The check of every answer.
    pub checked: Vec<Checked>,
    /// The comparison of every published frame.
    pub compared: Vec<Compared>,
    /// For a scripted instrument: the force's steps at new frames, and all contacts of every tick.
    pub path: Option<(Steps, Touches)>,
    /// Results of an instrument that a hand pushes.
    pub hand: Option<Hand>,
    /// The faults on the bus, if any.
    pub faults: Option<Faults>,
    /// Number of frames sent by a flood.
    pub flood: u64,
    /// The totals of `dibs bridge`, if frames came through it.
    pub bridge: Option<Value>,
    /// The last known tick when memory was changed, if it was.
    pub flipped_at: Option<u32>,
    /// Ticks requested.
    pub ticks_asked: u32,
    /// Number of completely sent frames.
    pub frames_sent: u32,
    /// Whether the controller ended with success.
    pub exited_well: bool,
    pub command: String,
    /// Real time that the run took.
    pub took: Duration,
}

/// Runs the controller for `seconds` of its time.
pub fn run(
    scene: &Scene,
    machine: &Machine,
    seconds: u32,
    harm: &Harm,
    folder: &Path,
) -> Result<Outcome> {
    let faults = match harm {
        Harm::Bus(plan) => Some(plan),
        Harm::Nothing | Harm::Memory(_) | Harm::Flood(_) => None,
    };
    let ticks_asked = seconds * TICK_RATE;
    let sockets = tempfile::tempdir()?;
    let telemetry_path = sockets.path().join("telemetry");
    let (bus, flood) = match harm {
        Harm::Flood(seed) => {
            let (bus, wire) = Opened::wire()?;
            (bus, Some((wire, *seed)))
        }
        Harm::Nothing | Harm::Bus(_) | Harm::Memory(_) => {
            (machine.bus().open(sockets.path())?, None)
        }
    };
    let telemetry_socket = UnixListener::bind(&telemetry_path)?;

    let mut command = machine.command(&bus.end, &telemetry_path, ticks_asked);
    let debugger = match harm {
        Harm::Memory(bits) => Some((sockets.path().join("debugger"), *bits)),
        Harm::Nothing | Harm::Bus(_) | Harm::Flood(_) => None,
    };
    if let Some((socket, _)) = &debugger {
        command.arg("-gdb").arg(format!("unix:{},server=on,wait=off", socket.display()));
    }
    // As typed at the top of the repository.
    let shown = shown(&command)
        .replace(&format!("{}/", workspace::root().display()), "")
        .replace(&format!("{}/", sockets.path().display()), "");
    command.stdout(File::create(folder.join(machine.log()))?);
    let start = Instant::now();
    let mut child = Guard(command.spawn().with_context(|| format!("cannot start `{shown}`"))?);
    let link = Arc::new(Link::default());
    let feed = bus.connect(&mut child.0, &link)?;
    let telemetry = accept(&telemetry_socket, &mut child.0)?;

    let (to_check, answers) = mpsc::channel::<Tick>();
    let (listened, sent, checked, flooded) = thread::scope(|scope| {
        let flood = flood.as_ref().map(|(wire, seed)| scope.spawn(|| wire.flood(&link, *seed)));
        let sender = scope.spawn(|| match feed {
            Feed::Own(line) => Ok((send(scene, machine.bus(), &link, line, faults)?, None)),
            Feed::Bridge(port) => Ok((Vec::new(), Some(bridge::send(scene, &link, port)?))),
        });
        let checker = scope.spawn(|| {
            answers.into_iter().map(|tick| check(scene, &link, &tick)).collect::<Result<Vec<_>>>()
        });
        let debugger = debugger.as_ref().map(|(socket, bits)| (socket.as_path(), *bits));
        let listened = listen(telemetry, &link, &to_check, ticks_asked, debugger);
        link.over.store(true, Ordering::Relaxed);
        drop(to_check);
        let flooded = flood.map_or(Ok(0), |flood| joined(flood.join()));
        (listened, joined(sender.join()), joined(checker.join()), flooded)
    });
    let ended = |error: anyhow::Error| match child.0.try_wait() {
        Ok(Some(status)) => error.context(format!("the controller ended: {status}")),
        _ => error,
    };
    let Heard { ticks, pushes, network, summary, flipped_at } = listened.map_err(ended)?;
    let (injected, bridge) = sent?;
    let mut compared = Vec::new();
    for tick in &ticks {
        compare(&link, tick, &mut compared);
    }
    let checked = checked?;
    let (path, hand) = match machine.robot() {
        Robot::Script => {
            let steps = Steps::of(scene, &link, &ticks)?;
            (Some((steps, Touches::of(scene, &link, &ticks)?)), None)
        }
        Robot::Hand => (None, Some(Hand::new(scene, &link, &ticks, pushes, &checked)?)),
    };
    let status = child.0.wait()?;
    Ok(Outcome {
        bus: machine.bus(),
        ticks,
        network,
        summary,
        checked,
        compared,
        path,
        hand,
        faults: faults.map(|plan| Faults::new(plan, injected)),
        flood: flooded?,
        bridge,
        flipped_at,
        ticks_asked,
        frames_sent: link.frames_sent.load(Ordering::Relaxed),
        exited_well: status.success(),
        command: shown,
        took: start.elapsed(),
    })
}

/// Ends the controller if the run fails.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        // Both fail only if the controller has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub fn joined<T>(result: thread::Result<Result<T>>) -> Result<T> {
    result.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Waits until the controller connects.
pub fn accept(socket: &UnixListener, child: &mut Child) -> Result<UnixStream> {
    socket.set_nonblocking(true)?;
    let start = Instant::now();
    loop {
        match socket.accept() {
            Ok((stream, _)) => {
                stream.set_nonblocking(false)?;
                return Ok(stream);
            }
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => {
                if let Some(status) = child.try_wait()? {
                    bail!("the controller ended before it connected: {status}");
                }
                ensure!(start.elapsed() < SILENCE, "the controller does not connect");
                thread::sleep(Duration::from_millis(5));
            }
            Err(error) => return Err(error.into()),
        }
    }
}

/// The telemetry of a controller.
struct Heard {
    ticks: Vec<Tick>,
    pushes: Vec<Push>,
    network: Option<Network>,
    summary: Summary,
    flipped_at: Option<u32>,
}

/// Reads telemetry until the summary, and passes every answer to the checker. With a debugger, flips its bits once a
/// frame is published.
fn listen(
    mut telemetry: UnixStream,
    link: &Link,
    to_check: &mpsc::Sender<Tick>,
    ticks_asked: u32,
    debugger: Option<(&Path, Bits)>,
) -> Result<Heard> {
    telemetry.set_read_timeout(Some(SILENCE))?;
    let style = "{bar:24} {pos}/{len} ticks  {msg}";
    let bar = ProgressBar::new(ticks_asked.into()).with_style(ProgressStyle::with_template(style)?);
    let mut deframer = Deframer::<MAX_FRAMED>::new();
    let (mut ticks, mut pushes) = (Vec::new(), Vec::new());
    let (mut network, mut flipped_at) = (None, None);
    let mut buffer = [0; 4096];
    loop {
        let bytes = telemetry.read(&mut buffer).context("the controller fell silent")?;
        let last = ticks.last().map_or(0, |tick: &Tick| tick.tick);
        ensure!(bytes > 0, "no summary after tick {last} of {ticks_asked}");
        for &byte in &buffer[..bytes] {
            let Some(packet) = deframer.push(byte) else { continue };
            let record = packet.ok().and_then(Record::decode).context("damaged telemetry")?;
            match record {
                Record::Summary(summary) => {
                    bar.finish_and_clear();
                    return Ok(Heard { ticks, pushes, network, summary, flipped_at });
                }
                Record::Push(push) => pushes.push(push),
                Record::Network(record) => network = Some(record),
                Record::Tick(tick) => {
                    link.bytes.store(tick.bytes, Ordering::Relaxed);
                    link.tick.store(tick.tick, Ordering::Relaxed);
                    if let Some((socket, bits)) = debugger
                        && flipped_at.is_none()
                        && tick.frames_published > 0
                    {
                        flip(socket, bits).context("no bit was flipped")?;
                        flipped_at = Some(tick.tick);
                    }
                    if tick.is_answered() {
                        to_check.send(tick)?;
                    }
                    ticks.push(tick);
                    bar.set_position(tick.tick.into());
                    bar.set_message(line(&tick));
                }
            }
        }
    }
}

fn line(tick: &Tick) -> String {
    let instructions = u64::from(tick.query_counts) * u64::from(qemu::INSTRUCTIONS_A_COUNT);
    let epoch = tick.epoch;
    format!("frame {epoch}  separation {:6.2} mm  {instructions:6} instructions", tick.separation)
}
