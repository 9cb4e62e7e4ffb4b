//! Methods side by side on one stream, interleaved in one process, so that a slower machine slows all of them.
//!
//! They take turns of a few steps rather than of one: a method that waits for ten others at every step would find its
//! data evicted from the caches, unlike in a controller. The first step of a turn is run once before it is timed.

use std::time::Instant;

use anyhow::{Result, ensure};
use dibs_tests::method::{Method, Probe};
use glam::Vec3;

use super::record::{Cell, Record, Records};
use super::statistics::Summary;

/// The purpose of a method's `update`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Update {
    /// No work.
    Nothing,
    /// Boxes are refitted: part of the total.
    Refit,
    /// The stretch is measured: in a separate column and total, because in a controller this is done when a frame
    /// arrives.
    Measure,
}

/// A method that takes part.
pub struct Contender<'a> {
    pub name: &'static str,
    pub method: Box<dyn Method + 'a>,
    pub update: Update,
    /// Takes part in one of this many steps: more than 1 for slow methods.
    pub every: usize,
    /// Largest difference of its answers from the others', in mm.
    pub tolerance: f32,
}

/// Agreement expected of exact methods: f32 rounding at coordinates of some 100 mm, many times over.
pub const EXACT: f32 = 1e-3;
/// Agreement expected of parry3d's stock capsule distance, which is iterative.
pub const ITERATIVE: f32 = 0.5;

impl<'a> Contender<'a> {
    pub fn new(name: &'static str, update: Update, method: Box<dyn Method + 'a>) -> Self {
        Self { name, method, update, every: 1, tolerance: EXACT }
    }

    /// A step that is not timed.
    fn warm_up(&mut self, step: &Step) {
        self.method.load(&step.positions);
        for tool in &step.tools {
            self.method.update();
            self.method.find(tool);
        }
    }

    fn take(&mut self, step: &mut Step, place: usize, samples: &mut [Samples]) -> Result<()> {
        self.method.load(&step.positions);
        let count = step.tools.len();
        let mut measured = None;
        for tool in (0..count).map(|turn| (turn + place) % count) {
            let samples = &mut samples[tool];
            let took = measured.unwrap_or_else(|| {
                let start = Instant::now();
                self.method.update();
                microseconds(start)
            });
            samples.update.push(took);
            if self.update == Update::Measure && measured.is_none() {
                // A frame is measured when it arrives, not in the tick of a query, so the query finds the caches as the
                // vertices' arrival left them. One measurement serves every tool.
                self.method.load(&step.positions);
                measured = Some(took);
            }
            let start = Instant::now();
            let found = self.method.find(&step.tools[tool]);
            samples.traversal.push(microseconds(start));
            if let Some([nodes, triangles]) = found.tests {
                samples.node_tests.push(f64::from(nodes));
                samples.triangle_tests.push(f64::from(triangles));
            }
            let separation = found.separation;
            if let Some((other, expected)) = step.reference[tool] {
                let off = (separation - expected).abs();
                samples.disagreement = samples.disagreement.max(off);
                let name = self.name;
                ensure!(
                    off <= self.tolerance,
                    "{name} says {separation} mm where {other} says {expected} mm"
                );
            } else if self.tolerance == EXACT {
                step.reference[tool] = Some((self.name, separation));
            }
        }
        Ok(())
    }
}

/// The samples of one method with one tool: one value a step, times in microseconds.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    pub update: Vec<f64>,
    pub traversal: Vec<f64>,
    pub node_tests: Vec<f64>,
    pub triangle_tests: Vec<f64>,
    pub disagreement: f32,
}

/// Steps of a turn.
const TURN: usize = 10;

/// A frame, its tools and the first exact answer for each.
struct Step {
    positions: Vec<Vec3>,
    tools: Vec<Probe>,
    reference: Vec<Option<(&'static str, f32)>>,
}

/// Contenders, and their samples so far.
pub struct Race<'a> {
    contenders: Vec<Contender<'a>>,
    /// By contender, then by tool.
    samples: Vec<Vec<Samples>>,
    /// One value a step, in mm.
    separations: Vec<Vec<f64>>,
    waiting: Vec<Step>,
    done: usize,
}

impl<'a> Race<'a> {
    /// A race with this many tools a step.
    pub fn new(contenders: Vec<Contender<'a>>, tools: usize) -> Self {
        let samples = vec![vec![Samples::default(); tools]; contenders.len()];
        let separations = vec![Vec::new(); tools];
        Self { contenders, samples, separations, waiting: Vec::new(), done: 0 }
    }

    /// Forgets the samples: the end of the warm-up.
    pub fn reset(&mut self) -> Result<()> {
        self.finish()?;
        let contenders = std::mem::take(&mut self.contenders);
        *self = Self::new(contenders, self.separations.len());
        Ok(())
    }

    /// Adds a step: every method loads the frame, and for every tool updates itself and answers. The separations must
    /// agree.
    pub fn step(&mut self, positions: &[Vec3], tools: &[Probe]) -> Result<()> {
        let reference = vec![None; tools.len()];
        self.waiting.push(Step { positions: positions.to_vec(), tools: tools.to_vec(), reference });
        if self.waiting.len() == TURN { self.finish() } else { Ok(()) }
    }

    /// Runs the waiting steps. The first method changes from turn to turn, and the first tool from step to step.
    pub fn finish(&mut self) -> Result<()> {
        let mut steps = std::mem::take(&mut self.waiting);
        let count = self.contenders.len();
        for turn in 0..count {
            let number = (turn + self.done / TURN) % count;
            let contender = &mut self.contenders[number];
            let mut warm = false;
            for (place, step) in (self.done..).zip(&mut steps) {
                if place % contender.every != 0 {
                    continue;
                }
                if !warm {
                    contender.warm_up(step);
                    warm = true;
                }
                contender.take(step, place, &mut self.samples[number])?;
            }
        }
        for (tool, separations) in self.separations.iter_mut().enumerate() {
            let answers = steps.iter().filter_map(|step| step.reference[tool]);
            separations.extend(answers.map(|(_, separation)| f64::from(separation)));
        }
        self.done += steps.len();
        Ok(())
    }

    /// The samples of a method with one tool.
    pub fn of(&self, name: &str, tool: usize) -> Option<&Samples> {
        let number = self.contenders.iter().position(|c| c.name == name)?;
        self.samples.get(number)?.get(tool)
    }

    /// Every contender with its samples with one tool.
    pub fn results(&self, tool: usize) -> impl Iterator<Item = (&Contender<'a>, &Samples)> {
        self.contenders.iter().zip(self.samples.iter().map(move |of_tool| &of_tool[tool]))
    }

    /// Every contender.
    pub fn contenders(&self) -> &[Contender<'a>] {
        &self.contenders
    }

    /// Records of everything measured with one tool.
    pub fn record(&self, cell: &Cell, tool: usize, records: &mut Records) {
        let separation = Summary::of(&self.separations[tool]);
        records.push(Record::summary(cell, "", "separation", &separation, "mm"));
        for (contender, samples) in self.results(tool) {
            let mut push = |metric: &str, values: &[f64], unit: &str| {
                if !values.is_empty() {
                    let summary = Summary::of(values);
                    records.push(Record::summary(cell, contender.name, metric, &summary, unit));
                }
            };
            match contender.update {
                Update::Nothing => {}
                Update::Refit => push("refit", &samples.update, "us"),
                Update::Measure => push("measure", &samples.update, "us"),
            }
            push("traversal", &samples.traversal, "us");
            push("node_tests", &samples.node_tests, "tests");
            push("triangle_tests", &samples.triangle_tests, "tests");
            push("total", &samples.total(contender.update), "us");
            if contender.update == Update::Measure {
                push("total_with_measuring", &samples.total(Update::Refit), "us");
            }
            push("disagreement", &[f64::from(samples.disagreement)], "mm");
        }
    }
}

impl Samples {
    /// Time of each step: the traversal, and the update unless that is a measurement.
    pub fn total(&self, update: Update) -> Vec<f64> {
        match update {
            Update::Refit => self.update.iter().zip(&self.traversal).map(|(u, t)| u + t).collect(),
            Update::Nothing | Update::Measure => self.traversal.clone(),
        }
    }
}

pub fn microseconds(start: Instant) -> f64 {
    start.elapsed().as_nanos() as f64 / 1e3
}

/// The time of reading the clock twice, in microseconds: part of every time measured.
pub fn clock() -> f64 {
    let readings: Vec<f64> = (0..10_000).map(|_| microseconds(Instant::now())).collect();
    Summary::of(&readings).mean
}
