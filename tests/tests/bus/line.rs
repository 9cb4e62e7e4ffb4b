//! A lossless line between a sender and a receiver with a key, for attacks on both.

// Requirement: B-04

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{AesCmac, Encoding, FrameEncoder, FrameId, Freshness, Mac, encode_status};
use dibs_nostd::{Advance, Assembler, FrameReader, Frames, Millis, NoAdmissionCheck};
use dibs_stream::transport::Transport;
use dibs_stream::{SendError, Sender, Settings, SurfaceOrder};
use dibs_tests::bus::*;

pub const KEY: [u8; 16] = *b"a secret of ours";
pub const RECEIVER: u32 = 7;

pub fn mac() -> AesCmac {
    AesCmac::new(&KEY, RECEIVER, 77)
}

pub type Guarded<M = AesCmac> = Assembler<'static, NoAdmissionCheck, M>;

pub fn guarded<M: Mac>(mac: M) -> (Guarded<M>, FrameReader<'static>) {
    let frames: &'static Frames<N> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().unwrap();
    (Assembler::with_mac(writer, NoAdmissionCheck, MESH, 100.0, mac), reader)
}

pub fn tagged(id: FrameId, positions: &[Vec3], freshness: Freshness) -> Vec<Vec<u8>> {
    let encoder = FrameEncoder::<_, 64>::new(id, Encoding::Float, positions).unwrap();
    collect(encoder.with_freshness(freshness).with_mac(mac()).unwrap())
}

pub fn work<M: Mac>(assembler: &mut Guarded<M>) -> Option<u32> {
    (0..10).find_map(|_| match assembler.advance(1000) {
        Ok(Advance::Published { epoch }) => Some(epoch),
        _ => None,
    })
}

pub fn status<M: Mac>(assembler: &mut Guarded<M>, now: u32, safety: u8) -> Vec<u8> {
    let status = assembler.status(Millis(now), safety);
    encode_status(MESH, &status, assembler.counters(), assembler.mac(), &mut [0; 256]).to_vec()
}

/// A lossless line: packets to the receiver, and packets to the sender.
#[derive(Clone, Default)]
pub struct Pipe(Arc<Mutex<[Vec<Vec<u8>>; 2]>>);

impl Pipe {
    pub fn sent(&self) -> Vec<Vec<u8>> {
        std::mem::take(&mut self.0.lock().unwrap()[0])
    }

    pub fn answer(&self, packet: &[u8]) {
        self.0.lock().unwrap()[1].push(packet.to_vec());
    }
}

impl Transport for Pipe {
    fn send(&mut self, packet: &[u8]) -> std::io::Result<()> {
        self.0.lock().unwrap()[0].push(packet.to_vec());
        Ok(())
    }

    fn receive(&mut self) -> std::io::Result<Option<Vec<u8>>> {
        let back = &mut self.0.lock().unwrap()[1];
        Ok((!back.is_empty()).then(|| back.remove(0)))
    }
}

/// A sender with its own clock.
pub struct Source<M> {
    pub sender: Sender<Pipe, 256, M>,
    pub pipe: Pipe,
    clock: Arc<AtomicU64>,
}

impl<M: Mac + 'static> Source<M> {
    pub fn new(session: u32, keyed_mac: fn(u64) -> M) -> Self {
        let rows = (0..N as u32).collect();
        Self::of(SurfaceOrder::new(MESH, rows), session, None, keyed_mac)
    }

    /// The same for another surface, and with heartbeats.
    pub fn of(
        order: SurfaceOrder,
        session: u32,
        heartbeat: Option<Duration>,
        keyed_mac: fn(u64) -> M,
    ) -> Self {
        let (pipe, clock) = (Pipe::default(), Arc::new(AtomicU64::new(0)));
        let settings = Settings { session, partial: Some(0.01), heartbeat, ..Settings::default() };
        let time = Arc::clone(&clock);
        let sender = Sender::with_mac(pipe.clone(), order, settings, keyed_mac)
            .with_clock(move || Duration::from_millis(time.load(Ordering::Relaxed)));
        Self { sender, pipe, clock }
    }

    pub fn set_clock(&self, now: u32) {
        self.clock.store(u64::from(now), Ordering::Relaxed);
    }

    /// Passes the status to the sender, and its packets to the receiver. Returns the result of the sender's poll.
    pub fn hear(
        &mut self,
        assembler: &mut Guarded<M>,
        now: u32,
        safety: u8,
    ) -> Result<(), SendError> {
        self.set_clock(now);
        self.pipe.answer(&status(assembler, now, safety));
        let heard = self.sender.poll();
        for packet in self.pipe.sent() {
            let _ = assembler.accept(&packet, Millis(now));
        }
        heard
    }

    /// Passes statuses to the sender until it knows the receiver.
    pub fn meet(&mut self, assembler: &mut Guarded<M>, now: u32) {
        for _ in 0..4 {
            self.hear(assembler, now, 1).unwrap();
        }
        assert!(self.sender.is_ready());
    }

    /// Sends a frame, and does all work that follows. Returns the published epoch.
    pub fn frame(&mut self, assembler: &mut Guarded<M>, moment: u32, now: u32) -> Option<u32> {
        self.set_clock(now);
        self.sender.send(&surface(moment)).unwrap();
        deliver(assembler, &self.pipe.sent(), now)
    }
}

/// Passes packets to the receiver, with checking in between. Returns the published epoch.
pub fn deliver<M: Mac>(assembler: &mut Guarded<M>, packets: &[Vec<u8>], now: u32) -> Option<u32> {
    let mut published = None;
    for packet in packets {
        let _ = assembler.accept(packet, Millis(now));
        published = published.or(work(assembler));
    }
    published
}

pub fn keyed(challenge: u64) -> AesCmac {
    AesCmac::new(&KEY, RECEIVER, challenge)
}
