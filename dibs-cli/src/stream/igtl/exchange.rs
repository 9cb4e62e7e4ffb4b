//! The state shared by two threads: one reads a peer, the other sends to the receiver.

use super::message;
use super::tool::SentSurface;
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Time between two equal statuses; and between any two.
const STATUS: Duration = Duration::from_secs(1);
const BETWEEN: Duration = Duration::from_millis(100);

/// Largest number of queued notes.
const NOTES: usize = 8;

/// Least time between two notes.
const NOTE: Duration = Duration::from_secs(1);

/// The device name in messages to the peer.
const DEVICE: &str = "dibs";

/// Codes of STATUS messages.
const OK: u16 = 1;
const CHECKSUM: u16 = 9;
const CONFIGURATION: u16 = 10;
const NOT_READY: u16 = 13;

/// Why a message was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    Checksum,
    /// Its content violates the protocol, or is larger than any of this surface.
    Layout,
    /// Its triangles are not those of the tree.
    Topology,
    /// Its positions are not a frame of the tree's surface.
    Frame,
    /// Its pose is not a rigid one, or its frame has no pose.
    Pose,
}

impl Cause {
    const ALL: [Self; 5] = [Self::Checksum, Self::Layout, Self::Topology, Self::Frame, Self::Pose];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Checksum => "checksum",
            Self::Layout => "layout",
            Self::Topology => "topology",
            Self::Frame => "frame",
            Self::Pose => "pose",
        }
    }
}

/// What the receiver reports.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Whether it has a published surface that is not too old to act on.
    pub is_ready: bool,
    pub text: String,
}

#[derive(Default)]
pub struct Exchange(Mutex<State>);

#[derive(Default)]
struct State {
    connections: u64,
    messages: u64,
    /// Number of messages whose pose was accepted.
    poses: u64,
    /// Number of messages of other types or devices.
    passed: u64,
    /// Whether a note has reported another device with positions.
    has_other: bool,
    /// Number of messages with a frame and without a time.
    timeless: u64,
    refused: [u64; Cause::ALL.len()],
    broken: u64,
    /// Cause of the last message's refusal; `None` if it was accepted.
    last: Option<Cause>,
    /// The refusal to report to the peer, and whether it was reported.
    refusal: Option<(Cause, String)>,
    is_told: bool,
    notes: VecDeque<String>,
    noted: Option<Instant>,
    report: Option<Report>,
    /// The code of the last status, and its time.
    reported: Option<(u16, Instant)>,
    sent: Option<Arc<SentSurface>>,
}

impl Exchange {
    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn connected(&self) {
        let mut state = self.state();
        state.connections += 1;
        // A new peer gets a status at once.
        state.reported = None;
    }

    /// Records that the connection broke within a message.
    pub fn broken(&self, note: String) {
        let mut state = self.state();
        state.broken += 1;
        state.tell(note);
    }

    /// Counts a message of another type or device; the first time a note reports it.
    pub fn passed(&self, note: Option<String>) {
        let mut state = self.state();
        state.messages += 1;
        state.passed += 1;
        if let Some(note) = note.filter(|_| !state.has_other) {
            state.has_other = state.tell(note);
        }
    }

    /// Counts a message whose frame is accepted.
    pub fn accepted(&self, has_time: bool) {
        let mut state = self.state();
        state.messages += 1;
        state.last = None;
        if state.is_told {
            state.refusal = None;
        }
        if !has_time {
            if state.timeless == 0 {
                state.tell("messages without a time: how long they wait is not seen".to_owned());
            }
            state.timeless += 1;
        }
    }

    /// Counts a message whose pose is accepted.
    pub fn posed(&self) {
        let mut state = self.state();
        state.messages += 1;
        state.poses += 1;
    }

    /// Queues a note.
    pub fn tell(&self, note: String) {
        self.state().tell(note);
    }

    /// Counts a refused message; a note reports it unless the last message was refused for the same cause.
    pub fn refused(&self, cause: Cause, text: String) {
        let mut state = self.state();
        state.messages += 1;
        state.refused[cause as usize] += 1;
        if state.last != Some(cause) {
            state.tell(text.clone());
        }
        state.last = Some(cause);
        // Of several refusals between two statuses the first is reported: the others follow from it, or recur.
        if state.refusal.is_none() || state.is_told {
            (state.refusal, state.is_told) = (Some((cause, text)), false);
        }
    }

    /// Removes the next note from the queue, once it is due.
    pub fn note(&self) -> Option<String> {
        let mut state = self.state();
        if state.noted.is_some_and(|at| at.elapsed() < NOTE) {
            return None;
        }
        let note = state.notes.pop_front()?;
        state.noted = Some(Instant::now());
        Some(note)
    }

    /// Removes the notes that are left at the end.
    pub fn notes(&self) -> VecDeque<String> {
        std::mem::take(&mut self.state().notes)
    }

    pub fn report(&self, report: Report) {
        self.state().report = Some(report);
    }

    /// A STATUS message, when its code has changed and once a second.
    pub fn status_due(&self) -> Option<Vec<u8>> {
        let mut state = self.state();
        let (code, name, text) = match (&state.refusal, &state.report) {
            (Some((Cause::Checksum, text)), _) => (CHECKSUM, Cause::Checksum.name(), text.clone()),
            (Some((cause, text)), _) => (CONFIGURATION, cause.name(), text.clone()),
            (None, None) => (NOT_READY, "receiver", "no status from the receiver yet".to_owned()),
            (None, Some(report)) if report.is_ready => (OK, "", report.text.clone()),
            (None, Some(report)) => (NOT_READY, "receiver", report.text.clone()),
        };
        let is_early =
            |(last, at): (u16, Instant)| at.elapsed() < if last == code { STATUS } else { BETWEEN };
        if state.reported.is_some_and(is_early) {
            return None;
        }
        state.reported = Some((code, Instant::now()));
        state.is_told = true;
        if state.last.is_none() {
            state.refusal = None;
        }
        let mut body = code.to_be_bytes().to_vec();
        body.extend([0; 8]);
        body.extend(name.bytes().chain(std::iter::repeat(0)).take(20));
        body.extend(text.bytes().chain([0]));
        Some(message::pack("STATUS", DEVICE, now(), &body))
    }

    /// Keeps the frame that was sent last, for answers about a tool.
    pub fn keep(&self, sent: SentSurface) {
        self.state().sent = Some(Arc::new(sent));
    }

    pub fn sent(&self) -> Option<Arc<SentSurface>> {
        self.state().sent.clone()
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
            "poses": state.poses,
            "passed": state.passed,
            "without_time": state.timeless,
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
        if state.timeless > 0 {
            text += &format!("; {} without a time", state.timeless);
        }
        if state.broken > 0 {
            text += &format!("; {} connections broke", state.broken);
        }
        text
    }
}

/// Seconds since 1970.
pub fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64()
}

impl State {
    /// Returns whether there was room.
    fn tell(&mut self, note: String) -> bool {
        let has_room = self.notes.len() < NOTES;
        if has_room && !self.notes.contains(&note) {
            self.notes.push_back(note);
        }
        has_room
    }
}

#[cfg(test)]
mod tests {
    use super::Exchange;

    /// Notes that arrive faster than they are shown are queued, each once.
    #[test]
    fn notes_wait_for_their_turn() {
        let exchange = Exchange::default();
        for note in ["one", "two", "two", "three"] {
            exchange.tell(note.to_owned());
        }
        assert_eq!(exchange.note().as_deref(), Some("one"));
        assert_eq!(exchange.note(), None, "within a second");
        assert_eq!(exchange.notes(), ["two", "three"]);
        assert!(exchange.notes().is_empty());
    }
}
