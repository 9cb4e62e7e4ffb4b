//! `dibs bridge --pose-device …`: every frame goes out with the pose that came last before it.

// Requirement: B-09

use std::collections::BTreeMap;
use std::fs;
use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Output;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::glam::{DQuat, DVec3, Mat3, Quat, Vec3};
use dibs_nostd::wire::{Body, Packet, PacketRows, VertexPacket};
use dibs_nostd::{RigidPose, Tree};

use super::igtl::{accepted, organ};
use super::igtl_messages::{array_in_metres, message};
use super::receiver::{Bytes, Link};
use super::{FRAMES, N, PATIENCE, heart, spawn, totals};

/// Of one kind or the other, in metres and RAS; `shift` in millimetres and LPS.
pub fn pose_message(kind: &str, device: &str, rotation: Quat, shift: Vec3) -> Vec<u8> {
    // Half a turn about S leads from LPS to RAS.
    let half = Quat::from_rotation_z(std::f32::consts::PI);
    let rotation = (half * rotation * half.inverse()).normalize();
    as_given(kind, device, rotation, Vec3::new(-shift.x, -shift.y, shift.z) * 1e-3)
}

/// The same, with these numbers.
pub fn as_given(kind: &str, device: &str, rotation: Quat, shift: Vec3) -> Vec<u8> {
    let matrix = Mat3::from_quat(rotation).to_cols_array();
    let matrix: Vec<f32> = matrix.into_iter().chain(shift.to_array()).collect();
    let quaternion: Vec<f32> = shift.to_array().into_iter().chain(rotation.to_array()).collect();
    let bytes = |numbers: &[f32]| numbers.iter().flat_map(|x| x.to_be_bytes()).collect::<Vec<_>>();
    let element = |name: &str, numbers: &[f32]| {
        let name = name.bytes().chain([0; 20]).take(20);
        name.chain([1, 0]).chain(bytes(numbers)).collect::<Vec<_>>()
    };
    match kind {
        "TRANSFORM" => message(2, kind, device, &bytes(&matrix)),
        "TDATA" => {
            let others = element("needle", &[0.0; 12]);
            message(1, kind, "tracker", &[others, element(device, &matrix)].concat())
        }
        _ => message(1, kind, "tracker", &element(device, &quaternion)),
    }
}

/// A frame as packets bring it.
#[derive(Default)]
pub struct Posed {
    /// Begin packets that announce a pose.
    pub begun: u32,
    pub poses: Vec<RigidPose>,
    pub age_ms: u16,
    /// By their rows in the tree.
    pub positions: BTreeMap<u32, Vec3>,
}

/// The frames that a bridge makes of a source's messages and the poses of its device "organ", with `line`.
pub fn posed(
    folder: &Path,
    line: &str,
    source: impl FnOnce(TcpStream) -> TcpStream + Send,
) -> (Vec<Posed>, Output) {
    let [server, receiver] = [0; 2].map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
    let [from, to] = [&server, &receiver].map(|socket| socket.local_addr().unwrap());
    let line =
        format!("--to tcp:{to} --from igtl:{from} --pose-device organ --motion-rate 200 {line}");
    let mut child = spawn(folder, &line);
    let (socket, _) = receiver.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    thread::scope(|scope| {
        // Its connection stays: one that is closed with unread statuses takes what it sent with it.
        let source = scope.spawn(|| source(accepted(&server)));
        let (mut link, mut found) = (Bytes::new(socket), BTreeMap::<u32, Posed>::new());
        let start = Instant::now();
        while let Some(packets) = link.receive() {
            if start.elapsed() > PATIENCE {
                // What it has not sent is in the assertions.
                child.kill().unwrap();
            }
            for packet in packets {
                let packet = Packet::decode(&packet).unwrap();
                let frame = found.entry(packet.epoch).or_default();
                match packet.body {
                    Body::Begin(begin) => {
                        frame.begun += u32::from(begin.is_posed);
                        frame.age_ms = begin.freshness.age_ms;
                    }
                    Body::Pose(sent) => frame.poses.push(sent.unwrap()),
                    Body::Vertices(VertexPacket { first, rows: PacketRows::Float(rows) }) => {
                        let at = |row: &[u8; 12]| {
                            let (numbers, _) = row.as_chunks::<4>();
                            Vec3::from_slice(
                                &numbers.iter().map(|x| f32::from_le_bytes(*x)).collect::<Vec<_>>(),
                            )
                        };
                        frame.positions.extend((first..).zip(rows.iter().map(at)));
                    }
                    _ => (),
                }
            }
        }
        let output = child.wait_with_output().unwrap();
        drop(source.join());
        // Heartbeats have an epoch, too.
        (found.into_values().filter(|frame| frame.begun > 0).collect(), output)
    })
}

/// Poses of all three types, among those of others, mirrored and damaged ones; frames before the first pose are refused.
#[test]
fn every_frame_has_its_positions_and_the_last_pose() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let turn = |number: usize| DQuat::from_scaled_axis(DVec3::new(0.2, 0.7, -0.4) * number as f64);
    let shift = |number: usize| DVec3::new(20.0, -300.0, 7.0) * number as f64;
    let line = format!("--unit m --axes RAS:LPS --frames {FRAMES}");
    let (found, output) = posed(folder, &line, |mut peer| {
        let frame = |number: usize| {
            // RAS, as the other axes are the mesh's.
            let turned: Vec<Vec3> =
                frames[number].iter().map(|at| Vec3::new(-at.x, -at.y, at.z)).collect();
            message(1, "NDARRAY", "heart", &array_in_metres(&turned))
        };
        peer.write_all(&frame(3)).unwrap();
        for number in 0..FRAMES {
            let kind = ["TRANSFORM", "TDATA", "QTDATA"][number % 3];
            let (rotation, shift) = (turn(number).as_quat(), shift(number).as_vec3());
            let pose = pose_message(kind, "organ", rotation, shift);
            let other = pose_message(kind, "probe", Quat::IDENTITY, Vec3::ONE);
            let mut mirrored = [0.0_f32; 12];
            (mirrored[0], mirrored[4], mirrored[8]) = (1.0, 1.0, -1.0);
            let mirrored: Vec<u8> = mirrored.iter().flat_map(|x| x.to_be_bytes()).collect();
            let mirrored = message(1, "TRANSFORM", "organ", &mirrored);
            let longer = message(1, kind, "organ", &[0; 53]);
            let mut damaged = pose_message(kind, "organ", Quat::IDENTITY, Vec3::ZERO);
            *damaged.last_mut().unwrap() ^= 1;
            let messages = [pose, other, mirrored, longer, damaged, frame(number)];
            peer.write_all(&messages.concat()).unwrap();
        }
        peer
    });
    let notes = String::from_utf8_lossy(&output.stderr);
    assert_eq!(found.len(), FRAMES, "{notes}");
    let totals = totals(&output);
    let blob = fs::read(folder.join("heart.dibs")).unwrap();
    let tree = Tree::<u16>::from_bytes(&blob).unwrap();
    for (number, (posed, frame)) in found.iter().zip(&frames).enumerate() {
        assert_eq!((posed.begun, posed.poses.len()), (1, 1), "frame {number}");
        assert_eq!(posed.positions.len(), N, "frame {number}");
        for (&row, at) in &posed.positions {
            assert_eq!(*at, frame[tree.vertex_number(row).unwrap().0 as usize], "frame {number}");
        }
        for at in &frame[..20] {
            let truth = turn(number) * at.as_dvec3() + shift(number);
            let off = (posed.poses[0].apply(*at).as_dvec3() - truth).length();
            assert!(off < 2e-3, "frame {number}: {off} mm");
        }
    }
    let refused = &totals["source"]["refused"];
    assert_eq!((&refused["pose"], &refused["checksum"]), (&26.into(), &25.into()), "{totals}");
    assert_eq!(refused["layout"], 25, "{totals}");
    assert_eq!((&totals["source"]["poses"], &totals["frames"]), (&25.into(), &25.into()));
    assert_eq!(totals["source"]["passed"], 25, "{totals}");
    for part in [
        "no pose of device \"organ\" has come before it",
        "TRANSFORM of device \"organ\": its content has 53 bytes, and should have 48",
        "its content has 53 bytes, and should have 70 for each instrument",
        "its content has 53 bytes, and should have 50 for each instrument",
    ] {
        assert!(notes.contains(part), "{part}: {notes}");
    }
}
