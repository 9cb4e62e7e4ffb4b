//! `dibs stream`, from the program over a socket to what a controller would act on: the packets go
//! through the assembler and the stretch monitor, and what is published is compared with the motion.
//!
//! One file, because all tests receive by the same helpers.

// Requirements: B-09, P-08

mod igtl;
mod igtl_age;
mod igtl_messages;
mod igtl_peers;
mod igtl_pose;
mod igtl_record;
mod igtl_refused;
mod igtl_tool;
mod live;
#[cfg(target_os = "linux")]
mod memory;
mod receiver;

use std::io::Read;
use std::net::{TcpListener, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use dibs_build::glam::Vec3;
use dibs_nostd::wire::{AesCmac, Event, Mac, NoMac, encode_status};
use dibs_nostd::{Assembler, Frames, Millis, Tree};
use serde_json::Value;

use receiver::{Bytes, Datagrams, Link, Seen, receive};

/// Vertices of the heart of 1,000 triangles.
const N: usize = 502;
const FRAMES: usize = 25;
/// A test that hangs fails after this long.
const PATIENCE: Duration = Duration::from_secs(60);

fn program(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dibs"));
    command.current_dir(folder).args(line.split_whitespace());
    command
}

fn run(folder: &Path, line: &str) {
    let output = program(folder, line).output().unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
}

/// A folder with a heart, its motion, and its tree.
fn heart() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    run(folder.path(), "build heart.ply -o heart.dibs --stretch 1.5 --motion heart.pc2");
    folder
}

/// `dibs stream` of the heart, whose input and output are the test's.
fn spawn(folder: &Path, line: &str) -> Child {
    let mut command = program(folder, &format!("stream heart.dibs --json {line}"));
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn stream(folder: &Path, line: &str) -> Child {
    spawn(folder, &format!("--motion heart.pc2 {line}"))
}

fn raw(frame: &[Vec3]) -> Vec<u8> {
    frame.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes).collect()
}

/// The totals that the program printed.
fn totals(output: &Output) -> Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn over_tcp<M: Mac>(folder: &Path, line: &str, mac: M) -> (Seen, Output) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let child = stream(folder, &format!("--to tcp:{} {line}", listener.local_addr().unwrap()));
    let (socket, _) = listener.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    receive(folder, &mut Bytes::new(socket), mac, child)
}

/// Every frame is published, in order, and the program knows.
fn assert_all(seen: &Seen, totals: &Value) {
    assert_eq!(seen.epochs, (1..=FRAMES as u32).collect::<Vec<_>>());
    assert_eq!((seen.published, seen.rejected), (FRAMES as u32, 0));
    assert_eq!(totals["frames"], FRAMES);
    assert_eq!(totals["acknowledged"], FRAMES);
    assert_eq!(totals["events"]["published"], FRAMES);
    assert!(totals["statuses"].as_u64().unwrap() >= 1, "{totals}");
    let events = totals["events"].as_object().unwrap();
    assert_eq!(events.len(), Event::ALL.len());
    let mut rejections = Event::ALL.iter().filter(|event| event.is_rejection());
    assert!(rejections.all(|event| events[event.name()] == 0), "{totals}");
}

#[test]
fn floats_over_tcp_arrive_to_the_bit() {
    let folder = heart();
    let (seen, output) = over_tcp(folder.path(), "--motion-rate 200", NoMac);
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!((seen.error, seen.stated), (0.0, 0.0));
    assert!(seen.heartbeats >= 1 && seen.largest > 64 && seen.largest <= 1024);
    // 12 bytes a vertex, and what packets and heartbeats take besides.
    let bytes = totals["bytes_per_frame"].as_f64().unwrap() / N as f64;
    assert!((12.0..13.5).contains(&bytes), "{bytes} bytes a vertex");
}

#[test]
fn quantised_frames_are_half_as_long_and_keep_their_stated_error() {
    let folder = heart();
    let (seen, output) = over_tcp(folder.path(), "--motion-rate 200 --quantise", NoMac);
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert!(seen.error > 0.0 && seen.stated < 0.01, "{} of {}", seen.error, seen.stated);
    let bytes = totals["bytes_per_frame"].as_f64().unwrap() / N as f64;
    assert!((6.0..7.5).contains(&bytes), "{bytes} bytes a vertex");
}

#[test]
fn partial_frames_carry_what_moved() {
    let folder = heart();
    let (seen, output) =
        over_tcp(folder.path(), "--motion-rate 100 --quantise --partial 1 --mtu 64", NoMac);
    let totals = totals(&output);
    assert_all(&seen, &totals);
    assert_eq!(seen.largest, 64);
    assert!(seen.stated <= 1.0, "{} mm", seen.stated);
    let partial = totals["partial"].as_u64().unwrap();
    assert!(partial >= 20, "{partial} partial frames");
}

#[cfg(unix)]
#[test]
fn unix_socket_and_loop() {
    let folder = heart();
    let path = folder.path().join("bus");
    let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
    let child = stream(folder.path(), "--to unix:bus --motion-rate 200 --loop --frames 40");
    let (socket, _) = listener.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    let (seen, output) = receive(folder.path(), &mut Bytes::new(socket), NoMac, child);
    assert_eq!(seen.epochs, (1..=40).collect::<Vec<_>>(), "the motion starts over");
    assert_eq!(totals(&output)["acknowledged"], 40);
}

#[test]
fn datagrams() {
    let folder = heart();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let line = format!("--to udp:{} --motion-rate 100 --quantise", socket.local_addr().unwrap());
    let child = stream(folder.path(), &line);
    let (seen, output) = receive(folder.path(), &mut Datagrams(socket), NoMac, child);
    assert_all(&seen, &totals(&output));
}

/// Frames are never sent earlier than the rate says. How late a busy system makes them is not tested.
#[test]
fn the_rate_is_kept() {
    let folder = heart();
    let start = Instant::now();
    let (seen, output) = over_tcp(folder.path(), "--motion-rate 20 --quantise", NoMac);
    assert_all(&seen, &totals(&output));
    let last = seen.last_begun.expect("frames came");
    assert!(last - start >= Duration::from_millis(50 * (FRAMES as u64 - 1)));
}

const KEY: [u8; 16] = *b"\x00\x11\x22\x33\x44\x55\x66\x77\x88\x99\xaa\xbb\xcc\xdd\xee\xff";

/// What a key file needs.
fn share_with_nobody(path: &Path) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).unwrap();
    }
}

#[test]
fn with_a_key_the_receiver_believes_and_without_it_nothing() {
    let folder = heart();
    let folder = folder.path();
    std::fs::write(folder.join("heart.key"), "00112233445566778899aabbCCDDEEFF\n").unwrap();
    std::fs::write(folder.join("other.key"), "00112233445566778899aabbccddeefe").unwrap();
    share_with_nobody(&folder.join("heart.key"));
    share_with_nobody(&folder.join("other.key"));
    let mac = || AesCmac::new(&KEY, 0, 0xC0FFEE);
    for line in ["--key heart.key --quantise", "--key heart.key --quantise --mtu 64"] {
        let (seen, output) = over_tcp(folder, &format!("--motion-rate 200 {line}"), mac());
        assert_all(&seen, &totals(&output));
    }

    let (seen, output) = over_tcp(folder, "--key other.key", mac());
    assert_eq!((seen.published, output.status.code()), (0, Some(1)));
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("has it the same key?") && error.lines().count() == 1, "{error}");
    // Sent all the same, under the right challenge and a wrong key; and without one.
    for line in ["--key other.key --challenge 12648430", ""] {
        let (seen, _) = over_tcp(folder, &format!("--motion-rate 500 {line}"), mac());
        assert_eq!(seen.published, 0);
        assert!(seen.rejected > 100, "{} rejected", seen.rejected);
    }
    // A receiver without a way back: the challenge is given.
    let (seen, output) =
        over_tcp(folder, "--motion-rate 200 --key heart.key --challenge 12648430", mac());
    assert_all(&seen, &totals(&output));
}

#[test]
fn what_cannot_be_streamed_is_one_sentence() {
    let folder = heart();
    let folder = folder.path();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("short.key", "00112233");
    write("text.key", "this is no hexadecimal, is it?!!");
    for key in ["short.key", "text.key"] {
        share_with_nobody(&folder.join(key));
    }
    write("open.key", "00112233445566778899aabbccddeeff");
    let to = "--to udp:127.0.0.1:9";
    let cases = [
        (format!("{to} --key absent.key"), "absent.key: cannot be read"),
        (format!("{to} --key short.key"), "short.key: a key file holds 32 hexadecimal digits"),
        (format!("{to} --key text.key"), "text.key: a key file holds 32 hexadecimal digits"),
        #[cfg(unix)]
        (format!("{to} --key open.key"), "open.key: other users can read"),
        (
            format!("{to} --motion-rate 0"),
            "heart.pc2: 0 frames a second; give a --motion-rate from 0.001 to 100000",
        ),
        (format!("{to} --motion-rate 1e-30"), "a --motion-rate from 0.001 to 100000"),
        (format!("{to} --partial=-1"), "--partial: a tolerance"),
        (format!("{to} --weights"), "--motion and --modes"),
        ("--to unix:absent/bus".to_owned(), "unix:absent/bus: cannot be opened"),
    ];
    for (line, part) in cases {
        let output = stream(folder, &line).wait_with_output().unwrap();
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(1), "{line}: {error}");
        assert!(output.stdout.is_empty() && error.contains(part), "{line}: {error}");
        assert_eq!(error.lines().count(), 1, "{line}: {error}");
        assert!(!error.contains("hexadecimal, is"), "a key is not repeated");
    }
}

/// A receiver on UDP knows nobody until something comes, and a sender with a key says nothing until it has
/// heard: a hello has to start it. From a given port, where the receiver answers to one.
#[test]
fn datagrams_with_a_key() {
    let folder = heart();
    let folder = folder.path();
    std::fs::write(folder.join("heart.key"), "00112233445566778899aabbccddeeff").unwrap();
    share_with_nobody(&folder.join("heart.key"));
    for is_fixed in [false, true] {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
        let mut to = format!("udp:{}", socket.local_addr().unwrap());
        let free = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        if is_fixed {
            to += &format!("@{}", free.port());
            socket.connect(free).unwrap();
        }
        let line = format!("--to {to} --motion-rate 100 --quantise --key heart.key --receiver 3");
        let child = stream(folder, &line);
        let mac = AesCmac::new(&KEY, 3, 0xC0FFEE);
        let (seen, output) = receive(folder, &mut Datagrams(socket), mac, child);
        assert_all(&seen, &totals(&output));
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_prints_the_totals() {
    let folder = heart();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--to tcp:{} --motion-rate 100 --loop", listener.local_addr().unwrap());
    let child = stream(folder.path(), &line);
    let (mut socket, _) = listener.accept().unwrap();
    let mut some = [0; 20_000];
    socket.read_exact(&mut some).unwrap();
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    // It ends by itself, although nobody reads any more.
    let totals = totals(&child.wait_with_output().unwrap());
    assert_eq!(totals["interrupted"], true);
    assert!(totals["frames"].as_u64().unwrap() >= 2, "{totals}");
}

#[test]
fn a_broken_connection_is_made_again() {
    let folder = heart();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = format!("--to tcp:{}", listener.local_addr().unwrap());
    let child = stream(folder.path(), &format!("{to} --motion-rate 50 --loop --frames 75"));
    let (mut first, _) = listener.accept().unwrap();
    first.read_exact(&mut [0; 20_000]).unwrap();
    drop(first);
    let (second, _) = listener.accept().unwrap();
    second.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    let (seen, output) = receive(folder.path(), &mut Bytes::new(second), NoMac, child);
    let totals = totals(&output);
    assert_eq!(totals["reconnections"], 1);
    assert!(seen.published > 30 && totals["acknowledged"] == 75, "{totals}");

    // Nobody comes back.
    let child = stream(folder.path(), &format!("{to} --motion-rate 50 --loop --retry 1"));
    drop(listener.accept().unwrap());
    drop(listener);
    let output = child.wait_with_output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("did not come back within 1 s"), "{error}");
}

/// A receiver that accepts the connection and reads nothing: the program gives up, or ends when it is asked to, with
/// its totals.
#[cfg(unix)]
#[test]
fn a_receiver_that_reads_nothing_is_named() {
    let folder = heart();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let to = format!("--to tcp:{} --motion-rate 100000 --loop", listener.local_addr().unwrap());
    let given_up = stream(folder.path(), &format!("{to} --retry 0"));
    let interrupted = stream(folder.path(), &to);
    let _unread = [listener.accept().unwrap(), listener.accept().unwrap()];
    std::thread::sleep(Duration::from_secs(3));
    let kill = Command::new("kill").args(["-INT", &interrupted.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let outcomes = [given_up, interrupted].map(|mut child| {
        let start = Instant::now();
        while child.try_wait().unwrap().is_none() {
            assert!(start.elapsed() < PATIENCE, "the program waits for ever");
            std::thread::sleep(Duration::from_millis(20));
        }
        child.wait_with_output().unwrap()
    });
    let [given_up, interrupted] = &outcomes;
    let error = String::from_utf8_lossy(&given_up.stderr);
    assert_eq!(given_up.status.code(), Some(1), "{error}");
    assert!(error.contains("the receiver has taken nothing for 5 s"), "{error}");
    let totals = totals(interrupted);
    assert_eq!(totals["interrupted"], true);
    assert!(totals["frames"].as_u64().unwrap() > 0, "{totals}");
}

/// An interrupt ends a stream to a receiver that reads nothing while it is stuck, not once it gives up.
#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_stuck_stream_at_once() {
    let folder = heart();
    let tcp = TcpListener::bind("127.0.0.1:0").unwrap();
    let unix = std::os::unix::net::UnixListener::bind(folder.path().join("bus")).unwrap();
    let targets = [format!("tcp:{}", tcp.local_addr().unwrap()), "unix:bus".to_owned()];
    let children =
        targets.map(|to| stream(folder.path(), &format!("--to {to} --motion-rate 100000 --loop")));
    let _unread = (tcp.accept().unwrap(), unix.accept().unwrap());
    std::thread::sleep(Duration::from_secs(2));
    for mut child in children {
        let start = Instant::now();
        let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
        assert!(kill.success());
        while child.try_wait().unwrap().is_none() {
            assert!(start.elapsed() < Duration::from_secs(3), "the program does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
        let totals = totals(&child.wait_with_output().unwrap());
        assert_eq!(totals["interrupted"], true);
    }
}

/// Datagrams to a port that nobody listens at come back: the program says so, and ends with an error.
#[test]
fn datagrams_that_come_back_are_an_error_at_the_end() {
    let folder = heart();
    let closed = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    for frames in [1, 20] {
        let line = format!("--to udp:{closed} --motion-rate 100 --frames {frames}");
        let output = stream(folder.path(), &line).wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{error}");
        assert!(error.contains("nothing listens there"), "{error}");
        let totals: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(totals["refused"].as_u64().unwrap() > 0, "{totals}");
        assert_eq!(totals["frames"], frames);
    }
    // A receiver that started late, and one that only listens.
    let late = std::thread::spawn(move || {
        std::thread::sleep(Duration::from_secs(1));
        let socket = UdpSocket::bind(closed).unwrap();
        std::thread::sleep(Duration::from_secs(4));
        drop(socket);
    });
    let line = format!("--to udp:{closed} --motion-rate 100 --frames 350");
    let output = stream(folder.path(), &line).wait_with_output().unwrap();
    assert!(totals(&output)["refused"].as_u64().unwrap() > 0);
    late.join().unwrap();
}

/// A receiver that reports and publishes nothing: the program says so, and goes on.
#[test]
fn a_receiver_that_acknowledges_nothing_is_named() {
    let folder = heart();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let line = format!("--to tcp:{} --motion-rate 10 --frames 3", listener.local_addr().unwrap());
    let child = stream(folder.path(), &line);
    let (socket, _) = listener.accept().unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
    // Another mesh's statuses are nobody's; this receiver has the mesh, and none of the frames' packets.
    let blob = std::fs::read(folder.path().join("heart.dibs")).unwrap();
    let mesh = Tree::<u16>::from_bytes(&blob).unwrap().mesh_id();
    let mut link = Bytes::new(socket);
    let frames = Frames::<N>::new();
    let (writer, _reader) = frames.split().unwrap();
    let mut deaf = Assembler::new(writer, dibs_nostd::NoAdmissionCheck, mesh, 1e4);
    let mut child = child;
    let start = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < PATIENCE, "the program waits for ever");
        let _ = link.receive();
        let status = deaf.status(Millis(start.elapsed().as_millis() as u32), 1);
        let mut buffer = [0; 256];
        link.reply(encode_status(mesh, &status, deaf.counters(), &NoMac, &mut buffer));
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = child.wait_with_output().unwrap();
    assert_eq!(totals(&output)["frames"], 3);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(
        error.contains("2 frames are not acknowledged; the receiver has published none"),
        "{error}"
    );
}
