//! Ticks of the paper's moving tool around a moving surface, for the probe with a tracker.

use anyhow::{Result, bail, ensure};
use dibs_build::{BuiltTree, Motion};
use dibs_nostd::{Budget, Capsule, Tool};
use dibs_tests::method::Probe;
use dibs_tests::streams::{Beat, TICK_RATE};
use glam::{Quat, Vec3};
use probe::track::{ANSWER_WORDS, JOINTS, command, tick};

/// A script: a tree, then frames and ticks.
pub struct Script {
    bytes: Vec<u8>,
}

impl Script {
    /// A script that starts with the surface before the first tick.
    pub fn new(built: &BuiltTree, rows: &[Vec3]) -> Self {
        let mut bytes = (built.blob().len() as u32).to_le_bytes().to_vec();
        bytes.extend(built.blob());
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let mut script = Self { bytes };
        script.frame(rows);
        script
    }

    fn put(&mut self, words: &[u32]) {
        self.bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    }

    fn put_points(&mut self, points: &[Vec3]) {
        self.bytes.extend(points.iter().flat_map(Vec3::to_array).flat_map(f32::to_le_bytes));
    }

    /// The next frame.
    pub fn frame(&mut self, rows: &[Vec3]) {
        self.put(&[command::FRAME]);
        self.put_points(rows);
    }

    /// Adds a tick at the fraction `share` of the interval to the last frame. `bits` selects what the probe must find.
    pub fn tick(&mut self, bits: u32, share: f32, tool: &Capsule) {
        self.put(&[command::TICK, bits, share.to_bits()]);
        if bits & tick::CHAIN == 0 {
            self.put_points(&[tool.start(), tool.end()]);
        } else {
            self.put_points(&joints(tool));
        }
        self.put(&[tool.radius().to_bits()]);
    }

    /// The script's bytes.
    pub fn end(mut self) -> Vec<u8> {
        self.put(&[command::END]);
        self.bytes
    }
}

/// The script for this many ticks. `bits` selects what the probe must find at each.
pub fn script(built: &BuiltTree, motion: &Motion, bits: u32, ticks: u32) -> Result<Vec<u8>> {
    let rows = |number: usize| built.to_rows(&motion.frames[number % motion.frames.len()]);
    let beat = Beat::new(motion);
    let mut script = Script::new(built, &rows(0));
    let mut last = None;
    for tick in 0..ticks {
        let time = tick as f32 / TICK_RATE * motion.rate;
        let frame = time as usize;
        if last.replace(frame) != Some(frame) {
            script.frame(&rows(frame + 1));
        }
        let Probe::Capsule(tool) = beat.tool(tick) else { bail!("no capsule") };
        script.tick(bits, time.fract(), &tool);
    }
    Ok(script.end())
}

/// The ends of a chain whose first link is the tool; each link is rotated by 0.1 rad relative to the previous one.
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
    /// Number of pairs that were searched.
    pub searched: u32,
    pub is_fallback: bool,
    /// Distance of the certified interval from a whole query's, in units of both accuracies.
    pub apart: f32,
}

impl Tick {
    /// The tracker's work in node tests, which a budget bounds.
    pub fn work(&self) -> u32 {
        let [nodes, triangles] = self.tests;
        nodes + triangles * Budget::TRIANGLE
    }

    /// Whether the answer is a whole query's.
    pub fn is_whole(&self) -> bool {
        self.apart <= 1.0
    }
}

/// The answers to a script of this many ticks, except the first one.
pub fn read(words: &[u32], ticks: u32) -> Result<Vec<Tick>> {
    // The board's clock counts 1.6 for each instruction.
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
