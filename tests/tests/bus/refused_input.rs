//! Input of senders and receivers that no frame of the other tests has: each is refused by its name, or taken as
//! documented.

// Requirements: B-01, B-02

use dibs_nostd::wire::canfd::{Identifiers, dlc_of};
use dibs_nostd::wire::{
    Content, Direction, EncodeError, Encoding, Event, FrameEncoder, Mac, NoMac, Packet,
    WeightsEncoder, encode_heartbeat,
};
use dibs_nostd::{
    Assembler, Frames, MAX_COORDINATE, Millis, NoAdmissionCheck, ReceiveError, SurfaceFacts,
    format::Unit,
};
use dibs_tests::bus::{MESH, N, bus, collect, frame, give, id, packets, surface};
use glam::Vec3;

#[test]
fn a_frame_that_cannot_be_sent_is_named() {
    let many = vec![0.5; 300];
    for (weights, expected) in [
        (&many[..0], EncodeError::Rows { rows: 0 }),
        (&many[..], EncodeError::Rows { rows: 300 }),
        (&[0.5, 0.25, f32::NAN, 1.0], EncodeError::NotFinite { row: 2 }),
        (&[f32::INFINITY], EncodeError::NotFinite { row: 0 }),
    ] {
        let refused = WeightsEncoder::<64>::new(id(1), weights).err();
        assert_eq!(refused, Some(expected), "{} weights", weights.len());
    }
    let (now, held) = (surface(2), surface(1));
    let short = FrameEncoder::<_, 64>::partial(id(2), Encoding::Float, &now[..], 1, &held[1..]);
    assert_eq!(short.err(), Some(EncodeError::Base { rows: N - 1 }));
}

/// A number of 24 bits that is larger is sent as unknown.
#[test]
fn counts_beyond_24_bits_are_unknown() {
    let positions = surface(1);
    for (triangles, sent) in
        [((1 << 24) - 1, (1 << 24) - 1), (1 << 24, 0), ((1 << 24) + 5, 0), (u32::MAX, 0)]
    {
        let facts = SurfaceFacts { unit: Some(Unit::Metre), vertices: N as u32, triangles };
        let encoder = FrameEncoder::<_, 64>::new(id(1), Encoding::Float, &positions[..]);
        let packets = collect(encoder.expect("valid").with_surface(facts));
        let begin = Packet::decode(&packets[0]).expect("sound").body;
        let dibs_nostd::wire::Body::Begin(begin) = begin else { panic!("{begin:?}") };
        assert_eq!(begin.surface, SurfaceFacts { triangles: sent, ..facts });
        assert_eq!(begin.content, Content::Whole);
    }
}

/// A receiver's limit does not exceed the coordinates for which distances are accurate.
#[test]
fn no_limit_admits_coordinates_beyond_the_accurate_ones() {
    for (size, is_far) in [(MAX_COORDINATE, false), (MAX_COORDINATE.next_up(), true)] {
        let frames = Frames::<N>::new();
        let (writer, _reader) = frames.split().expect("new");
        let mut assembler = Assembler::new(writer, NoAdmissionCheck, MESH, f32::INFINITY);
        let mut positions = surface(1);
        positions[1] = Vec3::X * size;
        let sent = packets::<64>(1, Encoding::Float, &positions);
        assembler.accept(&sent[0], Millis(0)).expect("a begin");
        let outcome = assembler.accept(&sent[1], Millis(0)).err();
        assert_eq!(outcome, is_far.then_some(ReceiveError::TooFar { row: 1 }), "{size}");
    }
}

/// Vertices in a frame of weights, and no weights in one of vertices.
#[test]
fn rows_of_another_content_are_refused() {
    let (mut assembler, _reader) = bus();
    let good = frame(1, false);
    give(&mut assembler, &good[0]).expect("a begin");
    let mut weights = WeightsEncoder::<64>::new(id(1), &[0.5; N]).expect("valid");
    let mut buffer = [0; 64];
    weights.next_packet(&mut buffer).expect("a begin");
    let values = weights.next_packet(&mut buffer).expect("weights").to_vec();
    assert_eq!(give(&mut assembler, &values), Err(ReceiveError::Encoding));
    assert_eq!(assembler.counters().of(Event::Encoding), 1);
    for packet in &good[1..] {
        give(&mut assembler, packet).expect("the frame continues");
    }
    assert_eq!(assembler.counters().of(Event::Published), 1);
}

#[test]
fn identifiers_and_lengths_of_can_fd_are_those_of_the_standard() {
    assert_eq!(Identifiers::new(0x7FE), None);
    let identifiers = Identifiers::new(0x7FD).expect("the largest");
    let mut buffer = [0; 64];
    let heartbeat = encode_heartbeat(&id(1), 701, None, &NoMac, &mut buffer);
    assert_eq!(identifiers.of(heartbeat), 0x7FD);
    assert_eq!(identifiers.of(&frame(1, false)[0]), 0x7FF);
    assert!(identifiers.is_to_receiver(0x7FD) && identifiers.is_to_sender(0x7FE));
    let lengths = [0, 1, 8, 9, 12, 13, 16, 20, 24, 25, 32, 48, 49, 64, 65].map(dlc_of);
    let codes = [0, 1, 8, 9, 9, 10, 10, 11, 12, 13, 13, 14, 15, 15];
    assert_eq!(lengths[..14], codes.map(Some));
    assert_eq!(lengths[14], None);
}

/// A borrowed code is the code; without one there is no tag to check.
#[test]
fn a_borrowed_mac_is_the_mac() {
    fn code<M: Mac>(mac: M) -> ([u8; 6], u32, u64) {
        let code = mac.code(Direction::ToSender, 1, &[1, 2, 3]);
        (code.tag, code.contribution, mac.challenge())
    }
    assert_eq!(code(NoMac), ([0; 6], 0, 0));
    assert_eq!(code::<&NoMac>(&NoMac), code(NoMac));
    let mac = dibs_nostd::wire::AesCmac::new(b"sixteen letters.", 1, 2);
    assert_eq!(code(&mac), code(mac.clone()));
    assert_ne!(code(&mac).0, [0; 6]);
}
