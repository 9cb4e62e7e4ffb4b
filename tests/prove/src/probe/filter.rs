//! Ticks of a filter of commands, for the probe that runs them.

use anyhow::{Result, ensure};
use dibs_build::BuiltTree;
use dibs_tests::filter::{Asked, Listener, Settings};
use glam::Vec3;
use probe::filter::{ADMITTED_WORDS, ANSWER_WORDS, HELD, UNLABELLED, command, words};

/// A script of walks on one tree, and the host's answers to it.
pub struct Script {
    words: Vec<u32>,
    /// The instructions that a tick may take.
    budget: u32,
    /// Of each tick, with its budget.
    expected: Vec<(u32, [u32; ADMITTED_WORDS])>,
}

/// One tick on the board.
pub struct Tick {
    pub instructions: u32,
    /// The instructions that it may take.
    pub budget: u32,
    /// Whether its answer equals the host's, to the bit.
    pub is_same: bool,
}

impl Script {
    /// A script without a walk. On a large surface the trackers remember more nodes.
    pub fn new(built: &BuiltTree, is_large: bool) -> Self {
        let blob = built.blob();
        let mut words = vec![u32::from(is_large), blob.len() as u32];
        words.extend(super::padded(blob));
        Self { words, budget: 0, expected: Vec::new() }
    }

    pub fn bytes(&self) -> Vec<u8> {
        let end = [command::END];
        self.words.iter().chain(&end).flat_map(|word| word.to_le_bytes()).collect()
    }

    pub fn read(&self, answers: &[u32]) -> Result<Vec<Tick>> {
        let (answers, rest) = answers.as_chunks::<ANSWER_WORDS>();
        ensure!(
            rest.is_empty() && answers.len() == self.expected.len(),
            "not every tick is answered"
        );
        let pairs = answers.iter().zip(&self.expected);
        Ok(pairs
            .map(|([took, admitted @ ..], (budget, expected))| Tick {
                // The board's clock counts 1.6 for each instruction.
                instructions: (u64::from(*took) * 5 / 8) as u32,
                budget: *budget,
                is_same: admitted == expected,
            })
            .collect())
    }

    fn put(&mut self, numbers: &[f32]) {
        self.words.extend(numbers.iter().map(|number| number.to_bits()));
    }

    fn put_points(&mut self, points: &[Vec3]) {
        points.iter().for_each(|point| self.put(&point.to_array()));
    }
}

impl Listener for Script {
    fn walk(&mut self, settings: &Settings<'_>) {
        let &Settings { stand_off, labels, robot, approach, instructions, period, is_measured } =
            settings;
        self.words.push(command::WALK);
        self.put(&[stand_off, robot, approach]);
        self.words.push(instructions);
        self.budget = instructions;
        self.put(&[period]);
        self.words.push(u32::from(is_measured));
        assert!(labels.len() <= 1, "the probe has no more than one label");
        match labels.first() {
            Some(&(label, of_label)) => {
                self.words.push(label.into());
                self.put(&[of_label]);
            }
            None => self.words.push(UNLABELLED),
        }
    }

    fn frame(&mut self, rows: &[Vec3]) {
        self.words.push(command::FRAME);
        self.put_points(rows);
    }

    fn tick(&mut self, asked: &Asked) {
        let Asked { share, joints, radii, command: motion, tissue, admitted } = asked;
        self.words.extend([command::TICK, share.map_or(HELD, f32::to_bits)]);
        self.put_points(joints);
        self.put(radii);
        self.put_points(&[motion.translation, motion.rotation]);
        self.put(tissue);
        self.expected.push((self.budget, words(admitted)));
    }
}
