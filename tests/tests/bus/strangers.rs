//! Strangers without the key change neither the rejections' count nor the state, and the rate of guesses is measured.

// Requirement: B-04

use dibs_nostd::failsafe::{FailSafe, Limits, LinkStatus, Observation, State, ThresholdPair};
use dibs_nostd::wire::{
    AesCmac, Encoding, Event, FrameEncoder, FrameId, Mac, NoMac, encode_heartbeat,
};
use dibs_nostd::{Assembler, BusHealth, FrameReader, Frames, Millis, NoAdmissionCheck};
use dibs_tests::bus::*;

type Line<M> = (Assembler<'static, NoAdmissionCheck, M>, FrameReader<'static>);

fn line<M: Mac>(mac: M) -> Line<M> {
    let frames: &'static Frames<N> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().unwrap();
    (Assembler::with_mac(writer, NoAdmissionCheck, MESH, 100.0, mac), reader)
}

fn mac() -> AesCmac {
    AesCmac::new(b"a secret of ours", 7, 77)
}

fn sent<M: Mac>(epoch: u32, mac: M) -> Vec<Vec<u8>> {
    let rows = surface(epoch);
    let encoder = FrameEncoder::<_, 64>::new(id(epoch), Encoding::Float, &rows[..]).unwrap();
    collect(encoder.with_mac(mac).unwrap())
}

/// Packets of every kind that somebody without the key can make from frame `epoch`.
fn strays(epoch: u32, salt: u32) -> Vec<Vec<u8>> {
    let other = AesCmac::new(b"another key.....", 7, 77);
    let mut damaged = sent(epoch, &other).swap_remove(1);
    damaged[40] ^= 1;
    let mut all = vec![damaged, vec![salt as u8; 24]];
    for ahead in [1, 2 + salt % 1000, 1_000_000, i32::MAX as u32 - 5, u32::MAX - 3] {
        let epoch = epoch.wrapping_add(ahead);
        let far = id(epoch);
        all.push(raw(2, 1, epoch, [1, 1], 0, &[0; 12])); // rows without a tag
        all.push(raw(2, 9, epoch, [1, 1], 0, &[0; 12])); // of a session that is not known
        all.push(raw(0x82, 1, epoch, [1, 1], 0, &[0; 18])); // with a guessed tag
        all.push(raw(0x82, 9, epoch, [1, 1], 0, &[0; 18]));
        all.push(raw(4, 1, epoch, [3, 0], 0, &[0; 4]));
        all.push(raw_begin(1, epoch, 0, N as u32, 0));
        all.push(raw_begin(1, epoch, 0, 41, 0));
        all.push(encode_heartbeat(&far, salt, None, &other, &mut [0; 64]).to_vec());
        let rows = surface(1);
        let forged = FrameEncoder::<_, 64>::new(far, Encoding::Float, &rows[..]).unwrap();
        all.push(collect(forged.with_mac(&other).unwrap()).swap_remove(0));
    }
    all
}

/// The count of rejections is the same with and without strangers: if frames are published, if they are refused, and if
/// their begins are lost.
#[test]
fn strangers_change_no_count_of_rejections() {
    for loss in ["none", "begin", "row", "all after the begin"] {
        let counts = [false, true].map(|is_attacked| {
            let (mut assembler, _reader) = line(mac());
            let mut counts = Vec::new();
            for epoch in 1..200 {
                let lost = |place: usize| match loss {
                    "none" => false,
                    _ if epoch < 3 => false,
                    "begin" => place == 0,
                    "row" => place == 4,
                    _ => place > 0,
                };
                for (place, packet) in sent(epoch, mac()).iter().enumerate() {
                    if is_attacked && place < 3 {
                        for stray in strays(epoch, epoch * 64 + place as u32) {
                            let _ = assembler.accept(&stray, Millis(20 * epoch));
                        }
                    }
                    if !lost(place) {
                        let _ = give_at(&mut assembler, packet, 20 * epoch);
                    }
                }
                counts.push(assembler.health().rejections);
            }
            counts
        });
        assert_eq!(counts[0], counts[1], "lost: {loss}");
        let most = if loss == "none" { 0 } else { 196 };
        assert!(counts[0].last().is_some_and(|&last| last >= most), "{loss}: {:?}", counts[0]);
    }
}

/// Refused authentic begins are recorded and replayed alternately: each frame counts once.
#[test]
fn recorded_begins_count_once() {
    let (mut assembler, _reader) = line(mac());
    for packet in sent(1, mac()) {
        give(&mut assembler, &packet).unwrap();
    }
    // Frame 2 is lost; the partial frames that build on it and on each other are refused.
    let rows = surface(9);
    let begins: Vec<_> = (3..12)
        .map(|epoch| {
            let frame = FrameEncoder::<_, 64>::partial(
                id(epoch),
                Encoding::Float,
                &rows[..],
                epoch - 1,
                &rows[..],
            );
            collect(frame.unwrap().with_mac(mac()).unwrap()).swap_remove(0)
        })
        .collect();
    for _ in 0..50 {
        for begin in &begins {
            give(&mut assembler, begin).unwrap_err();
        }
    }
    assert_eq!(assembler.health().rejections, begins.len() as u32);
    assert_eq!(assembler.counters().of(Event::Base), 50 * begins.len() as u32);
}

/// A sender that starts anew numbers its frames from the start: a frame that is refused counts once, although the last
/// one refused had a higher number.
#[test]
fn a_refused_frame_of_a_new_session_counts() {
    let (mut assembler, _reader) = line(mac());
    for packet in sent(1, mac()) {
        give(&mut assembler, &packet).unwrap();
    }
    // Of partial frames whose base is not published.
    let rows = surface(9);
    let begin = |session, epoch: u32| {
        let id = FrameId { mesh_id: MESH, session, epoch };
        let encoding = Encoding::Float;
        let frame = FrameEncoder::<_, 64>::partial(id, encoding, &rows[..], epoch - 1, &rows[..]);
        collect(frame.unwrap().with_mac(mac()).unwrap()).swap_remove(0)
    };
    for (count, (session, epoch)) in (1..).zip([(1, 9), (2, 3), (2, 4)]) {
        for _ in 0..3 {
            give(&mut assembler, &begin(session, epoch)).unwrap_err();
            assert_eq!(assembler.health().rejections, count, "frame {epoch} of session {session}");
        }
    }
}

/// Even without a key a stray packet of a frame far ahead does not hide a later frame that fails.
#[test]
fn without_a_key_nothing_mutes() {
    for ahead in [1 << 20, i32::MAX as u32 - 5] {
        let (mut assembler, _reader) = line(NoMac);
        for packet in sent(1, NoMac) {
            give(&mut assembler, &packet).unwrap();
        }
        let mut before = 0;
        for epoch in 2..100 {
            // A row of a frame far ahead; the authentic frame's begin is lost.
            let _ = give(&mut assembler, &raw(2, 1, epoch + ahead, [1, 1], 0, &[0; 12]));
            for packet in &sent(epoch, NoMac)[1..] {
                give(&mut assembler, packet).unwrap_err();
            }
            assert!(assembler.health().rejections > before, "frame {epoch} counts");
            before = assembler.health().rejections;
        }
    }
}

/// Forgeries at a steady rate, while authentic frames are published: the limit is exceeded only if the rate is above
/// that at which they are forgotten.
#[test]
fn publications_do_not_hide_forgeries() {
    let other = AesCmac::new(b"another key.....", 7, 77);
    let watch = ThresholdPair::count(50, 500).unwrap();
    let age = ThresholdPair::new(Millis(60), Millis(120)).unwrap();
    let limits = Limits::new(age, 0.0).unwrap().without_transit();
    let limits = limits.forgeries(watch).unwrap().automatic();
    let drain = BusHealth::FORGERIES_A_SECOND;
    for (a_second, worst) in [
        (1, State::Nominal),
        (drain, State::Nominal),
        (2 * drain, State::Degraded),
        (100, State::Safe),
        (10_000, State::Safe),
    ] {
        let (mut assembler, mut reader) = line(mac());
        let (link, mut machine) = (LinkStatus::new(), FailSafe::new(limits));
        let (mut forged, mut states, mut changes) = (0, Vec::new(), 0);
        for now in 0..20_000 {
            if now % 20 == 0 {
                for packet in sent(now / 20 + 1, mac()) {
                    give_at(&mut assembler, &packet, now).unwrap();
                }
            }
            while forged < u64::from(now) * u64::from(a_second) / 1000 {
                forged += 1;
                let packet =
                    encode_heartbeat(&id(1), forged as u32, None, &other, &mut [0; 64]).to_vec();
                assert!(assembler.accept(&packet, Millis(now)).is_err());
            }
            link.set(&assembler.health());
            let frame = reader.latest(Millis(now)).frame();
            let link = link.read(Millis(now));
            let seen =
                Observation { frame, lag: None, link, no_answer: None, is_tree_corrupt: false };
            let before = machine.state();
            states.push(machine.step(&seen).state);
            changes += u32::from(machine.state() != before);
        }
        let after_start = &states[2_000..];
        let seen = if worst == State::Safe { states.last() } else { after_start.iter().max() };
        assert_eq!(seen, Some(&worst), "{a_second} a second");
        assert!(changes <= 4, "{a_second} a second: {changes} changes");
        assert!(assembler.health().forgeries <= BusHealth::MOST_FORGERIES);
        // The flood ends: it is forgotten within the time that the page states.
        let seconds = BusHealth::MOST_FORGERIES / drain;
        let later = 20_000 + 1_000 * seconds;
        for packet in sent(20_000, mac()) {
            give_at(&mut assembler, &packet, later).unwrap();
        }
        assert_eq!(assembler.health().forgeries, 0);
    }
}

/// A stranger sends stray rows with each frame for twenty seconds: with a key the state stays nominal.
#[test]
fn strangers_change_no_state() {
    let age = ThresholdPair::new(Millis(60), Millis(120)).unwrap();
    let rejections = ThresholdPair::count(10, 30).unwrap();
    let limits = Limits::new(age, 0.0).unwrap().without_transit();
    let limits = limits.rejections(rejections).automatic();
    for strays_a_frame in [1_u32, 11, 31] {
        let (mut assembler, mut reader) = line(mac());
        let (link, mut machine) = (LinkStatus::new(), FailSafe::new(limits));
        let mut changes = Vec::new();
        for now in 0..20_000 {
            if now % 16 == 0 {
                for packet in sent(now / 16 + 1, mac()) {
                    give_at(&mut assembler, &packet, now).unwrap();
                }
            }
            if now % 16 == 8 {
                for k in 0..strays_a_frame {
                    let epoch = 1_000_000 + 64 * now + k;
                    let _ = assembler.accept(&raw(2, 1, epoch, [1, 1], 0, &[0; 12]), Millis(now));
                    let _ =
                        assembler.accept(&raw(0x82, 1, epoch, [1, 1], 0, &[0; 18]), Millis(now));
                }
            }
            link.set(&assembler.health());
            let (frame, link) = (reader.latest(Millis(now)).frame(), link.read(Millis(now)));
            let seen =
                Observation { frame, lag: None, link, no_answer: None, is_tree_corrupt: false };
            let before = machine.state();
            if machine.step(&seen).state != before {
                changes.push((now, machine.state()));
            }
        }
        assert_eq!(
            changes.len(),
            1,
            "{strays_a_frame} a frame: {:?}",
            &changes[..changes.len().min(9)]
        );
        assert_eq!(assembler.health().rejections, 0);
    }
}

/// The clock of the forgeries wraps, which neither forgets nor keeps any.
#[test]
fn forgeries_are_forgotten_across_the_wrap_of_the_clock() {
    let (mut assembler, _reader) = line(mac());
    for packet in sent(1, mac()) {
        give_at(&mut assembler, &packet, u32::MAX - 2_000).unwrap();
    }
    let name = FrameId { session: 3, ..id(1) };
    for n in 0..100 {
        let forged = encode_heartbeat(&name, n, None, &NoMac, &mut [0; 64]).to_vec();
        let _ = assembler.accept(&forged, Millis(u32::MAX - 500));
    }
    let mut left = Vec::new();
    for now in [u32::MAX - 450, 500_u32, 4_500, 9_500] {
        let _ = assembler.accept(&[], Millis(now));
        left.push(assembler.health().forgeries);
    }
    assert_eq!(left, [100, 90, 50, 0]);
}

/// A clock that goes back, because a packet was stamped on another core, forgets no forgery.
#[test]
fn a_clock_that_goes_back_forgets_no_forgery() {
    let (mut assembler, _reader) = line(mac());
    for packet in sent(1, mac()) {
        give_at(&mut assembler, &packet, 10_000).unwrap();
    }
    let mut at = |now: u32, forgeries: u32| {
        for n in 0..forgeries {
            let forged = encode_heartbeat(&id(1), n, None, &NoMac, &mut [0; 64]).to_vec();
            let _ = assembler.accept(&forged, Millis(now));
        }
        let _ = assembler.accept(&[], Millis(now));
        assembler.health().forgeries
    };
    assert_eq!(at(10_000, 40), 40);
    assert_eq!([1, 100, 9_000].map(|back| at(10_000 - back, 0)), [40; 3]);
    assert_eq!(at(9_990, 2), 42);
    assert_eq!(at(11_000, 0), 32);
}
