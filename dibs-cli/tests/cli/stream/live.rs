//! `dibs stream --from -`: frames from standard input reach a receiver, or are refused by their number.

// Requirements: B-09, B-10

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::net::{TcpListener, UdpSocket};
use std::path::Path;
use std::process::Child;
use std::thread;
use std::time::Duration;

use dibs_build::Motion;
use dibs_build::glam::Vec3;
use dibs_nostd::wire::{Body, NoMac, Packet};

use super::receiver::{Bytes, receive};
use super::{FRAMES, N, assert_all, heart, program, raw, spawn, totals};

fn live(folder: &Path, line: &str) -> Child {
    spawn(folder, &format!("--from - {line}"))
}

fn motion(folder: &Path) -> Vec<Vec<Vec3>> {
    Motion::read_pc2(folder.join("heart.pc2")).unwrap().frames
}

/// Lengths in metres: f64 numbers, which f32 ones are as millimetres.
fn json(frame: &[Vec3]) -> String {
    let mut text = String::new();
    for (number, p) in frame.iter().enumerate() {
        let [x, y, z] = p.to_array().map(|x| f64::from(x) / 1000.0);
        let comma = if number == 0 { "" } else { "," };
        write!(text, "{comma}[{x},{y},{z}]").unwrap();
    }
    format!("[{text}]")
}

/// What the program says to this input, which ends there.
fn answer(folder: &Path, line: &str, input: &[u8]) -> (Option<i32>, String) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = socket.local_addr().unwrap();
    let mut child = live(folder, &format!("--to udp:{to} {line}"));
    // The program may have ended at an error before it.
    let _ = child.stdin.take().unwrap().write_all(input);
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8(output.stderr).unwrap())
}

/// The age in ms that each frame's begin states, until the program ends.
fn ages(child: &mut Child, socket: &UdpSocket) -> Vec<u16> {
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let (mut ages, mut buffer) = (Vec::new(), [0; 2048]);
    loop {
        let has_ended = child.try_wait().unwrap().is_some();
        let Ok(bytes) = socket.recv(&mut buffer) else {
            if has_ended {
                return ages;
            }
            continue;
        };
        if let Body::Begin(begin) = Packet::decode(&buffer[..bytes]).unwrap().body {
            ages.push(begin.freshness.age_ms);
        }
    }
}

/// With a rate every frame is sent, however fast they come; the line is kept alive while none comes.
#[test]
fn every_frame_of_a_pipe_arrives_at_a_rate() {
    let folder = heart();
    let folder = folder.path();
    let frames = motion(folder);
    let wrapped = |frame: &Vec<Vec3>| format!("{{\"age_ms\":4,\"positions\":{}}}\n\n", json(frame));
    let inputs: [(&str, Vec<Vec<u8>>); 3] = [
        ("", frames.iter().map(|frame| raw(frame)).collect()),
        (
            "--format json --unit m",
            frames.iter().map(|f| json(f) + "\r\n").map(Into::into).collect(),
        ),
        ("--format json --unit m", frames.iter().map(wrapped).map(Into::into).collect()),
    ];
    for (line, input) in inputs {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let to = listener.local_addr().unwrap();
        let mut child = live(folder, &format!("--to tcp:{to} --motion-rate 200 {line}"));
        let mut pipe = child.stdin.take().unwrap();
        let (socket, _) = listener.accept().unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
        let writer = thread::spawn(move || -> io::Result<()> {
            let (first, rest) = input.split_first().unwrap();
            pipe.write_all(first)?;
            thread::sleep(Duration::from_secs(1));
            rest.iter().try_for_each(|frame| pipe.write_all(frame))
        });
        let (seen, output) = receive(folder, &mut Bytes::new(socket), NoMac, child);
        writer.join().unwrap().unwrap();
        let totals = totals(&output);
        assert_all(&seen, &totals);
        assert_eq!((&totals["passed_over"], seen.error), (&0.into(), 0.0), "{line}");
        assert!(seen.heartbeats >= 5, "{} heartbeats", seen.heartbeats);
    }
}

/// Without a rate the newest frame is sent, with the age that it has: one that waits is passed over, and one that repeats
/// the one before it is as old.
#[test]
fn the_newest_frame_is_sent() {
    let folder = heart();
    let folder = folder.path();
    let frames = motion(folder);
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut child = live(folder, &format!("--to udp:{}", socket.local_addr().unwrap()));
    let mut pipe = child.stdin.take().unwrap();
    let input = frames.concat();
    let writer = thread::spawn(move || {
        pipe.write_all(&raw(&input)).unwrap();
        thread::sleep(Duration::from_millis(400));
        pipe.write_all(&raw(&input[input.len() - N..])).unwrap();
    });
    let ages = ages(&mut child, &socket);
    writer.join().unwrap();
    let totals = totals(&child.wait_with_output().unwrap());
    let [sent, passed_over] = ["frames", "passed_over"].map(|name| totals[name].as_u64().unwrap());
    assert_eq!(sent + passed_over, FRAMES as u64 + 1, "{totals}");
    // The first frame's packets are spread over more time than all frames take to come.
    assert!((2..=FRAMES as u64).contains(&sent), "{totals}");
    // The last frame repeats one that was read some time after it was written.
    assert!(ages[0] < 300 && ages.last().is_some_and(|age| *age >= 300), "{ages:?}");
}

/// With a rate a frame is as new as it is due, even if it repeats one that came long before it.
#[test]
fn a_frame_that_has_a_rate_does_not_age() {
    let folder = heart();
    let folder = folder.path();
    let frame = raw(&motion(folder)[0]);
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = socket.local_addr().unwrap();
    let mut child = live(folder, &format!("--to udp:{to} --motion-rate 200"));
    let mut pipe = child.stdin.take().unwrap();
    let writer = thread::spawn(move || {
        pipe.write_all(&frame).unwrap();
        thread::sleep(Duration::from_millis(400));
        pipe.write_all(&frame).unwrap();
    });
    let ages = ages(&mut child, &socket);
    writer.join().unwrap();
    totals(&child.wait_with_output().unwrap());
    assert_eq!(ages, [0, 0]);
}

#[test]
fn wrong_frames_are_one_sentence() {
    let folder = heart();
    let folder = folder.path();
    let frames = motion(folder);
    let first = raw(&frames[0]);
    let mut with_nan = frames[1].clone();
    with_nan[17].y = f32::NAN;
    let few = json(&frames[1][1..]);
    let good = json(&frames[0]);
    let null = good.replacen(",[", ",[null],[", 1);
    let token = good.replacen("],[", ",NaN],[", 1);
    let lines = |text: &str| format!("{good}\n{text}\n").into_bytes();
    let metres = raw(&frames[0].iter().map(|&p| p / 1000.0).collect::<Vec<_>>());
    let cases: [(&str, Vec<u8>, &str); 15] = [
        ("", Vec::new(), "standard input: no frame came"),
        (
            "",
            [&first[..], &first[..100]].concat(),
            "standard input, frame 1: ends after 100 of its 6024 bytes, in position 8",
        ),
        (
            "",
            [first.clone(), raw(&with_nan)].concat(),
            "position 17 (counted from 0) of frame 1 has the coordinate NaN",
        ),
        (
            "",
            [&first[..], &metres].concat(),
            "frame 1: the frame has edges 1.000e-3 times as long as at rest",
        ),
        ("", lines(&good), "standard input, frame 0: begins with text: give --format json"),
        ("--format json", Vec::new(), "standard input: no frame came"),
        (
            "--format json --unit m",
            lines(&few),
            "frame 1: the frame has 501 vertices and the tree's mesh has 502",
        ),
        ("--format json --unit m", lines(&null), "frame 1: position 1 (counted from 0), column"),
        ("--format json --unit m", lines(&token), "frame 1: position 0 (counted from 0), column"),
        (
            "--format json --unit m",
            lines("[[1,2,null]]"),
            "position 0 (counted from 0) of frame 1 has the coordinate NaN",
        ),
        (
            "--format json --unit m",
            lines("[[1,2,1e39]]"),
            "position 0 (counted from 0) of frame 1 has the coordinate inf",
        ),
        (
            "--format json --unit m",
            lines("{\"time\":1}"),
            "frame 1: column 7: unknown field `time`",
        ),
        (
            "--format json --unit m",
            lines(&format!("{{\"age_ms\":-1,\"positions\":{good}}}")),
            "age_ms is -1: give milliseconds",
        ),
        (
            "--format json --unit m",
            lines(&good[..good.len() - 1]),
            "frame 1: position 501 (counted from 0), column",
        ),
        (
            "--format json --unit m",
            [b' '; 200_000].to_vec(),
            "frame 0: a line longer than 132608 bytes",
        ),
    ];
    for (line, input, part) in cases {
        let (code, error) = answer(folder, line, &input);
        assert!(code == Some(1) && error.contains(part), "{line} {part}: {error}");
        let errors = error.lines().filter(|line| line.starts_with("error: "));
        assert_eq!(errors.count(), 1, "{error}");
    }
    for (line, part) in [
        ("stream heart.dibs --to udp:127.0.0.1:9", "<MOTION>"),
        ("stream heart.dibs heart.pc2 --from - --to udp:127.0.0.1:9", "cannot be used with"),
        ("stream heart.dibs --from - --loop --to udp:127.0.0.1:9", "cannot be used with"),
        ("stream heart.dibs heart.pc2 --format json --to udp:127.0.0.1:9", "cannot be used with"),
    ] {
        let output = program(folder, line).output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && error.contains(part), "{line}: {error}");
    }
}
