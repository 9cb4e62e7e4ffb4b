//! What a bridge refuses of OpenIGTLink, and what it says of itself to the peer and to the user.

// Requirement: B-10

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use dibs_build::glam::Vec3;

use super::igtl::{accepted, bridged, bridged_to, free_address, organ};
use super::igtl_messages::{array, crc, message, point_list, poly_data};
use super::{FRAMES, PATIENCE, assert_all, heart, program, totals};

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

/// All frames of a server that ends arrive. Then the bridge tries to connect again, and fails with one sentence.
#[test]
fn a_server_that_ends_for_good_ends_the_bridge() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--from igtl:{} --motion-rate 200 --retry 1", server.local_addr().unwrap());
    let (seen, output, _) = bridged_to(folder, &line, Duration::MAX, move || {
        let mut peer = accepted(&server);
        for frame in &frames[..3] {
            peer.write_all(&message(1, "NDARRAY", "", &array(frame))).unwrap();
        }
    });
    let error = String::from_utf8(output.stderr).unwrap();
    let is_told = error.contains("ended, and cannot be reached again within 1 s");
    assert!(output.status.code() == Some(1) && is_told, "{error}");
    assert_eq!(error.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{error}");
    assert_eq!(seen.published, 3);
    let totals: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(totals["frames"], 3);
}

/// The time to come back begins when a connection ends, also where the server was silent before.
#[test]
fn a_server_that_was_silent_has_the_whole_time_to_come_back() {
    let folder = heart();
    let folder = folder.path();
    let (frames, _) = organ(folder);
    let server = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = server.local_addr().unwrap();
    let line = format!("--from igtl:{address} --motion-rate 200 --retry 1");
    let (seen, output, _) = bridged_to(folder, &line, Duration::MAX, move || {
        let mut peer = accepted(&server);
        peer.write_all(&message(1, "NDARRAY", "", &array(&frames[0]))).unwrap();
        thread::sleep(Duration::from_millis(1_500));
        drop((peer, server));
        // Long enough for several refused connections.
        thread::sleep(Duration::from_millis(300));
        let mut peer = accepted(&TcpListener::bind(address).unwrap());
        peer.write_all(&message(1, "NDARRAY", "", &array(&frames[1]))).unwrap();
    });
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("ended, and cannot be reached again within 1 s"), "{error}");
    assert_eq!(seen.published, 2, "{error}");
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
        ("--from ros2:/heart".to_owned(), 2, "examples/ros2/surface_node.py"),
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
