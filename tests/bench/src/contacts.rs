//! All contacts within a margin of a brain that deforms, on this computer: table 5.

use std::f32::consts::TAU;
use std::fmt::Write;
use std::time::Instant;

use anyhow::{Result, ensure};
use dibs_build::{Builder, BuiltTree, Mesh, Motion};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Capsule, Contacts, Index, Odometer, Options, Query, Side, Tracker, Tree, measure_stretch,
};
use dibs_tests::method::Probe;
use dibs_tests::streams::{Beat, Pulse};
use glam::Vec3;

use super::brain::STRETCH;
use super::facts;
use super::markdown::number;
use super::names::{DIBS, TRACKER};
use super::plan::{self, Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::{Summary, repeatable_worst};
use super::subjects;

pub const EXPERIMENT: &str = "contacts";
/// The facts about its run.
pub const RUN: &str = "contacts-run";

/// How far contacts are looked for, in mm.
const MARGIN: f32 = 5.0;
/// Ticks, and frames, a second.
const RATES: [u32; 2] = [1_000, 30];
/// The motion's seed.
const SEED: u64 = 3_000;
/// The path is run through so often, since any tick may be interrupted.
const PASSES: usize = 3;
/// Radius and length of the tool, in mm.
const TOOL: [f32; 2] = [2.5, 60.0];

/// Contacts that are kept, and triangles that are compared.
type List = Contacts<16, 4_096>;
/// Opened nodes that the tracker remembers.
const OPENED: usize = 4_096;
/// A query, and a tracker.
const METHODS: [(&str, &str); 2] = [(DIBS, "`Query`"), (TRACKER, "`Tracker`")];

/// Where the tool goes.
const PATHS: [&str; 2] = ["over the surface", "through the middle"];

/// Runs this experiment anew, whatever the records have of it.
pub fn run(plan: &Plan, options: &plan::Options, records: &mut Records) -> Result<()> {
    records.0.retain(|r| ![EXPERIMENT, RUN].contains(&r.experiment.as_str()));
    facts::of(RUN, plan, options, records);
    for &triangles in &plan.imaging_brains {
        let subject = subjects::brain(triangles)?;
        let progress = Progress::start(&format!("contacts, {triangles} triangles"), 0);
        let built = Builder::new().stretch(STRETCH).build(&subject.mesh)?;
        for path in PATHS {
            let cell = Cell::new(EXPERIMENT, &subject.name, subject.mesh.triangles.len(), path);
            let (mesh, ticks) = (&subject.mesh, plan.contact_ticks);
            for (method, _) in METHODS {
                if built.index_bits() == 16 {
                    let tree = built.tree::<u16>()?;
                    follow(method, &cell, mesh, &built, &tree, ticks, records)?;
                } else {
                    let tree = built.tree::<u32>()?;
                    follow(method, &cell, mesh, &built, &tree, ticks, records)?;
                }
            }
        }
        progress.finish();
    }
    Ok(())
}

/// Follows a path with a method, and records it.
fn follow<I: Index>(
    method: &str,
    cell: &Cell,
    mesh: &Mesh,
    built: &BuiltTree,
    tree: &Tree<'_, I>,
    ticks: u32,
    records: &mut Records,
) -> Result<()> {
    let pulse = Pulse::new(&mesh.positions, SEED);
    let rest = Motion { frames: vec![mesh.positions.clone()], ..Motion::default() };
    let (beat, outline) = (Beat::new(&rest), Outline::of(&built.to_rows(&mesh.positions)));
    let mut query = Query::<I, MAX_STACK>::new(tree)?;
    let mut tracker = Box::new(Tracker::<I, MAX_STACK, OPENED, OPENED>::with_range(tree)?);
    let mut list = Box::new(List::new());
    let frame = |number: u32| -> Result<_> {
        let mut positions = Vec::new();
        pulse.deform(number as f32 / RATES[1] as f32, &mut positions);
        let rows = built.to_rows(&positions);
        let stretch = measure_stretch(tree, rows.as_slice())?;
        Ok((rows, stretch))
    };
    let mut times = Vec::new();
    let (mut contacts, mut near, mut crossing) = (Vec::new(), Vec::new(), 0_u32);
    for _ in 0..PASSES {
        let (mut number, mut odometer) = (0, Odometer::new(tree));
        let (mut before, mut after) = (frame(0)?, frame(1)?);
        let mut step = odometer.step(before.0.as_slice(), after.0.as_slice());
        for tick in 0..ticks {
            let now = tick * RATES[1];
            if now / RATES[0] != number {
                number = now / RATES[0];
                (before, after) = (after, frame(number + 1)?);
                step = odometer.step(before.0.as_slice(), after.0.as_slice());
            }
            let surface = step.at((now % RATES[0]) as f32 / RATES[0] as f32);
            let tool = if cell.tool == PATHS[0] {
                outline.tool(tick, ticks, |row| {
                    dibs_nostd::VertexTable::position(&surface, row).unwrap_or_default()
                })?
            } else {
                let Probe::Capsule(tool) = beat.tool(tick) else { anyhow::bail!("no capsule") };
                tool
            };
            let both = before.1.or_larger(after.1);
            let options = both.map_or(Options::new(), |both| Options::new().stretch(both));
            let start = Instant::now();
            let closest = if method == TRACKER {
                tracker.contacts(&surface, &tool, MARGIN, &options, &mut list)?.closest
            } else {
                query.contacts(&surface, &tool, MARGIN, &options, &mut list)?
            };
            times.push(start.elapsed().as_secs_f64() * 1e6);
            // Where the axis crosses or is wholly inside, other parts of it may be inside, less deep.
            let is_inside = matches!(closest.side, Side::Crossing | Side::Inside);
            // A tracker's own lower end is rounded once more.
            let is_bounded = is_inside && (list.bound() - closest.lower).abs() <= closest.accuracy;
            let is_whole = list.bound() >= MARGIN || is_bounded;
            ensure!(is_whole, "tick {tick}: contacts only within {} of {closest:?}", list.bound());
            contacts.push(list.len() as f64);
            near.push(f64::from(closest.triangle_tests));
            crossing += u32::from(closest.side == Side::Crossing);
        }
    }
    let mut put = |metric: &str, values: &[f64], unit: &str| {
        records.push(Record::summary(cell, method, metric, &Summary::of(values), unit));
    };
    put("time", &times, "us");
    put("contacts", &contacts, "contacts");
    put("triangle_tests", &near, "tests");
    put("worst", &[repeatable_worst(&times, ticks as usize)], "us");
    put("crossing", &[f64::from(crossing) / times.len() as f64], "share of ticks");
    Ok(())
}

/// The outermost vertices around the middle of a surface, at rest.
struct Outline {
    middle: Vec3,
    rows: Vec<u32>,
}

impl Outline {
    /// One vertex for each half of a degree.
    fn of(rows: &[Vec3]) -> Self {
        let middle = rows.iter().sum::<Vec3>() / rows.len() as f32;
        let mut farthest = vec![None::<(f32, u32)>; 720];
        let height = rows.iter().map(|row| (row.z - middle.z).abs()).fold(0.0, f32::max) / 8.0;
        for (number, row) in (0..).zip(rows) {
            let from = *row - middle;
            if from.z.abs() < height {
                let turn = from.y.atan2(from.x) / TAU + 0.5;
                let sector = &mut farthest[((turn * 720.0) as usize).min(719)];
                let distance = from.truncate().length();
                if sector.is_none_or(|(most, _)| distance > most) {
                    *sector = Some((distance, number));
                }
            }
        }
        Self { middle, rows: farthest.into_iter().flatten().map(|(_, row)| row).collect() }
    }

    /// The tool at a tick: once around the outline, its tip from 4 mm inside to 6 mm outside, its axis outwards.
    fn tool(&self, tick: u32, ticks: u32, position: impl Fn(u32) -> Vec3) -> Result<Capsule> {
        let place = tick as f32 / ticks as f32 * (self.rows.len() - 1) as f32;
        let (at, share) = (place as usize, place.fract());
        let surface = position(self.rows[at]).lerp(position(self.rows[at + 1]), share);
        let outwards = ((surface - self.middle) * Vec3::new(1.0, 1.0, 0.0)).normalize();
        let tip = surface + outwards * (1.0 + 5.0 * (tick as f32 * 0.013).sin());
        Ok(Capsule::new(tip, tip + outwards * TOOL[1], TOOL[0])?)
    }
}

/// Table 5.
pub fn table(page: &mut String, records: &Records) {
    let meshes = records.meshes(EXPERIMENT);
    if meshes.is_empty() {
        return;
    }
    page.push_str(HEAD);
    let fact = |metric| records.note_of(RUN, metric);
    let _ = writeln!(
        page,
        "Recorded by `{}` on {}, commit {}, {}.\n\n\
         | surface | triangles | tool | asked | ticks | mean | p99 | worst \
         | worst of the fastest passes | contacts | axis crosses |\n|---|---|---|---|---|---|---|---|---|---|---|",
        fact("command"),
        fact("machine"),
        fact("commit"),
        fact("date")
    );
    for (mesh, triangles) in meshes {
        for (path, (method, asked)) in
            PATHS.into_iter().flat_map(|path| METHODS.map(|method| (path, method)))
        {
            let cell = Cell::new(EXPERIMENT, &mesh, triangles as usize, path);
            let get = |metric| {
                records.0.iter().find(|r| {
                    (
                        r.experiment.as_str(),
                        r.mesh.as_str(),
                        r.triangles,
                        r.tool.as_str(),
                        r.method.as_str(),
                        r.metric.as_str(),
                    ) == (EXPERIMENT, mesh.as_str(), cell.triangles, path, method, metric)
                })
            };
            let (Some(time), Some(worst), Some(contacts), Some(crossing)) =
                (get("time"), get("worst"), get("contacts"), get("crossing"))
            else {
                continue;
            };
            let _ = writeln!(
                page,
                "| {mesh} | {triangles} | {path} | {asked} | {} | {} | {} | {} | {} | {} | {:.0} % |",
                time.n,
                number(time.mean),
                number(time.p99),
                number(time.max),
                number(worst.max),
                number(contacts.mean),
                100.0 * crossing.mean
            );
        }
    }
}

const HEAD: &str = "\n## Table 5: contacts with a deforming brain\n\n\
    All contacts within 5 mm of a capsule, with side and depth, in µs: of `Query::contacts`, which remembers only the \
    last triangle, and of `Tracker::contacts`. \
    The brain pulses in long waves; frames come 30 times a second, each tick is interpolated between the last two. \
    Not in it are the arrival of a frame and its measurement, once a frame: see table 4. Over the surface the tip \
    goes once around the brain, from 4 mm inside to 6 mm outside; through the middle it is the tool of table 3, which \
    lies across many folds. At every tick the list is complete. The path is run through three times; \
    *worst of the fastest passes* is the slowest tick, each tick taken at its fastest pass: a tick that was slow once \
    was interrupted.\n\n";
