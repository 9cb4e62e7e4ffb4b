//! `docs/wire.md` compared with the code: the encoders write its test vectors, and the decoder reads them.

// Requirement: B-07

use dibs_nostd::format::Unit;
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::wire::{
    AesCmac, Body, Counters, Encoding, FrameEncoder, FrameId, Freshness, NoMac, Packet,
    PublishedStatus, QuantisedBox, Status, StatusAnswer, StatusReport, WeightsEncoder,
    encode_heartbeat, encode_hello, encode_status, enframe, framed_bytes,
};
use dibs_nostd::{RigidPose, SurfaceFacts};

const ID: FrameId = FrameId { mesh_id: 0xD1B5_0001, session: 0x0003_0002, epoch: 258 };

/// Age and echo of the first frame.
const FRESHNESS: Freshness = Freshness { age_ms: 35, echo: Some(0x0001_E208) };
/// The sender's surface in the first frame, and the receiver's.
const SURFACE: SurfaceFacts =
    SurfaceFacts { unit: Some(Unit::Millimetre), vertices: 2, triangles: 1 };
const NONCE: u64 = 0x0123_4567_0BAD_CAFE;
const CHALLENGE: u64 = 0x89AB_CDEF_00C0_FFEE;
/// The key of the tagged packets: bytes 0 to 15.
const KEY: [u8; 16] = 0x0001_0203_0405_0607_0809_0A0B_0C0D_0E0F_u128.to_be_bytes();

/// The test vectors, in the page's order: name and bytes.
fn vectors() -> Vec<(&'static str, Vec<u8>)> {
    let mut buffer = [0; 64];
    let mut all = Vec::new();

    let positions = [Vec3::new(-1.0, 0.0, 1.0), Vec3::new(0.25, 0.5, 31.0)];
    let grid = QuantisedBox::new(Vec3::splat(-1.0), Vec3::splat(0.25)).unwrap();
    let encoding = Encoding::Quantised(grid);
    let mut whole =
        FrameEncoder::<_, 64>::new(ID, encoding, &positions[..]).unwrap().with_freshness(FRESHNESS);
    whole = whole.with_surface(SURFACE);
    for name in ["begin", "vertices", "commit"] {
        all.push((name, whole.next_packet(&mut buffer).unwrap().to_vec()));
    }
    let mut line = [0; framed_bytes(64)];
    let stream = enframe(&all[2].1, &mut line).unwrap().to_vec();

    let moved = [positions[0], Vec3::new(0.25, 0.5, 30.0)];
    let id = FrameId { epoch: 259, ..ID };
    let mut partial =
        FrameEncoder::<_, 64>::partial(id, Encoding::Float, &moved[..], 258, &positions[..])
            .unwrap();
    for name in ["begin", "vertices", "commit"] {
        all.push((name, partial.next_packet(&mut buffer).unwrap().to_vec()));
    }

    let id = FrameId { epoch: 260, ..ID };
    let modes = SurfaceFacts { vertices: 5, ..SURFACE };
    let modal = |id| WeightsEncoder::<64>::new(id, &[1.0, -0.5, 0.25]).unwrap().with_surface(modes);
    let mut modal_frame = modal(id);
    for name in ["begin", "weights", "commit"] {
        all.push((name, modal_frame.next_packet(&mut buffer).unwrap().to_vec()));
    }
    assert!(whole.next_packet(&mut buffer).is_none());
    assert!(partial.next_packet(&mut buffer).is_none());
    assert!(modal_frame.next_packet(&mut buffer).is_none());

    let echo = FRESHNESS.echo;
    all.push(("heartbeat", encode_heartbeat(&id, 7, echo, &NoMac, &mut buffer).into()));
    all.push(("hello", encode_hello(&id, NONCE, &NoMac, &mut buffer).into()));
    all.push((
        "status",
        encode_status(ID.mesh_id, &status(), &counters(), &NoMac, &mut buffer).into(),
    ));
    let plain = encode_status(ID.mesh_id, &answer(), &counters(), &NoMac, &mut buffer);
    all.push(("answer", plain.into()));
    all.push(("stream", stream));

    let id = FrameId { epoch: 261, ..ID };
    let mac = AesCmac::new(&KEY, 7, CHALLENGE);
    let mut tagged = modal(id).with_mac(&mac);
    for name in ["begin", "weights", "commit"] {
        all.push((name, tagged.next_packet(&mut buffer).unwrap().to_vec()));
    }
    all.push(("heartbeat", encode_heartbeat(&id, 8, None, &mac, &mut buffer).into()));
    all.push(("hello", encode_hello(&id, NONCE, &mac, &mut buffer).into()));
    let status = encode_status(ID.mesh_id, &status(), &counters(), &mac, &mut buffer);
    all.push(("status", status.into()));
    let answer = encode_status(ID.mesh_id, &answer(), &counters(), &mac, &mut buffer);
    all.push(("answer", answer.into()));

    let posed = |epoch| {
        let id = FrameId { epoch, ..ID };
        let frame = FrameEncoder::<_, 64>::new(id, encoding, &positions[..]).unwrap();
        frame.with_pose(pose()).unwrap()
    };
    let mut frame = posed(262);
    for name in ["begin", "pose", "vertices", "commit"] {
        all.push((name, frame.next_packet(&mut buffer).unwrap().to_vec()));
    }
    let mut frame = posed(263).with_mac(&mac).unwrap();
    for name in ["begin", "pose"] {
        all.push((name, frame.next_packet(&mut buffer).unwrap().to_vec()));
    }
    all
}

/// The pose of the last frames.
fn pose() -> RigidPose {
    let turn = Quat::from_xyzw(0.0, 0.0, 0.6, 0.8);
    RigidPose::new(turn, Vec3::new(1.0, -2.0, 3.0)).unwrap()
}

/// The status that answers the hello.
fn answer() -> Status {
    let answer = StatusAnswer { nonce: NONCE, challenge: CHALLENGE, surface: SURFACE };
    let mut status = Status { number: 7, answer: Some(answer), ..status() };
    status.published.as_mut().unwrap().stretch = None;
    status
}

fn status() -> Status {
    Status {
        published: Some(PublishedStatus {
            session: ID.session,
            epoch: 259,
            age_ms: 12,
            stretch: Some(1.25),
        }),
        wants_whole: false,
        safety: 1,
        number: 6,
        clock: 0x0001_E240,
        answer: None,
    }
}

/// Counter number `i` is `i`.
fn counters() -> Counters {
    let numbers: Vec<[u8; 4]> = (0..24_u32).map(u32::to_le_bytes).collect();
    let mut counters = Counters::new();
    counters.update(&StatusReport { status: status(), first_counter: 0, counters: &numbers });
    counters
}

#[test]
fn the_specification_shows_what_is_sent() {
    let document = include_str!("../../../docs/wire.md");
    let shown = document.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
    let mut expected = String::new();
    for (name, bytes) in vectors() {
        for (i, line) in bytes.chunks(32).enumerate() {
            let hex = |word: &[u8]| word.iter().map(|byte| format!("{byte:02x}")).collect();
            let words: Vec<String> = line.chunks(4).map(hex).collect();
            let name = if i == 0 { name } else { "" };
            expected += &format!("{name:<10}{}\n", words.join(" "));
        }
    }
    assert!(shown == expected, "docs/wire.md must show\n{expected}");
}

#[test]
fn every_vector_is_read_as_what_it_was_written_from() {
    let vectors = vectors();
    for (name, bytes) in vectors.iter().filter(|(name, _)| *name != "stream") {
        let packet = Packet::decode(bytes).unwrap();
        assert_eq!(packet.mesh_id, ID.mesh_id);
        assert_eq!(packet.session_low, 2);
        match (*name, packet.body) {
            ("begin", Body::Begin(begin)) => {
                assert_eq!(begin.session, ID.session);
                assert_eq!(begin.is_posed, packet.epoch > 261);
                let is_first = packet.epoch == 258;
                let freshness = if is_first { FRESHNESS } else { Freshness::default() };
                assert_eq!(begin.freshness, freshness);
                let surface = match packet.epoch {
                    258 => SURFACE,
                    259 | 262.. => SurfaceFacts { vertices: 2, ..SurfaceFacts::default() },
                    _ => SurfaceFacts { vertices: 5, ..SURFACE },
                };
                assert_eq!(begin.surface, surface);
            }
            ("hello", Body::Hello(hello)) => {
                assert_eq!((hello.session, hello.nonce), (ID.session, NONCE));
            }
            ("vertices", Body::Vertices(_)) | ("commit", Body::Commit(_)) => {}
            ("weights", Body::Weights(weights)) => {
                let values: Vec<_> =
                    weights.values.iter().map(|w| f32::from_le_bytes(*w)).collect();
                assert_eq!((weights.first, values), (0, vec![1.0, -0.5, 0.25]));
            }
            ("pose", Body::Pose(found)) => assert_eq!((found, packet.sequence), (Ok(pose()), 1)),
            ("heartbeat", Body::Heartbeat(heartbeat)) => {
                assert_eq!(heartbeat.session, ID.session);
                assert_eq!(heartbeat.beat, packet.epoch - 253);
            }
            ("status", Body::Status(report)) => {
                assert_eq!(report.status, status());
                assert_eq!(report.counters.len(), if packet.is_tagged() { 3 } else { 5 });
                assert_eq!(packet.epoch, 259);
            }
            ("answer", Body::Status(report)) => {
                assert_eq!((report.status, packet.epoch), (answer(), 259));
            }
            (name, body) => panic!("{name} was read as {body:?}"),
        }
    }
}
