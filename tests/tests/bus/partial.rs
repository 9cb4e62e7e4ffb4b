//! Partial frames: only the moved rows, based on the published frame.

// Requirement: B-01

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{EncodeError, Encoding, Event, FrameEncoder, FrameId, QuantisedBox};
use dibs_nostd::{
    Advance, Assembler, FrameReader, Frames, Millis, NoAdmissionCheck, ReceiveError,
    StretchMonitor, VertexTable,
};
use dibs_tests::bus::*;
use fastrand::Rng;

/// Rows of the larger surface, which takes several packets and several slices of copying.
const ROWS: usize = 300;

fn large() -> (Assembler<'static, NoAdmissionCheck>, FrameReader<'static>) {
    let frames: &'static Frames<ROWS> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().unwrap();
    (Assembler::new(writer, NoAdmissionCheck, MESH, 1e4), reader)
}

fn read(reader: &mut FrameReader<'_>) -> Vec<Vec3> {
    let frame = reader.read().expect("published");
    (0..frame.len() as u32).map(|row| frame.position(row).unwrap()).collect()
}

fn partial(epoch: u32, encoding: Encoding, now: &[Vec3], base: u32, held: &[Vec3]) -> Vec<Vec<u8>> {
    collect(FrameEncoder::<_, 64>::partial(id(epoch), encoding, now, base, held).unwrap())
}

/// Long chains of partial frames, of any number of moved vertices: the receiver has every vertex within the stated
/// error, and leaves unmoved vertices untouched.
#[test]
fn chains_of_partial_frames_add_up_without_errors() {
    let mut rng = Rng::with_seed(5);
    for quantised in [false, true] {
        let (mut assembler, mut reader) = large();
        let mut now: Vec<Vec3> = (0..ROWS)
            .map(|_| Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 100.0 - Vec3::splat(50.0))
            .collect();
        let grid = QuantisedBox::new(Vec3::splat(-200.0), Vec3::splat(0.01)).unwrap();
        let encoding = if quantised { Encoding::Quantised(grid) } else { Encoding::Float };
        for packet in packets::<64>(1, encoding, &now) {
            give(&mut assembler, &packet).unwrap();
        }
        let mut fewest = usize::MAX;
        for epoch in 2..200 {
            let held = read(&mut reader);
            let moves = rng.usize(0..ROWS / 2) * usize::from(epoch % 5 != 0);
            for _ in 0..moves {
                let at = rng.usize(0..ROWS);
                now[at] += Vec3::new(rng.f32() - 0.5, rng.f32() - 0.5, rng.f32() - 0.5);
            }
            let packets = partial(epoch, encoding, &now, epoch - 1, &held);
            fewest = fewest.min(packets.len());
            let sent = packets.len();
            let outcomes: Vec<_> =
                packets.iter().map(|packet| give(&mut assembler, packet).unwrap()).collect();
            assert_eq!(outcomes[sent - 1], Some(epoch));
            let error = reader.read().unwrap().label().position_error;
            assert_eq!(error, encoding.error());
            for ((exact, decoded), held) in now.iter().zip(read(&mut reader)).zip(held) {
                assert!(exact.as_dvec3().distance(decoded.as_dvec3()) <= f64::from(error));
                if *exact == held {
                    assert_eq!(decoded, held);
                }
            }
        }
        assert_eq!(fewest, 2, "a frame in which nothing moved is a begin and a commit");
        assert_eq!(assembler.counters().rejected(), 0);
    }
}

#[test]
fn a_partial_frame_takes_no_more_packets_than_it_must() {
    let held = surface(1);
    let mut now = held.clone();
    for row in [0, 2, 9, 10, 39] {
        now[row].x += 1.0;
    }
    let packets = partial(2, Encoding::Float, &now, 1, &held);
    let runs: Vec<_> =
        packets[1..packets.len() - 1].iter().map(|packet| (packet[15], packet[14])).collect();
    assert_eq!(runs, [(0, 3), (9, 2), (39, 1)]);
}

/// The base must be the published frame, of the same session. Otherwise the sender is asked for whole frames until one
/// is published.
#[test]
fn another_base_is_refused_and_a_whole_frame_asked_for() {
    let (mut assembler, mut reader) = bus();
    let positions = surface(1);
    let onto = |session, epoch, base| {
        let id = FrameId { mesh_id: MESH, session, epoch };
        let encoder =
            FrameEncoder::<_, 64>::partial(id, Encoding::Float, &positions[..], base, &positions);
        collect(encoder.unwrap())[0].clone()
    };
    let base = |epoch| Err(ReceiveError::Base { epoch });
    assert_eq!(give(&mut assembler, &onto(1, 1, 0)), base(0), "nothing is published");
    assert!(assembler.status(Millis(0), 0).wants_whole);
    for packet in frame(5, false) {
        assert!(assembler.status(Millis(0), 0).wants_whole);
        give(&mut assembler, &packet).unwrap();
    }
    assert!(!assembler.status(Millis(0), 0).wants_whole);
    for (session, epoch, of) in [(1, 6, 4), (1, 6, 3), (2, 6, 5), (0x0001_0001, 6, 5)] {
        assert_eq!(give(&mut assembler, &onto(session, epoch, of)), base(of));
        assert!(assembler.status(Millis(0), 0).wants_whole);
    }
    assert_eq!(assembler.counters().of(Event::Base), 5);
    assert_eq!(give(&mut assembler, &onto(1, 6, 5)), Ok(None));
    // A base that the protocol cannot express.
    for (epoch, base) in [(6, 6), (6, 7), (65_542, 6)] {
        let encoding = Encoding::Float;
        let frame =
            FrameEncoder::<_, 64>::partial(id(epoch), encoding, &positions[..], base, &positions);
        assert_eq!(frame.unwrap_err(), EncodeError::BaseEpoch { epoch: base });
    }
    assert_eq!(published(&mut reader).unwrap().0, 5);
}

/// A frame that was abandoned, or refused at its end, does not affect the next one.
#[test]
fn nothing_of_an_unpublished_frame_shows_up_later() {
    let mut rng = Rng::with_seed(8);
    for round in 0..400 {
        let (mut assembler, mut reader) = bus();
        let mut held = surface(1);
        for packet in frame(1, false) {
            give(&mut assembler, &packet).unwrap();
        }
        let mut base = 1;
        for epoch in 2..12 {
            let mut now = held.clone();
            for _ in 0..rng.usize(1..12) {
                now[rng.usize(0..N)] = Vec3::splat(rng.f32() * 10.0 + epoch as f32);
            }
            let is_whole = rng.u8(0..4) == 0;
            let mut packets = if is_whole {
                packets::<64>(epoch, Encoding::Float, &now)
            } else {
                partial(epoch, Encoding::Float, &now, base, &held)
            };
            let last = packets.len() - 1;
            match rng.u8(0..4) {
                // Abandoned.
                0 => packets.truncate(rng.usize(0..=last)),
                // A digest that is wrong.
                1 => {
                    packets[last][18] ^= 1;
                    packets[last] = reseal(packets[last].clone());
                }
                _ => {}
            }
            let mut is_published = false;
            for packet in &packets {
                // Between the packets there are slices of different lengths, or none.
                if rng.bool() {
                    assembler.advance(rng.u32(0..20)).unwrap();
                }
                match give(&mut assembler, packet) {
                    Ok(outcome) => is_published |= outcome == Some(epoch),
                    Err(ReceiveError::Digest { .. }) => {}
                    Err(other) => panic!("{other} in round {round}"),
                }
            }
            if is_published {
                (held, base) = (now, epoch);
            }
            assert_eq!(read(&mut reader), held, "round {round}, epoch {epoch}");
        }
    }
}

/// The published rows are copied in slices; a packet is refused until the rows before its own are copied.
#[test]
fn copying_is_bounded_and_rows_wait_for_it() {
    let (mut assembler, mut reader) = large();
    let mut positions: Vec<Vec3> = (0..ROWS).map(|i| Vec3::splat(i as f32)).collect();
    for packet in packets::<64>(1, Encoding::Float, &positions) {
        assembler.accept(&packet, Millis(0)).unwrap();
    }
    assert_eq!(assembler.advance(1), Ok(Advance::Published { epoch: 1 }));
    let held = positions.clone();
    positions[10].x = -1.0;
    positions[250].x = -2.0;
    let packets = partial(2, Encoding::Float, &positions, 1, &held);
    // Nothing was copied before the first partial frame.
    assembler.accept(&packets[0], Millis(0)).unwrap();
    assert_eq!(assembler.accept(&packets[1], Millis(0)), Err(ReceiveError::NotReady { first: 10 }));
    assert!(assembler.status(Millis(0), 0).wants_whole);
    assert_eq!(assembler.advance(10), Ok(Advance::Idle));
    assert_eq!(assembler.accept(&packets[1], Millis(0)), Err(ReceiveError::NotReady { first: 10 }));
    assert_eq!(assembler.advance(1), Ok(Advance::Idle));
    assert!(assembler.accept(&packets[1], Millis(0)).is_ok());
    assert_eq!(
        assembler.accept(&packets[2], Millis(0)),
        Err(ReceiveError::NotReady { first: 250 })
    );
    assert_eq!(assembler.advance(240), Ok(Advance::Idle));
    assert!(assembler.accept(&packets[2], Millis(0)).is_ok());
    assert!(assembler.accept(&packets[3], Millis(0)).is_ok());
    // 49 rows are left to copy.
    assert_eq!(assembler.advance(48), Ok(Advance::Pending));
    assert_eq!(assembler.advance(1), Ok(Advance::Pending));
    assert_eq!(assembler.advance(1), Ok(Advance::Published { epoch: 2 }));
    assert_eq!(read(&mut reader), positions);
    // From now on the rows are copied before the next frame begins.
    for _ in 0..3 {
        assert_eq!(assembler.advance(100), Ok(Advance::Idle));
    }
    let held = positions.clone();
    positions[299].y = 7.0;
    for packet in partial(3, Encoding::Float, &positions, 2, &held) {
        assembler.accept(&packet, Millis(0)).unwrap();
    }
    assert_eq!(assembler.advance(1), Ok(Advance::Published { epoch: 3 }));
    assert_eq!(read(&mut reader), positions);
}

/// The memory of a surface beyond 24 bytes a vertex is the same for any number of vertices.
#[test]
fn memory_does_not_grow_with_marks() {
    fn besides<const N: usize>() -> (usize, usize) {
        (size_of::<Frames<N>>() - 24 * N, size_of::<Assembler<'static, NoAdmissionCheck>>())
    }
    let one = besides::<1>();
    assert_eq!(one, besides::<42>());
    assert_eq!(one, besides::<5_138>());
    assert_eq!(one, besides::<250_000>());
    let monitor = size_of::<StretchMonitor<'static, u16>>();
    println!("besides the vertices: frames {}, assembler {}, monitor {monitor}", one.0, one.1);
    assert!(one.0 + one.1 <= 848, "{one:?}");
}
