//! Attacks on bus and sender by somebody without the key, and accidents with the same effect. Each once succeeded.

// Requirement: B-03

use std::cell::Cell;
use std::time::Duration;

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{
    AesCmac, Code, Content, Direction, Encoding, FrameEncoder, FrameId, Freshness, Mac, NoMac,
    encode_heartbeat,
};
use dibs_nostd::{Assembler, Millis, NoAdmissionCheck, ReceiveError};
use dibs_stream::SendError;
use dibs_tests::bus::*;

use crate::line::*;

/// An attacker has recorded the begin of an unfinished frame, and replays it after every later begin.
#[test]
fn a_replayed_begin_displaces_nothing() {
    let (mut assembler, _reader) = guarded(mac());
    let (mut recorded, mut published) = (Vec::new(), 0);
    for epoch in 1..=1000 {
        let now = 20 * epoch;
        let packets = tagged(id(epoch), &surface(epoch), Freshness::default());
        if epoch == 20 {
            recorded.clone_from(&packets[0]);
        }
        for (place, packet) in packets.iter().enumerate() {
            if epoch == 20 && place == 5 {
                continue; // lost by itself
            }
            let _ = assembler.accept(packet, Millis(now));
            if epoch > 20 && place == 0 {
                for _ in 0..2 {
                    let replayed = assembler.accept(&recorded, Millis(now));
                    assert_eq!(replayed, Err(ReceiveError::Stale { epoch: 20 }));
                }
            }
        }
        published += u32::from(work(&mut assembler).is_some());
    }
    assert_eq!(published, 999);
    assert_eq!(assembler.health().rejections, 0, "replays are no trouble of the line");
}

/// The receiver has published a frame of the sender's session that the sender has not sent: one from its earlier run,
/// or a forged one, 2^31 - 1 epochs ahead. The sender moves to the next session.
#[test]
fn a_sender_is_not_locked_out_of_its_session() {
    for ahead in [5000, i32::MAX as u32] {
        let (mut assembler, _reader) = guarded(mac());
        for packet in tagged(FrameId { session: 9, ..id(ahead) }, &surface(1), Freshness::default())
        {
            assembler.accept(&packet, Millis(0)).unwrap();
        }
        assert_eq!(work(&mut assembler), Some(ahead));
        let mut source = Source::new(9, keyed);
        source.meet(&mut assembler, 1);
        assert_eq!((source.sender.acknowledged(), source.sender.in_flight()), (None, 0));
        for n in 0..100 {
            let published = source.frame(&mut assembler, n, 20 * n + 20);
            source.hear(&mut assembler, 20 * n + 25, 1).unwrap();
            assert_eq!(published, Some(n + 1));
            assert_eq!(source.sender.acknowledged(), published);
        }
        assert_eq!(source.sender.session(), 10);
    }
}

/// The later of two senders takes over, and the earlier one gets an error: frames of both never alternate.
#[test]
fn of_two_senders_one_is_told_to_stop() {
    let (mut assembler, _reader) = guarded(mac());
    let (mut first, mut second) = (Source::new(100, keyed), Source::new(50, keyed));
    first.meet(&mut assembler, 0);
    for n in 1..5 {
        assert!(first.frame(&mut assembler, n, 40 * n).is_some());
        first.hear(&mut assembler, 40 * n + 1, 1).unwrap();
    }
    second.meet(&mut assembler, 200);
    assert!(second.frame(&mut assembler, 3, 201).is_some());
    let told = first.hear(&mut assembler, 202, 1);
    assert!(matches!(told, Err(SendError::Superseded { session: 101 })), "{told:?}");
    let refused = first.sender.send(&surface(9));
    assert!(matches!(refused, Err(SendError::Superseded { .. })), "{refused:?}");
    for n in 6..50 {
        second.hear(&mut assembler, 40 * n, 1).unwrap();
        assert!(second.frame(&mut assembler, n, 40 * n).is_some());
        assert!(first.sender.poll().is_err());
    }
    assert_eq!(assembler.published().map(|id| id.session), Some(101));
}

/// Replayed statuses, of this run and of an earlier one, change nothing in the sender.
#[test]
fn recorded_statuses_are_not_believed() {
    let (mut assembler, _reader) = guarded(mac());
    let mut source = Source::new(9, keyed);
    source.meet(&mut assembler, 0);
    let mut recorded = Vec::new();
    for n in 1..60 {
        recorded.push(status(&mut assembler, 20 * n, 1));
        source.pipe.answer(recorded.last().unwrap());
        source.sender.poll().unwrap();
        assert!(source.frame(&mut assembler, n, 20 * n).is_some());
    }
    source.hear(&mut assembler, 1200, 3).unwrap(); // the controller is safe now
    let (acknowledged, in_flight) = (source.sender.acknowledged(), source.sender.in_flight());
    let earlier = status(&mut guarded(keyed(5)).0, 0, 1);
    for (n, replayed) in (60..).zip(recorded.iter().chain([&earlier])) {
        source.pipe.answer(replayed);
        source.sender.poll().unwrap();
        assert_eq!(source.sender.status().unwrap().safety, 3);
        assert_eq!(source.sender.acknowledged(), acknowledged);
        assert_eq!(source.sender.in_flight(), in_flight + n - 60);
        source.set_clock(20 * n);
        let sent = source.sender.send(&surface(n)).unwrap();
        assert!(matches!(sent.content, Content::Partial { .. }), "no whole frame is asked for");
        let published = deliver(&mut assembler, &source.pipe.sent(), 20 * n);
        assert!(published.is_some(), "the challenge is still the receiver's");
    }
    // A receiver that really restarted is accepted, once it answers the sender's hello.
    let (mut anew, _reader) = guarded(keyed(78));
    source.set_clock(9999);
    source.meet(&mut anew, 9999);
    assert!(source.frame(&mut anew, 3, 10_000).is_some());
}

/// A delay of ten minutes, of the frames or of the statuses, appears in the transit time.
#[test]
fn delay_shows_whoever_is_delayed() {
    for (frames_late, statuses_late) in [(0, 0), (600_000, 0), (0, 600_000)] {
        let (mut assembler, _reader) = guarded(mac());
        let mut source = Source::new(9, keyed);
        source.meet(&mut assembler, 0);
        let start = 1_000_000;
        // The sender's last status was made at `heard`, and it sends at `start`.
        let heard = start - 30 - statuses_late;
        source.hear(&mut assembler, heard, 1).unwrap();
        source.set_clock(start);
        source.sender.send_captured(&surface(1), Duration::from_millis(12)).unwrap();
        for packet in source.pipe.sent() {
            assembler.accept(&packet, Millis(start + 2 + frames_late)).unwrap();
        }
        assert!(work(&mut assembler).is_some());
        let health = assembler.health();
        assert_eq!(health.transit, Millis(32 + frames_late + statuses_late));
        assert_eq!(health.source_age, Millis(12));
        let age =
            assembler.status(Millis(start + 2 + frames_late + 5), 1).published.unwrap().age_ms;
        assert_eq!(age, 12 + 5, "the age counts from the capture");
    }
    // A sender that has received no status, and senders that echo a time that this receiver's clock has not reached.
    for echo in [None, Some(1017), Some(1 << 31)] {
        let (mut assembler, _reader) = guarded(mac());
        for packet in tagged(id(1), &surface(1), Freshness { age_ms: 3, echo }) {
            assembler.accept(&packet, Millis(1000)).unwrap();
        }
        assert!(work(&mut assembler).is_some());
        assert_eq!(assembler.health().transit, Millis::MAX);
    }
}

/// A control tick may interrupt the bus between a frame's publication and the note of its delay: the delay counts before.
#[test]
fn the_worse_delay_counts_from_before_the_publication() {
    let (mut assembler, _reader) = guarded(mac());
    let delays = |assembler: &Assembler<'_, _, _>| {
        let health = assembler.health();
        [health.transit.0, health.source_age.0]
    };
    assert_eq!(delays(&assembler), [u32::MAX; 2], "nothing was published");
    let mut shown = [u32::MAX; 2];
    // Each frame's transit and age, one of them better or worse than before.
    for (epoch, stated) in (1..).zip([[20, 3], [60, 1], [10, 40], [5, 4]]) {
        let [transit, age_ms] = stated;
        let now = 1_000 * epoch;
        let freshness = Freshness { age_ms: age_ms as u16, echo: Some(now - transit) };
        let packets = tagged(id(epoch), &surface(epoch), freshness);
        let (last, first) = packets.split_last().unwrap();
        for packet in first {
            assembler.accept(packet, Millis(now)).unwrap();
            assert_eq!(delays(&assembler), shown, "an incomplete frame may never be published");
        }
        assembler.accept(last, Millis(now)).unwrap();
        let worse = [shown[0].max(transit), shown[1].max(age_ms)];
        assert_eq!(delays(&assembler), worse, "frame {epoch}");
        assert!(work(&mut assembler).is_some());
        shown = stated;
        assert_eq!(delays(&assembler), shown, "frame {epoch}");
    }
}

/// The source repeats its last frame, while its sender keeps sending.
#[test]
fn a_frozen_source_grows_old() {
    let (mut assembler, mut reader) = guarded(NoMac);
    let mut source = Source::new(9, |_| NoMac);
    source.meet(&mut assembler, 0);
    for n in 0..10 {
        let moment = if n < 5 { n } else { 5 };
        assert!(source.frame(&mut assembler, moment, 1000 * n).is_some());
        let age = 1000 * n.saturating_sub(5);
        assert_eq!(assembler.health().source_age, Millis(age));
        assert_eq!(reader.latest(Millis(1000 * n + 7)).frame().unwrap().age, Millis(age + 7));
    }
    // The age exceeds what a packet can state: the surface stays the last one whose age was known.
    assert!(source.frame(&mut assembler, 5, 200_000).is_none());
    assert_eq!(assembler.health().source_age, Millis(4_000));
    assert_eq!(reader.latest(Millis(200_000)).frame().unwrap().age, Millis(195_000));
    assert!(source.frame(&mut assembler, 6, 200_001).is_some());
    assert_eq!(assembler.health().source_age, Millis(0));
}

/// Two frames of one session and epoch, both with authentic tags, are mixed. The mixture is refused: the digest is the
/// sum of contributions that nobody can compute without the key.
#[test]
fn two_frames_of_one_name_are_not_spliced() {
    let rows: [Vec<Vec3>; 2] = [surface(1), surface(500)];
    let [a, b] = rows.map(|rows| tagged(id(1), &rows, Freshness::default()));
    assert_eq!(a[0], b[0], "the begins are the same");
    let last = a.len() - 1;
    for mixture in [1, 0b11, 0b1010_1010_1010, 0b1111_1111_1111] {
        let (mut assembler, mut reader) = guarded(mac());
        let mut outcome = Ok(None);
        for i in 0..=last {
            let is_other = (1..=12).contains(&i) && mixture >> (i - 1) & 1 == 1;
            outcome = give(&mut assembler, if is_other { &b[i] } else { &a[i] });
        }
        assert!(matches!(outcome, Err(ReceiveError::Digest { .. })), "{outcome:?}");
        assert!(published(&mut reader).is_none());
    }
    // The digest is the sum of the contributions, which are not in any packet.
    let code = |i: usize| mac().code(Direction::ToReceiver, 1, &a[i][..a[i].len() - 10]);
    let sum = (0..last).fold(0_u32, |sum, i| sum.wrapping_add(code(i).contribution));
    assert_eq!(a[last][18..22], sum.to_le_bytes());
    for (i, packet) in a.iter().enumerate() {
        assert_eq!(packet[packet.len() - 10..packet.len() - 4], code(i).tag);
        assert!(!packet.windows(4).any(|four| four == code(i).contribution.to_le_bytes()));
    }
}

/// The same packet has different tags for different receivers, and for the other direction.
#[test]
fn keys_differ_by_receiver_and_direction() {
    let packet = [7; 40];
    let codes: Vec<Code> = [RECEIVER, RECEIVER + 1]
        .iter()
        .flat_map(|&receiver| {
            let mac = AesCmac::new(&KEY, receiver, 77);
            [Direction::ToReceiver, Direction::ToSender].map(|way| mac.code(way, 1, &packet))
        })
        .collect();
    for (i, one) in codes.iter().enumerate() {
        assert!(
            codes[..i]
                .iter()
                .all(|other| other.tag != one.tag && other.contribution != one.contribution)
        );
    }
}

/// The fail-safe machine counts one rejection for a fault, however many packets are rejected because of it.
#[test]
fn a_frame_counts_once() {
    let (mut assembler, _reader) = bus();
    let rejections =
        |assembler: &Assembler<'static, NoAdmissionCheck>| assembler.health().rejections;
    for packet in frame(1, true) {
        give(&mut assembler, &packet).unwrap();
    }
    // The begin is lost, so none of the following packets is expected.
    for packet in &frame(2, true)[1..] {
        give(&mut assembler, packet).unwrap_err();
    }
    assert_eq!(rejections(&assembler), 1);
    assert!(assembler.counters().rejected() > 5);
    // The next frame's begin is damaged, and its packets arrive twice: damage has no frame, but the other packets have.
    let mut third = frame(3, true);
    third[0][30] ^= 1;
    for packet in third.iter().chain(&third) {
        give(&mut assembler, packet).unwrap_err();
    }
    assert_eq!(rejections(&assembler), 2);
    // Packets of other meshes and of past frames are not counted, however often they are repeated.
    let other = FrameId { mesh_id: MESH ^ 1, ..id(9) };
    let rows = surface(9);
    let foreign = collect(FrameEncoder::<_, 64>::new(other, Encoding::Float, &rows[..]).unwrap());
    for packet in foreign.iter().chain(&frame(1, true)).chain(&frame(2, true)[1..]) {
        for _ in 0..3 {
            give(&mut assembler, packet).unwrap_err();
        }
    }
    assert_eq!(rejections(&assembler), 2);
    // Damage is only counted by cause, until it costs a frame.
    for _ in 0..9 {
        give(&mut assembler, &[0; 64]).unwrap_err();
    }
    assert_eq!(rejections(&assembler), 2);
    let mut fourth = frame(4, true);
    fourth[2][30] ^= 1;
    for packet in &fourth {
        let _ = give(&mut assembler, packet);
    }
    assert_eq!(rejections(&assembler), 2, "the packet may come again");
    for packet in &frame(5, true)[..3] {
        give(&mut assembler, packet).unwrap();
    }
    assert_eq!(rejections(&assembler), 3, "frame 4 was abandoned");
    for packet in &frame(5, true)[3..] {
        give(&mut assembler, packet).unwrap();
    }
    assert_eq!(rejections(&assembler), 0);
    // Replays of past frames, before any other fault.
    for packet in frame(5, true).iter().chain(&frame(1, true)) {
        give(&mut assembler, packet).unwrap_err();
    }
    let health = assembler.health();
    assert_eq!((health.rejections, health.forgeries), (0, 0));
}

/// A MAC that counts its calls.
struct Counting(AesCmac, Cell<u32>);

impl Mac for &Counting {
    const TAGGED: bool = true;

    fn code(&self, direction: Direction, session: u32, packet: &[u8]) -> Code {
        self.1.set(self.1.get() + 1);
        self.0.code(direction, session, packet)
    }

    fn challenge(&self) -> u64 {
        self.0.challenge()
    }
}

/// Forgeries are counted separately, and the receiver computes one code for each.
#[test]
fn a_forgery_is_verified_once_and_counted_apart() {
    let counting = Box::leak(Box::new(Counting(mac(), Cell::new(0))));
    let (mut assembler, _reader) = guarded(&*counting);
    let rows = surface(1);
    let wrong = AesCmac::new(b"another's guess.", RECEIVER, 77);
    let encoder =
        FrameEncoder::<_, 64>::partial(id(2), Encoding::Float, &rows[..], 1, &rows[..]).unwrap();
    let partial = collect(encoder.with_mac(wrong).unwrap());
    for n in 1..=10 {
        assert_eq!(
            assembler.accept(&partial[0], Millis(n)),
            Err(ReceiveError::Forged { epoch: 2 })
        );
        assert_eq!(counting.1.get(), n);
        let health = assembler.health();
        assert_eq!((health.forgeries, health.rejections, health.packet), (n, 0, None));
    }
    let genuine = tagged(id(1), &rows, Freshness::default());
    for (n, packet) in (11..).zip(&genuine) {
        assembler.accept(packet, Millis(n)).unwrap();
        assert_eq!(counting.1.get(), n);
    }
    assert!(work(&mut assembler).is_some());
    assert_eq!(assembler.health().forgeries, 0);
}

/// The sender has stopped, and somebody repeats its packets or sends hellos in its name.
#[test]
fn repetitions_are_no_sign_of_life() {
    let (mut assembler, _reader) = bus();
    let packets = frame(1, true);
    assembler.accept(&packets[0], Millis(5)).unwrap();
    let beat = encode_heartbeat(&id(1), 1, None, &NoMac, &mut [0; 64]).to_vec();
    assembler.accept(&beat, Millis(6)).unwrap();
    let hello = dibs_nostd::wire::encode_hello(&id(1), 3, &NoMac, &mut [0; 64]).to_vec();
    for now in 7..100 {
        for packet in [&packets[0], &beat, &hello] {
            let _ = assembler.accept(packet, Millis(now));
        }
    }
    let health = assembler.health();
    assert_eq!((health.packet, health.heartbeat), (Some(Millis(6)), Some(Millis(6))));
    assert_eq!(assembler.status(Millis(100), 1).answer.map(|answer| answer.nonce), Some(3));
}
