//! Instructions of receiving a frame and checking its stretch on the board, for each vertex and packet.

// Requirement: B-11

use anyhow::{Result, ensure};
use dibs_build::{Builder, BuiltTree, IndexWidth, Motion, generate};
use dibs_nostd::wire::{AesCmac, Mac, NoMac};
use dibs_stream::{Sender, Settings, SurfaceOrder};
use glam::Vec3;
use probe::receive::{ANSWER_WORDS, KEY, TAGGED, UNTAGGED, VERTICES};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, golden};
use crate::harness::{Check, Effort};
use crate::probe::{COUNTING, board, build_for_board, padded, run_on_board};

pub const CHECK: Check = Check {
    name: "receiving on the board",
    run: check,
    promises: &[
        Promise {
            id: "receive.quantised.1024.sum",
            says: "Receiving a vertex and checking the stretch around it",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions a vertex on the emulated Cortex-M7: {receive.quantised.1024.receive} to receive it in \
         a quantised packet of 1,024 bytes, {receive.quantised.1024.check} to check its two triangles",
            limits: "Whole frames of the generated heart of 10,272 triangles, slices of 512 triangles. As floats \
         {receive.float.1024.sum}, in CAN-FD's 64 bytes {receive.quantised.64.sum}. COBS is not in it.",
        },
        Promise {
            id: "receive.tag",
            says: "What a tag (AES-128-CMAC in software) adds to a packet of 64 bytes",
            criterion: TIMING,
            bound: Bound::Golden,
            unit: "instructions a packet on the emulated Cortex-M7",
            limits: "A board with a hardware cipher implements `Mac` with that.",
        },
        golden("receive.quantised.1024.receive"),
        golden("receive.quantised.1024.check"),
        golden("receive.float.1024.receive"),
        golden("receive.float.1024.check"),
        golden("receive.float.1024.sum"),
        golden("receive.quantised.64.receive"),
        golden("receive.quantised.64.check"),
        golden("receive.quantised.64.sum"),
        golden("receive.tagged.64.receive"),
        golden("receive.tagged.64.check"),
        golden("receive.tagged.64.sum"),
    ],
};

/// Frames of each kind, spread over the beat.
const FRAMES: usize = 6;

/// A way of sending frames.
#[derive(Clone, Copy)]
struct Way {
    name: &'static str,
    mtu: usize,
    quantised: bool,
    is_tagged: bool,
    /// Number of packets between two slices of the check, which is some hundred vertices.
    every: u32,
}

const WAYS: [Way; 4] = [
    Way { name: "quantised.1024", mtu: 1024, quantised: true, is_tagged: false, every: 1 },
    Way { name: "float.1024", mtu: 1024, quantised: false, is_tagged: false, every: 2 },
    Way { name: "quantised.64", mtu: 64, quantised: true, is_tagged: false, every: 20 },
    Way { name: "tagged.64", mtu: 64, quantised: true, is_tagged: true, every: 20 },
];

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let program = build_for_board(&board()?, "receive")?;
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272)?;
    let built = Builder::new().index(IndexWidth::Bits16).stretch(1.5).build(&mesh)?;
    let mut script = Script::default();
    script.bytes(built.blob());
    for way in WAYS {
        script.frames(way, &built, &motion)?;
    }
    script.words.push(0);
    let answers = run_on_board(&program, &script.finish(), COUNTING)?;
    let (answers, _) = answers.as_chunks::<ANSWER_WORDS>();
    ensure!(answers.len() == FRAMES * WAYS.len(), "{} frames answered", answers.len());
    let mut a_packet = Vec::new();
    for (way, answers) in WAYS.iter().zip(answers.chunks(FRAMES)) {
        // The clock counts 1.6 for each instruction.
        let sum = |word: usize| answers.iter().map(|answer| f64::from(answer[word])).sum::<f64>();
        let instructions = |word: usize| sum(word) * 0.625;
        let vertices = (FRAMES * VERTICES) as f64;
        let (receive, check) = (instructions(1) / vertices, instructions(3) / vertices);
        let mut note = |name: &str, value: f64| {
            figures.note(&format!("receive.{}.{name}", way.name), (value * 10.0).round() / 10.0);
        };
        note("receive", receive);
        note("check", check);
        note("sum", receive + check);
        a_packet.push(instructions(1) / sum(0));
    }
    // The last two ways differ only in the tags.
    if let [.., untagged, tagged] = a_packet[..] {
        figures.note("receive.tag", (tagged - untagged).round());
    }
    Ok(Outcome::Passed)
}

/// The board's input.
#[derive(Default)]
struct Script {
    words: Vec<u32>,
}

impl Script {
    fn bytes(&mut self, bytes: &[u8]) {
        self.words.push(bytes.len() as u32);
        self.words.extend(padded(bytes));
    }

    /// Frames sent in one way, in a separate session.
    fn frames(&mut self, way: Way, built: &BuiltTree, motion: &Motion) -> Result<()> {
        // The session must be later than the earlier ones, because the same receivers get all of them.
        let session = WAYS.iter().position(|other| other.name == way.name).unwrap_or(0) as u32 + 1;
        let step = motion.frames.len() / FRAMES;
        for (number, positions) in motion.frames.iter().step_by(step).take(FRAMES).enumerate() {
            let session = session << 8 | number as u32;
            let packets = match (way.mtu, way.is_tagged) {
                (64, false) => packets::<_, 64>(way, built, positions, session, |_| NoMac)?,
                (64, true) => {
                    packets::<_, 64>(way, built, positions, session, |c| AesCmac::new(&KEY, 0, c))?
                }
                _ => packets::<_, 1024>(way, built, positions, session, |_| NoMac)?,
            };
            self.words.push(if way.is_tagged { TAGGED } else { UNTAGGED });
            self.words.extend([packets.len() as u32, way.every]);
            for packet in &packets {
                self.bytes(packet);
            }
        }
        Ok(())
    }

    fn finish(self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

fn packets<M: Mac, const MTU: usize>(
    way: Way,
    built: &BuiltTree,
    positions: &[Vec3],
    session: u32,
    keyed_mac: impl Fn(u64) -> M + Send + 'static,
) -> Result<Vec<Vec<u8>>> {
    let order = SurfaceOrder::of(&built.tree::<u16>()?);
    let settings =
        Settings { quantised: way.quantised, heartbeat: None, session, ..Settings::default() };
    let mut sender = Sender::<_, MTU, M>::with_mac(Vec::new(), order, settings, keyed_mac);
    sender.challenge(0);
    sender.send(positions)?;
    Ok(std::mem::take(sender.transport()))
}
