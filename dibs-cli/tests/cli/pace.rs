//! The times of a frame's packets, on a clock of the test's; and of `dibs stream`.

// Requirement: B-09

use std::collections::BTreeMap;
use std::net::UdpSocket;
use std::thread;
use std::time::{Duration, Instant};

use dibs_nostd::wire::{Body, Packet};
use dibs_stream::Pace;

use crate::program::{json, succeeds};

const TIME: Duration = Duration::from_millis(10);
const PACKETS: usize = 31;

/// Times after the start at which the packets are sent, by a system on which each pause takes `delay(packet)` longer than
/// asked, and on which sending takes no time.
fn sent(time: Duration, packets: usize, delay: impl Fn(usize) -> Duration) -> Vec<Duration> {
    let start = Instant::now();
    let (mut pace, mut now) = (Pace::new(start, time, packets), start);
    let packets = (0..packets).map(|packet| {
        let pause = pace.pause(now);
        if !pause.is_zero() {
            now += pause + delay(packet);
        }
        now - start
    });
    packets.collect()
}

/// The most packets within any stretch of half a gap.
fn most_at_once(times: &[Duration], gap: Duration) -> usize {
    let within = |&first: &Duration| {
        times.iter().filter(|&&time| time >= first && time < first + gap / 2).count()
    };
    times.iter().map(within).max().unwrap_or(0)
}

#[test]
fn packets_are_evenly_apart() {
    let gap = TIME / PACKETS as u32;
    let times = sent(TIME, PACKETS, |_| Duration::ZERO);
    let even: Vec<_> = (0..PACKETS as u32).map(|packet| gap * packet).collect();
    assert_eq!(times, even);
}

#[test]
fn short_delays_are_made_up_for() {
    let gap = TIME / PACKETS as u32;
    for delay in [gap / 5, gap, gap * 2] {
        let times = sent(TIME, PACKETS, |_| delay);
        assert!(times.iter().enumerate().all(|(packet, time)| *time >= gap * packet as u32));
        assert!(*times.last().unwrap() < TIME + delay, "{delay:?}: {times:?}");
    }
}

/// A receiver whose buffer holds seven packets loses none after a delay.
#[test]
fn no_delay_makes_a_burst() {
    let gap = TIME / PACKETS as u32;
    for delay in [gap * 3, gap * 10, TIME * 5] {
        for late in [1, 12, PACKETS - 2] {
            let once = |packet| if packet == late { delay } else { Duration::ZERO };
            let times = sent(TIME, PACKETS, once);
            assert!(most_at_once(&times, gap) <= 4, "{delay:?}: {times:?}");
            assert!(*times.last().unwrap() <= TIME + delay, "{delay:?}: {times:?}");
        }
        let times = sent(TIME, PACKETS, |_| delay);
        assert!(most_at_once(&times, gap) <= 4, "{delay:?}: {times:?}");
    }
}

#[test]
fn extremes_end() {
    assert!(sent(Duration::ZERO, PACKETS, |_| TIME).iter().all(Duration::is_zero));
    assert_eq!(sent(TIME, 1, |_| TIME), [Duration::ZERO]);
    assert_eq!(Pace::new(Instant::now(), TIME, 0).pause(Instant::now()), Duration::ZERO);
    for packets in [1, usize::MAX] {
        let start = Instant::now();
        let mut pace = Pace::new(start, Duration::MAX, packets);
        assert_eq!(pace.pause(start), Duration::ZERO);
        let _ = pace.pause(start);
    }
}

/// Of nine frames the median time from the first datagram to the last: a busy system may hold some of them up.
fn span(option: &str) -> Duration {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    succeeds(folder, "generate heart --triangles 1000 -o heart.ply --motion heart.pc2");
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(100))).unwrap();
    let to = format!("--to udp:{}{option}", socket.local_addr().unwrap());
    let line = format!(
        "stream heart.ply --motion heart.pc2 {to} --motion-rate 10 --frames 9 --mtu 64 --json"
    );
    let mut spans = BTreeMap::new();
    thread::scope(|scope| {
        let stream = scope.spawn(|| json(folder, &line));
        let mut buffer = [0; 64];
        loop {
            let has_ended = stream.is_finished();
            let Ok(bytes) = socket.recv(&mut buffer) else {
                if has_ended {
                    break;
                }
                continue;
            };
            let packet = Packet::decode(&buffer[..bytes]).expect("no damage");
            if !matches!(packet.body, Body::Heartbeat(_)) {
                let now = Instant::now();
                spans.entry(packet.epoch).or_insert((now, now)).1 = now;
            }
        }
        assert_eq!(stream.join().unwrap()["frames"], 9);
    });
    let mut times: Vec<_> = spans.values().map(|(first, last)| *last - *first).collect();
    times.sort();
    assert_eq!(times.len(), 9);
    times[4]
}

/// Half of the time from one frame to the next is 50 ms.
#[test]
fn datagrams_of_a_frame_are_spread() {
    let spread = span("");
    assert!(spread >= Duration::from_millis(25), "{spread:?}");
    let at_once = span(" --at-once");
    assert!(at_once < Duration::from_millis(25), "{at_once:?}");
}
