//! `cargo xtask bound`: docs/evidence/bound.md.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use xtask::toolchain::Cross;
use xtask::{qemu, workspace};

use super::core_items::{Item, items, section};
use super::depth::TRACKED_DEPTH;
use super::facts::{Facts, MODAL, ONLY_FROM};
use super::follow::{Traced, faults, planted_in_queries, trace};
use super::queries::{Counted, KINDS, Proven, TYPICAL, count, to_trace};
use super::second::{Listing, agree};
use super::sided::{RING, SIDED_CAPSULE};
use super::ticks::{self, TICKS};
use super::tracked::{SLOTS, TRACKED};
use super::walk::UNIT;
use crate::harness::Effort;
use crate::harness::run::Run;
use crate::probe::build_for_board;

/// Proves the bound of plain queries in the probe, compares it with the emulated board, and writes docs/evidence/bound.md.
#[derive(clap::Args)]
pub struct Options {
    /// Queries whose instructions are counted, and ticks of each kind.
    #[arg(long, default_value_t = Effort::FULL.bounds)]
    queries: usize,
    /// Queries that are traced, instruction by instruction.
    #[arg(long, default_value_t = Effort::FULL.bound_traces)]
    traces: usize,
}

/// A bound, and its measurements on the board.
pub struct Row {
    pub proven: Proven,
    pub counted: Counted,
    pub traced: Traced,
    /// Instructions that another decoder decodes identically.
    pub decoded: usize,
    /// The constants in cycles of a model.
    pub cycles: [u32; 4],
}

impl Row {
    fn new(proven: Proven, counted: Counted, traced: Traced, listing: &Listing) -> Result<Self> {
        let decoded = agree(&proven.analysis, listing)?;
        let cycles = proven.cycles(listing)?;
        Ok(Self { proven, counted, traced, decoded, cycles })
    }
}

/// The result of a complete run.
pub struct Findings {
    pub rows: Vec<Row>,
    /// Number of planted errors, and of those that were not found.
    pub planted: usize,
    pub unnoticed: usize,
    /// Functions of the language's `core` in a tick with side and depth.
    pub core: Vec<Item>,
    /// Time of the proof itself, in seconds.
    pub seconds: f64,
}

/// Ticks of each kind that are traced, for one query: a tick with side has the most facts, and takes least.
const TICKS_TRACED: usize = 8;

/// Proves, counts and traces.
pub fn findings([probe, tracker]: [&Path; 2], queries: usize, traces: usize) -> Result<Findings> {
    let start = Instant::now();
    let proven: Vec<Proven> =
        KINDS.iter().map(|kind| Proven::new(kind, probe, kind.facts)).collect::<Result<_>>()?;
    let ticks: Vec<Proven> =
        TICKS.iter().map(|kind| Proven::new(kind, tracker, kind.facts)).collect::<Result<_>>()?;
    let seconds = start.elapsed().as_secs_f64();
    let listings = [Listing::read(probe)?, Listing::read(tracker)?];
    let counted = count(&proven, probe, queries)?;
    let traced = trace(&proven, probe, &to_trace(traces)?)?;
    let mut rows = Vec::new();
    for ((proven, counted), traced) in proven.into_iter().zip(counted).zip(traced) {
        rows.push(Row::new(proven, counted, traced, &listings[0])?);
    }
    for proven in ticks {
        let counted = ticks::count(&proven, tracker, queries)?;
        let traced = ticks::trace(&proven, tracker, (TICKS_TRACED * traces) as u32)?;
        rows.push(Row::new(proven, counted, traced, &listings[1])?);
    }
    let core = items(&rows.last().context("no tick")?.proven.analysis)?;
    let found = faults().map(|(kind, fault)| planted_in_queries(kind, probe, &fault));
    let found: Vec<_> = found.chain(ticks::faults(tracker)).collect::<Result<_>>()?;
    let found = found.as_flattened();
    let unnoticed = found.iter().filter(|is_found| !**is_found).count();
    Ok(Findings { rows, planted: found.len(), unnoticed, core, seconds })
}

/// Runs the task.
pub fn run(options: &Options) -> Result<()> {
    qemu::find()?;
    let run = Run::now(String::new());
    let cross = Cross::find()?;
    let [probe, tracker] = ["probe", "bound"].map(|name| build_for_board(&cross, name));
    write(&findings([&probe?, &tracker?], options.queries, options.traces)?, &run)
}

/// Writes the page of a run, unless it found an error.
pub fn write(findings: &Findings, run: &Run) -> Result<()> {
    let page = page(findings, run)?;
    let above: usize = findings.rows.iter().map(|row| row.counted.above).sum();
    let broken: Vec<_> = findings.rows.iter().flat_map(|row| &row.traced.broken).collect();
    ensure!(above == 0, "{above} queries are above their bound");
    ensure!(broken.is_empty(), "facts that queries broke: {broken:?}");
    ensure!(findings.unnoticed == 0, "{} planted errors were not found", findings.unnoticed);
    if !run.is_whole() {
        // Evidence must belong to a commit.
        println!("{page}\nbound.md is left as it is: commit the changes first");
        return Ok(());
    }
    let file = workspace::evidence().join("bound.md");
    fs::write(&file, page).with_context(|| format!("cannot write {}", file.display()))?;
    println!("{}", file.display());
    Ok(())
}

/// The constants in cycles of a model, and those of the bound for each of its instructions, of a typical query in a tree of
/// one root.
fn cycles(rows: &[Row]) -> String {
    let sum = |[base, _, node, triangle]: [u32; 4]| {
        let tests = [(node, TYPICAL.nodes), (triangle, TYPICAL.triangles)];
        f64::from(base) + tests.iter().map(|&(each, n)| f64::from(each) * n as f64).sum::<f64>()
    };
    let lines = rows.iter().map(|Row { proven, cycles, .. }| {
        let [base, root, node, triangle] = cycles;
        let root = if proven.kind.is_signed { "–".to_owned() } else { root.to_string() };
        let each = sum(*cycles) / sum(proven.whole());
        format!("| {} | {base} | {root} | {node} | {triangle} | {each:.2} |\n", proven.kind.name)
    });
    lines.collect()
}

/// A sentence about the facts that no trace tests.
fn untried(rows: &[Row]) -> String {
    let all = rows.iter().filter(|row| !row.traced.untried.is_empty());
    let all = all.map(|Row { proven, traced, .. }| {
        format!("{} ({})", traced.untried.join(", "), proven.kind.name)
    });
    let all: Vec<String> = all.collect();
    if all.is_empty() {
        return "Every fact has queries that execute what it limits.".to_owned();
    }
    format!("No traced query executes the code that these facts limit: {}.", all.join("; "))
}

/// The prices of facts in some rows, and the calls that are never made.
fn facts(text: &mut String, facts: &Facts, rows: &[&Row]) -> Result<()> {
    writeln!(text, "| fact | price | reason |\n|---|---:|---|")?;
    for fact in facts.rows() {
        let price = |row: &Row| {
            let mut rows = row.proven.analysis.system.rows.iter();
            let place = rows.position(|row| row.name == fact.name)?;
            Some(format!("{:.2}", row.proven.bound.prices[place] as f64 / UNIT as f64))
        };
        let prices = rows.iter().map(|row| price(row).unwrap_or_else(|| "–".to_owned()));
        let prices: Vec<String> = prices.collect();
        writeln!(text, "| {} | {} | {} |", fact.name, prices.join(", "), fact.because)?;
    }
    *text += "\nCalls that are never made:\n\n";
    for (caller, callee, because) in facts.never {
        let of =
            |name: &str| if name.is_empty() { "anything".to_owned() } else { format!("`{name}`") };
        writeln!(text, "- from {} to {}: {because}", of(caller), of(callee))?;
    }
    *text += "\n";
    Ok(())
}

fn page(findings: &Findings, run: &Run) -> Result<String> {
    let mut text = format!(
        "# A proven bound on instructions\n\n\
         Written by `cargo xtask bound`: do not edit. Of the probe linked from commit {}, {}, {}.\n\n\
         A plain query (`Query::closest`, unsigned, of a table of vertices, of a surface between two frames, or of one that nodes or modes move) that makes `n` node tests and `t` triangle tests in a tree with \
         `a` roots besides the first takes at most `base + a * root + n * node test + t * triangle test` instructions of a Cortex-M7: no path \
         through the linked program that keeps the flow facts below is longer. The facts are of \
         [facts.rs](../../tests/prove/src/bound/facts.rs); the proof is checked in whole numbers \
         ([walk.rs](../../tests/prove/src/bound/walk.rs)), so neither the solver nor its rounding is trusted. Trusted are the \
         facts, that the debug information places them, the calls declared as never made, the reader of the program, and \
         that an instruction counts one, as it does for the emulator; without interrupts. A bound is of \
         one linked program, here the probe's, of 16-bit indices; `n` is `Proximity::node_tests`. Instructions; cycles are below, by a model.\n\n\
         A query *with side* is of a table of vertices, for a closed surface of one root with at most {RING} triangles around a \
         vertex, none of them flat, and of a capsule whose axis is outside (`Side::Outside`): it searches no depth. Its facts are of \
         [sided.rs](../../tests/prove/src/bound/sided.rs). Its base holds up to 32 tied triangles, each at another \
         vertex; its node test holds the work in f64, by software on this processor, which is counted as node tests of typical \
         time.\n\n\
         A *tracker's tick* is a call of `Tracker::closest`, unsigned and with a budget, on a surface between two frames, by a tracker that \
         has room for {SLOTS} opened nodes and was never asked for a side. The bound is on the whole call: the visits of the opened nodes, and the \
         query from the root that follows where the room is used up. A tick's `n` also counts the work besides node tests that a budget pays \
         for ([prices.rs](../../dibs-nostd/src/query/prices.rs)). Its facts are of [tracked.rs](../../tests/prove/src/bound/tracked.rs).\n\n\
         A tick *with side and depth* is of a surface as a query with side; the axis may be anywhere, and the tracker remembers the depth \
         of earlier ticks. Its facts are also of [sided.rs](../../tests/prove/src/bound/sided.rs) and \
         [depth.rs](../../tests/prove/src/bound/depth.rs).\n\n\
         | query | base | root | node test | triangle test | times the typical base, node and triangle test | functions | instructions in the graph |\n\
         |---|---:|---:|---:|---:|---|---:|---:|\n",
        run.commit, run.compiler, run.emulator
    );
    for Row { proven, .. } in &findings.rows {
        let ratios = proven.ratios().map(|ratios| ratios.map(|one| format!("{one:.2}")).join(", "));
        let mut constants = proven.whole().map(|constant| constant.to_string());
        if proven.kind.is_signed {
            // Of a tree of one root.
            constants[1] = "–".to_owned();
        }
        let constants = constants.join(" | ");
        writeln!(
            text,
            "| {} | {constants} | {} | {} | {} |",
            proven.kind.name,
            ratios.unwrap_or_default(),
            proven.analysis.program.functions.len(),
            proven.analysis.instructions(),
        )?;
    }
    writeln!(
        text,
        "\nThe typical constants are those of `Cost`: for unsigned queries of a table of vertices a plane above measured ones plus a margin, \
         and for a tick a line above those of a path. Elsewhere the column is empty. \
         The bound's worst leaf is one \
         that two planes scan to the last vertex in vain, which queries seldom do: most of all a sphere's node test pays for it. On a surface of modes an exact test costs less than the node test that is \
         counted before it, so its own price is 0. The proof takes {:.1} s.\n\n\
         ## Cycles, by a model\n\n\
         The same facts bound the cycles, where each instruction takes at least the latency that LLVM's scheduling model of the Cortex-M7 \
         (`ARMScheduleM7.td`) states, and one cycle more where it needs an operand early, as if none overlapped with another although the processor can issue two at a time, and no branch is predicted \
         ([cycles.rs](../../tests/prove/src/bound/cycles.rs)). This is a model: ARM publishes no latencies, memory is taken to answer \
         at once (code and data in tightly coupled memory), and no processor was measured. The last column divides \
         the bound in cycles by that in instructions, of a query of {} node tests and {} triangle tests.\n\n\
         | query | base | root | node test | triangle test | cycles for each instruction |\n\
         |---|---:|---:|---:|---:|---:|\n{}\n\
         ## Against the emulated board\n\n\
         | query | counted | above the bound | largest share of the bound | mean share | traced | their instructions | facts \
         broken | facts met with equality | blocks executed | instructions whose length and target a second decoder reads alike |\n\
         |---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
        findings.seconds,
        TYPICAL.nodes,
        TYPICAL.triangles,
        cycles(&findings.rows)
    )?;
    for Row { proven, counted, traced, decoded, .. } in &findings.rows {
        writeln!(
            text,
            "| {} | {} | {} | {:.0} % | {:.0} % | {} | {} | {} | {} of {} | {} of {} | {decoded} |",
            proven.kind.name,
            counted.queries,
            counted.above,
            100.0 * counted.share,
            100.0 * counted.mean_share,
            traced.queries,
            traced.instructions,
            traced.broken.len(),
            traced.tight.len(),
            proven.analysis.system.rows.len(),
            traced.reached,
            traced.blocks,
        )?;
    }
    writeln!(
        text,
        "\nA traced query is followed instruction by instruction: each must be where the graph leads, and each fact is \
         compared with the numbers of executions; triangle tests are as many as the answer says, and node tests as many or one fewer. \
         {} Planted were {} errors, in capsules without and with side a wrong fact and a path that the graph does not \
         have; not found: {}.\n\n## Flow facts\n\nThe price of a fact is what one more of its right side adds to the bound, in \
         instructions, in the order of the queries above.\n",
        untried(&findings.rows),
        findings.planted,
        findings.unnoticed
    )?;
    let is_tick = |row: &&Row| TICKS.iter().any(|kind| kind.id == row.proven.kind.id);
    let (of_ticks, of_queries): (Vec<_>, Vec<_>) = findings.rows.iter().partition(is_tick);
    let is_signed = |row: &&Row| row.proven.kind.is_signed;
    let (with_side, without): (Vec<_>, Vec<_>) = of_queries.into_iter().partition(is_signed);
    let (with_depth, unsigned): (Vec<_>, Vec<_>) = of_ticks.into_iter().partition(is_signed);
    facts(&mut text, &MODAL, &without)?;
    text += "## Flow facts with side\n\n";
    facts(&mut text, &SIDED_CAPSULE, &with_side)?;
    text += "## Flow facts of a tracker's tick\n\n";
    facts(&mut text, &TRACKED, &unsigned)?;
    text += "## Flow facts of a tick with side and depth\n\n";
    facts(&mut text, &TRACKED_DEPTH, &with_depth)?;
    text += "## Of all\n\n";
    for (callee, caller) in ONLY_FROM {
        writeln!(
            text,
            "- to `{callee}` but from `{caller}`: checked, since its facts are of those calls"
        )?;
    }
    section(&mut text, &findings.core)?;
    Ok(text)
}
