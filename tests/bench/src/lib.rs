//! `cargo xtask bench`: the paper's experiments, run and reported.

#![allow(missing_docs, reason = "a library of one program")]

mod ablation;
mod brain;
mod claims;
pub mod contacts;
pub mod embedded;
mod facts;
mod figures;
mod heart;
pub mod imaging;
mod markdown;
mod measure;
mod names;
mod peers;
pub mod plan;
pub mod record;
mod search;
pub mod statistics;
mod subjects;
mod tracker;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};

pub use plan::Options;
use plan::{Only, Plan};
use record::Records;
use xtask::workspace;

use dibs_prove::demo;

/// Runs the benchmark, or makes its documents anew.
pub fn bench(options: &Options) -> Result<()> {
    let quick = || workspace::target().join("bench");
    let default = if options.quick { quick() } else { workspace::root().join("docs/evidence") };
    let folder = options.out.clone().unwrap_or(default);
    let records = if options.render {
        Records::read(&folder.join("benchmarks.json"))?
    } else if let Some(only) = options.only {
        let path = folder.join("benchmarks.json");
        let mut records = if path.is_file() { Records::read(&path)? } else { Records::default() };
        let start = Instant::now();
        let plan = Plan::of(options);
        match only {
            Only::Paper => {
                let is_other = |name: &str| {
                    let others = ["imaging", "embedded", "contacts", "tracker"];
                    others.iter().any(|other| name.starts_with(other))
                };
                records.0.retain(|record| is_other(&record.experiment));
                paper(&plan, options, &mut records)?;
                board(options, &mut records)?;
            }
            Only::Imaging => imaging::run(&plan, options, &mut records)?,
            Only::Embedded => embedded::run(&plan, options, &mut records)?,
            Only::Contacts => contacts::run(&plan, options, &mut records)?,
            Only::Tracker => tracker::run(&plan, options, &mut records)?,
        }
        println!("measured in {:.0} s", start.elapsed().as_secs_f64());
        records
    } else if options.paper_search {
        let mut records = Records::read(&folder.join("benchmarks.json"))?;
        search::run(&Plan::of(options), &mut records)?;
        records
    } else {
        let start = Instant::now();
        let mut records = run(&Plan::of(options), options)?;
        if !options.no_board {
            board(options, &mut records)?;
            tracker::run(&Plan::of(options), options, &mut records)?;
        }
        println!("measured in {:.0} s", start.elapsed().as_secs_f64());
        records
    };
    write(&records, &folder)?;
    println!("written to {}", folder.display());
    Ok(())
}

/// Table 3 on the emulated board: the demo's path and heart.
fn board(options: &Options, records: &mut Records) -> Result<()> {
    let seconds = if options.quick { 7 } else { 14 };
    let demo = demo::Options { seconds, script: true, ..demo::Options::default() };
    match demo::run(&demo) {
        Ok(()) => facts::cortex_m7(&workspace::target().join("demo").join("report.json"), records),
        Err(error) if options.release => Err(error),
        Err(error) => {
            eprintln!("the Cortex-M7's part is left out: {error:#}");
            Ok(())
        }
    }
}

/// Runs all experiments of a plan.
pub fn run(plan: &Plan, options: &Options) -> Result<Records> {
    let mut records = Records::default();
    paper(plan, options, &mut records)?;
    imaging::run(plan, options, &mut records)?;
    embedded::run(plan, options, &mut records)?;
    contacts::run(plan, options, &mut records)?;
    Ok(records)
}

/// The paper's experiments.
fn paper(plan: &Plan, options: &Options, records: &mut Records) -> Result<()> {
    facts::run(plan, options, records);
    brain::run(plan, records)?;
    heart::run(plan, records)?;
    ablation::run(plan, records)?;
    search::run(plan, records)
}

/// All documents made from the records: file names, below the folder of the records, and contents.
pub fn documents(records: &Records) -> Result<Vec<(String, String)>> {
    let mut documents = vec![
        ("benchmarks.md".to_owned(), markdown::benchmarks(records)),
        ("paper.md".to_owned(), claims::paper(records)),
    ];
    documents.extend(figures::all(records)?);
    Ok(documents)
}

/// Writes the records and the documents made from them.
pub fn write(records: &Records, folder: &Path) -> Result<()> {
    let json = ("benchmarks.json".to_owned(), records.json()?);
    std::fs::create_dir_all(folder.join("figures"))
        .with_context(|| format!("cannot make {}", folder.display()))?;
    for (name, text) in [json].into_iter().chain(documents(records)?) {
        let path = folder.join(name);
        dibs_build::write_atomically(&path, |out| out.write_all(text.as_bytes()))
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
