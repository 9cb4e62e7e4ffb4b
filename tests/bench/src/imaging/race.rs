//! Control loops side by side on one motion.
//!
//! They take turns of a few imaging periods. Each turn begins with the period before it, untimed, so that a loop
//! finds its state and the caches as if it had never waited.

use anyhow::{Result, ensure};
use dibs_tests::method::Found;
use glam::Vec3;

use super::super::measure::EXACT;
use super::controller::{Controller, Tick, Times};
use super::ours::Surface;

/// Imaging periods of a turn.
const TURN: usize = 5;

/// A control loop that takes part.
pub struct Contender<'a> {
    pub name: &'static str,
    pub surface: Surface,
    pub controller: Box<dyn Controller + 'a>,
    /// Largest difference of its answers from the others', in mm.
    pub tolerance: f32,
    /// Takes part in one of this many turns: more than 1 for slow methods.
    pub every: usize,
    pub samples: Samples,
}

impl<'a> Contender<'a> {
    pub fn new(name: &'static str, surface: Surface, controller: impl Controller + 'a) -> Self {
        let controller = Box::new(controller);
        let samples = Samples::default();
        Self { name, surface, controller, tolerance: EXACT, every: 1, samples }
    }
}

/// Means a tick of each imaging period, in microseconds, and counts of each tick.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// The number of each period.
    pub period: Vec<usize>,
    pub update: Vec<f64>,
    pub query: Vec<f64>,
    pub total: Vec<f64>,
    pub node_tests: Vec<f64>,
    pub triangle_tests: Vec<f64>,
    pub fallbacks: u32,
    pub disagreement: f32,
}

impl Samples {
    fn push(&mut self, period: usize, times: &Times) {
        let ticks = times.found.len() as f64;
        self.period.push(period);
        self.update.push(times.update / ticks);
        self.query.push(times.query / ticks);
        self.total.push((times.update + times.query) / ticks);
        self.fallbacks += times.fallbacks;
        for Found { tests, .. } in &times.found {
            if let Some([nodes, triangles]) = tests {
                self.node_tests.push(f64::from(*nodes));
                self.triangle_tests.push(f64::from(*triangles));
            }
        }
    }
}

/// A frame, and the ticks until the next.
pub struct Period {
    pub frame: Vec<Vec3>,
    pub ticks: Vec<Tick>,
}

/// The first exact method's name, and its answers to a period's ticks.
type Reference = Option<(&'static str, Vec<f32>)>;

/// Contenders, and the periods that wait for their turn.
pub struct Race<'a> {
    pub contenders: Vec<Contender<'a>>,
    /// The two frames before the waiting periods, and the ticks of the second.
    before: Vec<Vec3>,
    last: Period,
    waiting: Vec<Period>,
    turns: usize,
    done: usize,
}

impl<'a> Race<'a> {
    /// A race after a frame and a whole period, which are not timed.
    pub fn new(contenders: Vec<Contender<'a>>, before: Vec<Vec3>, last: Period) -> Self {
        Self { contenders, before, last, waiting: Vec::new(), turns: 0, done: 0 }
    }

    /// Adds a period.
    pub fn period(&mut self, period: Period) -> Result<()> {
        self.waiting.push(period);
        if self.waiting.len() == TURN { self.finish() } else { Ok(()) }
    }

    /// Runs the waiting periods, and compares all answers of a tick on the same surface. The first method changes from
    /// turn to turn.
    pub fn finish(&mut self) -> Result<()> {
        let periods = std::mem::take(&mut self.waiting);
        let mut references: Vec<[Reference; 2]> = periods.iter().map(|_| [None, None]).collect();
        let count = self.contenders.len();
        for place in 0..count {
            let contender = &mut self.contenders[(place + self.turns) % count];
            if !self.turns.is_multiple_of(contender.every) {
                continue;
            }
            contender.controller.receive(&self.before);
            contender.controller.receive(&self.last.frame);
            contender.controller.run(&self.last.ticks, &mut Times::default());
            for ((number, period), references) in (self.done..).zip(&periods).zip(&mut references) {
                contender.controller.receive(&period.frame);
                let mut times = Times::default();
                times.found.reserve(period.ticks.len());
                contender.controller.run(&period.ticks, &mut times);
                contender.samples.push(number, &times);
                contender.compare(&times.found, &mut references[contender.surface as usize])?;
            }
        }
        self.done += periods.len();
        self.turns += 1;
        for period in periods {
            self.before = std::mem::replace(&mut self.last, period).frame;
        }
        Ok(())
    }
}

impl Contender<'_> {
    fn compare(&mut self, found: &[Found], reference: &mut Reference) -> Result<()> {
        let Some((other, expected)) = reference else {
            if self.tolerance == EXACT {
                *reference = Some((self.name, found.iter().map(|f| f.separation).collect()));
            }
            return Ok(());
        };
        ensure!(found.len() == expected.len(), "{} did not answer every tick", self.name);
        for (found, expected) in found.iter().zip(expected) {
            let (separation, expected) = (found.separation, *expected);
            let off = (separation - expected).abs();
            self.samples.disagreement = self.samples.disagreement.max(off);
            // Written so that a NaN stops the run, too.
            ensure!(
                off <= self.tolerance,
                "{} says {separation} mm where {other} says {expected} mm",
                self.name
            );
        }
        Ok(())
    }
}
