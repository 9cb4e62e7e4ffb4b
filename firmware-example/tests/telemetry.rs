//! Records over the line to the host.

// Requirement: P-05

use std::collections::BTreeSet;

use bytemuck::Zeroable;
use controller::telemetry::{MAX_FRAMED, Record, Summary, Tick, cause_code, cause_name, frame};
use dibs_nostd::wire::Deframer;
use dibs_nostd::{Millis, QueryError, Unavailable};

fn over_the_line(bytes: &[u8]) -> Option<Record> {
    let mut deframer = Deframer::<256>::new();
    let mut records = Vec::new();
    for &byte in bytes {
        if let Some(Ok(packet)) = deframer.push(byte) {
            records.extend(Record::decode(packet));
        }
    }
    records.first().copied()
}

#[test]
fn records_survive_the_line_and_damage_is_seen() {
    let tick = Tick { kind: Tick::KIND, tick: 7, separation: 1.25, ..Tick::zeroed() };
    let summary = Summary { kind: Summary::KIND, ticks: 9, ..Summary::zeroed() };
    let mut out = [0; MAX_FRAMED];
    let sent = frame(&summary, &mut out).unwrap();
    assert_eq!(over_the_line(sent), Some(Record::Summary(summary)));
    let sent = frame(&tick, &mut out).unwrap().to_vec();
    assert_eq!(over_the_line(&sent), Some(Record::Tick(tick)));
    for at in 0..sent.len() {
        let mut damaged = sent.clone();
        damaged[at] ^= 0x10;
        assert_eq!(over_the_line(&damaged), None, "byte {at}");
    }
}

#[test]
fn every_cause_has_a_number_and_a_name_of_its_own() {
    let (age, silence, transit) = (Millis(1), Millis(1), Millis(1));
    let causes = [
        Unavailable::NoSurface,
        Unavailable::Unacknowledged,
        Unavailable::Stale { age },
        Unavailable::Query(QueryError::NoAdjacency),
        Unavailable::CorruptTree,
        Unavailable::LinkLost { silence },
        Unavailable::HeartbeatLost { silence },
        Unavailable::Rejections { streak: 1 },
        Unavailable::Delayed { transit },
        Unavailable::SourceStale { age },
        Unavailable::Forgeries { count: 1 },
        Unavailable::NoPose,
        Unavailable::NoDirection,
        Unavailable::NoSide,
        Unavailable::CutShort,
        Unavailable::NotFinite,
    ];
    let numbers: BTreeSet<u32> = causes.iter().map(cause_code).collect();
    let names: BTreeSet<&str> = numbers.iter().map(|&number| cause_name(number)).collect();
    assert_eq!([numbers.len(), names.len()], [causes.len(); 2], "{names:?}");
    let of_none = [0, u32::MAX].map(cause_name);
    assert!(!of_none.iter().any(|name| names.contains(name)), "{names:?}");
}
