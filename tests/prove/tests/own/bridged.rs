//! A bridge's account of the demo notices a lost frame behind refusals of another kind.

// Requirement: B-09

use std::collections::BTreeMap;

use dibs_nostd::wire::Event;
use dibs_prove::demo::bridged::Bridged;
use serde_json::json;

/// Sentences about frames of 10 packets, of which these events were counted besides 90 published ones and 20 heartbeats.
fn broken_of(sent: u32, received: u32, events: &[(Event, u32)]) -> Vec<String> {
    let mut counted: BTreeMap<&'static str, u32> =
        events.iter().map(|(event, count)| (event.name(), *count)).collect();
    counted.insert(Event::Published.name(), 90);
    counted.insert(Event::Heartbeat.name(), 20);
    let totals = json!({ "frames": sent, "packets": 10 * sent + 22 });
    let events = &counted;
    Bridged { sent, received, ticks: 1_600, events, totals: &totals }.broken()
}

/// All of 100 frames arrived.
fn broken(events: &[(Event, u32)]) -> Vec<String> {
    broken_of(100, 1_020, events)
}

fn assert_says(found: &[String], sentence: &str) {
    assert!(matches!(found, [one] if one.contains(sentence)), "{found:?}");
}

#[test]
fn every_frame_is_published_or_refused_once() {
    use Event::{Abandoned, Busy, Damaged, Stale, TooFast, Unexpected};
    let good: [&[(Event, u32)]; 5] = [
        // Three end as too fast at their second packet, and the last is in its check.
        &[(Busy, 6), (TooFast, 3), (Unexpected, 54 + 3 * 8)],
        &[(Busy, 6), (Stale, 2), (TooFast, 2), (Unexpected, 72)],
        &[(Busy, 9), (Unexpected, 81)],
        &[(Busy, 10), (Unexpected, 90)],
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
        assert_says(&broken(events), sentence);
    }
}

/// A run may end with frames on their way. None of those that arrived may be missing for it.
#[test]
fn frames_are_missing_with_their_packets_only() {
    use Event::{Busy, Unexpected};
    let refused = [(Busy, 10), (Unexpected, 90)];
    // The last packet of the hundredth frame, or its first: it was refused, or is incomplete.
    for (received, events) in
        [(1_019, refused), (1_011, refused), (1_011, [(Busy, 9), (Unexpected, 81)])]
    {
        assert_eq!(broken_of(102, received, &events), Vec::<String>::new(), "{received}");
    }
    // A heartbeat that the board has not counted yet.
    assert_eq!(broken_of(102, 1_021, &refused), Vec::<String>::new());
    assert_eq!(broken_of(102, 1_021, &[(Busy, 9), (Unexpected, 81)]), Vec::<String>::new());
    assert_says(&broken_of(102, 1_032, &refused), "of 102 frames that arrived");
    assert_says(&broken_of(102, 1_010, &refused), "of 99 frames that arrived");
    // 7 of 107 frames in 1,600 ticks wait for 105 ms, 9 of 109 for 132 ms.
    assert_eq!(broken_of(107, 1_020, &refused), Vec::<String>::new());
    assert_says(&broken_of(109, 1_020, &refused), "9 of 109 frames did not arrive");
}
