//! A method as part of a control loop: a frame now and then, and a query at every tick.

use std::time::Instant;

use dibs_tests::baselines::Swept;
use dibs_tests::method::{Found, Layout, Method, Probe};
use glam::Vec3;

use super::super::measure::microseconds;

/// A tick of the control loop.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    pub tool: Probe,
    /// The time since the last frame, in units of the time between two.
    pub share: f32,
}

/// The times of one imaging period, in microseconds, and its answers.
#[derive(Clone, Debug, Default)]
pub struct Times {
    /// All work between the arrival of positions and the queries.
    pub update: f64,
    pub query: f64,
    pub found: Vec<Found>,
    /// Ticks that a tracker answered by a whole query.
    pub fallbacks: u32,
}

impl Times {
    /// Times and adds up an update.
    pub fn update<T>(&mut self, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let made = work();
        self.update += microseconds(start);
        made
    }

    /// Times and adds up a query.
    pub fn query(&mut self, find: impl FnOnce() -> Found) {
        let start = Instant::now();
        let found = find();
        self.query += microseconds(start);
        self.found.push(found);
    }
}

/// A method and its strategy.
pub trait Controller {
    /// Copies a frame's positions (in the mesh's order) to the method's own order and layout. Not timed: every method
    /// needs its vertices written.
    fn receive(&mut self, frame: &[Vec3]);

    /// Answers the ticks from the arrival of this frame to that of the next.
    fn run(&mut self, ticks: &[Tick], times: &mut Times);
}

/// The surface stays as the last frame has it: one update a frame.
pub struct Held<M>(pub M);

impl<M: Method> Controller for Held<M> {
    fn receive(&mut self, frame: &[Vec3]) {
        self.0.load(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        times.update(|| self.0.update());
        for tick in ticks {
            times.query(|| self.0.find(&tick.tool));
        }
    }
}

/// The surface moves from frame to frame: at every tick all positions are interpolated, and the method is updated.
pub struct Interpolated<M: Layout> {
    method: M,
    before: Vec<M::Position>,
    after: Vec<M::Position>,
}

impl<M: Layout> Interpolated<M> {
    pub fn new(method: M) -> Self {
        Self { method, before: Vec::new(), after: Vec::new() }
    }
}

impl<M: Layout> Controller for Interpolated<M> {
    fn receive(&mut self, frame: &[Vec3]) {
        std::mem::swap(&mut self.before, &mut self.after);
        self.method.load(frame);
        self.after.clear();
        self.after.extend_from_slice(self.method.positions_mut());
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        let Self { method, before, after } = self;
        for tick in ticks {
            times.update(|| {
                let ways = before.iter().zip(&*after);
                for (position, (&before, &after)) in method.positions_mut().iter_mut().zip(ways) {
                    *position = before + (after - before) * tick.share;
                }
                method.update();
            });
            times.query(|| method.find(&tick.tool));
        }
    }
}

impl Controller for Swept {
    fn receive(&mut self, frame: &[Vec3]) {
        self.load(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        times.update(|| Self::update(self));
        for tick in ticks {
            times.query(|| self.find(&tick.tool, tick.share));
        }
    }
}
