//! Plays a recording to a receiver, at the recorded speed.

use super::interrupt::Interrupt;
use super::report::{self, Display, Outcome};
use super::{Args, Recording};
use anyhow::{Result, anyhow, bail};
use dibs_nostd::wire::Mac;
use dibs_stream::transport::{Line, Target};
use dibs_stream::{Pace, SendError, Sender};
use std::time::{Duration, Instant};

/// A receiver without a status for this long does not report.
const SILENT: Duration = Duration::from_secs(2);

/// A datagram that nobody takes comes back within this time.
const REFUSAL: Duration = Duration::from_millis(100);

/// Datagrams that came back so long before the end were sent before the receiver started: not every one comes back.
const RECENT: Duration = Duration::from_millis(1500);

/// Between two attempts to connect.
const ATTEMPT: Duration = Duration::from_millis(200);

/// Longest time over which a frame's packets are spread: a slow recording's frames need not arrive later than that.
const SPREAD: Duration = Duration::from_millis(50);

/// Time between two polls.
const GLANCE: Duration = Duration::from_millis(2);

pub struct Player<'a, const MTU: usize, M> {
    args: &'a Args,
    recording: &'a Recording,
    sender: Sender<Line, MTU, M>,
    interrupt: Interrupt,
    /// From one frame to the next.
    interval: Duration,
    /// Time over which a frame's packets are spread.
    spread: Duration,
    display: Display,
    outcome: Outcome,
}

impl<'a, const MTU: usize, M: Mac> Player<'a, MTU, M> {
    pub fn new(
        args: &'a Args,
        recording: &'a Recording,
        sender: Sender<Line, MTU, M>,
        interrupt: Interrupt,
    ) -> Self {
        let interval = Duration::from_secs_f64(1.0 / recording.rate);
        // Any other line holds the sender up by itself; a datagram that does not fit the receiver's buffer is lost.
        let spread = match args.to {
            Target::Udp { .. } => SPREAD.min(interval / 2),
            _ => Duration::ZERO,
        };
        let (display, outcome) = (Display::new(), Outcome::default());
        Self { args, recording, sender, interrupt, interval, spread, display, outcome }
    }

    /// Sends the frames, and prints the totals, after an interrupt too.
    pub fn run(mut self) -> Result<()> {
        self.await_challenge()?;
        let played = self.play();
        let refused = self.refused();
        self.display.finish();
        report::print(&self.sender, &self.outcome, self.args.json);
        played.and(refused)
    }

    /// An error if nothing listens at the end.
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

    /// Waits for the receiver's challenge, if tags need it.
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
        let recorded = self.recording.frames.len() as u64;
        let end = if self.args.repeat { u64::MAX } else { recorded };
        for number in 0..self.args.frames.unwrap_or(end) {
            self.wait(due)?;
            if self.interrupt.is_raised() {
                self.outcome.is_interrupted = true;
                break;
            }
            let now = Instant::now();
            if now > due + interval {
                // The line is slower than the motion: continue from now instead of catching up.
                self.outcome.late += 1;
                due = now;
            }
            due += interval;
            self.send((number % recorded) as usize)?;
        }
        // Wait for the acknowledgement of frames on their way, if the receiver acknowledges any.
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

    fn send(&mut self, frame: usize) -> Result<()> {
        let (sender, recording) = (&mut self.sender, self.recording);
        // A recorded frame counts as captured when it is due, even if the surface stands still.
        let prepared = match &recording.weights {
            Some(weights) => sender.prepare_weights_captured(&weights[frame], Duration::ZERO),
            None => sender.prepare_captured(&recording.frames[frame], Duration::ZERO),
        };
        let sent = prepared.and_then(|prepared| {
            let packets = prepared.sent().packets;
            let mut pace = Pace::new(Instant::now(), self.spread, packets);
            sender.transmit_paced(prepared, || pace.wait())
        });
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
            Err(error) => return Err(anyhow!("{}: {error}", self.recording.name)),
        }
        Ok(())
    }

    fn poll(&mut self) -> Result<()> {
        match self.sender.poll() {
            Err(SendError::Line(error)) => self.reconnect(&error),
            polled => Ok(polled?),
        }
    }

    /// Connects again, within the time that the user allows.
    fn reconnect(&mut self, error: &std::io::Error) -> Result<()> {
        // An interrupt prints the totals and is no error.
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

    /// Sends heartbeats and takes statuses until the next frame is due and fits the window.
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
