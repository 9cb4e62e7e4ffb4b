//! What the thread that reads a peer and the one that sends to the receiver tell each other.

use super::message;
use serde_json::{Value, json};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Between two statuses that say the same.
const STATUS: Duration = Duration::from_secs(1);

/// Least time between two notes.
const NOTE: Duration = Duration::from_secs(1);

/// The name of this device in messages to the peer.
const DEVICE: &str = "dibs";

/// Codes of STATUS.
const OK: u16 = 1;
const CONFIGURATION: u16 = 10;
const NOT_READY: u16 = 13;

/// Why a message was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    Checksum,
    /// Its content is not as the protocol has it, or larger than any of this surface.
    Layout,
    /// Its triangles are not the tree's.
    Topology,
    /// Its positions are no frame of the tree's surface.
    Frame,
}

impl Cause {
    const ALL: [Self; 4] = [Self::Checksum, Self::Layout, Self::Topology, Self::Frame];

    const fn name(self) -> &'static str {
        match self {
            Self::Checksum => "checksum",
            Self::Layout => "layout",
            Self::Topology => "topology",
            Self::Frame => "frame",
        }
    }
}

/// What the receiver reports.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Whether it has a surface, and acts on it.
    pub is_ready: bool,
    pub text: String,
}

#[derive(Default)]
pub struct Exchange(Mutex<State>);

#[derive(Default)]
struct State {
    connections: u64,
    messages: u64,
    /// Messages of other types and devices.
    passed: u64,
    refused: [u64; Cause::ALL.len()],
    broken: u64,
    /// What is wrong with the last message.
    refusal: Option<(Cause, String)>,
    note: Option<String>,
    noted: Option<Instant>,
    report: Option<Report>,
    /// The code of the last status, and its time.
    reported: Option<(u16, Instant)>,
}

impl Exchange {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn connected(&self) {
        let mut state = self.state();
        state.connections += 1;
        // A new peer is told how things stand.
        state.reported = None;
    }

    /// The connection broke inside of a message.
    pub fn broken(&self, note: String) {
        let mut state = self.state();
        state.broken += 1;
        state.tell(note);
    }

    pub fn passed(&self) {
        let mut state = self.state();
        state.messages += 1;
        state.passed += 1;
    }

    pub fn accepted(&self) {
        let mut state = self.state();
        state.messages += 1;
        state.refusal = None;
    }

    /// Counts a message that is refused, and tells of it if the last one was not for the same cause.
    pub fn refused(&self, cause: Cause, text: String) {
        let mut state = self.state();
        state.messages += 1;
        state.refused[cause as usize] += 1;
        if state.refusal.as_ref().is_none_or(|(last, _)| *last != cause) {
            state.tell(text.clone());
        }
        state.refusal = Some((cause, text));
    }

    /// Takes the note that waits to be shown.
    pub fn note(&self) -> Option<String> {
        self.state().note.take()
    }

    pub fn report(&self, report: Report) {
        self.state().report = Some(report);
    }

    /// A STATUS message, when its code has changed and once a second.
    pub fn status_due(&self) -> Option<Vec<u8>> {
        let mut state = self.state();
        let (code, name, text) = match (&state.refusal, &state.report) {
            (Some((cause, text)), _) => (CONFIGURATION, cause.name(), text.clone()),
            (None, None) => (NOT_READY, "receiver", "no status from the receiver yet".to_owned()),
            (None, Some(report)) if report.is_ready => (OK, "", report.text.clone()),
            (None, Some(report)) => (NOT_READY, "receiver", report.text.clone()),
        };
        let is_same = |(last, at): (u16, Instant)| last == code && at.elapsed() < STATUS;
        if state.reported.is_some_and(is_same) {
            return None;
        }
        state.reported = Some((code, Instant::now()));
        let mut body = code.to_be_bytes().to_vec();
        body.extend([0; 8]);
        body.extend(name.bytes().chain(std::iter::repeat(0)).take(20));
        body.extend(text.bytes().chain([0]));
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Some(message::pack("STATUS", DEVICE, now.as_secs_f64(), &body))
    }

    pub fn json(&self) -> Value {
        let state = self.state();
        let refused: serde_json::Map<_, _> = Cause::ALL
            .map(|cause| (cause.name().to_owned(), state.refused[cause as usize].into()))
            .into_iter()
            .collect();
        json!({
            "connections": state.connections,
            "messages": state.messages,
            "passed": state.passed,
            "refused": refused,
            "broken": state.broken,
        })
    }

    pub fn text(&self) -> String {
        let state = self.state();
        let refused = Cause::ALL.map(|cause| (cause, state.refused[cause as usize]));
        let refused = refused.iter().filter(|(_, count)| *count > 0);
        let refused: Vec<_> =
            refused.map(|(cause, count)| format!("{count} for their {}", cause.name())).collect();
        let mut text = format!(
            "{} connections, {} messages, {} of them of other types or devices",
            state.connections, state.messages, state.passed
        );
        if !refused.is_empty() {
            text += &format!("; refused {}", refused.join(", "));
        }
        if state.broken > 0 {
            text += &format!("; {} connections broke", state.broken);
        }
        text
    }
}

impl State {
    fn tell(&mut self, note: String) {
        if self.noted.is_none_or(|at| at.elapsed() >= NOTE) {
            self.noted = Some(Instant::now());
            self.note = Some(note);
        }
    }
}
