//! A receiver with an admission check: packets from a socket go through the assembler, and published positions are
//! compared with the motion's.

use std::io::{Read, Write};
use std::net::UdpSocket;
use std::path::Path;
use std::process::{Child, Output};
use std::time::{Duration, Instant};

use dibs_build::Motion;
use dibs_nostd::wire::{Deframer, Event, Mac, encode_status, enframe, framed_bytes};
use dibs_nostd::{
    Advance, Assembler, Frames, Millis, Progress, ReceiveError, StretchMonitor, Tree, VertexTable,
};

use super::{FRAMES, N, PATIENCE};

/// Where packets come from, and statuses go to.
pub trait Link {
    /// The packets that have come; `None` once there will be no more.
    fn receive(&mut self) -> Option<Vec<Vec<u8>>>;
    fn reply(&mut self, packet: &[u8]);
}

/// A byte stream.
pub struct Bytes<S> {
    stream: S,
    deframer: Deframer<1024>,
}

impl<S: Read + Write> Bytes<S> {
    pub fn new(stream: S) -> Self {
        Self { stream, deframer: Deframer::new() }
    }
}

impl<S: Read + Write> Link for Bytes<S> {
    fn receive(&mut self) -> Option<Vec<Vec<u8>>> {
        let mut buffer = [0; 4096];
        match self.stream.read(&mut buffer) {
            Ok(0) => None,
            Ok(bytes) => {
                let pushed = buffer[..bytes].iter();
                let packets = pushed.filter_map(|&byte| {
                    self.deframer.push(byte).map(|packet| packet.expect("no damage").to_vec())
                });
                Some(packets.collect())
            }
            Err(_) => Some(Vec::new()),
        }
    }

    fn reply(&mut self, packet: &[u8]) {
        let mut framed = [0; framed_bytes(1024)];
        // The program may have ended, with all that it sent acknowledged.
        let _ = self.stream.write_all(enframe(packet, &mut framed).expect("room"));
    }
}

/// Datagrams. The receiver knows whom to answer once something has come.
pub struct Datagrams(pub UdpSocket);

impl Link for Datagrams {
    fn receive(&mut self) -> Option<Vec<Vec<u8>>> {
        let mut buffer = [0; 2048];
        let Ok((bytes, from)) = self.0.recv_from(&mut buffer) else { return Some(Vec::new()) };
        self.0.connect(from).unwrap();
        Some(vec![buffer[..bytes].to_vec()])
    }

    fn reply(&mut self, packet: &[u8]) {
        let _ = self.0.send(packet);
    }
}

/// What a receiver saw.
#[derive(Default)]
pub struct Seen {
    pub epochs: Vec<u32>,
    /// The age (ms) that each had when it was sent, as the sender states it.
    pub ages: Vec<u32>,
    pub published: u32,
    pub rejected: u32,
    pub heartbeats: u32,
    /// When the last frame began to come.
    pub last_begun: Option<Instant>,
    /// Largest packet.
    pub largest: usize,
    /// The largest error of a position, and the largest that was stated.
    pub error: f32,
    pub stated: f32,
}

/// Receives until the program ends, reports the status 50 times a second, and compares each published
/// position with the motion's: off by no more than `stated + tolerance`.
pub fn receive<M: Mac>(
    folder: &Path,
    link: &mut impl Link,
    mac: M,
    mut child: Child,
) -> (Seen, Output) {
    let blob = std::fs::read(folder.join("heart.dibs")).unwrap();
    let tree = Tree::<u16>::from_bytes(&blob).unwrap();
    let motion = Motion::read_pc2(folder.join("heart.pc2")).unwrap();
    assert_eq!((tree.vertex_count() as usize, motion.frames.len()), (N, FRAMES));
    let frames = Frames::<N>::new();
    let (writer, mut reader) = frames.split().unwrap();
    let monitor = StretchMonitor::new(&tree).unwrap();
    let mut assembler = Assembler::with_mac(writer, monitor, tree.mesh_id(), 1e4, mac);

    let mut seen = Seen::default();
    let (start, mut reported, mut is_over) = (Instant::now(), None::<Instant>, false);
    while !is_over {
        assert!(start.elapsed() < PATIENCE, "the program does not end");
        let has_ended = child.try_wait().unwrap().is_some();
        let packets = link.receive();
        is_over = packets.is_none() || has_ended && packets.as_ref().is_some_and(Vec::is_empty);
        for packet in packets.unwrap_or_default() {
            seen.largest = seen.largest.max(packet.len());
            let now = start.elapsed().as_millis() as u32;
            match assembler.accept(&packet, Millis(now)) {
                Ok(Progress::Begun { .. }) => seen.last_begun = Some(Instant::now()),
                // A forged begin, and what follows it.
                Ok(_)
                | Err(
                    ReceiveError::Forged { .. }
                    | ReceiveError::Unexpected { .. }
                    | ReceiveError::Refused { cause: Event::Forged, .. }
                    | ReceiveError::Unverifiable { cause: None | Some(Event::Forged), .. },
                ) => (),
                Err(rejection) => panic!("{rejection}"),
            }
            loop {
                match assembler.advance(200).unwrap() {
                    Advance::Pending => (),
                    Advance::Published { epoch } => {
                        seen.epochs.push(epoch);
                        seen.ages.push(assembler.health().source_age.0);
                        let frame = reader.read().unwrap();
                        let label = frame.label();
                        assert_eq!(label.epoch, epoch);
                        assert!(label.stretch.is_some_and(|stretch| stretch.sigma() <= 1.5));
                        seen.stated = seen.stated.max(label.position_error);
                        let recorded = &motion.frames[(epoch as usize - 1) % FRAMES];
                        for row in 0..tree.vertex_count() {
                            let exact = recorded[tree.vertex_number(row).unwrap().0 as usize];
                            let error = frame.position(row).unwrap().distance(exact);
                            assert!(error <= label.position_error, "frame {epoch}: {error}");
                            seen.error = seen.error.max(error);
                        }
                        break;
                    }
                    _ => break,
                }
            }
        }
        if reported.is_none_or(|at| at.elapsed() > Duration::from_millis(20)) {
            reported = Some(Instant::now());
            let status = assembler.status(Millis(start.elapsed().as_millis() as u32), 1);
            let mut buffer = [0; 1024];
            let (id, counters) = (tree.mesh_id(), assembler.counters());
            link.reply(encode_status(id, &status, counters, assembler.mac(), &mut buffer));
        }
    }
    let counters = assembler.counters();
    seen.published = counters.of(Event::Published);
    seen.rejected = counters.rejected();
    seen.heartbeats = counters.of(Event::Heartbeat);
    (seen, child.wait_with_output().unwrap())
}
