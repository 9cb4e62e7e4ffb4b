//! A bridge's account of the demo notices a lost frame behind refusals of another kind.

// Requirement: B-09

use std::collections::BTreeMap;

use dibs_nostd::wire::Event;
use dibs_prove::demo::bridged::Bridged;
use serde_json::json;

/// Sentences about 100 frames of 10 packets, of which these events were counted besides 90 published ones.
fn broken(events: &[(Event, u32)]) -> Vec<String> {
    let mut counted: BTreeMap<&'static str, u32> =
        events.iter().map(|(event, count)| (event.name(), *count)).collect();
    counted.insert(Event::Published.name(), 90);
    let totals = json!({ "frames": 100, "packets": 1_000 });
    Bridged { sent: 100, events: &counted, totals: &totals }.broken()
}

#[test]
fn every_frame_is_published_or_refused_once() {
    use Event::{Abandoned, Busy, Damaged, Stale, TooFast, Unexpected};
    let good: [&[(Event, u32)]; 5] = [
        // Three end as too fast at their second packet, and the last is on its way.
        &[(Busy, 7), (TooFast, 3), (Unexpected, 63 + 3 * 8 + 9)],
        &[(Busy, 6), (Stale, 2), (TooFast, 2), (Unexpected, 72)],
        // The last one is on its way, refused or not.
        &[(Busy, 9), (Unexpected, 81)],
        &[(Busy, 10), (Unexpected, 84)],
        &[(Busy, 8), (Abandoned, 2), (Unexpected, 72)],
    ];
    for events in good {
        assert_eq!(broken(events), Vec::<String>::new(), "{events:?}");
    }
    let wrong: [(&[(Event, u32)], &str); 5] = [
        (&[(Busy, 8), (Unexpected, 72)], "8 refused"),
        (&[(Busy, 11), (Unexpected, 99)], "11 refused"),
        // A frame is lost, and two packets that begin no frame are stale.
        (&[(Busy, 7), (Stale, 3), (Unexpected, 63)], "10 refused begins leave 90"),
        (&[(Busy, 7), (TooFast, 3), (Unexpected, 100)], "7 refused begins leave 63"),
        (&[(Busy, 10), (Unexpected, 90), (Damaged, 1)], "1 rejections of another cause"),
    ];
    for (events, sentence) in wrong {
        let found = broken(events);
        assert!(matches!(&found[..], [one] if one.contains(sentence)), "{found:?}");
    }
}
