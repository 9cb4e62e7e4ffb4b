//! This library on a surface that nodes move.

use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Index, Odometer, Query, Tracker, Tree};
use glam::Vec3;

use super::super::imaging::controller::{Controller, Tick, Times};
use super::super::imaging::ours::{Between, Frame, OPENED, Surface, ask, found, track};

/// The last two frames of nodes.
struct Frames<'t> {
    nodes: Nodes<'t>,
    before: Frame,
    after: Frame,
    arrived: Vec<Vec3>,
}

impl<'t> Frames<'t> {
    fn new(nodes: Nodes<'t>) -> Self {
        let [before, after] = [(); 2].map(|()| Frame::default());
        Self { nodes, before, after, arrived: Vec::new() }
    }

    fn receive(&mut self, frame: &[Vec3]) {
        if !self.arrived.is_empty() {
            self.take();
        }
        self.arrived.extend_from_slice(frame);
    }

    /// Takes and measures the frame that arrived.
    fn take(&mut self) {
        std::mem::swap(&mut self.before, &mut self.after);
        self.after.rows.clear();
        self.after.rows.append(&mut self.arrived);
        self.after.stretch = None;
        let measured = match self.before.stretch {
            Some(last) => self.nodes.measure_after(&self.after, &last),
            None => self.nodes.measure(&self.after),
        };
        self.after.stretch = Some(measured.expect("within the limit"));
    }
}

/// A tracker: stretch and motion are measured once a frame.
pub struct Tracking<'t, I> {
    tracker: Box<Tracker<'t, I, MAX_STACK, OPENED>>,
    odometer: Odometer,
    frames: Frames<'t>,
    surface: Surface,
}

impl<'t, I: Index> Tracking<'t, I> {
    pub fn new(tree: &'t Tree<'t, I>, nodes: Nodes<'t>, surface: Surface) -> Self {
        Self {
            tracker: Box::new(Tracker::new(tree).expect("enough for any tree")),
            odometer: nodes.odometer(),
            frames: Frames::new(nodes),
            surface,
        }
    }
}

impl<I: Index> Controller for Tracking<'_, I> {
    fn receive(&mut self, frame: &[Vec3]) {
        self.frames.receive(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        let Self { tracker, odometer, frames, surface } = self;
        times.update(|| frames.take());
        let Frames { nodes, before, after, .. } = frames;
        let step = times.update(|| odometer.step(before, after));
        for tick in ticks {
            let mut is_fallback = false;
            times.query(|| {
                let tracked = match surface {
                    Surface::Held => track(tracker, &nodes.surface(&step.after()), &tick.tool),
                    Surface::Continuous => {
                        track(tracker, &nodes.surface(&step.at(tick.share)), &tick.tool)
                    }
                };
                is_fallback = tracked.fallback.is_some();
                found(&tracked.closest)
            });
            times.fallbacks += u32::from(is_fallback);
        }
    }
}

/// A whole query at every tick, from the last answer's triangle.
pub struct Whole<'t, I> {
    query: Query<'t, I, MAX_STACK>,
    frames: Frames<'t>,
    surface: Surface,
}

impl<'t, I: Index> Whole<'t, I> {
    pub fn new(tree: &'t Tree<'t, I>, nodes: Nodes<'t>, surface: Surface) -> Self {
        let query = Query::new(tree).expect("enough for any tree");
        Self { query, frames: Frames::new(nodes), surface }
    }
}

impl<I: Index> Controller for Whole<'_, I> {
    fn receive(&mut self, frame: &[Vec3]) {
        self.frames.receive(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        let Self { query, frames, surface } = self;
        times.update(|| frames.take());
        let Frames { nodes, before, after, .. } = frames;
        for tick in ticks {
            times.query(|| match surface {
                Surface::Held => ask(query, &nodes.surface(after), &tick.tool),
                Surface::Continuous => {
                    let between = Between::new(before, after, tick.share);
                    ask(query, &nodes.surface(&between), &tick.tool)
                }
            });
        }
    }
}
