//! This library in a control loop.

use dibs_build::BuiltTree;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Admission, AdmissionCheck, FrameExtent, IncomingSurface, Index, MeasuredStretch, MovingSurface,
    Odometer, Options, Proximity, Query, StretchMonitor, Tracker, TrackerAnswer, Tree, VertexTable,
};
use dibs_tests::method::{Found, Probe};
use glam::Vec3;

use super::controller::{Controller, Tick, Times};

/// Nodes that a tracker remembers with their children: enough here, so that none falls back for want of places.
pub const OPENED: usize = 1_024;

/// The surface between two frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surface {
    /// As the last frame has it.
    Held,
    /// Interpolated between the last two frames: exact, and late by one.
    Continuous,
}

/// A frame in the tree's order, with its stretch once that is measured.
#[derive(Default)]
pub struct Frame {
    pub rows: Vec<Vec3>,
    pub stretch: Option<MeasuredStretch>,
}

impl VertexTable for Frame {
    fn len(&self) -> usize {
        self.rows.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.rows.get(vertex as usize).copied()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.stretch
    }
}

/// The last two frames, as they come from imaging.
pub struct Frames<'t, I> {
    order: &'t [u32],
    monitor: Option<StretchMonitor<'t, I>>,
    before: Frame,
    after: Frame,
}

impl<'t, I: Index> Frames<'t, I> {
    pub fn new(built: &'t BuiltTree, tree: &'t Tree<'t, I>, is_measured: bool) -> Self {
        let monitor = is_measured.then(|| StretchMonitor::new(tree).expect("has a metric"));
        let order = built.vertex_order();
        Self { order, monitor, before: Frame::default(), after: Frame::default() }
    }

    fn receive(&mut self, frame: &[Vec3]) {
        std::mem::swap(&mut self.before, &mut self.after);
        let Frame { rows, stretch } = &mut self.after;
        rows.clear();
        rows.extend(self.order.iter().map(|&vertex| frame[vertex as usize]));
        *stretch = None;
    }

    /// Measures the last frame.
    fn measure(&mut self) {
        let Some(monitor) = &mut self.monitor else { return };
        self.after.stretch = measured(monitor, &self.after);
    }
}

/// The stretch of a whole frame.
pub fn measured<I: Index>(
    monitor: &mut StretchMonitor<'_, I>,
    frame: &(impl VertexTable + ?Sized),
) -> Option<MeasuredStretch> {
    let count = frame.len() as u32;
    monitor.begin(FrameExtent::Whole);
    monitor.moved(0..count);
    let verdict = monitor.advance(IncomingSurface::new(frame, count), u32::MAX);
    let Ok(Admission::Admitted(stretch)) = verdict else { panic!("{verdict:?}") };
    monitor.published();
    stretch
}

/// A tracker: the motion is measured once a frame where the surface moves on, or where that costs less than a query, and the
/// stretch too unless the tree's limit is assumed.
pub struct Tracking<'t, I> {
    tracker: Box<Tracker<'t, I, MAX_STACK, OPENED>>,
    odometer: Odometer,
    frames: Frames<'t, I>,
    surface: Surface,
}

impl<'t, I: Index> Tracking<'t, I> {
    pub fn new(tree: &'t Tree<'t, I>, frames: Frames<'t, I>, surface: Surface) -> Self {
        Self {
            tracker: Box::new(Tracker::new(tree).expect("enough for any tree")),
            odometer: Odometer::new(tree),
            frames,
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
        times.update(|| frames.measure());
        let (before, after) = (&frames.before, &frames.after);
        match surface {
            Surface::Held => {
                let held = times.update(|| odometer.hold(before, after));
                each(ticks, times, |tick| track(tracker, &held, &tick.tool));
            }
            Surface::Continuous => {
                let step = times.update(|| odometer.step(before, after));
                each(ticks, times, |tick| track(tracker, &step.at(tick.share), &tick.tool));
            }
        }
    }
}

/// Times each tick's answer.
fn each(ticks: &[Tick], times: &mut Times, mut track: impl FnMut(&Tick) -> TrackerAnswer) {
    for tick in ticks {
        let mut is_fallback = false;
        times.query(|| {
            let tracked = track(tick);
            is_fallback = tracked.fallback.is_some();
            found(&tracked.closest)
        });
        times.fallbacks += u32::from(is_fallback);
    }
}

pub fn track<I: Index, S: MovingSurface>(
    tracker: &mut Tracker<'_, I, MAX_STACK, OPENED>,
    surface: &S,
    tool: &Probe,
) -> TrackerAnswer {
    let options = Options::new().unsigned();
    let tracked = match tool {
        Probe::Sphere(sphere) => tracker.closest(surface, sphere, &options),
        Probe::Capsule(capsule) => tracker.closest(surface, capsule, &options),
    };
    tracked.expect("finite positions")
}

/// A whole query at every tick, from the last answer's triangle.
pub struct Warm<'t, I> {
    query: Query<'t, I, MAX_STACK>,
    frames: Frames<'t, I>,
    surface: Surface,
}

impl<'t, I: Index> Warm<'t, I> {
    pub fn new(tree: &'t Tree<'t, I>, frames: Frames<'t, I>, surface: Surface) -> Self {
        let query = Query::new(tree).expect("enough for any tree");
        Self { query, frames, surface }
    }
}

impl<I: Index> Controller for Warm<'_, I> {
    fn receive(&mut self, frame: &[Vec3]) {
        self.frames.receive(frame);
    }

    fn run(&mut self, ticks: &[Tick], times: &mut Times) {
        let Self { query, frames, surface } = self;
        times.update(|| frames.measure());
        for tick in ticks {
            times.query(|| match surface {
                Surface::Held => ask(query, &frames.after, &tick.tool),
                Surface::Continuous => {
                    let between = Between::new(&frames.before, &frames.after, tick.share);
                    ask(query, &between, &tick.tool)
                }
            });
        }
    }
}

/// The surface between two frames whose motion is not measured.
pub struct Between<'f> {
    before: &'f Frame,
    after: &'f Frame,
    share: f32,
    stretch: Option<MeasuredStretch>,
}

impl<'f> Between<'f> {
    pub fn new(before: &'f Frame, after: &'f Frame, share: f32) -> Self {
        let both = before.stretch.zip(after.stretch);
        let stretch = both.and_then(|(before, after)| before.or_larger(after));
        Self { before, after, share, stretch }
    }
}

impl VertexTable for Between<'_> {
    fn len(&self) -> usize {
        self.after.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let (before, after) = (self.before.position(vertex)?, self.after.position(vertex)?);
        Some(before + (after - before) * self.share)
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.stretch
    }
}

pub fn ask<I: Index>(
    query: &mut Query<'_, I, MAX_STACK>,
    surface: &impl VertexTable,
    tool: &Probe,
) -> Found {
    let options = Options::new().unsigned();
    let closest = match tool {
        Probe::Sphere(sphere) => query.closest_batched(surface, sphere, &options),
        Probe::Capsule(capsule) => query.closest_batched(surface, capsule, &options),
    };
    found(&closest.expect("finite positions"))
}

pub fn found(closest: &Proximity) -> Found {
    let tests = Some([closest.node_tests, closest.triangle_tests]);
    Found { separation: closest.separation.max(0.0), tests }
}
