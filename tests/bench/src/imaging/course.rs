//! A surface and a tool in motion, and the races on them.

use anyhow::Result;
use dibs_tests::method::Probe;
use glam::Vec3;

use super::super::plan::Progress;
use super::super::statistics::Summary;
use super::controller::Tick;
use super::race::{Contender, Period, Race};

/// Ticks of the control loop a second.
pub const TICK_RATE: u32 = 1_000;
/// Imaging periods that train the hybrid's split level.
const TRAINING: u32 = 4;
/// The first period that is timed: two come before it.
const FIRST: u32 = 2;

/// A surface and a tool in motion.
pub struct Course<'m> {
    /// What a frame brings after so many seconds.
    pub frame: &'m dyn Fn(f32, &mut Vec<Vec3>),
    /// The tool at a tick.
    pub tool: &'m dyn Fn(u32) -> Probe,
}

impl Course<'_> {
    /// Runs so many periods, at so many frames a second.
    pub fn run<'a>(
        &self,
        title: &str,
        rate: u32,
        periods: u32,
        contenders: Vec<Contender<'a>>,
    ) -> Result<Vec<Contender<'a>>> {
        let progress = Progress::start(title, u64::from(periods));
        let mut race = self.race(rate, contenders);
        for number in 0..periods {
            race.period(self.period(rate, number + FIRST))?;
            progress.one();
        }
        race.finish()?;
        progress.finish();
        Ok(race.contenders)
    }

    /// The hybrid's best split level on so many triangles: `of` makes it with a level.
    pub fn split_level<'a>(
        &self,
        triangles: usize,
        rate: u32,
        of: impl Fn(u32) -> Contender<'a>,
    ) -> Result<u32> {
        let deepest = triangles.ilog2().saturating_sub(2).max(2);
        let mut best = (f64::INFINITY, 1);
        for level in 2..=deepest {
            let mut race = self.race(rate, vec![of(level)]);
            for number in 0..TRAINING {
                race.period(self.period(rate, number + FIRST))?;
            }
            race.finish()?;
            let median = Summary::of(&race.contenders[0].samples.total).median;
            if median < best.0 {
                best = (median, level);
            }
        }
        Ok(best.1)
    }

    /// A race that is ready for the period [`FIRST`].
    fn race<'a>(&self, rate: u32, contenders: Vec<Contender<'a>>) -> Race<'a> {
        let before = self.period(rate, FIRST - 2).frame;
        Race::new(contenders, before, self.period(rate, FIRST - 1))
    }

    /// A frame, and the ticks until the next.
    fn period(&self, rate: u32, number: u32) -> Period {
        let mut frame = Vec::new();
        (self.frame)(number as f32 / rate as f32, &mut frame);
        let first = |number: u32| (number * TICK_RATE).div_ceil(rate);
        let ticks = (first(number)..first(number + 1)).map(|tick| Tick {
            tool: (self.tool)(tick),
            share: (tick * rate % TICK_RATE) as f32 / TICK_RATE as f32,
        });
        Period { frame, ticks: ticks.collect() }
    }
}
