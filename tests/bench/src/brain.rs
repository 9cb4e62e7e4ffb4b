//! Tables 1 and 2: deforming brains of four sizes, a sphere and a capsule.

use anyhow::{Result, bail};
use dibs_build::{Builder, BuiltTree, Construction};
use dibs_tests::baselines::{AabbTree, Exhaustive, Hybrid, Refit};
use dibs_tests::dibs::{Knowledge, StretchOf, queries, stretch};
use dibs_tests::method::Probe;
use dibs_tests::streams::Stream;
use glam::Vec3;

use super::measure::{Contender, ITERATIVE, Race, Update};
use super::names::*;
use super::peers::{Obvhs, ParryBvh, ParryTriMesh};
use super::plan::{Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::{Paired, Summary, crossover, holm};
use super::subjects::{self, Subject};

/// The paper's limit on stretch.
pub const STRETCH: f32 = 2.0;
pub const TOOLS: [&str; 2] = ["sphere", "capsule"];
/// Independent seeds that a cell's queries come from.
pub const SEEDS: u64 = 5;
/// Seeds of the warm-up, which is not measured.
const TRAINING: u64 = 1_000;

/// Runs the experiment on every size of the plan.
pub fn run(plan: &Plan, records: &mut Records) -> Result<()> {
    for &(triangles, queries) in &plan.brains {
        let subject = subjects::brain(triangles)?;
        one(plan, &subject, queries, records)?;
    }
    Ok(())
}

fn one(plan: &Plan, subject: &Subject, count: usize, records: &mut Records) -> Result<()> {
    let mesh = &subject.mesh;
    let size = mesh.triangles.len();
    let progress = Progress::start(&format!("{} of {size} triangles: building", subject.name), 0);
    let builder = Builder::new().stretch(STRETCH);
    let ours = builder.build(mesh)?;
    let papers = builder.construction(Construction::Paper).build(mesh)?;
    let boxes = AabbTree::new(mesh);
    let level = split_level(&ours, mesh, &boxes)?;
    let contenders = vec![
        Contender::new(PAPER, Update::Nothing, queries(&papers, Knowledge::default())),
        Contender::new(DIBS, Update::Nothing, queries(&ours, Knowledge::default())),
        Contender::new(
            MEASURED,
            Update::Measure,
            queries(&ours, Knowledge { measured: true, warm: false }),
        ),
        Contender::new(REFIT, Update::Refit, Box::new(Refit::new(boxes.clone()))),
        Contender::new(HYBRID, Update::Refit, Box::new(Hybrid::new(boxes, level))),
        Contender {
            every: plan.exhaustive_every(size),
            ..Contender::new(EXHAUSTIVE, Update::Nothing, Box::new(Exhaustive::new(mesh)))
        },
        Contender::new(OBVHS, Update::Refit, Box::new(Obvhs::new(mesh))),
        Contender::new(PARRY_BVH, Update::Refit, Box::new(ParryBvh::new(mesh))),
        Contender {
            tolerance: ITERATIVE,
            ..Contender::new(PARRY_TRIMESH, Update::Refit, Box::new(ParryTriMesh::new(mesh)))
        },
    ];
    progress.finish();

    let mut race = Race::new(contenders, TOOLS.len());
    let mut frames = Frames::new(&ours);
    let mut warm_up = Stream::new(&mesh.positions, TRAINING);
    for _ in 0..plan.warm_up(size) {
        let (positions, tools) = frames.next(&mut warm_up)?;
        race.step(positions, &tools)?;
    }
    race.reset()?;
    frames.stretches.clear();
    let progress = Progress::start(&format!("{} of {size} triangles", subject.name), count as u64);
    for seed in 1..=SEEDS {
        let mut stream = Stream::new(&mesh.positions, seed);
        for _ in 0..count.div_ceil(SEEDS as usize) {
            let (positions, tools) = frames.next(&mut stream)?;
            race.step(positions, &tools)?;
            progress.one();
        }
    }
    race.finish()?;
    progress.finish();

    for (tool, name) in TOOLS.into_iter().enumerate() {
        let cell = Cell::new("brain", &subject.name, size, name);
        race.record(&cell, tool, records);
        let stretches = Summary::of(&frames.stretches);
        records.push(Record::summary(&cell, "", "stretch", &stretches, ""));
        records.push(Record::number(&cell, HYBRID, "split_level", f64::from(level), "levels"));
        for (method, built) in [(PAPER, &papers), (DIBS, &ours)] {
            let bytes = built.summary().query_bytes_per_triangle;
            records.push(Record::number(&cell, method, "flash", bytes, "bytes a triangle"));
        }
        compare(&race, &cell, tool, records);
        histogram(&race, &cell, tool, records);
    }
    Ok(())
}

/// Refused frames in a row after which the mesh, not the strength of its deformations, is the cause.
const MOST_REFUSED: usize = 1_000;

/// Frames that keep to the limit, and their stretches.
pub struct Frames<'t> {
    stretch: StretchOf<'t>,
    positions: Vec<Vec3>,
    pub stretches: Vec<f64>,
}

impl<'t> Frames<'t> {
    pub fn new(tree: &'t BuiltTree) -> Self {
        Self { stretch: stretch(tree), positions: Vec::new(), stretches: Vec::new() }
    }

    /// The stream's next frame within the tree's limit, with its tools.
    ///
    /// # Errors
    /// If all frames are beyond the limit, so that the tree refuses the mesh itself.
    pub fn next(&mut self, stream: &mut Stream<'_>) -> Result<(&[Vec3], [Probe; 2])> {
        for _ in 0..MOST_REFUSED {
            stream.deform(&mut self.positions);
            if let Some(largest) = (self.stretch)(&self.positions) {
                self.stretches.push(f64::from(largest));
                let tools = stream.tools(&self.positions);
                return Ok((&self.positions, tools));
            }
        }
        bail!("{MOST_REFUSED} frames in a row are beyond the tree's limit")
    }
}

/// The hybrid's best split level: that of the least mean total over both tools, on a separate stream.
fn split_level(ours: &BuiltTree, mesh: &dibs_build::Mesh, boxes: &AabbTree) -> Result<u32> {
    let deepest = mesh.triangles.len().ilog2().saturating_sub(2);
    let levels: Vec<u32> = (1..=deepest).collect();
    let contender = |&level: &u32| {
        let method = Box::new(Hybrid::new(boxes.clone(), level));
        Contender::new(HYBRID, Update::Refit, method)
    };
    let mut race = Race::new(levels.iter().map(contender).collect(), TOOLS.len());
    let mut frames = Frames::new(ours);
    let mut stream = Stream::new(&mesh.positions, TRAINING + 1);
    for step in 0..30 {
        let (positions, tools) = frames.next(&mut stream)?;
        race.step(positions, &tools)?;
        if step == 9 {
            race.reset()?;
        }
    }
    race.finish()?;
    let mut costs = vec![0.0; levels.len()];
    for tool in 0..TOOLS.len() {
        for (cost, (_, samples)) in costs.iter_mut().zip(race.results(tool)) {
            *cost += Summary::of(&samples.total(Update::Refit)).median;
        }
    }
    let best = levels.iter().zip(&costs).min_by(|(_, a), (_, b)| a.total_cmp(b));
    Ok(best.map_or(1, |(&level, _)| level))
}

/// Every DIBS row against every other method: paired ratios, sign tests, crossovers.
fn compare(race: &Race<'_>, cell: &Cell, tool: usize, records: &mut Records) {
    let mut tests = Vec::new();
    for ours in [PAPER, DIBS, MEASURED] {
        let Some(samples) = race.of(ours, tool) else { continue };
        let totals = [("total", samples.total(Update::Nothing)), {
            ("total_with_measuring", samples.total(Update::Refit))
        }];
        let totals = &totals[..if ours == MEASURED { 2 } else { 1 }];
        for contender in race.contenders().iter().filter(|c| OTHERS.contains(&c.name)) {
            let Some(theirs) = race.of(contender.name, tool) else { continue };
            let their_total = theirs.total(contender.update);
            for (metric, total) in totals {
                let same: Vec<f64> = total.iter().copied().step_by(contender.every).collect();
                let name = format!("{} {metric}", contender.name);
                tests.push((ours, name, Paired::of(&their_total, &same)));
            }
            if contender.update == Update::Refit {
                let traversal = &samples.traversal;
                let h = crossover(traversal, &theirs.traversal, &theirs.update, 1);
                let cell = Cell { experiment: "crossover".to_owned(), ..cell.clone() };
                records.push(Record::summary(&cell, ours, contender.name, &h, "refits a query"));
            }
        }
    }
    let cell = Cell { experiment: "compare".to_owned(), ..cell.clone() };
    let adjusted = holm(&tests.iter().map(|(.., paired)| paired.p).collect::<Vec<_>>());
    for ((ours, name, paired), p) in tests.iter().zip(adjusted) {
        let ratio = Record::summary(&cell, ours, name, &paired.ratio, "theirs / ours");
        records.push(ratio);
        records.push(Record::number(&cell, ours, &format!("{name} wins"), paired.wins, "share"));
        records.push(Record::number(&cell, ours, &format!("{name} p"), p, "p after Holm"));
    }
}

/// Bins of the distribution of node tests: `mean` is a bin's middle, `max` its upper edge.
fn histogram(race: &Race<'_>, cell: &Cell, tool: usize, records: &mut Records) {
    const BINS: usize = 60;
    let cell = Cell { experiment: "histogram".to_owned(), ..cell.clone() };
    for method in [DIBS, MEASURED] {
        let Some(samples) = race.of(method, tool) else { continue };
        let tests = &samples.node_tests;
        let most = tests.iter().copied().fold(0.0, f64::max);
        let width = (most / BINS as f64).ceil().max(1.0);
        let mut bins = [0_u64; BINS + 1];
        for t in tests {
            bins[(t / width) as usize] += 1;
        }
        for (bin, &count) in bins.iter().enumerate().filter(|(_, count)| **count > 0) {
            let low = bin as f64 * width;
            let mut record =
                Record::number(&cell, method, "node_tests", low + width / 2.0, "tests");
            (record.summary.max, record.summary.n) = (low + width, count);
            records.push(record);
        }
    }
}
