//! The paper's experiments, run and reported.

mod ablation;
mod brain;
mod claims;
mod facts;
mod figures;
mod heart;
mod markdown;
mod measure;
mod names;
mod peers;
pub mod plan;
pub mod record;
pub mod search;
mod statistics;
mod subjects;

use std::path::Path;

use anyhow::{Context, Result};

use plan::{Arguments, Plan};
use record::Records;

/// Runs all experiments of a plan.
pub fn run(plan: &Plan, arguments: &Arguments) -> Result<Records> {
    let mut records = Records::default();
    facts::run(plan, arguments, &mut records);
    brain::run(plan, &mut records)?;
    search::run(plan, &mut records)?;
    heart::run(plan, &mut records)?;
    if let Some(report) = &arguments.m7 {
        facts::cortex_m7(report, &mut records)?;
    }
    ablation::run(plan, &mut records)?;
    Ok(records)
}

/// Everything that is made from the records: file names, below the folder of the records, and contents.
pub fn documents(records: &Records) -> Result<Vec<(String, String)>> {
    let mut documents = vec![
        ("benchmarks.md".to_owned(), markdown::benchmarks(records)),
        ("paper.md".to_owned(), claims::paper(records)),
    ];
    documents.extend(figures::all(records)?);
    Ok(documents)
}

/// Writes the records and all that is made from them.
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
