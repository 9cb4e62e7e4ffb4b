//! The bus: packets, COBS, and the assembler that publishes complete, right frames only.

use std::cell::Cell;
use std::rc::Rc;

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Body, Deframer, EncodeError, Encoding, FrameEncoder, FrameId, Packet, PacketError,
    QuantisedBox, Rows, StreamError, enframe, framed_bytes,
};
use dibs_nostd::{Changed, Gate, Progress, Rejection, StretchError, Verdict, VertexTable};
use dibs_tests::bus::*;

#[test]
fn every_frame_arrives_as_it_was_sent() {
    for quantised in [false, true] {
        let (mut assembler, mut reader) = bus();
        for epoch in 1..=5 {
            let positions = surface(epoch);
            let encoding = encoding(quantised, &positions);
            let packets = packets::<64>(epoch, encoding, &positions);
            // 18 + 4 bytes of a packet are not vertices.
            assert_eq!(packets.len(), 2 + N.div_ceil(42 / if quantised { 6 } else { 12 }));
            for (i, packet) in packets.iter().enumerate() {
                let progress = assembler.accept(packet, 1000 * epoch + i as u32).unwrap();
                let is_last = i + 1 == packets.len();
                assert_eq!(progress == Progress::Published { epoch }, is_last);
            }
            let frame = reader.read().unwrap();
            assert_eq!(frame.label().epoch, epoch);
            assert_eq!(frame.label().received, 1000 * epoch, "the clock at the begin packet");
            let error = frame.label().position_error;
            assert_eq!(error > 0.0, quantised);
            for (vertex, sent) in positions.iter().enumerate() {
                let arrived = frame.position(vertex as u32).unwrap();
                assert!(arrived.as_dvec3().distance(sent.as_dvec3()) <= f64::from(error));
            }
        }
        assert_eq!(assembler.counters().published, 5);
        assert_eq!(assembler.counters().rejected(), 0);
    }
}

#[test]
fn a_packet_has_one_meaning_at_every_transport_unit() {
    let positions = surface(3);
    for packets in [
        packets::<64>(3, Encoding::Float, &positions),
        packets::<256>(3, Encoding::Float, &positions),
        packets::<1472>(3, Encoding::Float, &positions),
        packets::<65_507>(3, Encoding::Float, &positions),
    ] {
        let (mut assembler, mut reader) = bus();
        for packet in &packets {
            assembler.accept(packet, 0).unwrap();
        }
        let expected: Vec<_> = positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        assert_eq!(published(&mut reader), Some((3, expected)));
    }
}

/// Exhaustive: each bit, and each pair of bits, of each kind of packet.
#[test]
fn one_or_two_flipped_bits_are_always_detected() {
    for quantised in [false, true] {
        let frame = frame(7, quantised);
        for packet in [&frame[0], &frame[1], &frame[frame.len() - 2], &frame[frame.len() - 1]] {
            assert!(Packet::decode(packet).is_ok());
            let bits = packet.len() * 8;
            let mut damaged = packet.clone();
            for first in 0..bits {
                damaged[first / 8] ^= 1 << (first % 8);
                assert!(matches!(Packet::decode(&damaged), Err(PacketError::Checksum { .. })));
                for second in first + 1..bits {
                    damaged[second / 8] ^= 1 << (second % 8);
                    assert!(matches!(Packet::decode(&damaged), Err(PacketError::Checksum { .. })));
                    damaged[second / 8] ^= 1 << (second % 8);
                }
                damaged[first / 8] ^= 1 << (first % 8);
            }
        }
    }
}

#[test]
fn a_frame_without_any_one_of_its_packets_is_not_published() {
    for quantised in [false, true] {
        let frame = frame(7, quantised);
        for lost in 0..frame.len() {
            let (mut assembler, mut reader) = bus();
            for (_, packet) in frame.iter().enumerate().filter(|(i, _)| *i != lost) {
                let _ = assembler.accept(packet, 0);
            }
            assert!(published(&mut reader).is_none(), "published without packet {lost}");
            assert_eq!(assembler.counters().published, 0);
        }
    }
}

#[test]
fn epochs_wrap() {
    let (mut assembler, mut reader) = bus();
    for epoch in [u32::MAX - 1, u32::MAX, 0, 1, 0x7FFF_FFFF, 0xFFFF_FFFE_u32, 5] {
        for packet in frame(epoch, false) {
            assembler.accept(&packet, 0).unwrap();
        }
        assert_eq!(published(&mut reader).unwrap().0, epoch);
        // The same again, an older one, and the one just too far ahead.
        for stale in
            [epoch, epoch.wrapping_sub(1), epoch.wrapping_sub(0x7FFF_FFFF), epoch ^ 1 << 31]
        {
            for packet in frame(stale, false) {
                let rejection = assembler.accept(&packet, 0).unwrap_err();
                assert_eq!(rejection, Rejection::Stale { epoch: stale });
            }
        }
        assert_eq!(published(&mut reader).unwrap().0, epoch);
    }
}

#[test]
fn a_newer_frame_supersedes_an_unfinished_one() {
    let (mut assembler, mut reader) = bus();
    let (first, second) = (frame(1, false), frame(2, false));
    for packet in &first[..5] {
        assembler.accept(packet, 0).unwrap();
    }
    assert_eq!(assembler.accept(&second[0], 0), Ok(Progress::Begun { epoch: 2 }));
    assert_eq!(assembler.counters().abandoned, 1);
    // What is left of the first is of no use any more, not even its begin.
    let late = assembler.accept(&first[5], 0);
    assert_eq!(late, Err(Rejection::Unexpected { epoch: 1 }));
    assert_eq!(assembler.accept(&first[0], 0), Err(Rejection::Stale { epoch: 1 }));
    for packet in &second[1..] {
        assembler.accept(packet, 0).unwrap();
    }
    assert_eq!(published(&mut reader).unwrap().0, 2);
}

/// A sender that starts again within a frame, and numbers its frames from the same epoch: whatever
/// is lost of its packets, the mixture is not published.
#[test]
fn two_frames_of_one_epoch_are_never_mixed() {
    let (old, new) = (surface(1), surface(500));
    // With the same encoding, even the begin packets are equal.
    let old = packets::<64>(9, Encoding::Float, &old);
    let new = packets::<64>(9, Encoding::Float, &new);
    assert_eq!(old[0], new[0]);
    let last = old.len() - 1;
    for cut in 2..last {
        for commit in [&old[last], &new[last]] {
            let (mut assembler, mut reader) = bus();
            for packet in old[..cut].iter().chain(&new[cut..last]) {
                assembler.accept(packet, 0).unwrap();
            }
            let rejection = assembler.accept(commit, 0).unwrap_err();
            assert!(matches!(rejection, Rejection::Digest { .. }), "{rejection}");
            assert!(published(&mut reader).is_none());
            // The next whole frame is taken, under the same number.
            for packet in &new {
                assembler.accept(packet, 0).unwrap();
            }
            assert_eq!(published(&mut reader).unwrap().0, 9);
        }
    }
    // A begin packet that differs restarts the frame.
    let (mut assembler, mut reader) = bus();
    for packet in frame(9, true)[..4].iter().chain(&new) {
        assembler.accept(packet, 0).unwrap();
    }
    assert_eq!(published(&mut reader).unwrap().0, 9);
    assert_eq!(assembler.counters().abandoned, 1);
}

/// Each fault that a checksum cannot tell is rejected by its own cause and counted once.
#[test]
#[ignore = "to be rewritten with the assembler of version 2"]
fn every_cause_has_its_counter() {
    let positions = surface(1);
    let with = |vertex: usize, position: Vec3| {
        let mut moved = positions.clone();
        moved[vertex] = Vec3::ZERO;
        let mut packet = packets::<64>(1, Encoding::Float, &moved)[1 + vertex / 3].clone();
        let at = 18 + vertex % 3 * 12;
        for (i, coordinate) in position.to_array().into_iter().enumerate() {
            packet[at + 4 * i..at + 4 * i + 4].copy_from_slice(&coordinate.to_le_bytes());
        }
        reseal(packet)
    };
    let edit = |packet: &[u8], at: usize, value: &[u8]| {
        let mut packet = packet.to_vec();
        packet[at..at + value.len()].copy_from_slice(value);
        reseal(packet)
    };
    let good = frame(1, false);
    let vertices = &good[1];
    let cause = |fault: &[u8]| {
        let (mut assembler, mut reader) = bus();
        assembler.accept(&good[0], 0).unwrap();
        assembler.accept(&good[3], 0).unwrap();
        let rejection = assembler.accept(fault, 0).unwrap_err();
        assert_eq!(assembler.counters().rejected(), 1);
        // The fault leaves no trace: the frame goes on and is published.
        for packet in &good[1..] {
            assembler.accept(packet, 0).unwrap();
        }
        let sent: Vec<_> = positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        assert_eq!(published(&mut reader), Some((1, sent)));
        (rejection, *assembler.counters())
    };

    let (rejection, counters) = cause(&[0; 21]);
    assert_eq!(rejection, Rejection::Packet(PacketError::TooShort { bytes: 21 }));
    assert_eq!(counters.damaged, 1);
    let (rejection, counters) = cause(&edit(vertices, 0, &[2]));
    assert_eq!(rejection, Rejection::Packet(PacketError::Version { version: 2 }));
    assert_eq!(counters.version, 1);
    for (fault, expected) in [
        (edit(vertices, 1, &[9]), PacketError::Kind { kind: 9 }),
        (edit(vertices, 2, &[1]), PacketError::Reserved { offset: 2 }),
        (edit(vertices, 17, &[1]), PacketError::Reserved { offset: 16 }),
        (edit(vertices, 3, &[2]), PacketError::Length { bytes: 58, expected: 46 }),
        (edit(&vertices[..22], 3, &[0]), PacketError::Empty),
        (edit(&good[0], 3, &[1]), PacketError::Reserved { offset: 3 }),
        (edit(&good[0], 12, &[1]), PacketError::Reserved { offset: 12 }),
        (edit(&good[0], 22, &[7]), PacketError::Encoding { encoding: 7 }),
        (edit(&good[0], 23, &[7]), PacketError::Reserved { offset: 23 }),
        (edit(&good[0], 30, &[7]), PacketError::Reserved { offset: 26 }),
        (edit(&good[0], 22, &[1]), PacketError::Box),
    ] {
        let (rejection, counters) = cause(&fault);
        assert_eq!(rejection, Rejection::Packet(expected));
        assert_eq!(counters.malformed, 1);
    }
    let (rejection, counters) = cause(&edit(vertices, 4, &[0xFF]));
    assert_eq!(rejection, Rejection::WrongMesh { mesh_id: MESH | 0xFF });
    assert_eq!(counters.wrong_mesh, 1);
    let (rejection, counters) = cause(&edit(vertices, 8, &[2]));
    assert_eq!(rejection, Rejection::Unexpected { epoch: 2 });
    assert_eq!(counters.unexpected, 1);
    let (rejection, counters) = cause(&edit(&good[0], 18, &41_u32.to_le_bytes()));
    assert_eq!(rejection, Rejection::VertexCount { vertices: 41 });
    assert_eq!(counters.vertex_count, 1);
    let (rejection, counters) = cause(&frame(1, true)[1]);
    assert_eq!(rejection, Rejection::OtherEncoding);
    assert_eq!(counters.other_encoding, 1);
    for first in [38, 40, u32::MAX - 1] {
        let (rejection, counters) = cause(&edit(vertices, 12, &first.to_le_bytes()));
        assert_eq!(rejection, Rejection::OutOfRange { first, count: 3 });
        assert_eq!(counters.out_of_range, 1);
    }
    let (rejection, counters) = cause(&edit(vertices, 12, &5_u32.to_le_bytes()));
    assert_eq!(rejection, Rejection::Overlap { first: 5 });
    assert_eq!(counters.overlap, 1);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (rejection, counters) = cause(&with(2, Vec3::new(0.0, bad, 0.0)));
        assert_eq!(rejection, Rejection::NotFinite { vertex: 2 });
        assert_eq!(counters.not_finite, 1);
    }
    let (rejection, counters) = cause(&with(1, Vec3::new(0.0, 0.0, -100.01)));
    assert_eq!(rejection, Rejection::TooFar { vertex: 1 });
    assert_eq!(counters.too_far, 1);
    let far = QuantisedBox::new(Vec3::splat(-50.0), Vec3::splat(0.01)).unwrap();
    let far = packets::<64>(2, Encoding::Quantised(far), &surface(2));
    let (rejection, counters) = cause(&far[0]);
    assert_eq!(rejection, Rejection::TooFar { vertex: 0 });
    assert_eq!(counters.too_far, 1);
}

/// Refuses while it is told to.
struct Refuse(Rc<Cell<bool>>);

impl Gate for Refuse {
    fn begin(&mut self, _: Changed) {}

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        surface: &V,
        ready: u32,
        _: u32,
    ) -> Result<Verdict, StretchError> {
        assert_eq!((surface.len(), ready), (N, N as u32));
        if self.0.get() { Err(StretchError::NoMetric) } else { Ok(Verdict::Admitted(None)) }
    }
}

#[test]
fn a_refused_surface_is_not_published_and_the_last_one_stays() {
    let refusing = Rc::new(Cell::new(false));
    let (mut assembler, mut reader) = bus_with(Refuse(refusing.clone()));
    for (epoch, refuse) in [(1, false), (2, true), (2, false)] {
        refusing.set(refuse);
        let frame = frame(epoch, false);
        let (commit, others) = frame.split_last().unwrap();
        for packet in others {
            assembler.accept(packet, 0).unwrap();
        }
        if refuse {
            let rejection = assembler.accept(commit, 0).unwrap_err();
            assert_eq!(rejection, Rejection::Stretch(StretchError::NoMetric));
            assert_eq!(published(&mut reader).unwrap().0, 1);
            assert_eq!(assembler.published_epoch(), Some(1));
        } else {
            assert_eq!(assembler.accept(commit, 0), Ok(Progress::Published { epoch }));
        }
    }
    assert_eq!(published(&mut reader).unwrap().0, 2);
    assert_eq!(assembler.counters().stretch, 1);
}

#[test]
fn a_frame_that_meets_a_read_is_held_and_published_later() {
    let (mut assembler, mut reader) = bus();
    for packet in frame(1, false) {
        assembler.accept(&packet, 0).unwrap();
    }
    let guard = reader.read().unwrap();
    let second = frame(2, true);
    let (commit, others) = second.split_last().unwrap();
    for packet in others {
        assembler.accept(packet, 0).unwrap();
    }
    assert_eq!(assembler.accept(commit, 0), Ok(Progress::Held { epoch: 2 }));
    assert_eq!(assembler.accept(commit, 0), Ok(Progress::Duplicate));
    assert_eq!(assembler.poll(), None);
    assert_eq!(guard.label().epoch, 1);
    drop(guard);
    assert_eq!(assembler.poll(), Some(2));
    assert_eq!(published(&mut reader).unwrap().0, 2);
    // Or by the next packet.
    let guard = reader.read().unwrap();
    for packet in frame(3, false) {
        assembler.accept(&packet, 0).unwrap();
    }
    drop(guard);
    assert_eq!(assembler.accept(&frame(4, false)[0], 0), Ok(Progress::Begun { epoch: 4 }));
    assert_eq!(published(&mut reader).unwrap().0, 3);
    assert_eq!(assembler.counters().abandoned, 0);
}

const ID: FrameId = FrameId { mesh_id: MESH, session: 1, epoch: 1 };

#[test]
fn what_cannot_be_sent_is_named() {
    let mut positions = surface(1);
    let grid = encoding(true, &positions);
    positions[17].y = f32::NAN;
    for encoding in [Encoding::Float, grid] {
        let error = FrameEncoder::<_, 64>::new(ID, encoding, &positions[..]).err();
        assert_eq!(error, Some(EncodeError::NotFinite { row: 17 }));
    }
    positions[17].y = 99.0;
    let error = FrameEncoder::<_, 64>::new(ID, grid, &positions[..]).err();
    assert_eq!(error, Some(EncodeError::OutOfBox { row: 17 }));
    let error = FrameEncoder::<_, 64>::new(ID, grid, &positions[..0]).err();
    assert_eq!(error, Some(EncodeError::Rows { rows: 0 }));
    positions[17].y = f32::INFINITY;
    assert_eq!(QuantisedBox::covering(&positions), None);
    assert_eq!(QuantisedBox::covering(&[]), None);
    assert!(QuantisedBox::covering(&[Vec3::splat(1e30), Vec3::splat(1e30)]).is_some());
    assert_eq!(QuantisedBox::covering(&[Vec3::splat(-3e38), Vec3::splat(3e38)]), None);
    for bad in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(QuantisedBox::new(Vec3::ZERO, Vec3::new(1.0, bad, 1.0)).is_err());
    }
}

#[test]
fn a_packet_that_is_too_long_is_not_passed_on_cut() {
    let mut stream = [0; framed_bytes(65)];
    let framed = enframe(&[7; 65], &mut stream).unwrap().to_vec();
    let mut deframer = Deframer::<64>::new();
    let mut outcomes = Vec::new();
    for &byte in framed.iter().chain(&[2, 9, 0]).chain(&[5, 1, 0]).chain(&[2, 8, 0]) {
        if let Some(outcome) = deframer.push(byte) {
            outcomes.push(outcome.map(<[u8]>::to_vec));
        }
    }
    let expected = [
        Err(StreamError::TooLong { bytes: 65, limit: 64 }),
        Ok(vec![9]),
        Err(StreamError::Cut { bytes: 1 }),
        Ok(vec![8]),
    ];
    assert_eq!(outcomes, expected);
    assert_eq!(enframe(&[7; 65], &mut stream[..66]), None);
}

#[test]
fn rows_know_their_number() {
    let frame = frame(1, true);
    let Body::Vertices(vertices) = Packet::decode(&frame[1]).unwrap().body else { panic!() };
    assert!(matches!(vertices.rows, Rows::Quantised(_)));
    assert_eq!((vertices.first, vertices.rows.len()), (0, 7));
    assert!(!vertices.rows.is_empty());
}
