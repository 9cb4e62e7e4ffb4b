//! The bus: packets, COBS, and the assembler, which only publishes complete and correct frames.

// Requirement: B-01

use std::cell::Cell;
use std::rc::Rc;

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Body, Deframer, EncodeError, Encoding, Event, FrameEncoder, Packet, PacketError, PacketRows,
    QuantisedBox, StreamError, enframe, framed_bytes,
};
use dibs_nostd::{
    Admission, AdmissionCheck, Advance, FrameExtent, IncomingSurface, Millis, Progress,
    ReceiveError, StretchError, VertexTable,
};
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
                let progress = assembler.accept(packet, Millis(1000 * epoch + i as u32)).unwrap();
                let is_last = i + 1 == packets.len();
                assert_eq!(progress == Progress::Complete { epoch }, is_last);
                let advance = assembler.advance(1);
                let expected = if is_last { Advance::Published { epoch } } else { Advance::Idle };
                assert_eq!(advance, Ok(expected));
            }
            let frame = reader.read().unwrap();
            assert_eq!(frame.label().epoch, epoch);
            assert_eq!(
                frame.label().received,
                Millis(1000 * epoch),
                "the clock at the begin packet"
            );
            let error = frame.label().position_error;
            assert_eq!(error > 0.0, quantised);
            for (vertex, sent) in positions.iter().enumerate() {
                let arrived = frame.position(vertex as u32).unwrap();
                assert!(arrived.as_dvec3().distance(sent.as_dvec3()) <= f64::from(error));
            }
        }
        assert_eq!(assembler.counters().of(Event::Published), 5);
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
            give(&mut assembler, packet).unwrap();
        }
        let expected: Vec<_> = positions.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        assert_eq!(published(&mut reader), Some((3, expected)));
    }
}

/// Flips each bit, and each pair of bits, of the begin, of packets of rows and of the commit.
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
                let _ = give(&mut assembler, packet);
            }
            assert!(published(&mut reader).is_none(), "published without packet {lost}");
            assert_eq!(assembler.counters().of(Event::Published), 0);
        }
    }
}

/// A sender restarts within a frame, and numbers from the same epoch: a mixture of both frames is not published.
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
                give(&mut assembler, packet).unwrap();
            }
            let rejection = give(&mut assembler, commit).unwrap_err();
            assert!(matches!(rejection, ReceiveError::Digest { .. }), "{rejection}");
            assert!(published(&mut reader).is_none());
            // The next whole frame with the same number is accepted.
            for packet in &new {
                give(&mut assembler, packet).unwrap();
            }
            assert_eq!(published(&mut reader).unwrap().0, 9);
        }
    }
    // A begin packet that differs restarts the frame.
    let (mut assembler, mut reader) = bus();
    for packet in frame(9, true)[..4].iter().chain(&new) {
        give(&mut assembler, packet).unwrap();
    }
    assert_eq!(published(&mut reader).unwrap().0, 9);
    assert_eq!(assembler.counters().of(Event::Abandoned), 1);
}

/// An admission check that refuses complete surfaces while the cell is true.
struct Refuse(Rc<Cell<bool>>);

impl AdmissionCheck for Refuse {
    fn begin(&mut self, _: FrameExtent) {}

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        IncomingSurface { surface, ready, .. }: IncomingSurface<'_, V>,
        _: u32,
    ) -> Result<Admission, StretchError> {
        assert_eq!(surface.len(), N);
        if ready < N as u32 {
            Ok(Admission::Pending)
        } else if self.0.get() {
            Err(StretchError::NoMetric)
        } else {
            Ok(Admission::Admitted(None))
        }
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
        let (last, others) = others.split_last().unwrap();
        for packet in others {
            assert_eq!(give(&mut assembler, packet), Ok(None));
        }
        if refuse {
            // All rows have arrived: the check need not wait for the commit.
            let rejection = give(&mut assembler, last).unwrap_err();
            assert_eq!(rejection, ReceiveError::Stretch(StretchError::NoMetric));
            assert_eq!(assembler.advance(1), Ok(Advance::Idle), "the frame is gone");
            let late = give(&mut assembler, commit);
            assert_eq!(late, Err(ReceiveError::Refused { epoch, cause: Event::Stretch }));
            assert_eq!(published(&mut reader).unwrap().0, 1);
            assert_eq!(assembler.published(), Some(id(1)));
        } else {
            assert_eq!(give(&mut assembler, last), Ok(None));
            assert_eq!(give(&mut assembler, commit), Ok(Some(epoch)));
        }
    }
    assert_eq!(published(&mut reader).unwrap().0, 2);
    assert_eq!(assembler.counters().of(Event::Stretch), 1);
}

/// An admission check that takes 100 units of work for a frame, and counts its calls.
struct Slow {
    left: u32,
    began: Rc<Cell<u32>>,
    moved: Rc<Cell<u32>>,
    published: Rc<Cell<u32>>,
}

impl AdmissionCheck for Slow {
    fn begin(&mut self, _: FrameExtent) {
        self.left = 100;
        self.began.set(self.began.get() + 1);
        self.moved.set(0);
    }

    fn moved(&mut self, rows: std::ops::Range<u32>) {
        self.moved.set(self.moved.get() + rows.len() as u32);
    }

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        IncomingSurface { ready, .. }: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError> {
        assert!(ready <= self.moved.get());
        self.left = self.left.saturating_sub(work);
        let is_done = self.left == 0 && ready == N as u32;
        Ok(if is_done { Admission::Admitted(None) } else { Admission::Pending })
    }

    fn published(&mut self) {
        self.published.set(self.published.get() + 1);
    }
}

/// The check runs between the packets, and a complete frame is not abandoned for a newer one.
#[test]
fn a_frame_is_checked_in_slices_and_then_published() {
    let [began, moved, done] = [(); 3].map(|()| Rc::new(Cell::new(0)));
    let admission_check =
        Slow { left: 0, began: began.clone(), moved: moved.clone(), published: done.clone() };
    let (mut assembler, mut reader) = bus_with(admission_check);
    let packets = frame(1, false);
    for packet in &packets {
        assembler.accept(packet, Millis(0)).unwrap();
        assert!(matches!(assembler.advance(2), Ok(Advance::Idle | Advance::Pending)));
    }
    assert_eq!((began.get(), moved.get(), done.get()), (1, N as u32, 0));
    let next = frame(2, false);
    assert_eq!(assembler.accept(&next[0], Millis(0)), Err(ReceiveError::Busy { epoch: 2 }));
    let refused = ReceiveError::Refused { epoch: 2, cause: Event::Busy };
    assert_eq!(assembler.accept(&next[1], Millis(0)), Err(refused));
    // 2 of 100 units of work were done after each packet.
    let left = 100 - 2 * packets.len() as u32;
    for _ in 0..left / 2 - 1 {
        assert_eq!(assembler.advance(2), Ok(Advance::Pending));
        assert!(published(&mut reader).is_none());
    }
    assert_eq!(assembler.advance(2), Ok(Advance::Published { epoch: 1 }));
    assert_eq!(done.get(), 1);
    assert_eq!(published(&mut reader).unwrap().0, 1);
}

#[test]
fn a_frame_that_meets_a_read_is_held_and_published_later() {
    let (mut assembler, mut reader) = bus();
    for packet in frame(1, false) {
        give(&mut assembler, &packet).unwrap();
    }
    let guard = reader.read().unwrap();
    let second = frame(2, true);
    for packet in &second {
        assembler.accept(packet, Millis(0)).unwrap();
    }
    assert_eq!(assembler.advance(9), Ok(Advance::Held { epoch: 2 }));
    assert_eq!(assembler.accept(second.last().unwrap(), Millis(0)), Ok(Progress::Duplicate));
    assert_eq!(assembler.advance(9), Ok(Advance::Held { epoch: 2 }));
    assert_eq!(guard.label().epoch, 1);
    drop(guard);
    assert_eq!(assembler.advance(9), Ok(Advance::Published { epoch: 2 }));
    assert_eq!(published(&mut reader).unwrap().0, 2);
    // The next frame's begin publishes a held frame as well.
    let guard = reader.read().unwrap();
    for packet in frame(3, false) {
        assembler.accept(&packet, Millis(0)).unwrap();
    }
    assert_eq!(assembler.advance(9), Ok(Advance::Held { epoch: 3 }));
    let fourth = frame(4, false);
    assert_eq!(assembler.accept(&fourth[0], Millis(0)), Err(ReceiveError::Busy { epoch: 4 }));
    drop(guard);
    assert_eq!(assembler.accept(&fourth[0], Millis(0)), Ok(Progress::Begun { epoch: 4 }));
    assert_eq!(published(&mut reader).unwrap().0, 3);
    assert_eq!(assembler.counters().of(Event::Abandoned), 0);
}

#[test]
fn what_cannot_be_sent_is_named() {
    let mut positions = surface(1);
    let grid = encoding(true, &positions);
    positions[17].y = f32::NAN;
    for encoding in [Encoding::Float, grid] {
        let error = FrameEncoder::<_, 64>::new(id(1), encoding, &positions[..]).err();
        assert_eq!(error, Some(EncodeError::NotFinite { row: 17 }));
    }
    positions[17].y = 99.0;
    let error = FrameEncoder::<_, 64>::new(id(1), grid, &positions[..]).err();
    assert_eq!(error, Some(EncodeError::OutOfBox { row: 17 }));
    let error = FrameEncoder::<_, 64>::new(id(1), grid, &positions[..0]).err();
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
    assert!(matches!(vertices.rows, PacketRows::Quantised(_)));
    assert_eq!((vertices.first, vertices.rows.len()), (0, 7));
    assert!(!vertices.rows.is_empty());
}
