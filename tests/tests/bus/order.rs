//! The order of frames, heartbeats and statuses: sessions, epochs, and the wraps of their counters.

// Requirement: B-01

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    Body, Counters, EncodeError, Encoding, Event, FrameEncoder, FrameId, NoMac, Packet,
    encode_heartbeat, encode_status,
};
use dibs_nostd::{
    Advance, Assembler, Frames, LastHeartbeat, Millis, NoAdmissionCheck, Progress, ReceiveError,
    VertexTable,
};
use dibs_tests::bus::*;

/// The packets of a frame of any session.
fn frame_of(session: u32, epoch: u32) -> Vec<Vec<u8>> {
    let id = FrameId { mesh_id: MESH, session, epoch };
    let positions = surface(epoch ^ session);
    collect(FrameEncoder::<_, 64>::new(id, Encoding::Float, &positions[..]).unwrap())
}

/// Sends a frame. Returns the outcome of its last packet.
fn send(assembler: &mut Bus, session: u32, epoch: u32) -> Result<Option<u32>, ReceiveError> {
    let mut last = Ok(None);
    for packet in frame_of(session, epoch) {
        last = give(&mut assembler.0, &packet);
    }
    last
}

fn heartbeat(session: u32, epoch: u32, beat: u32) -> Vec<u8> {
    let id = FrameId { mesh_id: MESH, session, epoch };
    encode_heartbeat(&id, beat, None, &NoMac, &mut [0; 64]).to_vec()
}

#[test]
fn epochs_wrap() {
    let mut bus = bus();
    for epoch in [u32::MAX - 1, u32::MAX, 0, 1, 0x7FFF_FFFF, 0xFFFF_FFFE_u32, 5] {
        assert_eq!(send(&mut bus, 1, epoch), Ok(Some(epoch)));
        // The same epoch, older ones, and the smallest one that is too far ahead.
        for stale in
            [epoch, epoch.wrapping_sub(1), epoch.wrapping_sub(0x7FFF_FFFF), epoch ^ (1 << 31)]
        {
            let packets = frame_of(1, stale);
            assert_eq!(give(&mut bus.0, &packets[0]), Err(ReceiveError::Stale { epoch: stale }));
            assert_eq!(give(&mut bus.0, &packets[1]), Err(ReceiveError::Stale { epoch: stale }));
        }
        assert_eq!(published(&mut bus.1).unwrap().0, epoch);
    }
}

/// Whatever their epochs, a frame of a later session is accepted, and one of an earlier session refused.
#[test]
fn sessions_supersede_and_wrap() {
    let mut bus = bus();
    let mut last = None;
    for session in [7, 8, 0x7FFF_FFFF, 0xFFFF_0000, 0xFFFF_FFFF, 0, 0x0001_0000, 0x0002_0000] {
        // The epochs go back with each session.
        for epoch in [100_u32.wrapping_sub(session >> 16), 0x4000_0000] {
            assert_eq!(send(&mut bus, session, epoch), Ok(Some(epoch)), "session {session:#x}");
        }
        if let Some(before) = last {
            let begin = &frame_of(before, 0x5000_0000)[0];
            let stale = ReceiveError::Stale { epoch: 0x5000_0000 };
            assert_eq!(give(&mut bus.0, begin), Err(stale), "session {before:#x}");
        }
        assert_eq!(bus.0.published().map(|id| id.session), Some(session));
        last = Some(session);
    }
}

/// Sessions that differ only in their upper halves: a packet of rows only contains the lower half.
#[test]
fn sessions_are_told_apart_by_both_halves() {
    let mut bus = bus();
    assert_eq!(send(&mut bus, 0x0001_0005, 3), Ok(Some(3)));
    let old = frame_of(0x0001_0005, 9);
    let new = frame_of(0x0002_0005, 9);
    give(&mut bus.0, &new[0]).unwrap();
    give(&mut bus.0, &new[1]).unwrap();
    // A late packet of the old session is stored; the digest reveals it.
    give(&mut bus.0, &old[2]).unwrap();
    for packet in &new[3..new.len() - 1] {
        give(&mut bus.0, packet).unwrap();
    }
    let outcome = give(&mut bus.0, new.last().unwrap());
    assert!(matches!(outcome, Err(ReceiveError::Digest { .. })), "{outcome:?}");
    assert_eq!(published(&mut bus.1).unwrap().0, 3);
}

#[test]
fn a_newer_frame_supersedes_an_unfinished_one() {
    for (session, epoch) in [(1, 2), (2, 1), (2, 0)] {
        let mut bus = bus();
        let (first, second) = (frame_of(1, 1), frame_of(session, epoch));
        for packet in &first[..5] {
            give(&mut bus.0, packet).unwrap();
        }
        assert_eq!(bus.0.accept(&second[0], Millis(0)), Ok(Progress::Begun { epoch }));
        assert_eq!(bus.0.counters().of(Event::Abandoned), 1);
        // The rest of the first frame is refused, including its begin.
        assert_eq!(give(&mut bus.0, &first[0]), Err(ReceiveError::Stale { epoch: 1 }));
        if epoch != 1 {
            let refused = ReceiveError::Refused { epoch: 1, cause: Event::Stale };
            assert_eq!(give(&mut bus.0, &first[5]), Err(refused));
        }
        for packet in &second[1..] {
            give(&mut bus.0, packet).unwrap();
        }
        assert_eq!(bus.0.published(), Some(FrameId { mesh_id: MESH, session, epoch }));
    }
}

/// A begin from the far future without further packets blocks the line for a tenth of a second.
#[test]
fn a_stray_begin_does_not_block_the_line() {
    for (session, epoch) in [(1, 0x3000_0000), (0x4000_0000, 7)] {
        let mut bus = bus();
        let start = u32::MAX - 150;
        for packet in frame_of(1, 1) {
            give_at(&mut bus.0, &packet, start).unwrap();
        }
        assert_eq!(bus.0.published().map(|id| id.epoch), Some(1));
        give_at(&mut bus.0, &frame_of(session, epoch)[0], start).unwrap();
        let send_at = |bus: &mut Bus, epoch: u32, after: u32| {
            let mut last = Ok(None);
            for packet in frame_of(1, epoch) {
                last = give_at(&mut bus.0, &packet, start.wrapping_add(after));
            }
            last
        };
        for (epoch, after) in [(2, 20), (3, 40), (4, 60), (5, 80), (6, 99)] {
            assert!(send_at(&mut bus, epoch, after).is_err());
        }
        assert_eq!(send_at(&mut bus, 7, 100), Ok(Some(7)));
        // While its packets arrive, a frame is not displaced.
        let ahead = frame_of(session, epoch);
        for (place, packet) in (3..).zip(&ahead[..ahead.len() - 1]) {
            let now = start.wrapping_add(90 * place);
            give_at(&mut bus.0, packet, now).unwrap();
            let begin = &frame_of(1, 8)[0];
            let outcome = give_at(&mut bus.0, begin, now.wrapping_add(89));
            assert_eq!(outcome, Err(ReceiveError::Stale { epoch: 8 }));
        }
        assert_eq!(give(&mut bus.0, ahead.last().unwrap()), Ok(Some(epoch)));
    }
}

/// A frame of as many packets as the sequence can number is sent; with one row more it is refused.
#[test]
fn the_sequence_is_used_up_to_its_end() {
    const ROWS: usize = 3 * 65_534;
    static FRAMES: Frames<ROWS> = Frames::new();
    let (writer, mut reader) = FRAMES.split().unwrap();
    let mut assembler = Assembler::new(writer, NoAdmissionCheck, MESH, 1e6);
    let positions: Vec<_> = (0..ROWS).map(|i| Vec3::splat(i as f32)).collect();
    let mut encoder = FrameEncoder::<_, 64>::new(id(1), Encoding::Float, &positions[..]).unwrap();
    let mut buffer = [0; 64];
    let mut packets = 0;
    while let Some(packet) = encoder.next_packet(&mut buffer) {
        assembler.accept(packet, Millis(0)).unwrap();
        packets += 1;
    }
    assert_eq!(packets, 65_536);
    assert!(matches!(assembler.advance(9), Ok(Advance::Published { epoch: 1 })));
    let frame = reader.read().unwrap();
    for row in [0, 1, 98_304, ROWS as u32 - 1] {
        let position = frame.position(row).unwrap();
        assert_eq!(position.x, row as f32);
    }
    let more = [&positions[..], &positions[..1]].concat();
    let refused = FrameEncoder::<_, 64>::new(id(1), Encoding::Float, &more[..]).err();
    let expected = EncodeError::Packets { packets: 65_535 };
    assert_eq!(refused, Some(expected));
}

#[test]
fn heartbeats_are_in_order_and_wrap() {
    let (mut assembler, _) = bus();
    assert_eq!(assembler.last_heartbeat(), None);
    for (beat, received) in [(u32::MAX - 1, 5), (u32::MAX, 6), (0, u32::MAX), (9, 0)] {
        let packet = heartbeat(3, 77, beat);
        assert_eq!(assembler.accept(&packet, Millis(received)), Ok(Progress::Heartbeat));
        let last = LastHeartbeat { session: 3, beat, epoch: 77, received: Millis(received) };
        assert_eq!(assembler.last_heartbeat(), Some(last));
        for replayed in [beat, beat.wrapping_sub(1), beat ^ (1 << 31)] {
            let packet = heartbeat(3, 78, replayed);
            assert_eq!(
                assembler.accept(&packet, Millis(0)),
                Err(ReceiveError::Stale { epoch: 78 })
            );
        }
        assert_eq!(assembler.last_heartbeat(), Some(last));
    }
    // A later session has its own count; an earlier one is refused.
    assert_eq!(assembler.accept(&heartbeat(4, 1, 0), Millis(1)), Ok(Progress::Heartbeat));
    assert_eq!(
        assembler.accept(&heartbeat(3, 99, 10), Millis(1)),
        Err(ReceiveError::Stale { epoch: 99 })
    );
    assert_eq!(assembler.counters().of(Event::Heartbeat), 5);
}

/// Heartbeats of an unknown session are accepted until the sender's next frame is published.
#[test]
fn a_published_frame_decides_whose_heartbeats_count() {
    let mut bus = bus();
    bus.0.accept(&heartbeat(0x5000_0000, 1, 1), Millis(0)).unwrap();
    let ours = heartbeat(6, 1, 1);
    assert_eq!(bus.0.accept(&ours, Millis(0)), Err(ReceiveError::Stale { epoch: 1 }));
    assert_eq!(send(&mut bus, 6, 1), Ok(Some(1)));
    assert_eq!(bus.0.last_heartbeat(), None);
    assert_eq!(bus.0.accept(&ours, Millis(0)), Ok(Progress::Heartbeat));
    assert_eq!(bus.0.accept(&heartbeat(5, 1, 9), Millis(0)), Err(ReceiveError::Stale { epoch: 1 }));
}

#[test]
fn a_status_says_what_was_published() {
    let mut bus = bus();
    let nothing = bus.0.status(Millis(50), 3);
    assert_eq!((nothing.published, nothing.wants_whole, nothing.safety), (None, false, 3));
    for packet in frame_of(0x0009_0001, 5) {
        bus.0.accept(&packet, Millis(100)).unwrap();
    }
    bus.0.advance(9).unwrap();
    let status = bus.0.status(Millis(130), 1);
    assert_eq!(status.number, nothing.number + 1);
    let shown = status.published.unwrap();
    assert_eq!((shown.session, shown.epoch, shown.age_ms), (0x0009_0001, 5, 30));
    assert_eq!(shown.stretch, None);
    // The age does not go back when the clock wraps.
    let ages = [0x8000_0000, 0xFFFF_FFFF, 99, 130, 0x8000_0000]
        .map(|now| bus.0.status(Millis(now), 1).published.unwrap().age_ms);
    assert_eq!(ages, [0x8000_0000 - 100, u32::MAX - 100, u32::MAX, u32::MAX, u32::MAX]);
}

/// A few statuses carry every counter, and are decoded as they were encoded.
#[test]
fn statuses_carry_all_counters_in_turn() {
    let mut bus = bus();
    for epoch in 1..=7 {
        send(&mut bus, 1, epoch).unwrap();
    }
    send(&mut bus, 1, 3).unwrap_err();
    give(&mut bus.0, &frame_of(1, 9)[1]).unwrap_err();
    let mut copy = Counters::new();
    let mut statuses = 0;
    while copy != *bus.0.counters() {
        let status = bus.0.status(Millis(1), 0);
        let mut buffer = [0; 64];
        let packet = encode_status(MESH, &status, bus.0.counters(), &NoMac, &mut buffer);
        let Body::Status(report) = Packet::decode(packet).unwrap().body else { panic!() };
        assert_eq!(report.status, status);
        copy.update(&report);
        statuses += 1;
        assert!(statuses <= 8, "24 counters, 3 in a packet");
    }
    assert_eq!(copy.of(Event::Published), 7);
    assert!(copy.rejected() > 0);
}
