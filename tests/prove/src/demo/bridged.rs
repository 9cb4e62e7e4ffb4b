//! Every frame of a bridge must be published or refused on the board, and every packet counted.

use std::collections::BTreeMap;

use dibs_nostd::wire::Event;
use serde_json::Value;

use super::bus::Bus;

/// A run of `dibs bridge`.
pub struct Bridged<'a> {
    /// Frames of the source.
    pub sent: u32,
    /// Packets that the board received.
    pub received: u32,
    /// Ticks of the run.
    pub ticks: u32,
    /// The board's counters.
    pub events: &'a BTreeMap<&'static str, u32>,
    /// What the program printed.
    pub totals: &'a Value,
}

impl Bridged<'_> {
    /// What does not add up, a sentence each.
    ///
    /// The program keeps this computer's time, the emulated board a slower one. So frames bunch up, and one that begins
    /// while the last is checked is refused; and by the board's time the program states too great ages, so that one may
    /// seem to be of an earlier capture than the published one.
    pub fn broken(&self) -> Vec<String> {
        let of = |event: Event| self.events.get(event.name()).copied().unwrap_or(0);
        let published = of(Event::Published);
        let mut broken = Vec::new();
        let begins = of(Event::Busy) + of(Event::Stale);
        let refused = begins + of(Event::Abandoned) + of(Event::TooFast);
        let total = |name: &str| self.totals[name].as_u64().unwrap_or(0) as u32;
        let size = (total("packets") / total("frames").max(1)).max(1);
        // Packets arrive in their order, a lost one is a gap, and heartbeats are no part of a frame; the last of them may
        // have come between the two counts.
        let parts = self.received.saturating_sub(of(Event::Heartbeat));
        let begun = parts.div_ceil(size);
        let certain = parts.saturating_sub(1).div_ceil(size);
        // The last frame may be incomplete or in its check.
        let ended = published + refused;
        if ended > begun || ended + 1 < certain {
            broken.push(format!(
                "of {begun} frames that arrived {published} were published and {refused} refused"
            ));
        }
        // Where the run ends, frames wait for room in the board's buffer, none for as long as makes a surface too old.
        let waiting = self.sent.saturating_sub(begun);
        let age = Bus::Bridge.trust().age.1;
        if u64::from(waiting) * u64::from(self.ticks) > u64::from(age) * u64::from(self.sent) {
            broken.push(format!("{waiting} of {} frames did not arrive", self.sent));
        }
        // A refused begin leaves the other packets of its frame; a frame that is found too fast while it arrives leaves those
        // that were to come. So a stale packet that begins no frame is not taken for a refused one.
        let others = size - 1;
        let (left, expected) = (of(Event::Unexpected), begins * others);
        let unknown = (1 + of(Event::TooFast)) * others;
        if left.abs_diff(expected) > unknown {
            broken.push(format!(
                "{left} packets of no frame, where {begins} refused begins leave {expected}"
            ));
        }
        let heard = [Event::Heartbeat, Event::Published, Event::Duplicate, Event::Throttled];
        let all: u32 = self.events.values().sum();
        let known = refused + left + heard.into_iter().map(of).sum::<u32>();
        if known != all {
            broken.push(format!("{} rejections of another cause", all - known));
        }
        broken
    }
}
