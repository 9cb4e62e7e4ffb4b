//! Packets over every transport, there and back.

// Requirement: B-09

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, UdpSocket};
use std::time::{Duration, Instant};

use dibs_nostd::wire::{Deframer, enframe, framed_bytes};
use dibs_stream::transport::{Line, Target, TargetError, Transport};

/// Packets with every byte, with zeros in a row, and of all lengths up to a large one.
fn packets() -> Vec<Vec<u8>> {
    let mut packets = vec![vec![0; 64], vec![255; 300], (0..=255).collect()];
    packets.extend([1, 2, 253, 254, 255, 1024].map(|bytes| (0..bytes).map(|i| i as u8).collect()));
    packets
}

fn receive(line: &mut Line) -> Vec<u8> {
    let start = Instant::now();
    loop {
        if let Some(packet) = line.receive().expect("an open line") {
            return packet;
        }
        assert!(start.elapsed() < Duration::from_secs(20), "nothing came back");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The other side of a byte stream sends back what it gets.
fn echo(mut stream: impl Read + Write) {
    let mut deframer = Deframer::<1024>::new();
    let mut byte = [0];
    let mut framed = [0; framed_bytes(1024)];
    while let Ok(1) = stream.read(&mut byte) {
        if let Some(Ok(packet)) = deframer.push(byte[0]) {
            let bytes = enframe(packet, &mut framed).expect("room");
            stream.write_all(bytes).expect("the line takes it");
        }
    }
}

fn there_and_back(line: &mut Line) {
    for packet in packets() {
        line.send(&packet).expect("an open line");
        assert_eq!(receive(line), packet);
    }
    assert_eq!(line.receive().expect("still open"), None);
}

fn open(target: &str) -> Line {
    target.parse::<Target>().expect("a target").open().expect("somebody listens")
}

#[test]
fn tcp() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let server = std::thread::spawn(move || echo(listener.accept().unwrap().0));
    let mut line = open(&format!("tcp:{address}"));
    there_and_back(&mut line);
    drop(line);
    server.join().expect("the connection is closed with the line");
}

#[test]
fn udp() {
    let peer = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = peer.local_addr().unwrap();
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok((bytes, from)) = peer.recv_from(&mut buffer) {
            peer.send_to(&buffer[..bytes], from).unwrap();
        }
    });
    there_and_back(&mut open(&format!("udp:{address}")));
}

#[test]
fn a_datagram_that_nobody_takes_is_lost_and_no_error() {
    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let mut line = open(&format!("udp:127.0.0.1:{port}"));
    for _ in 0..5 {
        line.send(&[1, 2, 3]).unwrap();
        std::thread::sleep(Duration::from_millis(10));
        assert_eq!(line.receive().unwrap(), None);
    }
}

#[cfg(unix)]
#[test]
fn unix_socket() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("bus");
    let listener = std::os::unix::net::UnixListener::bind(&path).unwrap();
    std::thread::spawn(move || echo(listener.accept().unwrap().0));
    there_and_back(&mut open(&format!("unix:{}", path.display())));
}

/// On a pair of pseudo-terminals, as `socat` makes them.
#[cfg(unix)]
#[test]
fn serial() {
    let (mine, mut theirs) = serial2::SerialPort::pair().unwrap();
    theirs.set_read_timeout(Duration::from_secs(20)).unwrap();
    std::thread::spawn(move || echo(theirs));
    there_and_back(&mut Line::serial(mine).unwrap());
}

#[test]
fn a_closed_connection_is_told() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let mut line = open(&format!("tcp:{}", listener.local_addr().unwrap()));
    drop(listener.accept().unwrap());
    let start = Instant::now();
    let error = loop {
        match line.receive() {
            Ok(None) => assert!(start.elapsed() < Duration::from_secs(20)),
            Ok(Some(_)) => panic!("nobody sent"),
            Err(error) => break error,
        }
    };
    assert_eq!(error.kind(), ErrorKind::UnexpectedEof);
}

/// Whoever holds the other end open and reads nothing fills the line. A write then ends within a bound, by an error
/// that names the cause.
#[cfg(unix)]
#[test]
fn a_line_that_nobody_reads_is_an_error_in_bounded_time() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let over_tcp = open(&format!("tcp:{}", listener.local_addr().unwrap()));
    let (mine, _unix) = std::os::unix::net::UnixStream::pair().unwrap();
    let (port, _pty) = serial2::SerialPort::pair().unwrap();
    let lines = [over_tcp, Line::unix(mine).unwrap(), Line::serial(port).unwrap()];
    let (done, outcomes) = std::sync::mpsc::channel();
    for mut line in lines {
        let done = done.clone();
        std::thread::spawn(move || {
            let failed = (0..1_000_000).find_map(|_| line.send(&[0x55; 1024]).err());
            done.send(failed.expect("a line has no room for a gigabyte"))
        });
    }
    for _ in 0..3 {
        let error = outcomes.recv_timeout(Duration::from_secs(60)).expect("a write waits for ever");
        assert_eq!(error.kind(), ErrorKind::TimedOut);
        assert_eq!(error.to_string(), "the receiver has taken nothing for 5 s");
    }
}

/// A stuck write ends once it is told to stop.
#[cfg(unix)]
#[test]
fn a_stuck_line_stops_when_told() {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let over_tcp = open(&format!("tcp:{}", listener.local_addr().unwrap()));
    let (mine, _unix) = std::os::unix::net::UnixStream::pair().unwrap();
    let (port, _pty) = serial2::SerialPort::pair().unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let (done, outcomes) = std::sync::mpsc::channel();
    for line in [over_tcp, Line::unix(mine).unwrap(), Line::serial(port).unwrap()] {
        let (done, mut line) = (done.clone(), line.until(Arc::clone(&stop)));
        std::thread::spawn(move || {
            let failed = (0..1_000_000).find_map(|_| line.send(&[0x55; 1024]).err());
            done.send(failed.expect("a line has no room for a gigabyte"))
        });
    }
    std::thread::sleep(Duration::from_secs(1));
    stop.store(true, Ordering::Relaxed);
    for _ in 0..3 {
        let error = outcomes.recv_timeout(Duration::from_secs(3)).expect("a write goes on");
        assert_eq!(error.to_string(), "stopped while the receiver took nothing");
    }
}

#[test]
fn targets_are_read_and_bad_ones_named() {
    for text in ["serial:/dev/ttyUSB0@115200", "tcp:[::1]:80", "udp:host:5000", "unix:/tmp/x"] {
        assert_eq!(text.parse::<Target>().unwrap().to_string(), text);
    }
    assert_eq!("serial:COM3".parse::<Target>().unwrap().to_string(), "serial:COM3@115200");
    for text in
        ["", "heart", "tcp:", "tcp:host", "tcp:host:x", "tcp::80", "usb:1", "unix:", "udp:9"]
    {
        let error = text.parse::<Target>().unwrap_err();
        assert!(matches!(error, TargetError::Kind { .. }), "{text}: {error}");
        assert!(error.to_string().contains("serial:PORT"));
    }
    for text in ["serial:x@", "serial:x@fast", "serial:x@0", "serial:x@-1"] {
        let error = text.parse::<Target>().unwrap_err();
        assert!(matches!(error, TargetError::Baud { .. }), "{text}: {error}");
    }
    for text in ["unix:/nowhere/at/all", "serial:/nowhere/at/all", "tcp:127.0.0.1:1"] {
        let error = text.parse::<Target>().unwrap().open().expect_err("nobody is there");
        assert!(error.to_string().contains(text), "{error}");
    }
}
