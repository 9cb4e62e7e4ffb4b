//! `docs/evidence/benchmarks.md`: every number in it is a record's.
//!
//! One file, because it is one page, table after table.

use std::fmt::Write;

use super::brain::TOOLS;
use super::names::*;
use super::record::{Cell, Record, Records};
use super::{contacts, embedded, imaging, tracker};

/// The page.
pub fn benchmarks(records: &Records) -> String {
    let mut page = String::from(HEAD);
    run(&mut page, records);
    page.push_str(READING);
    for (number, tool) in (1..).zip(TOOLS) {
        let _ = writeln!(page, "\n## Table {number}: deforming brain, {tool}\n");
        for (mesh, triangles) in records.meshes("brain") {
            brain_table(&mut page, records, &Of(records, "brain", &mesh, triangles, tool));
        }
    }
    page.push_str(FIGURE_4);
    hearts(&mut page, records);
    cortex_m7(&mut page, records);
    control_loop(&mut page, records);
    contacts::table(&mut page, records);
    tracker::table(&mut page, records);
    embedded::table(&mut page, records);
    ratios(&mut page, records);
    crossovers(&mut page, records);
    page.push_str(FIGURE_6);
    ablation(&mut page, records);
    page.push_str(DISTRIBUTION);
    page
}

const HEAD: &str = "# Benchmarks\n\n\
    Generated from `benchmarks.json` by `cargo xtask bench`; not typed. What the paper claims and what \
    these numbers say of it is in [paper.md](paper.md).\n\n";

const READING: &str = "\n\
    Times are in microseconds on one core. A step is a new frame and one query; every vertex has moved. \
    Vertices reach each method in its own order and layout at no cost. *Refit* is what a method does \
    before the first query of a frame, *total* is refit and traversal. *Measuring* is the stretch \
    measurement of the whole frame, which in a controller belongs to the path by which vertices arrive: \
    it has a column of its own, and a total that includes it; after it, the frame is taken in once \
    more, untimed, so that it does not leave the query with cold caches. Queries are independent of each other \
    (no warm start) except where a row says so, and DIBS is asked by `closest_batched`. Methods take turns of ten steps in one process, in changing order, the first step \
    of a turn being done once before it is timed. Their answers are compared at every step, and the run stops if two exact methods \
    differ by more than 0.001 mm. Intervals are 95 % confidence intervals of the median (order \
    statistics). Node tests of DIBS are spheres, of the others boxes; exact counts. \
    (parry3d counts nothing in `TriMesh`.)\n";

const FIGURE_4: &str = "\n## Figure 4: total against size\n\n![figure 4](figures/figure4.svg)\n";
const FIGURE_6: &str = "\n![figure 6](figures/figure6.svg)\n\n\
    Not drawn: ratios of 0 and below, where DIBS is the faster one even if nothing moves.\n";
const DISTRIBUTION: &str = "\n## Node tests of each query\n\n\
    On a microcontroller the time of a query is its tests. The worst case of the run is marked.\n\n\
    ![node tests](figures/node-tests.svg)\n";

/// The records of a table.
struct Of<'a>(&'a Records, &'a str, &'a str, u64, &'a str);

impl<'a> Of<'a> {
    fn get(&self, method: &str, metric: &str) -> Option<&'a Record> {
        let Self(records, experiment, mesh, triangles, tool) = *self;
        records.0.iter().find(|r| {
            r.experiment == experiment
                && r.mesh == mesh
                && r.triangles == triangles
                && r.tool == tool
                && r.method == method
                && r.metric == metric
        })
    }
}

fn run(page: &mut String, records: &Records) {
    let rows = [
        ("kind of run", "kind"),
        ("machine", "machine"),
        ("compiler", "compiler"),
        ("commit", "commit"),
        ("command", "command"),
        ("meshes", "meshes"),
    ];
    page.push_str("| | |\n|---|---|\n");
    for (name, metric) in rows {
        let _ = writeln!(page, "| {name} | {} |", records.note(metric));
    }
    let cell = Cell { experiment: "run".to_owned(), ..Cell::default() };
    if let Some(clock) = records.find(&cell, "", "clock") {
        let time = number(clock.mean);
        let _ = writeln!(page, "| reading the clock, part of every time | {time} µs |");
    }
}

fn brain_table(page: &mut String, records: &Records, of: &Of<'_>) {
    let Of(_, experiment, mesh, triangles, _) = *of;
    let Some(separation) = of.get("", "separation") else { return };
    let _ = write!(
        page,
        "\n**{mesh}, {triangles} triangles**: {} queries, separation {} ± {} mm",
        separation.n,
        number(separation.mean),
        number(separation.sd)
    );
    if let Some(stretch) = of.get("", "stretch") {
        let (mean, max) = (number(stretch.mean), number(stretch.max));
        let _ = write!(page, ", largest stretch {mean} on average, {max} at most (limit 2)");
    }
    if let Some(level) = of.get(HYBRID, "split_level") {
        let _ = write!(page, "; the hybrid's best split level is {}", level.mean);
    }
    page.push_str(".\n\n");
    rows(page, of, &records.methods(experiment, mesh));
}

fn rows(page: &mut String, of: &Of<'_>, methods: &[String]) {
    page.push_str(
        "| method | queries | refit | measuring | traversal | node tests | polygon tests | total | \
         total, median | p99 | max | median with measuring |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    for method in methods {
        let Some(total) = of.get(method, "total") else { continue };
        let spread = |metric| of.get(method, metric).map_or("–".to_owned(), mean_sd);
        let measured = of.get(method, "total_with_measuring");
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            title(method),
            total.n,
            spread("refit"),
            spread("measure"),
            spread("traversal"),
            spread("node_tests"),
            spread("triangle_tests"),
            mean_sd(total),
            median(total),
            number(total.p99),
            number(total.max),
            measured.map_or("–".to_owned(), median),
        );
    }
}

fn hearts(page: &mut String, records: &Records) {
    page.push_str(
        "\n## Table 3: a beating heart\n\n\
         A capsule of 60 mm enters through a fixed port; its tip sweeps around the heart and through \
         the middle of it, with a hand's tremor. 1,000 steps a second; the surface is interpolated \
         between the motion's frames at every step. Worst frequency: the slowest tick, each tick's time \
         being its fastest repetition's (a tick that is slow once was interrupted). The plain maximum \
         is in the table as well.\n",
    );
    for (mesh, triangles) in records.meshes("heart") {
        let of = Of(records, "heart", &mesh, triangles, "capsule");
        let value = |method, metric| of.get(method, metric).map_or(0.0, |r| r.mean);
        let most = of.get("", "stretch").map_or(0.0, |r| r.max);
        let _ = writeln!(
            page,
            "\n**{mesh}, {triangles} triangles**, s = {} (largest stretch of the motion: {}), split \
             level of the hybrid {}.\n",
            number(value("", "stretch_limit")),
            number(most),
            value(HYBRID, "split_level")
        );
        let methods = records.methods("heart", &mesh);
        page.push_str(
            "| method | mean frequency, Hz | worst, Hz | with measuring: mean | worst |\n\
             |---|---|---|---|---|\n",
        );
        for method in &methods {
            let hertz = |metric| {
                of.get(method, metric).map_or("–".to_owned(), |r| format!("{:.0}", r.mean))
            };
            let _ = writeln!(
                page,
                "| {} | {} | {} | {} | {} |",
                title(method),
                hertz("frequency_mean"),
                hertz("frequency_worst"),
                hertz("frequency_mean_with_measuring"),
                hertz("frequency_worst_with_measuring")
            );
        }
        page.push('\n');
        rows(page, &of, &methods);
    }
}

fn cortex_m7(page: &mut String, records: &Records) {
    page.push_str("\n### The same path on a Cortex-M7\n\n");
    let found =
        records.0.iter().find(|r| r.experiment == "cortex-m7" && r.metric == "instructions");
    let Some(instructions) = found else {
        page.push_str(
            "Not part of this run: no emulator, no way to build for the board, or a failed demo.\n",
        );
        return;
    };
    let of = Of(records, "cortex-m7", &instructions.mesh, 0, "capsule");
    let value = |metric| of.get(DIBS, metric).map_or(0.0, |r| r.mean);
    let _ = writeln!(
        page,
        "{}: {} ticks in QEMU, {:.0} instructions a query on average and {:.0} at most ({:.0} node \
         and {:.0} polygon tests on average). QEMU counts instructions, not cycles; at 480 MHz and an \
         assumed one cycle an instruction that is {:.0} Hz on average and {:.0} Hz at worst.",
        instructions.mesh,
        instructions.n,
        instructions.mean,
        instructions.max,
        value("node_tests"),
        value("triangle_tests"),
        value("frequency_mean"),
        value("frequency_worst")
    );
}

/// Table 4.
fn control_loop(page: &mut String, records: &Records) {
    let of_experiment = |experiment: &'static str| {
        let meshes = records.meshes(experiment).into_iter();
        meshes.map(move |(mesh, triangles)| (experiment, mesh, triangles))
    };
    let mut meshes: Vec<_> =
        of_experiment(imaging::EXPERIMENT).chain(of_experiment(imaging::HEART)).collect();
    if meshes.is_empty() {
        return;
    }
    meshes.sort_by_key(|(.., triangles)| *triangles);
    page.push_str(CONTROL_LOOP);
    let fact = |metric| records.note_of(imaging::RUN, metric);
    let _ = writeln!(
        page,
        "Recorded by `{}` on {}, commit {}, {}.\n",
        fact("command"),
        fact("machine"),
        fact("commit"),
        fact("date")
    );
    page.push_str(
        "| surface | triangles | best peer | its total | tracker | ratio | of each period \
         | tracker at the limit: ratio \
         | warm query: ratio | warm query at the limit: ratio | boxes over both frames / tracker |\n\
         |---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let conditions: Vec<String> = imaging::SURFACES
        .iter()
        .flat_map(|&surface| imaging::RATES.map(|rate| imaging::condition(rate, surface)))
        .collect();
    for condition in &conditions {
        for (experiment, mesh, triangles) in &meshes {
            let of = Of(records, experiment, mesh, *triangles, condition);
            let total = |method: &str| of.get(method, "total").map(|r| r.mean);
            let peers = OTHERS.into_iter().filter_map(|peer| Some((peer, total(peer)?)));
            let Some((best, theirs)) = peers.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let Some(ours) = total(TRACKER) else { continue };
            let each = of.get(TRACKER, &format!("total {best}"));
            let ratio = |a: f64, b: Option<f64>| b.map_or("–".to_owned(), |b| number(a / b));
            let _ = writeln!(
                page,
                "| {condition} | {mesh}, {triangles} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                title(best),
                number(theirs),
                number(ours),
                number(theirs / ours),
                each.map_or("–".to_owned(), median),
                ratio(theirs, total(TRACKER_AT_LIMIT)),
                ratio(theirs, total(MEASURED_WARM)),
                ratio(theirs, total(WARM)),
                total(SWEPT).map_or("–".to_owned(), |swept| number(swept / ours)),
            );
        }
    }
    page.push_str("\n![imaging](figures/imaging.svg)\n");
    for (experiment, mesh, triangles) in &meshes {
        for condition in &conditions {
            let of = Of(records, experiment, mesh, *triangles, condition);
            periods(page, &of, &records.methods(experiment, mesh));
        }
    }
    page.push_str(
        "\n**The query alone**: a whole query with a warm start (`closest_batched`) against a tick of \
         the tracker, both with measured stretch, µs a tick. The last column is the median over the \
         imaging periods with its 95 % interval.\n\n\
         | surface | triangles | warm query | tracker | ratio | of each period |\n\
         |---|---|---|---|---|---|\n",
    );
    for (experiment, mesh, triangles) in &meshes {
        for condition in &conditions {
            let of = Of(records, experiment, mesh, *triangles, condition);
            let query = |method| of.get(method, "query").map(|r| r.mean);
            let (Some(warm), Some(tracker)) = (query(MEASURED_WARM), query(TRACKER)) else {
                continue;
            };
            let each = of.get(TRACKER, &format!("query {MEASURED_WARM}"));
            let _ = writeln!(
                page,
                "| {condition} | {mesh}, {triangles} | {} | {} | {} | {} |",
                number(warm),
                number(tracker),
                number(warm / tracker),
                each.map_or("–".to_owned(), median),
            );
        }
    }
}

const CONTROL_LOOP: &str = "\n## Table 4: a control loop at imaging rates\n\n\
    Frames come 30 or 60 times a second; the tool of table 3 is asked for 1,000 times a second, and all \
    work counts: the mean time a tick, over whole imaging periods. Not in it is the arrival of the \
    vertices, in each method's own order and layout: it is the same for all. The brain's surface pulses \
    in long waves; the heart beats once a second. Where the surface is *held*, it stays as the last frame \
    has it: trees of boxes are refitted once a frame. Where it is *continuous*, it is interpolated between \
    the last two frames: trees of boxes have all their positions moved and are refitted at every tick. \
    DIBS measures the stretch of each frame, and for the tracker its motion too, and interpolates the \
    vertices that it reads. *At the limit* it measures no stretch, and relies on the tissue keeping to the \
    tree's limit, as the paper does. All searches start from the last answer's triangle, except those of \
    parry3d's `TriMesh`, which has no way to say so. parry3d, which is slow on large meshes, takes part there \
    in fewer turns. Loops take turns of five periods in one process, in changing order, after \
    one untimed period. Answers on the same surface are compared at every tick, and the run stops if two \
    exact methods differ by more than 0.001 mm. The peer's and the tracker's total are in µs a tick; \
    *ratio* is that of these means, and *of each period* the median of each period's ratio with its 95 % \
    interval. *Boxes over both frames* is not what a library offers: its boxes hold \
    both ends of each vertex's way, so that one refit a frame serves a continuous surface.\n\n";

/// One surface and imaging rate of table 4.
fn periods(page: &mut String, of: &Of<'_>, methods: &[String]) {
    let Of(_, _, mesh, triangles, condition) = *of;
    let level = of.get(HYBRID, "split_level").map_or(0.0, |r| r.mean);
    let _ = writeln!(
        page,
        "\n**{mesh}, {triangles} triangles, {condition}**, split level of the hybrid {level}.\n\n\
         | method | periods | refit or measuring | query | total | total, median | node tests | \
         polygon tests | tracker's gain, median |\n|---|---|---|---|---|---|---|---|---|"
    );
    for method in methods {
        let Some(total) = of.get(method, "total") else { continue };
        let mean = |metric| of.get(method, metric).map_or("–".to_owned(), |r| number(r.mean));
        let gain = of.get(TRACKER, &format!("total {method}"));
        let _ = writeln!(
            page,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            title(method),
            total.n,
            mean("update"),
            mean("query"),
            mean("total"),
            median(total),
            mean("node_tests"),
            mean("triangle_tests"),
            gain.map_or("–".to_owned(), median),
        );
    }
}

fn ratios(page: &mut String, records: &Records) {
    page.push_str(
        "\n## How much faster\n\n\
         Their total over ours, query by query: median and 95 % interval, and the share of queries in \
         which DIBS is faster. Above 1, DIBS is faster. A ratio is in brackets where a two-sided sign \
         test, adjusted for all comparisons of its cell after Holm, does not exclude chance at 0.01. \
         (Not ANOVA and Tukey as in the paper: the queries are paired, the times skewed and their \
         variances differ by orders of magnitude.)\n",
    );
    let rows = [
        (PAPER, "total", "DIBS, the paper's construction, s = 2"),
        (DIBS, "total", "DIBS, s = 2, nothing measured"),
        (MEASURED, "total", "DIBS, measured stretch supplied"),
        (MEASURED, "total_with_measuring", "DIBS, measured stretch, its cost included"),
    ];
    for (ours, metric, name) in rows {
        let _ = writeln!(page, "\n**{name}**\n");
        header(page, "triangles, tool");
        for (mesh, triangles) in records.meshes("brain") {
            for tool in TOOLS {
                let of = Of(records, "compare", &mesh, triangles, tool);
                let cells = OTHERS.map(|other| {
                    let get = |what: &str| of.get(ours, &format!("{other} {metric}{what}"));
                    let Some(ratio) = get("") else { return "–".to_owned() };
                    let wins = get(" wins").map_or(0.0, |r| 100.0 * r.mean);
                    let text = format!("{}, {wins:.0} %", median(ratio));
                    let by_chance = get(" p").is_none_or(|p| p.mean >= 0.01);
                    if by_chance { format!("({text})") } else { text }
                });
                let _ = writeln!(page, "| {triangles}, {tool} | {} |", cells.join(" | "));
            }
        }
    }
}

fn header(page: &mut String, first: &str) {
    let names = OTHERS.map(title).join(" | ");
    let _ = writeln!(page, "| {first} | {names} |\n|---{}|", "|---".repeat(OTHERS.len()));
}

fn crossovers(page: &mut String, records: &Records) {
    page.push_str(
        "\n## Crossover refit ratio\n\n\
         A method that refits takes `h * refit + traversal` a query, where `h` is the number of refits a \
         query (the paper's equation 10: the rate at which the surface moves over the rate of queries). \
         DIBS takes its traversal, whatever `h`. They are equal at `h_c = (DIBS traversal - their \
         traversal) / their refit` (equation 11). Where the surface moves more often than once in `1 / \
         h_c` queries, DIBS is faster; below 0 it always is. From medians; 95 % intervals by \
         bootstrap. Exhaustive search has nothing to refit.\n",
    );
    let rows =
        [(PAPER, "the paper's construction"), (DIBS, "s = 2"), (MEASURED, "measured stretch")];
    for (ours, name) in rows {
        let _ = writeln!(page, "\n**DIBS, {name}**\n");
        let others: Vec<&str> = OTHERS.into_iter().filter(|o| *o != EXHAUSTIVE).collect();
        let names: Vec<&str> = others.iter().map(|o| title(o)).collect();
        let (names, rule) = (names.join(" | "), "|---".repeat(others.len()));
        let _ = writeln!(page, "| triangles, tool | {names} |\n|---{rule}|");
        for (mesh, triangles) in records.meshes("brain") {
            for tool in TOOLS {
                let of = Of(records, "crossover", &mesh, triangles, tool);
                let cell = |other: &&str| of.get(ours, other).map_or("–".to_owned(), median);
                let cells: Vec<String> = others.iter().map(cell).collect();
                let _ = writeln!(page, "| {triangles}, {tool} | {} |", cells.join(" | "));
            }
        }
    }
}

fn ablation(page: &mut String, records: &Records) {
    page.push_str(
        "\n## Ablation\n\n\
         One design choice at a time, on the same frames and tools. Counts are exact: the same seeds \
         give the same counts on every machine. `s = 2`, no warm start and nothing measured unless the \
         row says so; tools are drawn anew for every query, which is the worst case for a warm start.\n",
    );
    for (mesh, triangles) in records.meshes("ablation") {
        for tool in TOOLS {
            let of = Of(records, "ablation", &mesh, triangles, tool);
            let queries = of.get("", "separation").map_or(0, |r| r.n);
            let _ = writeln!(
                page,
                "\n**{mesh}, {triangles} triangles, {tool}**, {queries} queries\n\n\
                 | variant | node tests | at most | polygon tests | at most | traversal, median µs | \
                 bytes a triangle |\n|---|---|---|---|---|---|---|"
            );
            for method in records.methods("ablation", &mesh) {
                let Some(nodes) = of.get(&method, "node_tests") else { continue };
                let Some(triangles) = of.get(&method, "triangle_tests") else { continue };
                let time = of.get(&method, "traversal").map_or(0.0, |r| r.median);
                let bytes = of.get(&method, "flash").map_or(0.0, |r| r.mean);
                let _ = writeln!(
                    page,
                    "| {} | {:.1} | {} | {:.1} | {} | {} | {bytes:.1} |",
                    title(&method),
                    nodes.mean,
                    nodes.max,
                    triangles.mean,
                    triangles.max,
                    number(time)
                );
            }
        }
    }
}

fn mean_sd(r: &Record) -> String {
    if r.sd == 0.0 { number(r.mean) } else { format!("{} ± {}", number(r.mean), number(r.sd)) }
}

pub fn median(r: &Record) -> String {
    format!("{} [{}, {}]", number(r.median), number(r.median_low), number(r.median_high))
}

/// Three significant digits.
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = 2 - value.abs().log10().floor() as i32;
    let scale = 10_f64.powi(digits);
    let rounded = (value * scale).round() / scale;
    format!("{rounded:.*}", digits.max(0) as usize)
}
