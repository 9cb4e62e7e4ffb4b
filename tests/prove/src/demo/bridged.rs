//! Every frame of a bridge must be published or refused on the board, and every packet counted.

use std::collections::BTreeMap;

use dibs_nostd::wire::Event;
use serde_json::Value;

/// A run of `dibs bridge`.
pub struct Bridged<'a> {
    /// Frames of the source.
    pub sent: u32,
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
        let (sent, published) = (self.sent, of(Event::Published));
        let mut broken = Vec::new();
        let begins = of(Event::Busy) + of(Event::Stale);
        let refused = begins + of(Event::Abandoned) + of(Event::TooFast);
        // The last frame may have been in flight when the run ended.
        let ended = published + refused;
        if ended != sent && ended + 1 != sent {
            broken
                .push(format!("of {sent} frames {published} were published and {refused} refused"));
        }
        // A refused begin leaves the other packets of its frame; a frame that is found too fast while it arrives leaves those
        // that were to come. So a stale packet that begins no frame is not taken for a refused one.
        let total = |name: &str| self.totals[name].as_u64().unwrap_or(0);
        let others = (total("packets") / total("frames").max(1)).saturating_sub(1);
        let (left, expected) = (of(Event::Unexpected), u64::from(begins) * others);
        let unknown = (1 + u64::from(of(Event::TooFast))) * others;
        if u64::from(left).abs_diff(expected) > unknown {
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
