//! Rejections: each states its cause, is counted once and has no other effect.

// Requirement: B-02

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Content, Counters, Encoding, Event, NoMac, PacketError, QuantisedBox, Status, StreamError,
    WeightsEncoder, encode_status,
};
use dibs_nostd::{Millis, Progress, ReceiveError, VertexTable};
use dibs_tests::bus::*;

/// A packet with some bytes changed, and a correct checksum.
fn edit(packet: &[u8], at: usize, value: &[u8]) -> Vec<u8> {
    let mut packet = packet.to_vec();
    packet[at..at + value.len()].copy_from_slice(value);
    reseal(packet)
}

/// Bytes of a body, all zero except one.
fn with(bytes: usize, at: usize, value: u8) -> Vec<u8> {
    let mut body = vec![0; bytes];
    body[at] = value;
    body
}

/// The rejection of a fault within frame 1, after its begin and packet 3.
fn rejection_of(fault: &[u8]) -> ReceiveError {
    let good = frame(1, false);
    let (mut assembler, mut reader) = bus();
    give(&mut assembler, &good[0]).unwrap();
    give(&mut assembler, &good[3]).unwrap();
    let rejection = give(&mut assembler, fault).unwrap_err();
    assert_eq!(assembler.counters().rejected(), 1);
    assert_eq!(assembler.counters().of(rejection.event()), 1);
    assert!(rejection.event().is_rejection());
    assert!(!rejection.to_string().is_empty());
    // The fault has no effect: the frame continues and is published.
    for packet in &good[1..] {
        give(&mut assembler, packet).unwrap();
    }
    let sent: Vec<_> = surface(1).iter().map(|p| p.to_array().map(f32::to_bits)).collect();
    assert_eq!(published(&mut reader), Some((1, sent)));
    rejection
}

#[test]
fn what_is_no_packet() {
    let good = frame(1, false);
    let (begin, vertices, commit) = (&good[0], &good[1], &good[good.len() - 1]);
    let packet = |error| ReceiveError::Packet(error);
    assert_eq!(rejection_of(&[0; 21]), packet(PacketError::TooShort { bytes: 21 }));
    let flipped = rejection_of(&{
        let mut damaged = vertices.clone();
        damaged[30] ^= 4;
        damaged
    });
    assert!(matches!(flipped, ReceiveError::Packet(PacketError::Checksum { .. })));
    for version in [0, 1, 2, 3, 255] {
        let fault = edit(vertices, 0, &[version]);
        assert_eq!(rejection_of(&fault), packet(PacketError::Version { version }));
    }
    for (fault, expected) in [
        // Kinds of later versions, and unknown kinds.
        (edit(vertices, 1, &[11]), PacketError::Kind { kind: 11 }),
        (edit(vertices, 1, &[12]), PacketError::Kind { kind: 12 }),
        (edit(vertices, 1, &[0]), PacketError::Kind { kind: 0 }),
        (edit(vertices, 1, &[0x8C]), PacketError::Kind { kind: 0x8C }),
        // Length, count and padding.
        (edit(vertices, 14, &[2]), PacketError::Length { bytes: 64, expected: 48 }),
        (edit(vertices, 14, &[4]), PacketError::Length { bytes: 64, expected: 70 }),
        (
            reseal([&vertices[..60], &[0; 5]].concat()),
            PacketError::Length { bytes: 65, expected: 64 },
        ),
        (
            reseal([&commit[..24], &[0; 4]].concat()),
            PacketError::Length { bytes: 28, expected: 32 },
        ),
        (edit(vertices, 59, &[1]), PacketError::Reserved { offset: 54 }),
        (edit(commit, 27, &[1]), PacketError::Reserved { offset: 22 }),
        (raw(2, 1, 1, [1, 0], 0, &[]), PacketError::Empty),
        // Sequence.
        (edit(vertices, 12, &[0, 0]), PacketError::Sequence { sequence: 0 }),
        (edit(commit, 12, &[0, 0]), PacketError::Sequence { sequence: 0 }),
        (edit(begin, 12, &[1, 0]), PacketError::Sequence { sequence: 1 }),
        // The begin's fields.
        (edit(begin, 14, &[1]), PacketError::Reserved { offset: 14 }),
        (edit(begin, 15, &[1]), PacketError::Reserved { offset: 14 }),
        (edit(begin, 22, &[3]), PacketError::Content { content: 3 }),
        (edit(begin, 22, &[7]), PacketError::Content { content: 7 }),
        (edit(begin, 22, &[1]), PacketError::Sequence { sequence: 0 }),
        (edit(begin, 23, &[6]), PacketError::Unit { unit: 6 }),
        (edit(begin, 23, &[255]), PacketError::Unit { unit: 255 }),
        (edit(begin, 22, &[7 << 3]), PacketError::Encoding { encoding: 7 }),
        (edit(&raw_begin(1, 1, 2, 6, 0), 22, &[0x42]), PacketError::Reserved { offset: 22 }),
        (edit(begin, 24, &[0; 3]), PacketError::Rows { rows: 0 }),
        (edit(begin, 30, &[1]), PacketError::Reserved { offset: 30 }),
        (edit(begin, 53, &[1]), PacketError::Reserved { offset: 30 }),
        (edit(begin, 22, &[1 << 3]), PacketError::Box),
        (raw_begin(1, 1, 2, 65, 0), PacketError::Rows { rows: 65 }),
        (raw_begin(1, 1, 2, 0, 0), PacketError::Rows { rows: 0 }),
        (edit(&raw_begin(1, 1, 2, 6, 0), 33, &[1]), PacketError::Reserved { offset: 33 }),
        (edit(&raw_begin(1, 1, 2, 6, 0), 22, &[2 | 1 << 3]), PacketError::Encoding { encoding: 1 }),
        // A pose's.
        (raw(10, 1, 1, [0, 0], 0, &[0; 28]), PacketError::Sequence { sequence: 0 }),
        (raw(10, 1, 1, [2, 0], 0, &[0; 28]), PacketError::Sequence { sequence: 2 }),
        (raw(10, 1, 1, [1, 1], 0, &[0; 28]), PacketError::Reserved { offset: 14 }),
        (raw(10, 1, 1, [1, 0], 1, &[0; 28]), PacketError::Reserved { offset: 15 }),
        (raw(10, 1, 1, [1, 0], 0, &with(29, 28, 1)), PacketError::Reserved { offset: 46 }),
        // A heartbeat's and a status's.
        (raw(6, 1, 1, [0, 0], 0, &[0, 0, 1, 0, 0, 0, 0, 0]), PacketError::Reserved { offset: 20 }),
        (raw(6, 1, 1, [0, 1], 0, &[0; 8]), PacketError::Reserved { offset: 14 }),
        (raw(6, 1, 1, [1, 0], 0, &[0; 8]), PacketError::Sequence { sequence: 1 }),
        (raw(8, 1, 1, [0, 0], 0, &with(12, 2, 1)), PacketError::Reserved { offset: 20 }),
        (raw(8, 1, 1, [0, 0], 1, &[0; 12]), PacketError::Reserved { offset: 15 }),
        (raw(7, 1, 1, [0, 0], 0, &with(20, 2, 4)), PacketError::Reserved { offset: 20 }),
        (raw(7, 0, 1, [0, 0], 0, &[0; 20]), PacketError::Reserved { offset: 18 }),
        (raw(7, 0, 0, [0, 0], 256, &[0; 20]), PacketError::Reserved { offset: 16 }),
        (raw(9, 0, 0, [0, 0], 0, &with(36, 2, 4)), PacketError::Reserved { offset: 20 }),
        (raw(9, 0, 0, [0, 0], 0, &with(36, 28, 6)), PacketError::Unit { unit: 6 }),
        (raw(9, 0, 0, [0, 0], 0, &with(36, 35, 1)), PacketError::Reserved { offset: 53 }),
    ] {
        assert_eq!(rejection_of(&fault), packet(expected), "{fault:02x?}");
        assert_eq!(packet(expected).event(), Event::Malformed);
    }
    // A tag where the receiver has no key.
    let tagged = rejection_of(&raw(0x84, 1, 1, [2, 0], 0, &[0; 10]));
    assert_eq!(tagged, ReceiveError::Forged { epoch: 1 });
}

#[test]
fn what_is_a_packet_and_not_right() {
    let good = frame(1, false);
    let (begin, vertices) = (&good[0], &good[1]);
    let rejected = |fault: &[u8], expected| assert_eq!(rejection_of(fault), expected);
    rejected(&edit(vertices, 4, &[0xFF]), ReceiveError::WrongMesh { mesh_id: MESH | 0xFF });
    rejected(&edit(vertices, 8, &[2]), ReceiveError::Unexpected { epoch: 2 });
    rejected(&edit(vertices, 2, &[2]), ReceiveError::Unexpected { epoch: 1 });
    let status = Status {
        published: None,
        wants_whole: false,
        safety: 0,
        number: 0,
        clock: 0,
        answer: None,
    };
    let mut buffer = [0; 64];
    let status = encode_status(MESH, &status, &Counters::new(), &NoMac, &mut buffer);
    rejected(status, ReceiveError::ForSenders);
    rejected(&edit(begin, 24, &[41, 0, 0]), ReceiveError::RowCount { rows: 41 });
    rejected(&frame(1, true)[1], ReceiveError::Encoding);
    let weights = WeightsEncoder::<64>::new(id(2), &[0.5; N])
        .unwrap()
        .next_packet(&mut [0; 64])
        .unwrap()
        .to_vec();
    rejected(&weights, ReceiveError::Encoding);
    rejected(&raw(5, 1, 1, [1, 1], 0, &[0; 4]), ReceiveError::Encoding);
    for first in [38, 40, 0x00FF_FFFF] {
        let fault = edit(vertices, 15, &u32::to_le_bytes(first)[..3]);
        rejected(&fault, ReceiveError::OutOfRange { first, count: 3 });
    }
    // Packet 3 contains rows 6 to 8, so packet 2 can only contain rows 3 to 5.
    for first in [0, 2, 4, 5, 6, 7, 9, 20] {
        let fault = edit(&good[2], 15, &u32::to_le_bytes(first)[..3]);
        rejected(&fault, ReceiveError::Order { sequence: 2 });
    }
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let fault = edit(vertices, 18 + 2 * 12 + 4 * axis, &bad.to_le_bytes());
            rejected(&fault, ReceiveError::NotFinite { row: 2 });
        }
    }
    for (far, axis) in [(100.01_f32, 0), (-100.01, 1), (1e30, 2)] {
        let fault = edit(vertices, 18 + 12 + 4 * axis, &far.to_le_bytes());
        rejected(&fault, ReceiveError::TooFar { row: 1 });
    }
    rejected(&raw_begin(1, 2, 1, N as u32, 1), ReceiveError::Base { epoch: 1 });
}

/// A quantisation box may exceed the receiver's limit on coordinates; a vertex may not.
#[test]
fn a_box_may_be_larger_than_the_surface() {
    let coarse = QuantisedBox::new(Vec3::splat(-60.0), Vec3::splat(0.1)).unwrap();
    let (mut assembler, mut reader) = bus();
    let positions = surface(1);
    for packet in packets::<64>(1, Encoding::Quantised(coarse), &positions) {
        give(&mut assembler, &packet).unwrap();
    }
    assert_eq!(reader.read().unwrap().label().position_error, coarse.error());
    let mut far = positions;
    far[9].y = 100.2;
    let packets = packets::<64>(2, Encoding::Quantised(coarse), &far);
    let outcomes: Vec<_> = packets.iter().map(|packet| give(&mut assembler, packet)).collect();
    assert_eq!(outcomes[2], Err(ReceiveError::TooFar { row: 9 }));
    assert_eq!(published(&mut reader).unwrap().0, 1);
}

#[test]
fn packets_beyond_the_commit_do_not_belong() {
    let good = frame(1, false);
    let (commit, others) = good.split_last().unwrap();
    // The commit arrives first and claims that there are fewer packets.
    let (mut assembler, mut reader) = bus();
    give(&mut assembler, &good[0]).unwrap();
    give(&mut assembler, &edit(commit, 12, &3_u16.to_le_bytes())).unwrap();
    for (sequence, packet) in (1..).zip(&others[1..]) {
        let outcome = give(&mut assembler, packet);
        match sequence {
            1 => assert_eq!(outcome, Ok(None)),
            // The frame would be complete, but the commit's digest is that of all packets.
            2 => assert!(matches!(outcome, Err(ReceiveError::Digest { .. }))),
            _ => {
                let cause = Event::Digest;
                assert_eq!(outcome, Err(ReceiveError::Refused { epoch: 1, cause }));
            }
        }
    }
    let (mut again, _) = bus();
    give(&mut again, &good[0]).unwrap();
    give(&mut again, &edit(commit, 12, &3_u16.to_le_bytes())).unwrap();
    assert_eq!(give(&mut again, &good[3]), Err(ReceiveError::Order { sequence: 3 }));
    assert_eq!(
        give(&mut again, commit),
        Err(ReceiveError::Order { sequence: good.len() as u16 - 1 })
    );
    // The same commit comes last.
    let (mut last, _) = bus();
    for packet in others {
        give(&mut last, packet).unwrap();
    }
    let early = edit(commit, 12, &3_u16.to_le_bytes());
    assert_eq!(give(&mut last, &early), Err(ReceiveError::Order { sequence: 3 }));
    assert_eq!(give(&mut last, commit), Ok(Some(1)));
    assert!(published(&mut reader).is_none());
}

/// A frame that ends early, with a correct digest.
#[test]
fn a_frame_without_its_last_rows_is_not_published() {
    let good = frame(1, false);
    let (commit, others) = good.split_last().unwrap();
    let (mut assembler, mut reader) = bus();
    let (_, short) = others.split_last().unwrap();
    let mut digest = 0_u32;
    for packet in short {
        give(&mut assembler, packet).unwrap();
        digest = digest.wrapping_add(contribution(packet));
    }
    let mut commit = edit(commit, 12, &(short.len() as u16).to_le_bytes());
    commit = edit(&commit, 18, &digest.to_le_bytes());
    assert_eq!(give(&mut assembler, &commit), Err(ReceiveError::RowCount { rows: 39 }));
    assert!(published(&mut reader).is_none());
    let refused = ReceiveError::Refused { epoch: 1, cause: Event::RowCount };
    assert_eq!(give(&mut assembler, &good[1]), Err(refused));
    assert_eq!(refused.to_string(), "frame 1 was refused before: row count");
}

/// Packets of a frame whose begin was refused report the same cause.
#[test]
fn the_cause_of_a_refused_begin_stays() {
    let good = frame(1, false);
    for (begin, cause) in [
        (edit(&good[0], 24, &[41, 0, 0]), Event::RowCount),
        (raw_begin(1, 1, 2, N as u32, 0), Event::Encoding),
        (raw_begin(1, 1, 1, N as u32, 0), Event::Base),
    ] {
        let (mut assembler, _reader) = bus();
        assert_eq!(give(&mut assembler, &begin).unwrap_err().event(), cause);
        for packet in &good[1..] {
            let refused = give(&mut assembler, packet);
            assert_eq!(refused, Err(ReceiveError::Refused { epoch: 1, cause }));
        }
        assert_eq!(assembler.health().rejections, 1);
        // Another frame is only unexpected.
        let other = frame(2, false);
        assert_eq!(give(&mut assembler, &other[1]), Err(ReceiveError::Unexpected { epoch: 2 }));
    }
}

/// Every second packet of a frame is lost: more gaps than the receiver can record.
#[test]
fn gaps_are_bounded() {
    let positions: Vec<Vec3> = (0..200).map(|i| Vec3::splat(i as f32 * 0.01)).collect();
    let frames: &'static dibs_nostd::Frames<200> = Box::leak(Box::new(dibs_nostd::Frames::new()));
    let (writer, mut reader) = frames.split().unwrap();
    let mut assembler =
        dibs_nostd::Assembler::new(writer, dibs_nostd::NoAdmissionCheck, MESH, 100.0);
    let packets = packets::<64>(1, Encoding::Float, &positions);
    give(&mut assembler, &packets[0]).unwrap();
    let mut refused = Vec::new();
    for packet in packets[1..].iter().skip(1).step_by(2) {
        if let Err(rejection) = give(&mut assembler, packet) {
            assert!(matches!(rejection, ReceiveError::Gaps { .. }));
            refused.push(packet);
        }
    }
    let gaps = packets.len() / 2 - 1 - refused.len();
    assert!((5..=20).contains(&gaps), "{gaps} gaps are noted");
    assert_eq!(assembler.counters().of(Event::Gaps) as usize, refused.len());
    // All packets are sent again, in order, until none is missing.
    let published = packets.iter().find_map(|packet| give(&mut assembler, packet).unwrap());
    assert_eq!(published, Some(1));
    let frame = reader.read().expect("complete");
    for (row, position) in (0..).zip(&positions) {
        assert_eq!(frame.position(row), Some(*position));
    }
}

#[test]
fn damage_to_the_stream_is_counted_too() {
    let (mut assembler, _) = bus();
    assembler.count_framing(&StreamError::Cut { bytes: 9 });
    assert_eq!(assembler.counters().of(Event::Framing), 1);
    assert_eq!(assembler.counters().rejected(), 1);
    let good = frame(1, true);
    give(&mut assembler, &good[0]).unwrap();
    assert_eq!(assembler.accept(&good[0], Millis(0)), Ok(Progress::Duplicate));
    assert_eq!(assembler.counters().of(Event::Duplicate), 1);
    assert_eq!(assembler.counters().rejected(), 1, "a duplicate is none");
}

#[test]
fn every_event_has_its_place_and_name() {
    let document = include_str!("../../../docs/wire.md");
    let list = document.split("number 0 on:\n\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let list = list.replace("> ", "").replace('\n', " ");
    let names: Vec<_> = list.split(", ").collect();
    let all: Vec<_> = Event::ALL.iter().map(ToString::to_string).collect();
    assert_eq!(names, all);
    assert!(Event::ALL.iter().enumerate().all(|(i, event)| *event as usize == i));
    assert_ne!(Content::Whole, Content::Modal);
}

/// Packets of a frame that a later one displaced arrive late, and report that cause.
#[test]
fn the_late_packets_of_an_abandoned_frame_name_the_cause() {
    let (first, second) = (frame(1, false), frame(2, false));
    let (mut assembler, mut reader) = bus();
    give(&mut assembler, &first[0]).unwrap();
    give(&mut assembler, &second[0]).unwrap();
    let refused = ReceiveError::Refused { epoch: 1, cause: Event::Abandoned };
    for packet in &first[1..] {
        assert_eq!(give(&mut assembler, packet), Err(refused));
    }
    assert_eq!(assembler.health().rejections, 1);
    for packet in &second[1..] {
        give(&mut assembler, packet).unwrap();
    }
    assert!(published(&mut reader).is_some());
}
