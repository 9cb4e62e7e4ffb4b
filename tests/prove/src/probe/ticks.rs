//! Ticks of the paper's moving tool around a surface that moves, for the probe that tracks.

use anyhow::{Result, bail, ensure};
use dibs_build::{BuiltTree, Motion};
use dibs_nostd::{Capsule, Tool};
use dibs_tests::method::Probe;
use dibs_tests::streams::{Beat, TICK_RATE};
use glam::{Quat, Vec3};
use probe::track::{ANSWER_WORDS, JOINTS, command, tick};

/// The script of so many ticks. `bits` is what the probe asks at each.
pub fn script(built: &BuiltTree, motion: &Motion, bits: u32, ticks: u32) -> Result<Vec<u8>> {
    let mut bytes = (built.blob().len() as u32).to_le_bytes().to_vec();
    bytes.extend(built.blob());
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    let put = |bytes: &mut Vec<u8>, words: &[u32]| {
        bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    };
    let put_points = |bytes: &mut Vec<u8>, points: &[Vec3]| {
        bytes.extend(points.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
    };
    let put_frame = |bytes: &mut Vec<u8>, number: usize| {
        put(bytes, &[command::FRAME]);
        put_points(bytes, &built.to_rows(&motion.frames[number % motion.frames.len()]));
    };
    let beat = Beat::new(motion);
    put_frame(&mut bytes, 0);
    let mut last = None;
    for tick in 0..ticks {
        let time = tick as f32 / TICK_RATE * motion.rate;
        let frame = time as usize;
        if last.replace(frame) != Some(frame) {
            put_frame(&mut bytes, frame + 1);
        }
        let Probe::Capsule(tool) = beat.tool(tick) else { bail!("no capsule") };
        put(&mut bytes, &[command::TICK, bits, time.fract().to_bits()]);
        let joints = joints(&tool);
        put_points(&mut bytes, if bits & tick::CHAIN == 0 { &joints[..2] } else { &joints });
        put(&mut bytes, &[tool.radius().to_bits()]);
    }
    put(&mut bytes, &[command::END]);
    Ok(bytes)
}

/// The ends of a chain whose first link is the tool, each link turned by a tenth of a radian against the one before.
fn joints(tool: &Capsule) -> [Vec3; JOINTS] {
    let mut link = tool.end() - tool.start();
    let mut joints = [tool.start(); JOINTS];
    for at in 1..JOINTS {
        joints[at] = joints[at - 1] + link;
        link = Quat::from_rotation_y(0.1) * link;
    }
    joints
}

/// One answer of the probe.
pub struct Tick {
    /// Instructions of the tracker, and of a whole query.
    pub instructions: u32,
    pub whole: u32,
    /// The tracker's node and triangle tests.
    pub tests: [u32; 2],
    /// Pairs that were searched.
    pub searched: u32,
    pub is_fallback: bool,
    /// How far the certified interval is from a whole query's, in units of both accuracies.
    pub apart: f32,
}

impl Tick {
    /// Whether the answer is a whole query's.
    pub fn is_whole(&self) -> bool {
        self.apart <= 1.0
    }
}

/// The answers to a script of so many ticks, without that to the first.
pub fn read(words: &[u32], ticks: u32) -> Result<Vec<Tick>> {
    // The board's clock counts 1.6 to each instruction.
    let instructions = |clock: u32| (u64::from(clock) * 5 / 8) as u32;
    let (answers, rest) = words.as_chunks::<ANSWER_WORDS>();
    ensure!(rest.is_empty(), "an answer is not whole");
    ensure!(answers.len() == ticks as usize, "{} ticks of {ticks} answered", answers.len());
    let answers = answers.iter().skip(1);
    Ok(answers
        .map(|&[took, whole, nodes, triangles, fallback, searched, _, apart]| Tick {
            instructions: instructions(took),
            whole: instructions(whole),
            tests: [nodes, triangles],
            searched,
            is_fallback: fallback != 0,
            apart: f32::from_bits(apart),
        })
        .collect())
}
