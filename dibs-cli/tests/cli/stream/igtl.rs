//! `dibs bridge --from igtl:…`: what OpenIGTLink messages hold reaches a receiver, or is refused by its cause. The messages
//! are written here, from the protocol's specification.

// Requirement: B-10

use std::fs;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::Output;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::Motion;
use dibs_build::glam::Vec3;
use dibs_nostd::wire::NoMac;
use dibs_nostd::{Tree, TriangleRow};
use fastrand::Rng;

use super::igtl_messages::{array, array_in_metres, crc, message, point_list, poly_data, timed};
use super::receiver::{Bytes, Link, Seen, receive};
use super::{FRAMES, N, PATIENCE, assert_all, heart, program, spawn, totals};

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
fn bridged_to<T: Send>(
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
fn connected(to: &str) -> TcpStream {
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
            peer.set_read_timeout(Some(PATIENCE)).unwrap();
            return peer;
        }
        assert!(start.elapsed() < PATIENCE, "nobody connects");
        thread::sleep(Duration::from_millis(5));
    }
}

fn free_address() -> String {
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

/// What a bridge sends until it hangs up.
fn all(peer: &mut TcpStream) -> Vec<u8> {
    let mut bytes = Vec::new();
    let _ = peer.read_to_end(&mut bytes);
    bytes
}

/// Statuses that a bridge sent back, as code, name and sentence.
fn statuses(mut bytes: &[u8]) -> Vec<(u16, String, String)> {
    let text = |bytes: &[u8]| {
        String::from_utf8(bytes.split(|&byte| byte == 0).next().unwrap().to_vec()).unwrap()
    };
    let mut statuses = Vec::new();
    while let Some((header, rest)) = bytes.split_at_checked(58) {
        assert_eq!((&header[..2], &header[2..9]), (&[0, 1][..], &b"STATUS\0"[..]));
        let size = u64::from_be_bytes(header[42..50].try_into().unwrap()) as usize;
        let Some((body, rest)) = rest.split_at_checked(size) else { break };
        assert_eq!(header[50..58], crc(body).to_be_bytes());
        statuses.push((
            u16::from_be_bytes([body[0], body[1]]),
            text(&body[10..30]),
            text(&body[30..]),
        ));
        bytes = rest;
    }
    statuses
}

/// Between frames that are right come messages of every wrong kind. None of them reaches the receiver, whose last surface
/// stays; each is counted by its cause, and the peer is told.
#[test]
fn wrong_messages_are_refused_and_the_last_surface_stays() {
    let folder = heart();
    let folder = folder.path();
    let (frames, triangles) = organ(folder);
    let moved = |frame: &[Vec3]| -> Vec<Vec3> { frame.iter().map(|&at| at + Vec3::X).collect() };
    let wrong = |frame: &[Vec3]| -> Vec<(&'static str, Vec<u8>)> {
        let frame = &moved(frame)[..];
        // The other diagonal of two triangles: as many points and triangles.
        let mut flipped = triangles.clone();
        let [a, b, c] = flipped[0];
        let other =
            flipped.iter().skip(1).position(|t| t.contains(&a) && t.contains(&b)).unwrap() + 1;
        let far = flipped[other].into_iter().find(|v| *v != a && *v != b).unwrap();
        (flipped[0], flipped[other]) = ([far, b, c], [a, far, c]);
        let good = poly_data(frame, &triangles);
        let mut corrupt = message(1, "POLYDATA", "", &good);
        *corrupt.last_mut().unwrap() ^= 1;
        let mut hostile = good.clone();
        hostile[..4].copy_from_slice(&u32::MAX.to_be_bytes());
        let mut cells = good.clone();
        cells[24..28].copy_from_slice(&u32::MAX.to_be_bytes());
        let mut with_nan = frame.to_vec();
        with_nan[17].y = f32::NAN;
        let metres: Vec<Vec3> = frame.iter().map(|&at| at / 1000.0).collect();
        let polydata = |content: &[u8]| message(1, "POLYDATA", "", content);
        vec![
            ("topology", polydata(&poly_data(frame, &flipped))),
            ("topology", polydata(&poly_data(&[frame, &[Vec3::ZERO]].concat(), &triangles[1..]))),
            ("topology", polydata(&poly_data(frame, &[]))),
            ("topology", polydata(&poly_data(&frame[..400], &triangles))),
            ("checksum", corrupt),
            ("layout", polydata(&hostile)),
            ("layout", polydata(&cells)),
            ("layout", polydata(&good[..good.len() - 3])),
            ("layout", polydata(&vec![0; 1 << 22])),
            ("layout", message(1, "POINT", "", &point_list(frame)[1..])),
            ("layout", message(1, "NDARRAY", "", &[10, 255, 255])),
            ("layout", message(2, "NDARRAY", "", &array(frame)[..3])),
            ("frame", polydata(&poly_data(&with_nan, &triangles))),
            ("frame", message(1, "POINT", "", &point_list(&frame[1..]))),
            ("frame", message(1, "NDARRAY", "", &array(&metres))),
        ]
    };
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{}", server.local_addr().unwrap());
    let (seen, output, (sent, said)) = bridged(folder, &line, || {
        let mut peer = accepted(&server);
        let mut reader = peer.try_clone().unwrap();
        // Statuses are taken until the bridge ends.
        let said = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&said);
        let reading = thread::spawn(move || {
            let mut chunk = [0; 1024];
            while let Ok(bytes) = reader.read(&mut chunk)
                && bytes > 0
            {
                heard.lock().unwrap().extend_from_slice(&chunk[..bytes]);
            }
        });
        let mut sent = Vec::new();
        for (number, frame) in frames.iter().enumerate() {
            for (cause, wrong) in wrong(frame) {
                peer.write_all(&wrong).unwrap();
                sent.push(cause);
            }
            if number == 12 {
                // The surface ages for as long as only wrong messages come.
                thread::sleep(Duration::from_millis(1200));
            }
            peer.write_all(&message(1, "POLYDATA", "", &poly_data(frame, &triangles))).unwrap();
            // Once no wrong message follows, the peer is told that all is well.
            let start = Instant::now();
            while number == 13 && !statuses(&said.lock().unwrap()).iter().any(|one| one.0 == 1) {
                assert!(start.elapsed() < PATIENCE, "the peer is not told");
                thread::sleep(Duration::from_millis(20));
            }
        }
        reading.join().unwrap();
        let said = said.lock().unwrap().clone();
        (sent, said)
    });
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!(seen.error, 0.0);
    for cause in ["topology", "checksum", "layout", "frame"] {
        let count = sent.iter().filter(|one| **one == cause).count();
        assert_eq!(totals["source"]["refused"][cause], count, "{totals}");
    }
    assert_eq!(
        (sent.len(), &totals["source"]["connections"]),
        (15 * FRAMES, &1.into()),
        "{totals}"
    );
    assert!(totals["timing"]["longest_gap_ms"].as_f64().unwrap() > 1000.0, "{totals}");
    let notes = String::from_utf8_lossy(&output.stderr);
    assert!(
        notes.contains("POLYDATA of device \"\": its 1000 triangles of 502 points are not"),
        "{notes}"
    );
    let said = statuses(&said);
    let has = |code: u16, name: &str, part: &str| {
        said.iter().any(|one| one.0 == code && one.1 == name && one.2.contains(part))
    };
    assert!(has(10, "topology", "it is of another mesh"), "{said:?}");
    assert!(has(1, "", "published"), "{said:?}");
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

/// A message whose header's time says that it was half a second on its way makes a frame of that age.
#[test]
fn frames_are_as_old_as_their_headers_say() {
    const LATE: usize = 15;
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{}", server.local_addr().unwrap());
    let (seen, output, _) = bridged(folder, &line, || {
        let mut peer = accepted(&server);
        let start = Instant::now();
        for (number, frame) in frames.iter().enumerate() {
            if number == LATE {
                // What is held up is late by as long.
                thread::sleep(Duration::from_millis(500));
            }
            // The peer's clock has a beginning of its own.
            let time = start.elapsed().as_secs_f64() + if number < LATE { 1000.5 } else { 1000.0 };
            let message = message(1, "NDARRAY", "", &array(frame));
            peer.write_all(&timed(message, time)).unwrap();
            thread::sleep(Duration::from_millis(10));
        }
        peer
    });
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!(totals["source"]["without_time"], 0, "{totals}");
    let (prompt, late) = seen.ages.split_at(LATE);
    assert!(prompt.iter().any(|&age| age < 100), "{prompt:?}");
    // On a loaded computer the first ones may have been late, too.
    assert!(late.iter().all(|&age| age >= 400), "{late:?}");
}

/// Where the user gives a rate, a frame that waits for its turn grows old meanwhile.
#[test]
fn frames_that_wait_grow_old() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let at = server.local_addr().unwrap();
    let line = format!("--from igtl:{at} --motion-rate 20 --frames {FRAMES}");
    let (seen, output, _) = bridged_to(folder, &line, Duration::MAX, || {
        let mut peer = accepted(&server);
        for frame in &frames {
            peer.write_all(&message(1, "NDARRAY", "", &array(frame))).unwrap();
        }
        peer
    });
    assert_all(&seen, &totals(&output));
    // Each came when the one before it was taken; a tick that is late makes the next one's wait shorter.
    let waited = &seen.ages[2..];
    assert!(waited.iter().sum::<u32>() >= 40 * waited.len() as u32, "{waited:?}");
}

/// Who sends is told once the receiver says no more.
#[test]
fn a_receiver_that_falls_silent_is_reported() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{} --motion-rate 2 --frames 7", server.local_addr().unwrap());
    let (_, _, said) = bridged_to(folder, &line, Duration::from_millis(1_500), || {
        let mut peer = accepted(&server);
        for frame in &frames {
            peer.write_all(&message(1, "NDARRAY", "", &array(frame))).unwrap();
        }
        all(&mut peer)
    });
    let said = statuses(&said);
    let ready = said.iter().position(|(code, ..)| *code == 1);
    let silence = "no status from the receiver for";
    let silent = said.iter().rposition(|(code, _, text)| *code == 13 && text.contains(silence));
    assert!(ready.is_some_and(|ready| silent.is_some_and(|silent| ready < silent)), "{said:?}");
}

#[test]
fn what_no_source_is_is_one_sentence() {
    let folder = heart();
    let folder = folder.path();
    let closed = free_address();
    // Connects whoever comes, and says nothing before it hangs up.
    let mute = TcpListener::bind("127.0.0.1:0").unwrap();
    let mute_address = mute.local_addr().unwrap();
    thread::spawn(move || mute.incoming().for_each(drop));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap();
    for (line, code, part) in [
        (format!("--from igtl:{closed} --retry 0"), 1, "cannot be reached within 0 s"),
        (format!("--from igtl:{mute_address} --retry 1"), 1, "has sent no message within 1 s"),
        (format!("--from igtl-listen:{taken}"), 1, "cannot listen there"),
        ("--from igtl:18944".to_owned(), 2, "igtl:HOST:PORT"),
        ("--from - --device heart".to_owned(), 1, "only OpenIGTLink has devices"),
        (format!("--from igtl:{closed} --format json"), 1, "OpenIGTLink have its own"),
        ("--from - --axes RAS".to_owned(), 2, "FROM:TO"),
    ] {
        let line = format!("bridge heart.dibs {line} --to udp:127.0.0.1:9");
        let output = program(folder, &line).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(code) && error.contains(part), "{line}: {error}");
        let errors = error.lines().filter(|line| line.starts_with("error: "));
        assert_eq!(errors.count(), 1, "{error}");
    }
}
