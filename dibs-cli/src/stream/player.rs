//! Sends a motion to a receiver: a recording at its rate, live frames as they arrive.

use super::igtl::{Exchange, SentSurface};
use super::interrupt::Interrupt;
use super::live::{Frame, Next, ParsedFrame};
use super::report::{self, Display, Outcome};
use super::timing::Timing;
use super::{Args, Frames, Source};
use anyhow::{Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_nostd::RigidPose;
use dibs_nostd::wire::Mac;
use dibs_stream::transport::{Line, Target};
use dibs_stream::{Pace, SendError, Sender};
use std::borrow::Cow;
use std::time::{Duration, Instant};

/// A receiver that sends no status for this long counts as silent.
const SILENT: Duration = Duration::from_secs(2);

/// A datagram that nobody receives is rejected within this time.
const REFUSAL: Duration = Duration::from_millis(100);

/// Rejections this long before the end concern datagrams sent before the receiver started; not every datagram is
/// rejected.
const RECENT: Duration = Duration::from_millis(1500);

/// Interval of attempts to connect.
const ATTEMPT: Duration = Duration::from_millis(200);

/// Longest time over which a frame's packets are spread: frames of a slow recording need not arrive any later.
const SPREAD: Duration = Duration::from_millis(50);

/// Interval of polling.
const GLANCE: Duration = Duration::from_millis(2);

pub struct Player<'a, const MTU: usize, M> {
    args: &'a Args,
    source: &'a Source,
    sender: Sender<Line, MTU, M>,
    interrupt: Interrupt,
    /// Time between two frames; zero to send them as they arrive.
    interval: Duration,
    display: Display,
    outcome: Outcome,
    /// Number of the receiver's statuses, and the time of the last one.
    heard: (u64, Instant),
}

/// The content of a frame that is sent.
enum Rows<'a> {
    Positions(Cow<'a, [Vec3]>, Option<RigidPose>),
    Weights(&'a [f32]),
}

/// A frame that is due.
struct Due<'a> {
    rows: Rows<'a>,
    /// Time since its capture.
    ago: Duration,
    /// Time until the next frame, as far as known.
    period: Duration,
    /// Arrival time of its last byte, for a live source.
    came: Option<Instant>,
}

impl<'a, const MTU: usize, M: Mac> Player<'a, MTU, M> {
    pub fn new(
        args: &'a Args,
        source: &'a Source,
        sender: Sender<Line, MTU, M>,
        interrupt: Interrupt,
    ) -> Self {
        let interval =
            source.rate.map_or(Duration::ZERO, |rate| Duration::from_secs_f64(1.0 / rate));
        let (display, outcome) = (Display::new(), Outcome::default());
        let heard = (0, Instant::now());
        Self { args, source, sender, interrupt, interval, display, outcome, heard }
    }

    /// Sends the frames, and prints the totals, even after an interrupt.
    pub fn run(mut self) -> Result<()> {
        self.await_challenge()?;
        let played = self.play();
        let refused = self.refused();
        let exchange = match &self.source.frames {
            Frames::Live { exchange, .. } => exchange.as_deref(),
            Frames::Recorded { .. } => None,
        };
        for note in exchange.into_iter().flat_map(Exchange::notes) {
            self.display.note(&note);
        }
        self.display.finish();
        let totals = report::totals(&self.sender, &self.outcome, exchange, self.args.json);
        // Beside the answers about a tool the totals are no results.
        if self.args.tool.is_some() {
            eprintln!("{totals}");
        } else {
            println!("{totals}");
        }
        played.and(refused)
    }

    /// Fails if nothing listens at the end.
    fn refused(&mut self) -> Result<()> {
        let is_heard = self.sender.totals().statuses > 0 && self.sender.in_flight() == 0;
        if !matches!(self.args.to, Target::Udp { .. }) || is_heard {
            return Ok(());
        }
        let end = Instant::now();
        if !self.outcome.is_interrupted {
            std::thread::sleep(REFUSAL);
        }
        let refusals = self.sender.transport().refusals();
        self.outcome.refused = refusals.count;
        if refusals.last.is_some_and(|last| last + RECENT > end) {
            bail!(
                "{}: nothing listens there ({} datagrams came back); is the receiver running, and the address right?",
                self.args.to,
                refusals.count
            );
        }
        Ok(())
    }

    /// Waits for the receiver's challenge if tags are used.
    fn await_challenge(&mut self) -> Result<()> {
        let (start, to) = (Instant::now(), &self.args.to);
        while !self.sender.is_ready() && !self.interrupt.is_raised() {
            if start.elapsed() > SILENT {
                bail!(
                    "{to}: no genuine status came within {} s: is the receiver on, and has it the same \
                     key? One that cannot report needs --challenge",
                    SILENT.as_secs()
                );
            }
            match self.sender.poll() {
                Err(_) if self.interrupt.is_raised() => (),
                polled => polled?,
            }
            std::thread::sleep(GLANCE);
        }
        Ok(())
    }

    /// Sends each frame when it is due.
    fn play(&mut self) -> Result<()> {
        let interval = self.interval;
        let mut due = Instant::now();
        let end = match &self.source.frames {
            Frames::Recorded { positions, .. } if !self.args.repeat => positions.len() as u64,
            _ => u64::MAX,
        };
        for number in 0..self.args.frames.unwrap_or(end) {
            self.wait(due)?;
            let now = Instant::now();
            if !interval.is_zero() && now > due + interval {
                // The line is slower than the motion: continue from now instead of catching up.
                self.outcome.late += 1;
                due = now;
            }
            let frame = self.next(number, &mut due)?;
            if self.interrupt.is_raised() {
                self.outcome.is_interrupted = true;
                break;
            }
            let Some(frame) = frame else { break };
            due += interval;
            self.send(&frame)?;
        }
        if let Some(timing) = &mut self.outcome.timing {
            timing.end();
        }
        // Wait for the acknowledgement of frames in flight, if the receiver acknowledges any.
        let end = Instant::now();
        while self.sender.in_flight() > 0
            && self.sender.status().is_some()
            && end.elapsed() < SILENT
            && !self.interrupt.is_raised()
        {
            self.poll()?;
            std::thread::sleep(GLANCE);
        }
        Ok(())
    }

    /// The next frame to send; a live frame is due when it arrives. `None` after the last frame and after an interrupt.
    fn next(&mut self, number: u64, due: &mut Instant) -> Result<Option<Due<'a>>> {
        let period = self.interval;
        let is_due_when_it_came;
        let live = match &self.source.frames {
            Frames::Recorded { positions, weights } => {
                let at = (number % positions.len() as u64) as usize;
                let rows = match weights {
                    Some(weights) => Rows::Weights(&weights[at]),
                    None => Rows::Positions(Cow::Borrowed(&positions[at]), None),
                };
                // A recorded frame counts as captured when it is due, even if the surface does not move.
                return Ok(Some(Due { rows, ago: Duration::ZERO, period, came: None }));
            }
            Frames::Live { live, exchange } => {
                is_due_when_it_came = exchange.is_some();
                live
            }
        };
        while !self.interrupt.is_raised() {
            match live.next(GLANCE)? {
                Next::Frame(Frame { parsed: ParsedFrame { positions, pose, came, age }, gap }) => {
                    *due = came.max(*due);
                    self.outcome.passed_over = live.passed_over();
                    let rows = Rows::Positions(Cow::Owned(positions), pose);
                    // Frames of a program that prints faster than the rate are due later, so their waiting is no age.
                    let is_waiting = period.is_zero() || is_due_when_it_came;
                    let waited = if is_waiting { came.elapsed() } else { Duration::ZERO };
                    let period = if period.is_zero() { gap } else { period };
                    return Ok(Some(Due { rows, ago: age + waited, period, came: Some(came) }));
                }
                Next::Later => self.poll()?,
                Next::End => break,
            }
        }
        Ok(None)
    }

    fn send(&mut self, frame: &Due<'_>) -> Result<()> {
        // Any other line blocks until it has room; a datagram that does not fit in the receiver's buffer is lost.
        let spread = match self.args.to {
            Target::Udp { .. } if !self.args.at_once => SPREAD.min(frame.period / 2),
            _ => Duration::ZERO,
        };
        let (at, sender) = (Instant::now(), &mut self.sender);
        let prepared = match &frame.rows {
            Rows::Weights(weights) => sender.prepare_weights_captured(weights, frame.ago),
            Rows::Positions(positions, None) => sender.prepare_captured(positions, frame.ago),
            Rows::Positions(positions, Some(pose)) => {
                sender.prepare_at(positions, *pose, frame.ago)
            }
        };
        let sent = prepared.and_then(|prepared| {
            let packets = prepared.sent().packets;
            let mut pace = Pace::new(Instant::now(), spread, packets);
            sender.transmit_paced(prepared, || pace.wait())
        });
        if let (Ok(_), Some(came)) = (&sent, frame.came) {
            self.outcome.timing.get_or_insert_with(Timing::new).count(came);
        }
        if let (
            Ok(_),
            Rows::Positions(positions, pose),
            Frames::Live { exchange: Some(exchange), .. },
        ) = (&sent, &frame.rows, &self.source.frames)
            && self.args.tool.is_some()
        {
            let (positions, ago) = (positions.to_vec(), frame.ago);
            exchange.keep(SentSurface { positions, pose: *pose, at, ago });
        }
        match sent {
            Ok(sent) => {
                let refused = self.sender.transport().refusals().count;
                if refused > 0 && self.outcome.refused == 0 {
                    let text =
                        format!("{}: nothing listens there yet: datagrams come back", self.args.to);
                    self.display.note(&text);
                }
                self.outcome.refused = refused;
                self.display.show(&self.sender, &sent);
            }
            Err(SendError::Line(error)) => self.reconnect(&error)?,
            Err(error) => return Err(anyhow!("{}: {error}", self.source.name)),
        }
        Ok(())
    }

    fn poll(&mut self) -> Result<()> {
        if let Frames::Live { exchange: Some(exchange), .. } = &self.source.frames {
            if let Some(note) = exchange.note() {
                self.display.note(&note);
            }
            let statuses = self.sender.totals().statuses;
            if statuses != self.heard.0 {
                self.heard = (statuses, Instant::now());
            }
            if let Some(mut report) = report::receiver(&self.sender) {
                let silence = self.heard.1.elapsed();
                if silence > SILENT {
                    report.is_ready = false;
                    report.text =
                        format!("no status from the receiver for {} s", silence.as_secs());
                }
                exchange.report(report);
            }
        }
        match self.sender.poll() {
            Err(SendError::Line(error)) => self.reconnect(&error),
            polled => Ok(polled?),
        }
    }

    /// Reconnects, within the time that the user allows.
    fn reconnect(&mut self, error: &std::io::Error) -> Result<()> {
        // An interrupt prints the totals and is not an error.
        if self.interrupt.is_raised() {
            return Ok(());
        }
        let (start, to) = (Instant::now(), &self.args.to);
        let patience = Duration::from_secs(self.args.retry);
        eprintln!("{to}: the connection broke ({error})");
        while start.elapsed() < patience && !self.interrupt.is_raised() {
            let target = to.clone();
            if let Some(Ok(line)) = self.interrupt.unless_raised(move || target.open()) {
                drop(self.sender.reconnect(line.until(self.interrupt.flag())));
                self.outcome.reconnections += 1;
                eprintln!("{to}: connected again");
                return Ok(());
            }
            std::thread::sleep(ATTEMPT);
        }
        if self.interrupt.is_raised() {
            return Ok(());
        }
        bail!(
            "{to}: the connection broke ({error}), and did not come back within {} s",
            self.args.retry
        )
    }

    /// Sends heartbeats and receives statuses until the next frame is due and fits in the window.
    fn wait(&mut self, due: Instant) -> Result<()> {
        let mut heard = (self.sender.totals().statuses, Instant::now());
        loop {
            self.poll()?;
            let statuses = self.sender.totals().statuses;
            if statuses != heard.0 {
                heard = (statuses, Instant::now());
            }
            let now = Instant::now();
            let reports = statuses > 0 && now < heard.1 + SILENT;
            let is_full = reports && self.sender.in_flight() >= self.args.window;
            if self.interrupt.is_raised() || now >= due && !is_full {
                return Ok(());
            }
            if now >= due + SILENT {
                // The receiver reports but acknowledges nothing: warn, and try another frame.
                self.display.warn(&self.sender);
                return Ok(());
            }
            std::thread::sleep(
                Duration::from_millis(1)
                    .min(due.saturating_duration_since(now))
                    .max(Duration::from_micros(100)),
            );
        }
    }
}
