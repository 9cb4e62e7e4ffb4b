//! Heartbeats and statuses that are delayed, forged, or from far ahead. The fail-safe machine detects a dead sender,
//! and authentic packets recover.

// Requirements: B-04, B-05

use std::collections::VecDeque;
use std::time::Duration;

use dibs_nostd::failsafe::LinkStatus;
use dibs_nostd::format::Unit;
use dibs_nostd::wire::{
    Body, Counters, Event, FrameId, Mac, NoMac, Packet, PublishedStatus, Status, encode_heartbeat,
    encode_hello, encode_status,
};
use dibs_nostd::{Assembler, Millis, ReceiveError, SurfaceFacts, Tree};
use dibs_stream::{SendError, SurfaceOrder};
use dibs_tests::bus::*;

use crate::line::*;

fn beat(session: u32, beat: u32) -> Vec<u8> {
    let id = FrameId { session, ..id(0) };
    encode_heartbeat(&id, beat, None, &NoMac, &mut [0; 64]).to_vec()
}

/// Somebody delays the heartbeats, and forwards one each 990 ms after the sender has stopped.
fn silence_after_death<M: Mac + 'static>(mac: fn(u64) -> M) -> u32 {
    let (mut assembler, _reader) = guarded(mac(77));
    let order = SurfaceOrder::new(MESH, (0..N as u32).collect());
    let mut source = Source::of(order, 9, Some(Duration::from_millis(100)), mac);
    source.meet(&mut assembler, 0);
    let (link, mut bank) = (LinkStatus::new(), VecDeque::new());
    for now in 1..60_000 {
        source.set_clock(now);
        if now % 100 == 0 {
            source.pipe.answer(&status(&mut assembler, now, 1));
        }
        source.sender.poll().unwrap();
        for packet in source.pipe.sent() {
            let is_beat = matches!(Packet::decode(&packet).unwrap().body, Body::Heartbeat(_));
            if is_beat {
                bank.push_back(packet);
            } else {
                let _ = assembler.accept(&packet, Millis(now));
            }
        }
        if now % 990 == 0 {
            assembler.accept(&bank.pop_front().unwrap(), Millis(now)).unwrap();
        }
    }
    assert!(bank.len() > 500);
    let mut silence = 0;
    for now in 60_000..65_000 {
        if now % 990 == 0 {
            assembler.accept(&bank.pop_front().unwrap(), Millis(now)).unwrap();
        }
        link.set(&assembler.health());
        silence = link.read(Millis(now)).heartbeat.0;
    }
    silence
}

#[test]
fn heartbeats_held_back_hide_no_death() {
    for silence in [silence_after_death(keyed), silence_after_death(|_| NoMac)] {
        assert!(silence > 50_000, "the newest heartbeat that came is {silence} ms old");
    }
}

/// Without faults the heartbeat's age is at most the interval of a status plus that of a heartbeat.
#[test]
fn heartbeats_are_as_old_as_the_status_that_they_echo() {
    let (mut assembler, _reader) = guarded(keyed(77));
    let order = SurfaceOrder::new(MESH, (0..N as u32).collect());
    let mut source = Source::of(order, 9, Some(Duration::from_millis(100)), keyed);
    source.meet(&mut assembler, 5);
    let (link, mut most) = (LinkStatus::new(), 0);
    for now in 6..10_000 {
        source.set_clock(now);
        if now % 100 == 0 {
            source.pipe.answer(&status(&mut assembler, now, 1));
        }
        source.sender.poll().unwrap();
        for packet in source.pipe.sent() {
            assembler.accept(&packet, Millis(now)).unwrap();
        }
        link.set(&assembler.health());
        if now > 300 {
            most = most.max(link.read(Millis(now)).heartbeat.0);
        }
    }
    assert!((90..=200).contains(&most), "{most}");
    // After a silence of any length a heartbeat counts.
    for silence in [1_u32 << 31, u32::MAX - 1_000] {
        let later = 10_000_u32.wrapping_add(silence);
        let beat = encode_heartbeat(&id(1), 1, Some(later), &NoMac, &mut [0; 64]).to_vec();
        let (mut open, _reader) = guarded(NoMac);
        let first = encode_heartbeat(&id(1), 0, Some(9_990), &NoMac, &mut [0; 64]).to_vec();
        open.accept(&first, Millis(10_000)).unwrap();
        open.accept(&beat, Millis(later)).unwrap();
        assert_eq!(open.health().heartbeat, Some(Millis(later)));
    }
    // The newest echo counts, in whatever order echoes come.
    let (mut open, _reader) = guarded(NoMac);
    for (n, echo) in [(1, 90), (2, 40), (3, 95)] {
        let beat = encode_heartbeat(&id(1), n, Some(echo), &NoMac, &mut [0; 64]).to_vec();
        open.accept(&beat, Millis(100 + n)).unwrap();
        assert_eq!(open.health().heartbeat, Some(Millis(echo.max(90))));
    }
    // An echo ahead of the clock is from another run of the receiver: it does not count as a heartbeat.
    let (mut anew, _reader) = guarded(NoMac);
    for (n, echo) in [(1, 40), (2, 1 << 30), (3, i32::MAX as u32 - 10)] {
        let ahead = encode_heartbeat(&id(1), n, Some(30 + echo), &NoMac, &mut [0; 64]).to_vec();
        anew.accept(&ahead, Millis(20)).unwrap();
        assert_eq!(anew.health().heartbeat, None);
    }
}

/// Without a key, stray heartbeats far ahead in number or session only suppress a few authentic ones.
#[test]
fn heartbeats_far_ahead_lock_nobody_out() {
    let far_beat = |k: u32| beat(9, 5 + i32::MAX as u32 - 10 - k);
    let far_session = |k: u32| beat(9 + i32::MAX as u32 - k, 1);
    let near = |k: u32| beat(9, 600 + k);
    for stray in [&far_beat as &dyn Fn(u32) -> Vec<u8>, &far_session, &near] {
        for strays in [1, 3] {
            let (mut assembler, _reader) = guarded(NoMac);
            for n in 1..5 {
                assembler.accept(&beat(9, n), Millis(n * 100)).unwrap();
            }
            for k in 0..strays {
                let _ = assembler.accept(&stray(strays - k), Millis(500));
            }
            let refused =
                (6..2000).filter(|&n| assembler.accept(&beat(9, n), Millis(n * 100)).is_err());
            assert!(refused.count() <= 2, "of 1,994");
            assert_eq!(assembler.health().heartbeat, Some(Millis(199_900)));
        }
    }
    // The last two, repeated alternately, do not count as heartbeats.
    let (mut assembler, _reader) = guarded(NoMac);
    assembler.accept(&beat(9, 7), Millis(100)).unwrap();
    for now in 101..200 {
        assert!(assembler.accept(&beat(9, 6), Millis(now)).is_err());
        assert!(assembler.accept(&beat(9, 7), Millis(now)).is_err());
    }
}

/// A forged status claims a later session: the sender asks, and continues.
#[test]
fn a_forged_status_stops_no_sender() {
    for (session, number) in [(500, 1_000_000), (10, 20), (9 + i32::MAX as u32, i32::MAX as u32)] {
        let (mut assembler, _reader) = guarded(NoMac);
        let mut source = Source::new(9, |_| NoMac);
        source.meet(&mut assembler, 0);
        for n in 1..5 {
            assert!(source.frame(&mut assembler, n, 60 * n).is_some());
            source.hear(&mut assembler, 60 * n, 1).unwrap();
        }
        let published = PublishedStatus { session, epoch: 1, age_ms: 0, stretch: None };
        let forged = Status {
            published: Some(published),
            wants_whole: false,
            safety: 1,
            number,
            clock: 99,
            answer: None,
        };
        let forged = encode_status(MESH, &forged, &Counters::new(), &NoMac, &mut [0; 256]).to_vec();
        for n in 5..50 {
            if n % 10 == 5 {
                source.pipe.answer(&forged);
                source.sender.poll().unwrap();
            }
            assert!(source.frame(&mut assembler, n, 60 * n).is_some(), "frame {n}");
            source.hear(&mut assembler, 60 * n + 1, 1).unwrap();
        }
        assert_eq!(source.sender.session(), 9);
        assert!(source.sender.acknowledged().is_some());
    }
}

/// The answer to a hello from an earlier run of the receiver has no effect if it is replayed while no hello is pending.
#[test]
fn an_answer_to_no_hello_is_not_taken() {
    let (mut before, _before_reader) = guarded(keyed(5));
    let mut source = Source::new(9, keyed);
    source.set_clock(0);
    source.sender.poll().unwrap();
    for packet in source.pipe.sent() {
        before.accept(&packet, Millis(0)).unwrap();
    }
    let recorded = status(&mut before, 0, 1);
    // That receiver starts again, before the sender has heard it.
    let (mut assembler, _reader) = guarded(keyed(6));
    for n in 1..4 {
        source.hear(&mut assembler, 60 * n, 1).unwrap();
    }
    assert!(source.sender.is_ready());
    assert!(source.frame(&mut assembler, 1, 300).is_some());
    source.hear(&mut assembler, 310, 1).unwrap();
    let known = *source.sender.status().unwrap();
    source.pipe.answer(&recorded);
    source.sender.poll().unwrap();
    assert_eq!(source.sender.status(), Some(&known));
    assert!(source.frame(&mut assembler, 2, 330).is_some(), "under the challenge of this run");
}

/// Somebody who sees the hello forges its answer as well: the sender stops, asks again, and continues.
#[test]
fn a_sender_that_was_stopped_goes_on() {
    let (mut assembler, _reader) = guarded(NoMac);
    let mut source = Source::new(9, |_| NoMac);
    source.meet(&mut assembler, 0);
    for n in 1..5 {
        assert!(source.frame(&mut assembler, n, 60 * n).is_some());
        source.hear(&mut assembler, 60 * n, 1).unwrap();
    }
    // A stranger's own receiver, in which session 500 has published, receives the sender's hello.
    let (mut strangers, _strangers_reader) = guarded(NoMac);
    let mut stranger = Source::new(500, |_| NoMac);
    stranger.meet(&mut strangers, 0);
    assert!(stranger.frame(&mut strangers, 1, 10).is_some());
    let told = (0..4).find_map(|n| source.hear(&mut strangers, 300 + 60 * n, 1).err());
    assert!(matches!(told, Some(SendError::Superseded { session: 500 })), "{told:?}");
    assert!(source.sender.send(&surface(9)).is_err());
    let resumed = (1..40).find(|n| source.hear(&mut assembler, 600 + 100 * n, 1).is_ok());
    assert!(resumed.is_some_and(|n| n <= 15), "within 1.5 s: {resumed:?}");
    for n in 9..20 {
        let published = source.frame(&mut assembler, n, 5_000 + 60 * n);
        assert!(published.is_some());
        source.hear(&mut assembler, 5_000 + 60 * n, 1).unwrap();
    }
}

/// A stranger's hello after each of the sender's does not suppress the sender's answer, and gets none.
#[test]
fn strangers_collect_no_answers_and_jam_none() {
    let (mut assembler, _reader) = guarded(keyed(5));
    let mut source = Source::new(9, keyed);
    let mut answers = 0;
    for now in 0..2_000 {
        source.set_clock(now);
        source.sender.poll().unwrap();
        for packet in source.pipe.sent() {
            assembler.accept(&packet, Millis(now)).unwrap();
        }
        let hello = encode_hello(&id(0), u64::from(now), &NoMac, &mut [0; 64]).to_vec();
        assert_eq!(assembler.accept(&hello, Millis(now)), Err(ReceiveError::Forged { epoch: 0 }));
        if now % 10 == 0 {
            let status = assembler.status(Millis(now), 1);
            answers += u32::from(status.answer.is_some());
            let mac = assembler.mac();
            let packet =
                encode_status(MESH, &status, assembler.counters(), mac, &mut [0; 64]).to_vec();
            source.pipe.answer(&packet);
        }
        if source.sender.is_ready() && answers > 0 {
            assert!(now <= 60, "{now}");
            assert_eq!(answers, 1);
            return;
        }
    }
    panic!("the sender never heard an answer");
}

/// Without a key anybody may send hellos, which are answered at most each 20 ms, and by statuses; a stranger's hellos
/// do not suppress a sender's answer for long.
#[test]
fn hellos_without_a_tag_are_answered_at_a_bounded_rate() {
    let mut rng = fastrand::Rng::with_seed(19);
    for apart in [1, 5, 19, 20, 21] {
        let (mut assembler, _reader) = guarded(NoMac);
        let mut source = Source::new(9, |_| NoMac);
        let (mut taken, mut throttled, mut answers) = (0, 0, 0);
        let (mut genuine, mut answered) = (None, None);
        for now in 0..20_000_u32 {
            source.set_clock(now);
            source.sender.poll().unwrap();
            let mut packets = source.pipe.sent();
            if now % apart == 0 {
                let stranger = u64::from(now) + 1;
                packets.push(encode_hello(&id(0), stranger, &NoMac, &mut [0; 64]).to_vec());
                rng.shuffle(&mut packets);
            }
            let mut report = |assembler: &mut Guarded<NoMac>, genuine: Option<u64>| {
                let status = assembler.status(Millis(now), 1);
                answers += u32::from(status.answer.is_some());
                if status.answer.is_some_and(|answer| Some(answer.nonce) == genuine) {
                    answered = answered.or(Some(now));
                }
                let counters = assembler.counters();
                let packet = encode_status(MESH, &status, counters, &NoMac, &mut [0; 256]).to_vec();
                source.pipe.answer(&packet);
            };
            for packet in packets {
                let Body::Hello(hello) = Packet::decode(&packet).unwrap().body else { continue };
                genuine = Some(hello.nonce).filter(|&nonce| nonce > 20_000).or(genuine);
                match assembler.accept(&packet, Millis(now)) {
                    Ok(_) => {
                        taken += 1;
                        report(&mut assembler, genuine);
                    }
                    Err(ReceiveError::Throttled { after }) => {
                        assert!(after < Millis(20));
                        throttled += 1;
                    }
                    other => panic!("{other:?}"),
                }
            }
            if now % 97 == 0 {
                report(&mut assembler, genuine);
            }
        }
        assert!(taken <= 1_000, "{apart} ms apart: {taken} in 20 s");
        assert!(answers <= taken + 20_000 / 97 + 1, "{apart} ms apart: {answers}");
        assert_eq!(assembler.counters().of(Event::Throttled), throttled);
        assert_eq!(assembler.health().rejections, 0);
        assert!(answered.is_some_and(|at| at < 10_000), "{apart} ms apart: {answered:?}");
    }
}

/// Sender and receiver whose surfaces differ in unit or size although the mesh id is equal, and of different meshes.
#[test]
fn both_ends_say_that_their_surfaces_differ() {
    let millimetres = Some(Unit::Millimetre);
    let here = SurfaceFacts { unit: millimetres, vertices: 40, triangles: 76 };
    assert!(here.agrees_with(&here) && here.agrees_with(&SurfaceFacts::default()));
    for other in [
        SurfaceFacts { unit: Some(Unit::Metre), ..here },
        SurfaceFacts { triangles: 77, ..here },
        SurfaceFacts { vertices: 41, ..here },
    ] {
        assert!(!here.agrees_with(&other) && !other.agrees_with(&here));
    }
    let heart = dibs_build::generate::heart(320).unwrap().mesh;
    let tree = dibs_build::Builder::new().build(&heart).unwrap();
    let tree: Tree<'_, u16> = tree.tree().unwrap();
    let rows: Vec<u32> = (0..tree.vertex_count()).collect();
    let frame: Vec<_> = rows.iter().map(|&row| heart.positions[row as usize]).collect();
    const HEART: usize = 162;
    assert_eq!(rows.len(), HEART);
    let frames = dibs_nostd::Frames::<HEART>::new();
    let (writer, _reader) = frames.split().unwrap();
    let mut assembler = Assembler::with_mac(writer, &tree, tree.mesh_id(), 1e3, keyed(5));
    let mut ask = |order: SurfaceOrder| {
        let mut source = Source::of(order, 9, None, keyed);
        for now in 0..3 {
            source.set_clock(60 * now);
            let told = source.sender.poll();
            for packet in source.pipe.sent() {
                assembler.accept(&packet, Millis(60 * now)).unwrap();
            }
            let status = assembler.status(Millis(60 * now), 1);
            let (counters, mac) = (assembler.counters(), assembler.mac());
            let packet =
                encode_status(tree.mesh_id(), &status, counters, mac, &mut [0; 256]).to_vec();
            source.pipe.answer(&packet);
            told?;
        }
        source.sender.poll()
    };
    ask(SurfaceOrder::of(&tree)).unwrap();
    ask(SurfaceOrder::new(tree.mesh_id(), rows.clone())).unwrap();
    let fewer = ask(SurfaceOrder::new(tree.mesh_id(), rows[1..].to_vec()));
    assert!(matches!(fewer, Err(SendError::OtherSurface { .. })), "{fewer:?}");
    let other = ask(SurfaceOrder::new(tree.mesh_id() ^ 1, rows.clone()));
    let text = other.unwrap_err().to_string();
    assert!(text.contains("162 vertices, 320 triangles") && text.contains("build both"), "{text}");

    // The receiver refuses the frames.
    let id = FrameId { mesh_id: tree.mesh_id(), session: 9, epoch: 1 };
    let encoder = dibs_nostd::wire::FrameEncoder::<_, 64>::new(
        id,
        dibs_nostd::wire::Encoding::Float,
        &frame[..],
    );
    let sent = SurfaceFacts { triangles: 321, ..tree.surface_facts() };
    let packets = collect(encoder.unwrap().with_surface(sent).with_mac(keyed(5)).unwrap());
    let here = tree.surface_facts();
    assert_eq!(
        assembler.accept(&packets[0], Millis(0)),
        Err(ReceiveError::OtherSurface { sent, here })
    );
}
