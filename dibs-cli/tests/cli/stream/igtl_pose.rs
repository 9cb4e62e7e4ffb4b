//! `dibs bridge --pose-device …`: every frame goes out with the pose that came last before it.

// Requirement: B-09

use std::collections::BTreeMap;
use std::io::Write;
use std::net::TcpListener;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::glam::{DQuat, DVec3, Mat3, Quat, Vec3};
use dibs_nostd::RigidPose;
use dibs_nostd::wire::{Body, Packet};

use super::igtl::{accepted, organ};
use super::igtl_messages::{array_in_metres, message};
use super::receiver::{Bytes, Link};
use super::{FRAMES, PATIENCE, heart, spawn, totals};

/// Of one kind or the other, in metres and RAS; `shift` in millimetres and LPS.
fn pose_message(kind: &str, device: &str, rotation: Quat, shift: Vec3) -> Vec<u8> {
    // Half a turn about S leads from LPS to RAS.
    let half = Quat::from_rotation_z(std::f32::consts::PI);
    let rotation = (half * rotation * half.inverse()).normalize();
    let shift = Vec3::new(-shift.x, -shift.y, shift.z) * 1e-3;
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

/// Poses of all three types, among those of others, mirrored and damaged ones; frames before the first pose are refused.
#[test]
fn every_frame_has_the_last_pose() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let [source, receiver] = [0; 2].map(|_| TcpListener::bind("127.0.0.1:0").unwrap());
    let [from, to] = [&source, &receiver].map(|socket| socket.local_addr().unwrap());
    let options = "--pose-device organ --unit m --axes RAS:LPS --motion-rate 200";
    let line = format!("--to tcp:{to} --from igtl:{from} {options} --frames {FRAMES}");
    let mut child = spawn(folder, &line);
    let (socket, _) = receiver.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    let turn = |number: usize| DQuat::from_scaled_axis(DVec3::new(0.2, 0.7, -0.4) * number as f64);
    let shift = |number: usize| DVec3::new(20.0, -300.0, 7.0) * number as f64;
    let (found, output) = thread::scope(|scope| {
        // Its connection stays: one that is closed with unread statuses takes what it sent with it.
        let source = scope.spawn(|| {
            let mut peer = accepted(&source);
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
                let mut damaged = pose_message(kind, "organ", Quat::IDENTITY, Vec3::ZERO);
                *damaged.last_mut().unwrap() ^= 1;
                let messages = [pose, other, mirrored, damaged, frame(number)];
                peer.write_all(&messages.concat()).unwrap();
            }
            peer
        });
        let (mut link, mut found) = (Bytes::new(socket), BTreeMap::new());
        let start = Instant::now();
        while let Some(packets) = link.receive() {
            if start.elapsed() > PATIENCE {
                // What it has not sent is in the assertions.
                child.kill().unwrap();
            }
            for packet in packets {
                let packet = Packet::decode(&packet).unwrap();
                let (begun, pose): &mut (u32, Vec<RigidPose>) =
                    found.entry(packet.epoch).or_default();
                match packet.body {
                    Body::Begin(begin) => *begun += u32::from(begin.is_posed),
                    Body::Pose(sent) => pose.push(sent.unwrap()),
                    _ => (),
                }
            }
        }
        let output = child.wait_with_output().unwrap();
        drop(source.join());
        (found, output)
    });
    let notes = String::from_utf8_lossy(&output.stderr);
    found.values().filter(|(begun, _)| *begun > 0).for_each(|(begun, poses)| {
        assert_eq!((*begun, poses.len()), (1, 1));
    });
    let poses: Vec<RigidPose> = found.values().flat_map(|(_, poses)| poses.clone()).collect();
    assert_eq!(poses.len(), FRAMES, "{notes}");
    let totals = totals(&output);
    for (number, (pose, frame)) in poses.iter().zip(&frames).enumerate() {
        for at in &frame[..20] {
            let truth = turn(number) * at.as_dvec3() + shift(number);
            let off = (pose.apply(*at).as_dvec3() - truth).length();
            assert!(off < 2e-3, "frame {number}: {off} mm");
        }
    }
    let refused = &totals["source"]["refused"];
    assert_eq!((&refused["pose"], &refused["checksum"]), (&26.into(), &25.into()), "{totals}");
    assert_eq!((&totals["source"]["poses"], &totals["frames"]), (&25.into(), &25.into()));
    assert_eq!(totals["source"]["passed"], 25, "{totals}");
    assert!(notes.contains("no pose of device \"organ\" has come before it"), "{notes}");
}
