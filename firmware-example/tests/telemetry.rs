//! Records over the line to the host.

// Requirement: P-05

use bytemuck::Zeroable;
use controller::telemetry::{MAX_FRAMED, Record, Summary, Tick, frame};
use dibs_nostd::wire::Deframer;

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
