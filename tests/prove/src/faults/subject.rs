//! A small surface with its tree, a sender and a receiver.

use std::collections::VecDeque;
use std::f32::consts::{PI, TAU};
use std::io;
use std::sync::Arc;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use dibs_build::{Builder, BuiltTree, Mesh};
use dibs_nostd::format::CRC;
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::guard::Poses;
use dibs_nostd::wire::{
    AesCmac, Counters, Deframer, Event, Mac, encode_status, enframe, framed_bytes,
};
use dibs_nostd::{Advance, Assembler, FrameReader, Frames, Millis, RigidPose, Tree};
use dibs_stream::transport::Transport;
use dibs_stream::{PreparedFrame, Sender, Settings, SurfaceOrder};
pub use probe::bus::MTU;
use probe::bus::{KEY, PoseCheck, RECEIVER, VERTICES, WORK, pose_numbers, published_words};

/// Rings of vertices between the poles, and vertices of a ring.
const RINGS: usize = 8;
/// Vertices of the surface.
pub const N: usize = RINGS * RINGS + 2;
const _: () = assert!(N == VERTICES);
/// The stretch that the receiver admits.
const STRETCH: f32 = 1.3;
/// Limit on the coordinates, in mm.
pub const LIMIT: f32 = 400.0;

/// An egg of some 12 cm: the smallest heart would take ten times as long.
static MESH: LazyLock<Mesh> = LazyLock::new(|| {
    let ring = |i: usize| {
        (0..RINGS).map(move |j| {
            let (down, around) = ((i + 1) as f32 * PI / 9.0, j as f32 * TAU / RINGS as f32);
            let out = down.sin() * 50.0;
            Vec3::new(out * around.cos(), out * around.sin(), 60.0 * down.cos())
        })
    };
    let mut positions = vec![Vec3::Z * 60.0];
    positions.extend((0..RINGS).flat_map(ring));
    positions.push(Vec3::Z * -60.0);
    let at = |ring: usize, place: usize| (1 + ring * RINGS + place % RINGS) as u32;
    let mut triangles = Vec::new();
    for j in 0..RINGS {
        triangles.push([0, at(0, j), at(0, j + 1)]);
        for i in 1..RINGS {
            triangles.push([at(i - 1, j), at(i, j), at(i, j + 1)]);
            triangles.push([at(i - 1, j), at(i, j + 1), at(i - 1, j + 1)]);
        }
        triangles.push([at(RINGS - 1, j), N as u32 - 1, at(RINGS - 1, j + 1)]);
    }
    Mesh { positions, triangles, ..Mesh::default() }
});

pub static TREE: LazyLock<BuiltTree> =
    LazyLock::new(|| Builder::new().stretch(STRETCH).build(&*MESH).expect("a tree"));

/// The surface at a time: a moving bump, so that some vertices move from frame to frame and some do not.
pub fn surface(moment: u32) -> Vec<Vec3> {
    let rest = &MESH.positions;
    let at = rest[(moment as usize * 7) % rest.len()];
    let push = at.normalize_or(Vec3::X) * 2.0;
    let near = |p: Vec3| (1.0 - (p - at).length_squared() / 2_500.0).max(0.0);
    rest.iter().map(|&p| p + push * near(p)).collect()
}

/// Time between two frames, in ms.
pub const FRAME_MS: u32 = 40;

/// The surface's pose at a moment: it sways, so that no two poses are far apart.
pub fn pose(moment: u32) -> RigidPose {
    let sway = |period: f32| (moment as f32 / period).sin();
    let turn = Quat::from_scaled_axis(Vec3::new(0.05 * sway(3.0), 0.0, 0.08 * sway(2.0)));
    let shift = Vec3::new(4.0 * sway(5.0), -2.0, 3.0 * sway(1.0));
    RigidPose::new(turn.normalize(), shift).expect("a rotation")
}

/// A way of sending.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub quantised: bool,
    pub partial: bool,
    pub posed: bool,
}

impl Case {
    /// Makes the frame of a moment.
    pub fn prepare<M: Mac>(self, source: &mut Source<M>, moment: u32) -> PreparedFrame {
        let surface = surface(moment);
        let frame = if self.posed {
            source.prepare_at(&surface, pose(moment), Duration::ZERO)
        } else {
            source.prepare(&surface)
        };
        frame.expect("a finite surface")
    }
}

/// A sender's transport: the sent packets, and packets to be received.
#[derive(Default)]
pub struct Mailbox {
    pub sent: Vec<Vec<u8>>,
    pub inbox: VecDeque<Vec<u8>>,
}

impl Transport for Mailbox {
    fn send(&mut self, packet: &[u8]) -> io::Result<()> {
        self.sent.push(packet.to_vec());
        Ok(())
    }

    fn receive(&mut self) -> io::Result<Option<Vec<u8>>> {
        Ok(self.inbox.pop_front())
    }
}

/// A sender whose packets are collected.
pub type Source<M> = Sender<Mailbox, MTU, M>;

/// A sender on a clock that advances by [`FRAME_MS`] at each reading.
pub fn source<M: Mac>(
    case: Case,
    session: u32,
    keyed_mac: impl Fn(u64) -> M + Send + 'static,
) -> Source<M> {
    let tree = TREE.tree::<u16>().expect("16-bit indices");
    let settings = Settings {
        quantised: case.quantised,
        partial: case.partial.then_some(0.0),
        heartbeat: None,
        patience: Duration::ZERO,
        session,
        ..Settings::default()
    };
    let time = Arc::new(AtomicU64::new(0));
    let now = move || Duration::from_millis(time.fetch_add(u64::from(FRAME_MS), Ordering::Relaxed));
    Sender::with_mac(Mailbox::default(), SurfaceOrder::of(&tree), settings, keyed_mac)
        .with_clock(now)
}

/// The completely sent frames, each as the receiver must have it: its number, and its words, the pose's last.
#[derive(Default)]
pub struct Log(VecDeque<(u32, Vec<u32>)>);

/// More frames than any fault may refer back to.
const REMEMBERED: usize = 64;

impl Log {
    /// Notes the frame of a moment, which the sender has prepared last.
    pub fn note<M: Mac>(&mut self, source: &Source<M>, case: Case, moment: u32) {
        if let Some((epoch, positions)) = source.held() {
            let positions = positions.iter().flat_map(Vec3::to_array);
            let pose = if case.posed { pose(moment) } else { RigidPose::IDENTITY };
            let words = positions.chain(pose_numbers(pose)).map(f32::to_bits);
            self.0.push_back((epoch, words.collect()));
        }
        if self.0.len() > REMEMBERED {
            self.0.pop_front();
        }
    }

    /// Removes the last frame, which was not completely sent.
    pub fn forget_last(&mut self) {
        self.0.pop_back();
    }

    /// Whether a frame with this epoch and exactly these words was sent.
    fn has(&self, epoch: u32, words: &[u32]) -> bool {
        self.0.iter().rev().any(|(number, sent)| *number == epoch && sent == words)
    }

    /// The same, by the words' CRC-32.
    pub fn has_digest(&self, epoch: u32, digest: u32) -> bool {
        let of = |words: &[u32]| {
            let mut crc = CRC.digest();
            words.iter().for_each(|word| crc.update(&word.to_le_bytes()));
            crc.finalize()
        };
        self.0.iter().rev().any(|(number, words)| *number == epoch && of(words) == digest)
    }
}

/// A receiver, on the host or the board.
pub trait Receiver {
    fn counters(&self) -> &Counters;

    /// Its present status.
    fn status(&mut self) -> Vec<u8>;

    fn message(&mut self, packet: &[u8], log: &Log);

    /// Receives bytes of a stream.
    fn bytes(&mut self, bytes: &[u8], log: &Log);

    /// Frames published since the start.
    fn published(&self) -> u32;

    /// Frames published that were not sent.
    fn wrong(&self) -> u64;
}

/// The receiver on the host: the work of the bus interrupt, and a check of the frames that the control tick would read.
pub struct Controller<'f, M> {
    deframer: Deframer<MTU>,
    assembler: Assembler<'f, PoseCheck<'f, 'f>, M>,
    reader: FrameReader<'f>,
    poses: &'f Poses,
    published: u32,
    wrong: u64,
    /// Time in ms, which advances with each status.
    now: u32,
}

impl<'f, M: Mac> Controller<'f, M> {
    pub fn new(
        frames: &'f Frames<N, 3>,
        poses: &'f Poses,
        tree: &'f Tree<'f, u16>,
        mac: M,
    ) -> Self {
        let (writer, reader) = frames.split().expect("new frames");
        let admission_check =
            probe::bus::admission_check(tree, poses).expect("a tree with a metric");
        let assembler = Assembler::with_mac(writer, admission_check, tree.mesh_id(), LIMIT, mac);
        Self { deframer: Deframer::new(), assembler, reader, poses, published: 0, wrong: 0, now: 0 }
    }

    /// Checks and publishes in slices, and compares the published frame with the sent one.
    fn work(&mut self, log: &Log) {
        for _ in 0..100 {
            match self.assembler.advance(WORK) {
                Ok(Advance::Pending) => (),
                Ok(Advance::Published { epoch }) => {
                    self.published += 1;
                    let frame = self.reader.read();
                    let is_right = frame.is_some_and(|frame| {
                        let words: Vec<u32> = published_words(&frame, self.poses).collect();
                        frame.label().epoch == epoch && log.has(epoch, &words)
                    });
                    self.wrong += u64::from(!is_right);
                }
                _ => return,
            }
        }
        panic!("a check without end");
    }
}

impl<M: Mac> Receiver for Controller<'_, M> {
    fn counters(&self) -> &Counters {
        self.assembler.counters()
    }

    fn status(&mut self) -> Vec<u8> {
        let mesh_id = TREE.summary().mesh_id;
        self.now = self.now.wrapping_add(FRAME_MS);
        let status = self.assembler.status(Millis(self.now), 0);
        let (counters, mac) = (*self.assembler.counters(), self.assembler.mac());
        encode_status(mesh_id, &status, &counters, mac, &mut [0; MTU]).to_vec()
    }

    fn message(&mut self, packet: &[u8], log: &Log) {
        let _ = self.assembler.accept(packet, Millis(self.now));
        self.work(log);
    }

    fn bytes(&mut self, bytes: &[u8], log: &Log) {
        for &byte in bytes {
            match self.deframer.push(byte) {
                None => continue,
                Some(Ok(packet)) => drop(self.assembler.accept(packet, Millis(self.now))),
                Some(Err(error)) => self.assembler.count_framing(&error),
            }
            self.work(log);
        }
    }

    fn published(&self) -> u32 {
        self.published
    }

    fn wrong(&self) -> u64 {
        self.wrong
    }
}

pub fn mac_under(challenge: u64) -> AesCmac {
    AesCmac::new(&KEY, RECEIVER, challenge)
}

/// A packet framed for a byte stream.
pub fn framed(packet: &[u8]) -> Vec<u8> {
    let mut line = [0; framed_bytes(MTU)];
    enframe(packet, &mut line).expect("packets fit").to_vec()
}

/// The counts of rejections by cause, of abandoned frames and of duplicates: the signs of a fault.
pub fn noticed(counters: &Counters) -> Vec<u32> {
    Event::ALL
        .into_iter()
        .filter(|event| !matches!(event, Event::Published | Event::Heartbeat))
        .map(|event| counters.of(event))
        .collect()
}
