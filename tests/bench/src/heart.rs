//! Table 3: a beating heart and a capsule that a hand moves around and through it.

use anyhow::{Context, Result};
use dibs_build::{Builder, BuiltTree, Construction};
use dibs_tests::baselines::{AabbTree, Exhaustive, Hybrid, Refit};
use dibs_tests::dibs::{Knowledge, queries, stretch};
use dibs_tests::streams::Beat;

use super::measure::{Contender, ITERATIVE, Race, Samples, Update};
use super::names::*;
use super::peers::{Obvhs, ParryBvh, ParryTriMesh};
use super::plan::{Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::{Summary, repeatable_worst};
use super::subjects::{self, Heart};

/// Margin above the largest stretch of a recorded motion.
const MARGIN: f32 = 1.02;
/// A limit beyond any motion, for the tree that measures a motion's stretch.
const ANY_STRETCH: f32 = 1_000.0;
/// Ticks between those that train the hybrid's split level: a prime, so that they spread over the beat.
const TRAINING_STRIDE: u32 = 97;

pub fn run(plan: &Plan, records: &mut Records) -> Result<()> {
    for heart in subjects::hearts(plan.heart_triangles)? {
        one(plan, &heart, records)?;
    }
    Ok(())
}

fn one(plan: &Plan, heart: &Heart, records: &mut Records) -> Result<()> {
    let mesh = &heart.mesh;
    let limit = match heart.stretch {
        Some(limit) => limit,
        None => sufficient_stretch(heart)?,
    };
    let builder = Builder::new().stretch(limit);
    let ours = builder.build(mesh)?;
    let papers = builder.construction(Construction::Paper).build(mesh)?;
    let boxes = AabbTree::new(mesh);
    let beat = Beat::new(&heart.motion);
    let level = split_level(&beat, &boxes)?;
    let knowing = |measured, warm| queries(&ours, Knowledge { measured, warm });
    let contenders = vec![
        Contender::new(PAPER, Update::Nothing, queries(&papers, Knowledge::default())),
        Contender::new(DIBS, Update::Nothing, knowing(false, false)),
        Contender::new(WARM, Update::Nothing, knowing(false, true)),
        Contender::new(MEASURED, Update::Measure, knowing(true, false)),
        Contender::new(MEASURED_WARM, Update::Measure, knowing(true, true)),
        Contender::new(REFIT, Update::Refit, Box::new(Refit::new(boxes.clone()))),
        Contender::new(HYBRID, Update::Refit, Box::new(Hybrid::new(boxes, level))),
        Contender::new(EXHAUSTIVE, Update::Nothing, Box::new(Exhaustive::new(mesh))),
        Contender::new(OBVHS, Update::Refit, Box::new(Obvhs::new(mesh))),
        Contender::new(PARRY_BVH, Update::Refit, Box::new(ParryBvh::new(mesh))),
        Contender {
            tolerance: ITERATIVE,
            ..Contender::new(PARRY_TRIMESH, Update::Refit, Box::new(ParryTriMesh::new(mesh)))
        },
    ];
    let mut race = Race::new(contenders, 1);
    let mut positions = Vec::new();
    let steps = u64::from(plan.ticks) * plan.repetitions as u64;
    let progress = Progress::start(&heart.name, steps);
    for tick in 0..20 {
        beat.deform(tick, &mut positions);
        race.step(&positions, &[beat.tool(tick)])?;
    }
    race.reset()?;
    let mut stretches = Vec::new();
    let stretch_of = stretch(&ours);
    for repetition in 0..plan.repetitions {
        for tick in 0..plan.ticks {
            beat.deform(tick, &mut positions);
            race.step(&positions, &[beat.tool(tick)])?;
            if repetition == 0 {
                stretches.extend(stretch_of(&positions).map(f64::from));
            }
            progress.one();
        }
    }
    race.finish()?;
    progress.finish();

    let cell = Cell::new("heart", &heart.name, mesh.triangles.len(), "capsule");
    race.record(&cell, 0, records);
    records.push(Record::summary(&cell, "", "stretch", &Summary::of(&stretches), ""));
    records.push(Record::number(&cell, "", "stretch_limit", f64::from(limit), ""));
    records.push(Record::number(&cell, HYBRID, "split_level", f64::from(level), "levels"));
    for (contender, samples) in race.results(0) {
        let mut totals = vec![("", samples.total(contender.update))];
        if contender.update == Update::Measure {
            totals.push(("_with_measuring", samples.total(Update::Refit)));
        }
        for (kind, total) in totals {
            let worst = repeatable_worst(&total, plan.ticks as usize);
            let mean = Summary::of(&total).mean;
            for (metric, time) in [("frequency_mean", mean), ("frequency_worst", worst)] {
                let (name, metric) = (contender.name, format!("{metric}{kind}"));
                records.push(Record::number(&cell, name, &metric, 1e6 / time, "Hz"));
            }
        }
    }
    Ok(())
}

/// The limit that a recorded motion needs, with a margin.
pub fn sufficient_stretch(heart: &Heart) -> Result<f32> {
    let tree: BuiltTree = Builder::new().stretch(ANY_STRETCH).build(&heart.mesh)?;
    let stretch_of = stretch(&tree);
    let mut largest = 1.0_f32;
    for (number, frame) in heart.motion.frames.iter().enumerate() {
        let found = stretch_of(frame)
            .with_context(|| format!("frame {number} of the motion is torn apart"))?;
        largest = largest.max(found);
    }
    Ok((largest * MARGIN * 100.0).ceil() / 100.0)
}

fn split_level(beat: &Beat<'_>, boxes: &AabbTree) -> Result<u32> {
    let contender = |level: u32| {
        let method = Box::new(Hybrid::new(boxes.clone(), level));
        Contender::new(HYBRID, Update::Refit, method)
    };
    let mut race = Race::new((1..12).map(contender).collect(), 1);
    let mut positions = Vec::new();
    for step in 0..60 {
        let tick = step * TRAINING_STRIDE;
        beat.deform(tick, &mut positions);
        race.step(&positions, &[beat.tool(tick)])?;
    }
    race.finish()?;
    let cost = |(_, samples)| Summary::of(&Samples::total(samples, Update::Refit)).median;
    let costs: Vec<f64> = race.results(0).map(cost).collect();
    let best = (1..).zip(costs).min_by(|(_, a), (_, b)| a.total_cmp(b));
    Ok(best.map_or(1, |(level, _)| level))
}
