//! `dibs bridge --from igtl:…`: what OpenIGTLink messages hold reaches a receiver, or is refused by its cause. The messages
//! are written here, from the protocol's specification.

// Requirement: B-10

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Output;
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::Motion;
use dibs_build::glam::Vec3;
use dibs_nostd::wire::NoMac;
use dibs_nostd::{Tree, TriangleRow};
use fastrand::Rng;

use super::igtl_messages::{array, array_in_metres, message, point_list, poly_data};
use super::receiver::{Bytes, Link, Seen, receive};
use super::{FRAMES, N, PATIENCE, assert_all, heart, spawn, totals};

/// A link that sends statuses for so long, and no more.
struct Quiet<L> {
    link: L,
    first: Option<Instant>,
    speech: Duration,
}

impl<L: Link> Link for Quiet<L> {
    fn receive(&mut self) -> Option<Vec<Vec<u8>>> {
        self.link.receive()
    }

    fn reply(&mut self, packet: &[u8]) {
        if self.first.get_or_insert_with(Instant::now).elapsed() < self.speech {
            self.link.reply(packet);
        }
    }
}

/// The motion, and the triangles by the mesh's numbers.
pub fn organ(folder: &Path) -> (Vec<Vec<Vec3>>, Vec<[u32; 3]>) {
    let blob = fs::read(folder.join("heart.dibs")).unwrap();
    let tree = Tree::<u16>::from_bytes(&blob).unwrap();
    let corners = (0..tree.triangle_count()).map(|row| tree.corners(TriangleRow(row)).unwrap());
    let triangles = corners.map(|rows| rows.map(|row| tree.vertex_number(row).unwrap().0));
    (Motion::read_pc2(folder.join("heart.pc2")).unwrap().frames, triangles.collect())
}

/// Runs a bridge of every frame, with `line`, to a receiver, beside `source`.
pub fn bridged<T: Send>(
    folder: &Path,
    line: &str,
    source: impl FnOnce() -> T + Send,
) -> (Seen, Output, T) {
    let line = format!("--motion-rate 200 --frames {FRAMES} {line}");
    bridged_to(folder, &line, Duration::MAX, source)
}

/// The same of so many frames as the line says, to a receiver that is silent this long after its first status.
pub fn bridged_to<T: Send>(
    folder: &Path,
    line: &str,
    speech: Duration,
    source: impl FnOnce() -> T + Send,
) -> (Seen, Output, T) {
    let receiver = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = receiver.local_addr().unwrap();
    let line = format!("--to tcp:{to} {line}");
    let child = spawn(folder, &line);
    let (socket, _) = receiver.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    thread::scope(|scope| {
        let source = scope.spawn(source);
        let mut link = Quiet { link: Bytes::new(socket), first: None, speech };
        let (seen, output) = receive(folder, &mut link, NoMac, child);
        (seen, output, source.join().unwrap())
    })
}

/// Connects to a bridge that listens there, once it does.
pub fn connected(to: &str) -> TcpStream {
    let start = Instant::now();
    loop {
        match TcpStream::connect(to) {
            Ok(stream) => return stream,
            Err(error) => assert!(start.elapsed() < PATIENCE, "{error}"),
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// The next connection. One that does not come fails the test.
pub fn accepted(server: &TcpListener) -> TcpStream {
    server.set_nonblocking(true).unwrap();
    let start = Instant::now();
    loop {
        if let Ok((peer, _)) = server.accept() {
            peer.set_nonblocking(false).unwrap();
            // Else a message may wait until the bridge's system acknowledges the one before.
            peer.set_nodelay(true).unwrap();
            peer.set_read_timeout(Some(PATIENCE)).unwrap();
            return peer;
        }
        assert!(start.elapsed() < PATIENCE, "nobody connects");
        thread::sleep(Duration::from_millis(5));
    }
}

pub fn free_address() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string()
}

/// POLYDATA, POINT and NDARRAY of both versions, from a server and from a client, among messages of other types and devices.
#[test]
fn messages_of_every_kind_arrive_to_the_bit() {
    let folder = heart();
    let folder = folder.path();
    let (frames, triangles) = organ(folder);
    let send = |mut peer: TcpStream| {
        for (number, frame) in frames.iter().enumerate() {
            let version = 1 + (number % 2) as u16;
            let (kind, content) = match number % 4 {
                0 | 1 => ("POLYDATA", poly_data(frame, &triangles)),
                2 => ("POINT", point_list(frame)),
                _ => ("NDARRAY", array(frame)),
            };
            let messages = [
                message(version, "TRANSFORM", "tool", &[0; 48]),
                message(version, "IMAGE", "us", &vec![1; 300_000]),
                message(version, "POLYDATA", "bone", &poly_data(&frame[..3], &[[0, 1, 2]])),
                message(version, kind, "heart", &content),
            ];
            peer.write_all(&messages.concat()).unwrap();
        }
        peer
    };
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{} --device heart", server.local_addr().unwrap());
    let (seen, output, _) = bridged(folder, &line, || send(accepted(&server)));
    let from_server = totals(&output);
    assert_all(&seen, &from_server);
    let address = free_address();
    let line = format!("--from igtl-listen:{address} --device heart");
    let (seen, output, _) = bridged(folder, &line, || send(connected(&address)));
    let from_client = totals(&output);
    assert_all(&seen, &from_client);
    let notes = String::from_utf8_lossy(&output.stderr);
    let passed = "POLYDATA of device \"bone\" passed over: --device is heart";
    assert_eq!(notes.matches(passed).count(), 1, "{notes}");
    for totals in [from_server, from_client] {
        let source = &totals["source"];
        assert_eq!(
            (&source["connections"], &source["passed"]),
            (&1.into(), &75.into()),
            "{totals}"
        );
        assert_eq!((&source["messages"], &source["broken"]), (&100.into(), &0.into()), "{totals}");
        assert_eq!(source["without_time"], 25, "{totals}");
        assert!(totals["timing"]["rate_hz"].as_f64().unwrap() > 10.0, "{totals}");
        assert!(totals["timing"]["latency_ms"]["p50"].as_f64().unwrap() > 0.0, "{totals}");
    }
    assert_eq!(seen.error, 0.0);
}

/// Each frame has its points in an order of its own.
#[test]
fn points_in_any_order_are_the_meshs() {
    let folder = heart();
    let folder = folder.path();
    let (frames, triangles) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{}", server.local_addr().unwrap());
    let (seen, output, _) = bridged(folder, &line, || {
        let (mut peer, mut random) = (accepted(&server), Rng::with_seed(5));
        for frame in &frames {
            let mut point_of: Vec<u32> = (0..N as u32).collect();
            random.shuffle(&mut point_of);
            let mut points = vec![Vec3::ZERO; N];
            point_of.iter().zip(frame).for_each(|(&point, &at)| points[point as usize] = at);
            let mut triangles: Vec<[u32; 3]> =
                triangles.iter().map(|t| t.map(|vertex| point_of[vertex as usize])).collect();
            random.shuffle(&mut triangles);
            peer.write_all(&message(1, "POLYDATA", "", &poly_data(&points, &triangles))).unwrap();
            // Positions that do not say which order they have.
            let moved: Vec<Vec3> = frame.iter().map(|&at| at + Vec3::X).collect();
            let _ = peer.write_all(&message(1, "NDARRAY", "", &array(&moved)));
        }
        peer
    });
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!(seen.error, 0.0);
    assert!(totals["source"]["refused"]["topology"].as_u64().unwrap() >= 24, "{totals}");
}

/// Metres, and axes of which two point the other way.
#[test]
fn units_and_axes_are_converted() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{} --unit m --axes ALS:RPS", server.local_addr().unwrap());
    let (seen, output, _) = bridged(folder, &line, || {
        let mut peer = accepted(&server);
        for frame in &frames {
            // To the front is -y of the mesh, to the left its -x.
            let turned: Vec<Vec3> = frame.iter().map(|at| Vec3::new(-at.y, -at.x, at.z)).collect();
            peer.write_all(&message(1, "NDARRAY", "", &array_in_metres(&turned))).unwrap();
        }
        peer
    });
    assert_all(&seen, &totals(&output));
    assert_eq!(seen.error, 0.0);
}

/// A peer that goes, also inside of a message, comes back; so does one that sends what is no message, or a size that no
/// message has.
#[test]
fn a_peer_that_goes_is_met_again() {
    let folder = heart();
    let folder = folder.path();
    let (frames, triangles) = organ(folder);
    let good = |frame: &[Vec3]| message(1, "POLYDATA", "", &poly_data(frame, &triangles));
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{}", server.local_addr().unwrap());
    let (seen, output, ()) = bridged(folder, &line, || {
        let mut huge = message(1, "IMAGE", "", &[]);
        huge[42..50].copy_from_slice(&u64::MAX.to_be_bytes());
        let parts: [&[u8]; 5] =
            [&[], &good(&frames[0])[..5000], &good(&frames[0])[..30], &[7; 100], &huge];
        for (number, last) in parts.into_iter().enumerate() {
            let mut peer = accepted(&server);
            for frame in &frames[5 * number..5 * number + 5] {
                peer.write_all(&good(frame)).unwrap();
            }
            // The bridge hangs up where it is right to, and after the last frame.
            let _ = peer.write_all(last);
            let _ = peer.shutdown(std::net::Shutdown::Write);
            let _ = peer.read_to_end(&mut Vec::new());
        }
    });
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!(seen.error, 0.0);
    let connections = totals["source"]["connections"].as_u64().unwrap();
    assert!((5..=6).contains(&connections), "{totals}");
    assert!(totals["source"]["broken"].as_u64().unwrap() >= 3, "{totals}");
    let notes = String::from_utf8_lossy(&output.stderr);
    assert!(notes.contains("a message was cut short"), "{notes}");
}

/// Who connects last takes the place of a peer that is silent.
#[test]
fn a_silent_peer_gives_way() {
    let folder = heart();
    let folder = folder.path();
    let (frames, triangles) = organ(folder);
    let address = free_address();
    let line = format!("--from igtl-listen:{address}");
    let (seen, output, _) = bridged(folder, &line, || {
        let silent = connected(&address);
        let mut peer = connected(&address);
        for frame in &frames {
            peer.write_all(&message(1, "POLYDATA", "", &poly_data(frame, &triangles))).unwrap();
        }
        (silent, peer)
    });
    assert_all(&seen, &totals(&output));
}
