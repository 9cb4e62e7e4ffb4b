//! The path bound: proven constants of plain queries, against counted and traced ones.

use anyhow::Result;
use xtask::steps::Outcome;

use crate::bound::report::{Row, findings};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, TIMING},
    note,
};
use crate::harness::{Check, Effort};
use crate::probe::{board, build_for_board};

pub const CHECK: Check = Check {
    name: "path bound",
    run: check,
    promises: &[
        note("bound.queries"),
        note("bound.traced"),
        Promise {
            id: "bound.above",
            says: "Queries above the path bound, which is proven from the linked program",
            criterion: TIMING,
            bound: Bound::Is(0.0),
            unit: "of {bound.queries} plain queries on the emulated Cortex-M7, whole and cut short",
            limits: "Of this linked program. The proof trusts the flow facts of `facts.rs`. Unsigned queries of a table of \
                     vertices, of a surface between two frames, and of one that nodes or eight modes move; instructions, not \
                     cycles.",
        },
        Promise {
            id: "bound.broken",
            says: "Flow facts that a traced query breaks, or paths that are not in the graph",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "in {bound.traced} queries, followed instruction by instruction",
            limits: "",
        },
        Promise {
            id: "bound.unnoticed",
            says: "A wrong flow fact and a path that the graph lacks, put in on purpose, are found",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of two not found",
            limits: "",
        },
        Promise {
            id: "bound.sphere.ratio",
            says: "The proven constants beside the typical ones of `Cost`, sphere",
            criterion: TIMING,
            bound: Bound::AtMost(1.85),
            unit: "times at the most: {bound.sphere.base} + {bound.sphere.root} a + {bound.sphere.node-test} n + \
         {bound.sphere.triangle-test} t with a further roots",
            limits: "The node test is the largest: a leaf that two planes scan to the last vertex in vain.",
        },
        Promise {
            id: "bound.capsule.ratio",
            says: "The same, capsule",
            criterion: TIMING,
            bound: Bound::AtMost(1.6),
            unit: "times at the most: {bound.capsule.base} + {bound.capsule.root} a + {bound.capsule.node-test} n + \
         {bound.capsule.triangle-test} t",
            limits: "",
        },
        Promise {
            id: "bound.moving-capsule.node-test",
            says: "The proven node test of a capsule on a surface between two frames",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "instructions, after {bound.moving-capsule.base} and {bound.moving-capsule.root} a, with \
         {bound.moving-capsule.triangle-test} a triangle test; sphere {bound.moving-sphere.base} + {bound.moving-sphere.root} a \
         + {bound.moving-sphere.node-test} n + {bound.moving-sphere.triangle-test} t",
            limits: "",
        },
        note("bound.moving-capsule.base"),
        note("bound.moving-capsule.root"),
        note("bound.moving-capsule.triangle-test"),
        note("bound.moving-sphere.base"),
        note("bound.moving-sphere.root"),
        note("bound.moving-sphere.node-test"),
        note("bound.moving-sphere.triangle-test"),
        Promise {
            id: "bound.embedded-capsule.node-test",
            says: "The proven node test of a capsule on a surface that nodes carry",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "instructions, after {bound.embedded-capsule.base} and {bound.embedded-capsule.root} a, with \
         {bound.embedded-capsule.triangle-test} a triangle test; sphere {bound.embedded-sphere.base} + {bound.embedded-sphere.root} a \
         + {bound.embedded-sphere.node-test} n + {bound.embedded-sphere.triangle-test} t",
            limits: "Counted and traced in a tree of one root alone: no query has tried the part of a further root.",
        },
        note("bound.embedded-capsule.base"),
        note("bound.embedded-capsule.root"),
        note("bound.embedded-capsule.triangle-test"),
        note("bound.embedded-sphere.base"),
        note("bound.embedded-sphere.root"),
        note("bound.embedded-sphere.node-test"),
        note("bound.embedded-sphere.triangle-test"),
        Promise {
            id: "bound.modal-capsule.node-test",
            says: "The proven node test of a capsule on a surface that eight modes move",
            criterion: TIMING,
            bound: Bound::Informs,
            unit: "instructions, after {bound.modal-capsule.base} and {bound.modal-capsule.root} a, with \
         {bound.modal-capsule.triangle-test} a triangle test; sphere {bound.modal-sphere.base} + {bound.modal-sphere.root} a \
         + {bound.modal-sphere.node-test} n + {bound.modal-sphere.triangle-test} t",
            limits: "Each test of a plane may blend ten vertices.",
        },
        note("bound.modal-capsule.base"),
        note("bound.modal-capsule.root"),
        note("bound.modal-capsule.triangle-test"),
        note("bound.modal-sphere.base"),
        note("bound.modal-sphere.root"),
        note("bound.modal-sphere.node-test"),
        note("bound.modal-sphere.triangle-test"),
        note("bound.sphere.base"),
        note("bound.sphere.root"),
        note("bound.sphere.node-test"),
        note("bound.sphere.triangle-test"),
        note("bound.capsule.base"),
        note("bound.capsule.root"),
        note("bound.capsule.node-test"),
        note("bound.capsule.triangle-test"),
    ],
};

/// Of counted queries, one in so many is traced.
const TRACED: usize = 50;

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let probe = build_for_board(&board()?, "probe")?;
    let queries = effort.costs;
    let found = findings(&probe, queries, (queries / TRACED).min(2_000))?;
    let sum = |of: fn(&Row) -> usize| found.rows.iter().map(of).sum::<usize>() as f64;
    figures.note("bound.queries", sum(|row| row.counted.queries));
    figures.note("bound.above", sum(|row| row.counted.above));
    figures.note("bound.traced", sum(|row| row.traced.queries));
    figures.note("bound.broken", sum(|row| row.traced.broken.len()));
    figures.note("bound.unnoticed", found.unnoticed as f64);
    for Row { proven, .. } in &found.rows {
        let id = proven.kind.id;
        if let Some(ratios) = proven.ratios() {
            let ratio = ratios.into_iter().fold(0.0, f64::max);
            figures.note(&format!("bound.{id}.ratio"), (ratio * 100.0).ceil() / 100.0);
        }
        let names = ["base", "root", "node-test", "triangle-test"];
        for (constant, value) in names.into_iter().zip(proven.whole()) {
            figures.note(&format!("bound.{id}.{constant}"), f64::from(value));
        }
    }
    Ok(Outcome::Passed)
}
