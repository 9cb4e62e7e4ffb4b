//! The control loop at imaging rates: frames come 30 or 60 times a second, the tool is asked for at every tick, and
//! all work counts.
//!
//! The surface is held between frames, or interpolated between the last two. Every method has its best strategy for
//! each: DIBS measures stretch and motion once a frame; trees of boxes are refitted once a frame where the surface is
//! held, and at every tick where it moves. All searches start from the last answer's triangle, where a method can.

pub mod controller;
pub mod course;
pub mod ours;
pub mod race;

use anyhow::Result;
use dibs_build::{Builder, BuiltTree, Mesh, Motion};
use dibs_nostd::{Index, Tree};
use dibs_tests::baselines::{AabbTree, Hybrid, Refit, Swept};
use dibs_tests::streams::{Beat, Pulse};
use glam::Vec3;

use super::brain::STRETCH;
use super::facts;
use super::heart::sufficient_stretch;
use super::measure::ITERATIVE;
use super::names::*;
use super::peers::{Obvhs, ParryBvh, ParryTriMesh};
use super::plan::{Options, Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::{Paired, Summary};
use super::subjects::{self, Heart};
use controller::{Held, Interpolated};
use course::{Course, TICK_RATE};
use ours::{Frames, Surface, Tracking, Warm};
use race::Contender;

/// The experiment on brains; the heart's is [`HEART`], and its facts are those of [`RUN`].
pub const EXPERIMENT: &str = "imaging";
pub const HEART: &str = "imaging-heart";
pub const RUN: &str = "imaging-run";

/// Frames a second.
pub const RATES: [u32; 2] = [30, 60];
/// Seconds of a heartbeat. A recorded motion's frame a second is no living heart's.
const BEAT: f32 = 1.0;
/// The motion's seed.
const SEED: u64 = 3_000;

/// The turns of which parry3d takes part in one: its queries and refits at every tick would dominate the time of a run.
pub const fn rarely(triangles: usize) -> usize {
    match triangles {
        400_000.. => 40,
        40_000.. => 10,
        _ => 1,
    }
}

/// The name of a cell's rate and surface in the records.
pub fn condition(rate: u32, surface: Surface) -> String {
    let surface = if surface == Surface::Held { "held" } else { "continuous" };
    format!("{rate} Hz, {surface}")
}

pub const SURFACES: [Surface; 2] = [Surface::Held, Surface::Continuous];

/// Runs this experiment anew, whatever the records have of it.
pub fn run(plan: &Plan, options: &Options, records: &mut Records) -> Result<()> {
    records.0.retain(|r| ![EXPERIMENT, HEART, RUN].contains(&r.experiment.as_str()));
    facts::of(RUN, plan, options, records);
    for &triangles in &plan.imaging_brains {
        let subject = subjects::brain(triangles)?;
        let pulse = Pulse::new(&subject.mesh.positions, SEED);
        let scene = Scene {
            experiment: EXPERIMENT,
            name: subject.name,
            mesh: &subject.mesh,
            limit: STRETCH,
            ticks: plan.imaging_ticks,
        };
        scene.run(&|seconds, positions| pulse.deform(seconds, positions), records)?;
    }
    let Some(heart) = subjects::hearts(plan.heart_triangles)?.pop() else { return Ok(()) };
    let limit = heart.stretch.map_or_else(|| sufficient_stretch(&heart), Ok)?;
    let Heart { name, mesh, motion, .. } = heart;
    let motion = Motion { rate: motion.frames.len() as f32 / BEAT, ..motion };
    let beat = Beat::new(&motion);
    let scene = Scene { experiment: HEART, name, mesh: &mesh, limit, ticks: plan.imaging_ticks };
    scene.run(&|seconds, positions| beat.deform_at(seconds, positions), records)
}

/// A surface in motion.
struct Scene<'m> {
    experiment: &'static str,
    name: String,
    mesh: &'m Mesh,
    /// The tree's limit on stretch.
    limit: f32,
    ticks: u32,
}

/// The best split levels of the hybrid, for each surface.
type Levels = [u32; 2];

impl Scene<'_> {
    /// On a surface with these positions after so many seconds.
    fn run(&self, frame: &dyn Fn(f32, &mut Vec<Vec3>), records: &mut Records) -> Result<()> {
        let size = self.mesh.triangles.len();
        let progress = Progress::start(&format!("{} of {size} triangles: building", self.name), 0);
        let built = Builder::new().stretch(self.limit).build(self.mesh)?;
        let boxes = AabbTree::new(self.mesh);
        let rest = Motion { frames: vec![self.mesh.positions.clone()], ..Motion::default() };
        let beat = Beat::new(&rest);
        let course = Course { frame, tool: &|tick| beat.tool(tick) };
        let level = |surface| {
            course.split_level(size, RATES[0], |level| {
                of_boxes(HYBRID, surface, Hybrid::new(boxes.clone(), level).warm())
            })
        };
        let levels = [level(Surface::Held)?, level(Surface::Continuous)?];
        progress.finish();
        for rate in RATES {
            match built.index_bits() {
                16 => {
                    let tree = built.tree::<u16>()?;
                    self.at(rate, &built, &tree, &boxes, levels, &course, records)?;
                }
                _ => {
                    let tree = built.tree::<u32>()?;
                    self.at(rate, &built, &tree, &boxes, levels, &course, records)?;
                }
            }
        }
        Ok(())
    }

    /// All methods at one imaging rate.
    #[expect(clippy::too_many_arguments, reason = "all of them are of one scene")]
    fn at<I: Index>(
        &self,
        rate: u32,
        built: &BuiltTree,
        tree: &Tree<'_, I>,
        boxes: &AabbTree,
        levels: Levels,
        course: &Course<'_>,
        records: &mut Records,
    ) -> Result<()> {
        let size = self.mesh.triangles.len();
        let mut contenders = Vec::new();
        for surface in SURFACES {
            let frames = |is_measured| Frames::new(built, tree, is_measured);
            let hybrid = || Hybrid::new(boxes.clone(), levels[surface as usize]).warm();
            contenders.extend([
                Contender::new(TRACKER, surface, Tracking::new(tree, frames(true), surface)),
                Contender::new(
                    TRACKER_AT_LIMIT,
                    surface,
                    Tracking::new(tree, frames(false), surface),
                ),
                Contender::new(MEASURED_WARM, surface, Warm::new(tree, frames(true), surface)),
                Contender::new(WARM, surface, Warm::new(tree, frames(false), surface)),
                of_boxes(REFIT, surface, Refit::new(boxes.clone()).warm()),
                of_boxes(HYBRID, surface, hybrid()),
                of_boxes(OBVHS, surface, Obvhs::new(self.mesh).warm()),
            ]);
            let every = rarely(size);
            let by_hand = of_boxes(PARRY_BVH, surface, ParryBvh::new(self.mesh).warm());
            let stock = of_boxes(PARRY_TRIMESH, surface, ParryTriMesh::new(self.mesh));
            contenders.push(Contender { every, ..by_hand });
            contenders.push(Contender { every, tolerance: ITERATIVE, ..stock });
        }
        let swept = Swept::new(boxes.clone());
        contenders.push(Contender::new(SWEPT, Surface::Continuous, swept));

        let title = format!("{} of {size} triangles at {rate} Hz", self.name);
        let periods = self.ticks * rate / TICK_RATE;
        let contenders = course.run(&title, rate, periods, contenders)?;
        self.record(rate, levels, &contenders, records);
        Ok(())
    }

    fn record(
        &self,
        rate: u32,
        levels: Levels,
        contenders: &[Contender<'_>],
        records: &mut Records,
    ) {
        for surface in SURFACES {
            let condition = condition(rate, surface);
            let size = self.mesh.triangles.len();
            let cell = Cell::new(self.experiment, &self.name, size, &condition);
            let of_surface: Vec<_> = contenders.iter().filter(|c| c.surface == surface).collect();
            record(&cell, &of_surface, &OURS, records);
            let level = f64::from(levels[surface as usize]);
            records.push(Record::number(&cell, HYBRID, "split_level", level, "levels"));
            let find = |name: &str| of_surface.iter().find(|c| c.name == name);
            if let (Some(tracker), Some(warm)) = (find(TRACKER), find(MEASURED_WARM)) {
                let ratio = Paired::of(&warm.samples.query, &tracker.samples.query).ratio;
                let metric = format!("query {MEASURED_WARM}");
                records.push(Record::summary(&cell, TRACKER, &metric, &ratio, "theirs / ours"));
            }
        }
    }
}

/// The samples of each method on one surface, and how many times as long as each of ours the others take.
pub fn record(cell: &Cell, of_surface: &[&Contender<'_>], ours: &[&str], records: &mut Records) {
    for Contender { name, samples, .. } in of_surface {
        let mut push = |metric: &str, values: &[f64], unit: &str| {
            if !values.is_empty() {
                let summary = Summary::of(values);
                records.push(Record::summary(cell, name, metric, &summary, unit));
            }
        };
        push("update", &samples.update, "us a tick");
        push("query", &samples.query, "us a tick");
        push("total", &samples.total, "us a tick");
        push("node_tests", &samples.node_tests, "tests");
        push("triangle_tests", &samples.triangle_tests, "tests");
        push("disagreement", &[f64::from(samples.disagreement)], "mm");
        if [TRACKER, TRACKER_AT_LIMIT, NODES_TRACKER].contains(name) {
            push("fallbacks", &[f64::from(samples.fallbacks)], "ticks");
        }
    }
    for own in of_surface.iter().filter(|c| ours.contains(&c.name)) {
        for theirs in of_surface.iter().filter(|c| !ours.contains(&c.name)) {
            // Periods are numbered from 0, and these methods take part in all.
            let same = theirs.samples.period.iter().map(|&p| own.samples.total[p]);
            let ratio = Paired::of(&theirs.samples.total, &same.collect::<Vec<_>>()).ratio;
            let metric = format!("total {}", theirs.name);
            records.push(Record::summary(cell, own.name, &metric, &ratio, "theirs / ours"));
        }
    }
}

/// Methods of this library that take part.
pub const OURS: [&str; 4] = [TRACKER, TRACKER_AT_LIMIT, MEASURED_WARM, WARM];

/// Refits a tree of boxes once a frame, or at every tick, as the surface asks for.
fn of_boxes<'a, M: dibs_tests::method::Layout + 'a>(
    name: &'static str,
    surface: Surface,
    method: M,
) -> Contender<'a>
where
    M::Position: 'a,
{
    match surface {
        Surface::Held => Contender::new(name, surface, Held(method)),
        Surface::Continuous => Contender::new(name, surface, Interpolated::new(method)),
    }
}
