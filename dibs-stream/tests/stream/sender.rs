//! What the sender sends, read back packet by packet; and what the injector makes of it.

// Requirement: B-09

use std::collections::HashMap;
use std::mem::take;
use std::sync::LazyLock;

use dibs_build::{Builder, FrameError, Motion, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Body, Content, Encoding, NoMac, Packet, PacketError, PacketRows};
use dibs_stream::faults::{Fault, Injector};
use dibs_stream::{SendError, Sender, Settings, SurfaceOrder};

/// The order of a small heart's rows, the vertex of each, and the heart's motion.
fn heart() -> (SurfaceOrder, Vec<u32>, Motion) {
    static HEART: LazyLock<(SurfaceOrder, Vec<u32>, Motion)> = LazyLock::new(make);
    HEART.clone()
}

fn make() -> (SurfaceOrder, Vec<u32>, Motion) {
    let generate::MovingMesh { mesh, motion } = generate::heart(500).unwrap();
    let tree = Builder::new().build(&mesh).unwrap();
    let order = SurfaceOrder::of(&tree.tree::<u16>().unwrap());
    (order, tree.vertex_order().to_vec(), motion)
}

fn settings() -> Settings {
    Settings { heartbeat: None, session: 5, ..Settings::default() }
}

/// A receiver that believes everything, written from the specification.
fn receive(packets: &[Vec<u8>], held: &mut [Vec3]) -> (u32, Content, usize) {
    let (mut digest, mut rows_sent, mut what) = (0_u32, 0, None);
    let mut grid = None;
    for (place, bytes) in packets.iter().enumerate() {
        let packet = Packet::decode(bytes).unwrap();
        assert_eq!(usize::from(packet.sequence), place);
        match packet.body {
            Body::Begin(begin) => {
                assert_eq!((begin.session, begin.rows as usize), (5, held.len()));
                what = Some((packet.epoch, begin.content));
                grid = match begin.encoding {
                    Encoding::Quantised(grid) => Some(grid),
                    _ => None,
                };
            }
            Body::Vertices(vertices) => match vertices.rows {
                PacketRows::Float(rows) => {
                    for (row, bytes) in rows.iter().enumerate() {
                        let number =
                            |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
                        held[vertices.first as usize + row] =
                            Vec3::new(number(0), number(4), number(8));
                    }
                    rows_sent += rows.len();
                }
                PacketRows::Quantised(rows) => {
                    for (row, b) in rows.iter().enumerate() {
                        let number = |at: usize| u16::from_le_bytes([b[at], b[at + 1]]);
                        held[vertices.first as usize + row] =
                            grid.unwrap().position([number(0), number(2), number(4)]);
                    }
                    rows_sent += rows.len();
                }
                _ => panic!("an encoding that is not known here"),
            },
            Body::Commit(commit) => assert_eq!(commit.digest, digest),
            _ => panic!("not of a frame"),
        }
        digest = digest.wrapping_add(packet.verify(&NoMac, 5).unwrap());
    }
    let (epoch, content) = what.expect("a begin");
    (epoch, content, rows_sent)
}

#[test]
fn what_the_receiver_has_is_never_farther_off_than_stated() {
    let (order, vertices, motion) = heart();
    let rows = order.rows();
    for quantised in [false, true] {
        for partial in [None, Some(0.0), Some(0.05), Some(0.5), Some(3.0)] {
            let settings = Settings { quantised, partial, whole_every: 12, ..settings() };
            let mut sender = Sender::<_, 256>::new(Vec::new(), order.clone(), settings);
            let mut held = vec![Vec3::ZERO; rows];
            let (mut wholes, mut rows_sent) = (0, 0);
            for (number, frame) in (1_u32..).zip(motion.frames.iter().chain(&motion.frames)) {
                let sent = sender.send(frame).unwrap();
                let packets = take(sender.transport());
                let (epoch, content, count) = receive(&packets, &mut held);
                assert_eq!((epoch, content, count), (number, sent.content, sent.rows));
                assert_eq!((sent.epoch, sent.packets), (number, packets.len()));
                assert_eq!(sent.bytes, packets.iter().map(Vec::len).sum::<usize>());
                for (row, &vertex) in vertices.iter().enumerate() {
                    let error = held[row].as_dvec3().distance(frame[vertex as usize].as_dvec3());
                    assert!(error <= f64::from(sent.error), "row {row}: {error} > {}", sent.error);
                }
                assert_eq!(sender.held(), Some((number, held.as_slice())));
                if let (true, Some(tolerance)) = (quantised, partial) {
                    assert!(sent.error <= tolerance.max(0.002), "{} > {tolerance}", sent.error);
                }
                wholes += usize::from(content == Content::Whole);
                rows_sent += count;
            }
            let frames = 2 * motion.frames.len();
            assert_eq!(wholes, if partial.is_some() { frames.div_ceil(12) } else { frames });
            assert!(rows_sent <= frames * rows);
            if quantised && partial == Some(3.0) {
                assert!(rows_sent < frames * rows * 2 / 3, "{rows_sent} rows");
            }
        }
    }
}

#[test]
fn what_cannot_be_sent_is_named() {
    let (order, vertices, motion) = heart();
    let mut sender = Sender::<_, 64>::new(Vec::new(), order, settings());
    let mut bad = motion.frames[0].clone();
    bad[vertices[17] as usize].y = f32::NAN;
    let error = sender.send(&bad).unwrap_err();
    assert!(matches!(error, SendError::Frame(_)), "{error}");
    assert!(error.to_string().contains("row 17"), "{error}");
    bad.truncate(100);
    let error = sender.send(&bad).unwrap_err();
    let is_count = |error: &SendError| {
        matches!(error, SendError::Positions(FrameError::Vertices { found: 100, .. }))
    };
    assert!(is_count(&error), "{error}");
    assert!(sender.transport().is_empty(), "nothing was sent");
    sender.send(&motion.frames[0]).unwrap();
}

/// Each packet of some frames, with what the injector makes of it.
fn injected(fault: Fault, quantised: bool, seed: u64) -> Vec<(Vec<u8>, Vec<Vec<u8>>)> {
    let (order, _, motion) = heart();
    let settings = Settings { quantised, ..settings() };
    let mut sender = Sender::<_, 64>::new(Vec::new(), order, settings);
    let mut injector = Injector::new(seed);
    let mut all = Vec::new();
    for (number, frame) in motion.frames.iter().enumerate().take(9) {
        sender.send(frame).unwrap();
        for packet in take(sender.transport()) {
            let faulty = if number == 0 { None } else { injector.inject(fault, &packet) };
            match faulty {
                Some(faulty) => all.push((packet, faulty)),
                None => drop(injector.pass(&packet)),
            }
        }
    }
    all
}

#[test]
fn the_same_seed_gives_the_same_faults() {
    for fault in Fault::ALL {
        assert_eq!(injected(fault, true, 3), injected(fault, true, 3));
    }
    assert_ne!(injected(Fault::FlipOne, true, 3), injected(Fault::FlipOne, true, 4));
}

#[test]
fn damage_is_seen_by_the_checksum_and_sealed_faults_are_not() {
    for quantised in [false, true] {
        for fault in Fault::ALL {
            let all = injected(fault, quantised, 1);
            let mut kinds = HashMap::<&str, u32>::new();
            for (packet, faulty) in &all {
                let sent = Packet::decode(packet).unwrap();
                for faulty in faulty {
                    let outcome = match Packet::decode(faulty) {
                        Err(PacketError::Checksum { .. } | PacketError::TooShort { .. }) => "seen",
                        Err(PacketError::Box) => "box",
                        Err(error) => panic!("{fault:?}: {error}"),
                        Ok(_) if faulty == packet => "same",
                        Ok(got) if got.epoch != sent.epoch => "epoch",
                        Ok(got) if got.mesh_id != sent.mesh_id => "mesh",
                        Ok(got) => {
                            let is_other = matches!(fault, Fault::Reorder | Fault::Replay);
                            assert!(is_other || faulty.len() == packet.len());
                            assert_ne!(got.body, sent.body);
                            "body"
                        }
                    };
                    *kinds.entry(outcome).or_default() += 1;
                }
            }
            let only = |expected: &[&str]| {
                assert!(kinds.keys().all(|kind| expected.contains(kind)), "{fault:?}: {kinds:?}");
                assert!(!kinds.is_empty(), "{fault:?}");
            };
            match fault {
                Fault::FlipOne | Fault::FlipTwo | Fault::Burst => only(&["seen"]),
                Fault::Truncate | Fault::Overrun => only(&["seen"]),
                Fault::Drop | Fault::SenderRestart | Fault::ReceiverRestart => {
                    assert!(kinds.is_empty());
                }
                Fault::Forgery => assert!(all.is_empty(), "these packets have no tag"),
                Fault::Pose => assert!(all.is_empty(), "these frames have no pose"),
                Fault::Duplicate => only(&["same"]),
                // What was held back comes with another packet of the frame.
                Fault::Reorder => only(&["body", "same", "epoch"]),
                Fault::StaleEpoch => only(&["epoch"]),
                Fault::Replay => only(&["epoch", "same"]),
                Fault::WrongMesh => only(&["mesh"]),
                Fault::OutOfRange | Fault::Stretch => only(&["body"]),
                Fault::NotFinite if quantised => only(&["box"]),
                Fault::TooFar if quantised => only(&["box", "body"]),
                Fault::NotFinite | Fault::TooFar => only(&["body"]),
                _ => panic!("a fault that is not known here"),
            }
        }
    }
}
