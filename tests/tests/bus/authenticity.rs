//! Packets with tags: without the right key nothing is published; replays and forgeries are counted.

// Requirement: B-03

use dibs_nostd::wire::{
    AesCmac, Body, Counters, Encoding, Event, FrameEncoder, FrameId, Mac, NoMac, Packet,
    StatusAnswer, TAG_BYTES, WeightsEncoder, encode_heartbeat, encode_hello, encode_status,
};
use dibs_nostd::{
    Assembler, FrameReader, Frames, Millis, NoAdmissionCheck, Progress, ReceiveError, SurfaceFacts,
};
use dibs_tests::bus::*;
use proptest::prelude::*;

const KEY: [u8; 16] = *b"0123456789abcdef";
const CHALLENGE: u64 = 0x5EED_0000_00C0_FFEE;
const RECEIVER: u32 = 7;

type Guarded = (Assembler<'static, NoAdmissionCheck, AesCmac>, FrameReader<'static>);

fn mac() -> AesCmac {
    AesCmac::new(&KEY, RECEIVER, CHALLENGE)
}

fn guarded() -> Guarded {
    let frames: &'static Frames<N> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().unwrap();
    (Assembler::with_mac(writer, NoAdmissionCheck, MESH, 100.0, mac()), reader)
}

fn tagged(session: u32, epoch: u32, mac: &AesCmac) -> Vec<Vec<u8>> {
    let positions = surface(epoch);
    let id = FrameId { mesh_id: MESH, session, epoch };
    let encoder = FrameEncoder::<_, 64>::new(id, Encoding::Float, &positions[..]).unwrap();
    collect(encoder.with_mac(mac).unwrap())
}

#[test]
fn everything_fits_a_can_message() {
    let (mut assembler, mut reader) = guarded();
    let packets = tagged(1, 1, &mac());
    assert_eq!(packets.len(), 2 + N.div_ceil(3), "three float rows a packet");
    assert!(packets.iter().all(|packet| packet.len() <= 64));
    for packet in &packets {
        give(&mut assembler, packet).unwrap();
    }
    assert_eq!(published(&mut reader).unwrap().0, 1);
    let positions = surface(2);
    let encoder = FrameEncoder::<_, 64>::new(id(2), encoding(true, &positions), &positions[..]);
    let packets = collect(encoder.unwrap().with_mac(mac()).unwrap());
    assert_eq!(packets.len(), 2 + N.div_ceil(6), "six quantised rows");
    let mut last = None;
    for packet in &packets {
        assert!(packet.len() <= 64);
        last = give(&mut assembler, packet).unwrap();
    }
    assert_eq!(last, Some(2));
    let mut weights = WeightsEncoder::<64>::new(id(3), &[0.5; 10]).unwrap().with_mac(mac());
    let mut buffer = [0; 64];
    let mut packets = 0;
    while weights.next_packet(&mut buffer).is_some() {
        packets += 1;
    }
    assert_eq!(packets, 4, "nine weights");
}

/// Flips each bit of the begin, of a packet of rows and of the commit, and corrects the checksum.
#[test]
fn no_changed_bit_passes() {
    let packets = tagged(1, 1, &mac());
    for which in [0, 1, packets.len() - 1] {
        let (mut assembler, mut reader) = guarded();
        for packet in &packets[..which] {
            give(&mut assembler, packet).unwrap();
        }
        let content = packets[which].len() - 4;
        for bit in 0..8 * content {
            let mut forged = packets[which].clone();
            forged[bit / 8] ^= 1 << (bit % 8);
            let outcome = give(&mut assembler, &reseal(forged));
            assert!(outcome.is_err(), "bit {bit} of packet {which}: {outcome:?}");
        }
        assert!(assembler.counters().of(Event::Forged) >= 60);
        // The authentic packets are still accepted.
        let mut last = None;
        for packet in &packets[which..] {
            last = give(&mut assembler, packet).unwrap();
        }
        assert_eq!(last, Some(1));
        assert_eq!(published(&mut reader).unwrap().0, 1);
    }
}

/// Packets made with another key, another challenge or another receiver's id, or without tags.
#[test]
fn without_key_and_challenge_nothing_is_published() {
    let wrong_key = AesCmac::new(b"0123456789abcdeF", RECEIVER, CHALLENGE);
    let before_restart = mac().with_challenge(CHALLENGE - 1);
    let other_receiver = AesCmac::new(&KEY, RECEIVER + 1, CHALLENGE);
    let forgeries = [
        tagged(1, 1, &wrong_key),
        tagged(1, 1, &before_restart),
        tagged(1, 1, &other_receiver),
        frame(1, false),
    ];
    for packets in forgeries {
        let (mut assembler, mut reader) = guarded();
        assert_eq!(give(&mut assembler, &packets[0]), Err(ReceiveError::Forged { epoch: 1 }));
        for packet in &packets[1..] {
            let refused = match Packet::decode(packet).unwrap().is_tagged() {
                true => ReceiveError::Unverifiable { epoch: 1, cause: Some(Event::Forged) },
                false => ReceiveError::Forged { epoch: 1 },
            };
            assert_eq!(give(&mut assembler, packet), Err(refused));
        }
        assert_eq!(assembler.health().rejections, 0);
        let before = assembler.counters().of(Event::Forged) as usize;
        // Forgeries within an authentic frame are refused as well.
        let genuine = tagged(1, 1, &mac());
        give(&mut assembler, &genuine[0]).unwrap();
        for packet in &packets {
            assert_eq!(give(&mut assembler, packet), Err(ReceiveError::Forged { epoch: 1 }));
        }
        assert!(published(&mut reader).is_none());
        for packet in &genuine[1..] {
            give(&mut assembler, packet).unwrap();
        }
        assert_eq!(published(&mut reader).unwrap().0, 1);
        assert_eq!(assembler.counters().of(Event::Forged) as usize, packets.len() + before);
    }
    // A receiver without a key accepts no tags.
    let (mut open, _) = bus();
    assert_eq!(give(&mut open, &tagged(1, 1, &mac())[0]), Err(ReceiveError::Forged { epoch: 1 }));
}

/// All packets that were ever sent are sent again: no frame is published a second time.
#[test]
fn recordings_are_worth_nothing() {
    let (mut assembler, mut reader) = guarded();
    let mut recorded = Vec::new();
    for (session, epoch) in [(1, 5), (1, 6), (2, 1), (2, 2), (0x0001_0002, 1)] {
        let packets = tagged(session, epoch, &mac());
        for packet in &packets {
            give(&mut assembler, packet).unwrap();
        }
        recorded.extend(packets);
        let name = FrameId { mesh_id: MESH, session, epoch };
        assert_eq!(assembler.published(), Some(name));
        let before = *assembler.counters();
        for packet in &recorded {
            assert!(give(&mut assembler, packet).is_err());
            assert_eq!(published(&mut reader).unwrap().0, epoch);
        }
        let refused = assembler.counters().rejected() - before.rejected();
        assert_eq!(refused as usize, recorded.len());
        assert_eq!(assembler.published(), Some(name));
    }
    // A receiver that has restarted has another challenge, and accepts none of them.
    let frames = Frames::<N>::new();
    let (writer, _reader) = frames.split().unwrap();
    let other = mac().with_challenge(CHALLENGE + 1);
    let mut restarted = Assembler::with_mac(writer, NoAdmissionCheck, MESH, 100.0, other);
    for packet in &recorded {
        assert!(give(&mut restarted, packet).is_err());
    }
    assert_eq!(restarted.published(), None);
}

/// A packet of another frame, with the same epoch, sequence and lower half of the session, is a forgery.
#[test]
fn the_whole_session_is_under_the_tag() {
    let (mut assembler, _) = guarded();
    let (old, new) = (tagged(0x0001_0007, 4, &mac()), tagged(0x0002_0007, 4, &mac()));
    assert_eq!(old[1][..54], new[1][..54], "but for the tag they are the same");
    give(&mut assembler, &new[0]).unwrap();
    assert_eq!(give(&mut assembler, &old[1]), Err(ReceiveError::Forged { epoch: 4 }));
    assert_eq!(give(&mut assembler, &new[1]), Ok(None));
}

#[test]
fn heartbeats_and_statuses_are_under_the_tag() {
    let (mut assembler, _) = guarded();
    let mut buffer = [0; 64];
    let genuine = encode_heartbeat(&id(9), 1, None, &mac(), &mut buffer).to_vec();
    let forged = encode_heartbeat(&id(9), 1, None, &NoMac, &mut buffer).to_vec();
    let other = encode_heartbeat(&id(9), 1, None, &mac().with_challenge(1), &mut buffer).to_vec();
    assert_eq!(genuine.len(), 48);
    for packet in [&forged, &other] {
        assert_eq!(assembler.accept(packet, Millis(0)), Err(ReceiveError::Forged { epoch: 9 }));
    }
    assert_eq!(assembler.accept(&genuine, Millis(0)), Ok(Progress::Heartbeat));
    assert_eq!(assembler.accept(&genuine, Millis(0)), Err(ReceiveError::Stale { epoch: 9 }));

    let status = assembler.status(Millis(0), 1);
    assert_eq!(status.answer, None);
    let packet = encode_status(MESH, &status, assembler.counters(), &mac(), &mut buffer).to_vec();
    assert_eq!(packet.len(), 64, "four counters");
    let decoded = Packet::decode(&packet).unwrap();
    let Body::Status(report) = decoded.body else { panic!() };
    assert_eq!((report.status, report.counters.len()), (status, 4));
    assert!(decoded.is_genuine(&mac(), 0));
    assert!(!decoded.is_genuine(&mac(), 1));
    assert!(!decoded.is_genuine(&NoMac, 0));
    assert!(!decoded.is_genuine(&AesCmac::new(&[0; 16], RECEIVER, CHALLENGE), 0));
    let plain = encode_status(MESH, &status, &Counters::new(), &NoMac, &mut buffer).to_vec();
    assert!(!Packet::decode(&plain).unwrap().is_genuine(&mac(), 0));
}

/// Only a sender with the key gets an answer, with a tag for the receiver's challenge, once for each hello.
#[test]
fn hellos_and_answers_are_under_the_tag() {
    let (mut assembler, _) = guarded();
    let mut buffer = [0; 64];
    let nonce = 0xFEED_0000_0000_0001;
    let other = AesCmac::new(b"0123456789abcdeF", RECEIVER, CHALLENGE);
    let next = AesCmac::new(&KEY, RECEIVER + 1, CHALLENGE);
    let forged = [
        encode_hello(&id(9), nonce, &NoMac, &mut buffer).to_vec(),
        encode_hello(&id(9), nonce, &other, &mut buffer).to_vec(),
        encode_hello(&id(9), nonce, &next, &mut buffer).to_vec(),
    ];
    for hello in &forged {
        assert_eq!(assembler.accept(hello, Millis(0)), Err(ReceiveError::Forged { epoch: 9 }));
        assert_eq!(assembler.status(Millis(0), 1).answer, None);
    }
    // The sender does not know the challenge yet, or knows an old one.
    for known in [0, CHALLENGE, CHALLENGE - 1] {
        let mac = mac().with_challenge(known);
        let hello = encode_hello(&id(9), nonce ^ known, &mac, &mut buffer).to_vec();
        assert_eq!(hello.len(), 48);
        assert_eq!(assembler.accept(&hello, Millis(7)), Ok(Progress::Hello));
        let status = assembler.status(Millis(7), 1);
        let facts = SurfaceFacts { vertices: N as u32, ..SurfaceFacts::default() };
        let answer = StatusAnswer { nonce: nonce ^ known, challenge: CHALLENGE, surface: facts };
        assert_eq!(status.answer, Some(answer));
        assert_eq!(assembler.status(Millis(7), 1).answer, None, "one answer a hello");
        let packet = encode_status(MESH, &status, assembler.counters(), &mac, &mut buffer).to_vec();
        assert_eq!(packet.len(), 64);
        let decoded = Packet::decode(&packet).unwrap();
        let Body::Status(report) = decoded.body else { panic!() };
        assert_eq!(report.status, status);
        assert!(!decoded.is_genuine(&NoMac, 0));
        assert_eq!(decoded.is_genuine(&self::mac(), 0), known == CHALLENGE);
    }
    // A hello's tag is not valid for a frame: kind and direction differ.
    let hello = encode_hello(&id(9), nonce, &mac(), &mut buffer).to_vec();
    let mut heartbeat = hello;
    heartbeat[1] = 0x86;
    assert!(assembler.accept(&reseal(heartbeat), Millis(0)).is_err());
    assert_eq!(assembler.health().rejections, 0);
}

/// The challenge is that of the MAC in use, by value or by reference; without a MAC it is 0.
#[test]
fn the_challenge_is_that_of_the_mac() {
    assert_eq!(mac().challenge(), CHALLENGE);
    assert_eq!(<&AesCmac>::challenge(&&mac()), CHALLENGE);
    assert_eq!(NoMac.challenge(), 0);
}

proptest! {
    /// Guessed tags on random bytes.
    #[test]
    fn guesses_are_forgeries(
        tags in prop::collection::vec(any::<[u8; TAG_BYTES]>(), 1..20),
        noise in prop::collection::vec(any::<u8>(), 0..100),
    ) {
        let (mut assembler, mut reader) = guarded();
        let packets = tagged(1, 1, &mac());
        for tag in &tags {
            for packet in &packets {
                let mut forged = packet.clone();
                let end = forged.len() - 4;
                forged[end - TAG_BYTES..end].copy_from_slice(tag);
                prop_assert!(give(&mut assembler, &reseal(forged)).is_err());
            }
        }
        let _ = give(&mut assembler, &noise);
        prop_assert!(published(&mut reader).is_none());
        prop_assert_eq!(assembler.counters().of(Event::Forged) as usize, tags.len());
    }
}
