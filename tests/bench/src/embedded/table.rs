//! The experiment's part of `docs/evidence/benchmarks.md`.

use std::fmt::Write;

use super::super::markdown::{median, number};
use super::super::names::*;
use super::super::record::{Cell, Record, Records};
use super::{CONDITIONS, EXPERIMENT, FRAME, RUN};

const HEAD: &str = "\n## Table 7: surfaces that nodes move\n\n\
    A frame brings the nodes of a lattice around the brain, which pulses in long waves, in quantised packets. All \
    searches start from the last answer's triangle. Answers are compared at every tick, and the run stops if two \
    differ by more than 0.001 mm.\n\n\
    A total is the work from the packets to the answers, in µs a tick: every method *receives* nodes by this \
    library's receiver. (Where no time of receiving is given, the totals are without it.)\n\n\
    - DIBS checks every element, measures the nodes' motion, and computes the vertices that a query reads.\n\
    - Refitted trees move all vertices by four nodes each, in their own order and layout: once a frame where the \
    surface is held, at every tick where it is continuous.\n\
    - *Boxes over the elements* are around nodes. When a query enters one, the vertices below it are moved and their \
    boxes refitted. Nothing is checked. (A static tree in each element, mapped by it, took five to ten times as long: half of \
    the triangles lie across elements.)\n\
    - *Boxes over both frames* are refitted once a frame.\n\
    - *Ratio* is the peer's total over the tracker's; in brackets the 95 % interval of the median of each period's.\n\n";

/// Bytes of a node's row in a quantised frame.
const QUANTISED_ROW: f64 = 6.0;

/// The part, where the experiment was run.
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
         | surface | nodes | tetrahedra | a frame, bytes (of them rows) | two buffers, bytes | tree, bytes a triangle \
         | receive, µs | check, µs | check of the triangles, µs | triangles / elements |\n\
         |---|---|---|---|---|---|---|---|---|---|",
        fact("command"),
        fact("machine"),
        fact("commit"),
        fact("date")
    );
    for (mesh, triangles) in &meshes {
        let cell = Cell::new(EXPERIMENT, mesh, *triangles as usize, FRAME);
        let value = |method, metric, of: fn(&Record) -> f64| {
            records.find(&cell, method, metric).map_or("–".to_owned(), |r| number(of(r)))
        };
        let exact = |metric| {
            let found = records.find(&cell, NODES_QUERY, metric);
            found.map_or("–".to_owned(), |r| format!("{:.0}", r.mean))
        };
        let flash = records.find(&cell, NODES_QUERY, "flash").map_or(0.0, |r| r.mean);
        let ratio = records.find(&cell, NODES_QUERY, "check of triangles");
        let _ = writeln!(
            page,
            "| {mesh}, {triangles} | {} | {} | {} ({}) | {} | {} | {} | {} | {} | {} |",
            exact("nodes"),
            exact("elements"),
            exact("payload"),
            records.find(&cell, NODES_QUERY, "nodes").map_or(0.0, |r| r.mean) * QUANTISED_ROW,
            exact("memory"),
            number(flash / *triangles as f64),
            value(NODES_QUERY, "receive", |r| r.median),
            value(NODES_QUERY, "check", |r| r.median),
            value(DIBS, "check", |r| r.median),
            ratio.map_or("–".to_owned(), median),
        );
    }
    page.push_str(
        "\n| asked | surface | best refitted tree | its total | tracker | ratio | goal | boxes over the elements: total \
         | ratio | boxes over both frames: ratio | whole query: total |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let mut missed = String::new();
    for (condition, ..) in CONDITIONS {
        for (mesh, triangles) in &meshes {
            let cell = Cell::new(EXPERIMENT, mesh, *triangles as usize, condition);
            let total = |method| records.find(&cell, method, "total").map(|r| r.mean);
            let peers = OTHERS.into_iter().filter_map(|peer| Some((peer, total(peer)?)));
            let Some((best, theirs)) = peers.min_by(|a, b| a.1.total_cmp(&b.1)) else { continue };
            let text = |method| total(method).map_or("–".to_owned(), number);
            let ratio = |peer| {
                let found = records.find(&cell, NODES_TRACKER, &format!("total {peer}"));
                found.map_or("–".to_owned(), median)
            };
            let goal = goal(condition, *triangles);
            missed += &shortfall(records, &cell, best, goal);
            let _ = writeln!(
                page,
                "| {condition} | {mesh}, {triangles} | {} | {} | {} | {} | {} | {} | {} | {} | {} |",
                title(best),
                number(theirs),
                text(NODES_TRACKER),
                ratio(best),
                goal.map_or("–".to_owned(), number),
                text(LAZY),
                ratio(LAZY),
                ratio(SWEPT),
                text(NODES_QUERY),
            );
        }
    }
    page.push_str(&missed);
}

/// The least ratio that was aimed at before this was built.
fn goal(condition: &str, triangles: u64) -> Option<f64> {
    let [each, held, continuous] = CONDITIONS.map(|(name, ..)| name);
    match (condition, triangles) {
        (name, ..10_000) if name == each => Some(1.2),
        (name, 10_000..100_000) if name == each => Some(3.0),
        (name, 100_000..) if name == each => Some(10.0),
        (name, 100_000..) if name == held => Some(7.0),
        (name, 100_000..) if name == continuous => Some(60.0),
        _ => None,
    }
}

/// What is said of a ratio below its goal: its parts.
fn shortfall(records: &Records, cell: &Cell, best: &str, goal: Option<f64>) -> String {
    let metric = format!("total {best}");
    let found = records.find(cell, NODES_TRACKER, &metric);
    let Some((goal, found)) = goal.zip(found).filter(|(goal, found)| found.median < *goal) else {
        return String::new();
    };
    let mean = |method, metric| records.find(cell, method, metric).map(|r| r.mean);
    let part = |method, metric| mean(method, metric).map_or("–".to_owned(), number);
    let faster = |metric| {
        let parts = mean(best, metric).zip(mean(NODES_TRACKER, metric));
        parts.map_or("–".to_owned(), |(theirs, ours)| number(theirs / ours))
    };
    let (triangles, condition) = (cell.triangles, &cell.tool);
    format!(
        "\nNot reached for {triangles} triangles, {condition}: {} of {goal}. The tracker takes {} µs a tick, {} for frames and \
         {} for {} sphere and {} triangle tests; the {} {}, {} and {}: {} times as much for frames, and {} times for searches. Tried, and in: a check of four \
         elements at a time that starts with the last frame's most stretched one. Tried, and out: sections split by two means, \
         fewer sphere tests but dearer largest ticks (docs/decisions.md).\n",
        median(found),
        part(NODES_TRACKER, "total"),
        part(NODES_TRACKER, "update"),
        part(NODES_TRACKER, "query"),
        part(NODES_TRACKER, "node_tests"),
        part(NODES_TRACKER, "triangle_tests"),
        title(best),
        part(best, "total"),
        part(best, "update"),
        part(best, "query"),
        faster("update"),
        faster("query"),
    )
}
