//! Counts of the paper's search on the paper's construction: the polygon tests of tables 1 and 2.
//!
//! They are made on the frames and tools of those tables. Counts are exact, so they may be recorded apart from the
//! times (`--paper-search`); each names its commit.

use anyhow::{Result, ensure};
use dibs_build::{Builder, Construction};
use dibs_tests::baselines::Paper;
use dibs_tests::dibs::{Knowledge, queries};
use dibs_tests::method::Method;
use dibs_tests::streams::Stream;

use super::brain::{Frames, SEEDS, STRETCH, TOOLS};
use super::measure::EXACT;
use super::names::PAPER_SEARCH;
use super::plan::{Plan, Progress};
use super::record::{Cell, Record, Records};
use super::statistics::Summary;
use super::subjects::{self, Subject};
use dibs_prove::harness::run::Run;

/// The experiment's name in the records.
pub const EXPERIMENT: &str = "paper-search";

/// Most queries of a cell: the mean of this many is within a few percent.
const MOST: usize = 2_000;

/// Counts this experiment anew, and compares the records.
pub fn run(plan: &Plan, records: &mut Records) -> Result<()> {
    records.0.retain(|record| record.experiment != EXPERIMENT);
    for &(triangles, queries) in &plan.brains {
        one(&subjects::brain(triangles)?, queries.min(MOST), records)?;
    }
    Ok(())
}

fn one(subject: &Subject, count: usize, records: &mut Records) -> Result<()> {
    let size = subject.mesh.triangles.len();
    let title = format!("the paper's search, {} of {size} triangles", subject.name);
    let progress = Progress::start(&title, count as u64);
    let builder = Builder::new().stretch(STRETCH);
    let ours = builder.build(&subject.mesh)?;
    let papers = builder.construction(Construction::Paper).build(&subject.mesh)?;
    let (mut reference, mut search) = (queries(&ours, Knowledge::default()), Paper::new(&papers));
    let mut frames = Frames::new(&ours);
    let mut tests: [[Vec<f64>; 2]; 2] = Default::default();
    for seed in 1..=SEEDS {
        let mut stream = Stream::new(&subject.mesh.positions, seed);
        for _ in 0..count.div_ceil(SEEDS as usize) {
            let (positions, tools) = frames.next(&mut stream)?;
            reference.load(positions);
            search.load(positions);
            for (tool, tests) in tools.iter().zip(&mut tests) {
                let (found, expected) = (search.find(tool), reference.find(tool).separation);
                let separation = found.separation;
                let off = (separation - expected).abs();
                ensure!(off <= EXACT, "{title}: {separation} mm where DIBS says {expected} mm");
                for (all, one) in tests.iter_mut().zip(found.tests.unwrap_or_default()) {
                    all.push(f64::from(one));
                }
            }
            progress.one();
        }
    }
    progress.finish();
    for (tool, tests) in TOOLS.into_iter().zip(&tests) {
        let cell = Cell::new(EXPERIMENT, &subject.name, size, tool);
        for (metric, tests) in ["node_tests", "triangle_tests"].into_iter().zip(tests) {
            let summary = Summary::of(tests);
            let record = Record::summary(&cell, PAPER_SEARCH, metric, &summary, "tests");
            records.push(Record { note: Run::now(String::new()).commit, ..record });
        }
    }
    Ok(())
}
