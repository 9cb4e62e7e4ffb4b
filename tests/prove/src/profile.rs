//! `cargo xtask profile`: where a query's instructions go on the emulated board.
//!
//! Every executed instruction of the query is logged, looked up in the program's debug information, and assigned to the
//! innermost inlined function that has its own part.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Context, Result, anyhow};
use object::{Object, ObjectSymbol, SymbolKind};
use xtask::toolchain::Cross;
use xtask::{qemu, workspace};

use crate::harness::record;
use crate::harness::run::Run;
use crate::probe::script::{Asks, Script, Start};
use crate::probe::{build_for_board, executions};

/// Ticks profiled, spread over the whole path.
const TICKS: u32 = 100;

/// A part of a query, and the functions that it consists of.
struct Part {
    name: &'static str,
    functions: &'static [&'static str],
}

/// An instruction belongs to the first part that lists one of its functions.
const PARTS: [Part; 6] = [
    Part {
        name: "exact tests of triangles",
        functions: &[
            "closest_on_triangle",
            "closest_to_segment",
            "edge_to_segment",
            "nearly_parallel",
            "closest_of_all",
        ],
    },
    Part { name: "a leaf's vertices against its plane", functions: &["beyond"] },
    Part { name: "leaves: planes, and triangles against them", functions: &["leaf"] },
    Part { name: "stack, near subtrees first", functions: &["push"] },
    Part { name: "spheres of children", functions: &["expand"] },
    Part { name: "setting up, warm start, answer", functions: &["start", "finish"] },
];
const REST: &str = "loop over subtrees";

/// Measures, and writes docs/evidence/performance.md.
pub fn run() -> Result<()> {
    qemu::find()?;
    let program = build_for_board(&Cross::find()?, "probe")?;
    let script = Script::beating(TICKS, Start::Warm, Asks::Distance);
    let counts = executions(&program, &script, &ranges(&program)?)?;
    let loader = Loader::new(&program).map_err(|error| anyhow!("no debug information: {error}"))?;
    let mut parts: BTreeMap<&str, u64> = BTreeMap::new();
    for (&address, &count) in &counts {
        if let Some(part) = part(&loader, address)? {
            *parts.entry(part).or_default() += count;
        }
    }
    let queries = script.queries() as f64;
    let file = workspace::evidence().join("performance.md");
    fs::write(&file, document(&parts, queries)?)
        .with_context(|| format!("cannot write {}", file.display()))?;
    println!("{}", file.display());
    Ok(())
}

/// Address ranges of the functions of a query, and of functions that it is inlined into.
fn ranges(program: &Path) -> Result<Vec<Range<u64>>> {
    let bytes = fs::read(program)?;
    let file = object::File::parse(&*bytes)?;
    let is_ours = |name: &str| {
        let name = rustc_demangle::demangle(name).to_string();
        ["probe::timed", "probe::clocked", "probe::ask", "query::", "tool::"]
            .iter()
            .any(|part| name.contains(part))
    };
    Ok(file
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.name().is_ok_and(is_ours))
        // Bit 0 of an address is the Thumb bit.
        .map(|symbol| (symbol.address() & !1)..(symbol.address() & !1) + symbol.size())
        .collect())
}

/// The part of an instruction; `None` if it is not the query's.
fn part(loader: &Loader, address: u64) -> Result<Option<&'static str>> {
    let frames = loader.find_frames(address).map_err(|error| anyhow!("{error}"))?;
    let mut frames = frames;
    let mut names = Vec::new();
    while let Some(frame) = frames.next().map_err(|error| anyhow!("{error}"))? {
        if let Some(function) = frame.function {
            let name = function.demangle().map_err(|error| anyhow!("{error}"))?.into_owned();
            // Matches `closest_to_segment<...>` as well as `a::b::closest_to_segment`.
            let bare = name.split('<').next().unwrap_or_default();
            names.push(bare.rsplit("::").next().unwrap_or_default().to_owned());
        }
    }
    let has = |functions: &[&str]| names.iter().any(|name| functions.contains(&name.as_str()));
    Ok(PARTS
        .iter()
        .find(|part| has(part.functions))
        .map(|part| part.name)
        .or_else(|| has(&["run"]).then_some(REST)))
}

fn document(parts: &BTreeMap<&str, u64>, queries: f64) -> Result<String> {
    let total: u64 = parts.values().sum();
    let mut text = format!(
        "# Where a query's instructions go\n\n\
         Written by `cargo xtask profile` at commit {}: do not edit. Instructions of an emulated Cortex-M7, not cycles; what \
         they say about cycles, and how to measure those on silicon, is in [guarantees.md](guarantees.md).\n\n\
         The generated heart of 10,272 triangles as it beats, limit 1.5, the capsule of table 3 at {queries} \
         ticks spread over its path, warm start, measured stretch; every executed instruction counted: \
         {:.0} a query in the mean.\n\n\
         | part of a query | instructions | share |\n|---|---:|---:|\n",
        Run::now(String::new()).commit,
        total as f64 / queries
    );
    let mut rows: Vec<_> = parts.iter().collect();
    rows.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    for (part, &count) in rows {
        let share = 100.0 * count as f64 / total as f64;
        writeln!(text, "| {part} | {:.0} | {share:.1} % |", count as f64 / queries)?;
    }
    text += "\n## On the whole path\n\nFrom `cargo xtask guarantees`, docs/evidence/guarantees.json.\n\n\
             | queries | mean | 99 % below | largest | node tests | triangle tests |\n\
             |---|---:|---:|---:|---:|---:|\n";
    for (name, what) in [
        ("warm", "warm start, measured stretch"),
        ("cold", "cold, the limit alone"),
        ("poses", "cold, measured stretch, poses that hurt"),
    ] {
        let figure = |kind: &str| record::figure(&format!("m7.{name}.{kind}"));
        writeln!(
            text,
            "| {what} ({}) | {} | {} | {} | {} | {} |",
            figure("queries")?,
            figure("mean")?,
            figure("99")?,
            figure("largest")?,
            figure("node-tests")?,
            figure("triangle-tests")?
        )?;
    }
    writeln!(
        text,
        "\n## From tick to tick\n\nFrom the same record: a tracker on that path, {} ticks in a row, another surface at \
         every tick, the first aside. Other surfaces are in table 6 of [benchmarks.md](benchmarks.md).\n\n\
         | a tick's answer | mean | 99 % below | largest |\n|---|---:|---:|---:|",
        record::figure("m7.track.ticks")?
    )?;
    for (name, what) in [
        ("", "closest pair"),
        (".side", "closest pair and side"),
        (".signed", "and the depth of a crossing axis"),
        (".contacts", "and all contacts within 5 mm"),
        (".chain", "closest pair and side of eight capsules"),
        (".modes.8", "closest pair, the surface moved by 8 modes"),
        (".modes.24", "closest pair, 24 modes"),
    ] {
        let figure = |kind: &str| record::figure(&format!("m7.track{name}.{kind}"));
        let (mean, most, largest) = (figure("mean")?, figure("99")?, figure("largest")?);
        writeln!(text, "| {what} | {mean} | {most} | {largest} |")?;
    }
    Ok(text)
}
