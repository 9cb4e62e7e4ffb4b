//! The path bound: proven constants of plain queries, compared with counted and traced ones.

// Requirement: A-06

use anyhow::Result;
use xtask::steps::Outcome;

use crate::bound::report::{Row, findings, write};
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, TIMING},
    note,
};
use crate::harness::run::Run;
use crate::harness::{Check, Effort};
use crate::probe::{board, build_for_board};

/// The promises, with the constants of surfaces that move, each kind by its id, its words and its limits.
macro_rules! promises {
    ($($kind:literal, $surface:literal, $limits:literal;)*) => {
        &[
            note("bound.queries"),
            note("bound.traced"),
            note("bound.planted"),
            Promise {
                id: "bound.above",
                says: "Queries above the path bound, which is proven from the linked program",
                criterion: TIMING,
                bound: Bound::Is(0.0),
                unit: "of {bound.queries} queries and ticks on the emulated Cortex-M7, whole and cut short",
                limits: "Of this linked program. The proof trusts the flow facts of `facts.rs`, `sided.rs`, `tracked.rs` and `depth.rs`. Unsigned queries of a \
                         table of vertices, of a surface between two frames, and of one that nodes or eight modes move; queries with \
                         side of a table of vertices, of a sphere, and of a capsule outside; a tracker's ticks, without a side and with side and depth, of a capsule on a surface \
                         between two frames; instructions, not cycles.",
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
                unit: "of {bound.planted} not found",
                limits: "",
            },
            Promise {
                id: "bound.core.unlisted",
                says: "Functions of the language's `core` in a tick of which it is not known whether the certified subset has them",
                criterion: FLOW,
                bound: Bound::Is(0.0),
                unit: "of {bound.core.items}; {bound.core.outside} are known to be outside of it",
                limits: "A tick with side and depth. The subset is Ferrocene's for Rust 1.95, by `core_subset.txt`; nothing here claims \
                         certification.",
            },
            note("bound.core.items"),
            note("bound.core.outside"),
            Promise {
                id: "bound.sphere.ratio",
                says: "The proven constants beside the typical ones of `Cost`, sphere",
                criterion: TIMING,
                bound: Bound::AtMost(1.85),
                unit: concat!("times at the most: ", constants!("sphere"), " with a further roots"),
                limits: "The node test is the largest: a leaf that two planes scan to the last vertex in vain.",
            },
            Promise {
                id: "bound.capsule.ratio",
                says: "The same, capsule",
                criterion: TIMING,
                bound: Bound::AtMost(1.6),
                unit: concat!("times at the most: ", constants!("capsule")),
                limits: "",
            },
            $(
                Promise {
                    id: concat!("bound.", $kind, "-capsule.node-test"),
                    says: concat!("The proven node test of a capsule on ", $surface),
                    criterion: TIMING,
                    bound: Bound::Informs,
                    unit: concat!(
                        "instructions, after {bound.", $kind, "-capsule.base} and {bound.", $kind, "-capsule.root} a, with \
                         {bound.", $kind, "-capsule.triangle-test} a triangle test; sphere ",
                        constants!($kind, "-sphere"),
                    ),
                    limits: $limits,
                },
                note(concat!("bound.", $kind, "-capsule.base")),
                note(concat!("bound.", $kind, "-capsule.root")),
                note(concat!("bound.", $kind, "-capsule.triangle-test")),
                note(concat!("bound.", $kind, "-sphere.base")),
                note(concat!("bound.", $kind, "-sphere.root")),
                note(concat!("bound.", $kind, "-sphere.node-test")),
                note(concat!("bound.", $kind, "-sphere.triangle-test")),
            )*
            Promise {
                id: "bound.tick.node-test",
                says: "The proven node test of a tracker's tick, unsigned, within its budget: a capsule on a surface between two frames",
                criterion: TIMING,
                bound: Bound::Informs,
                unit: "instructions, after {bound.tick.base} and {bound.tick.root} a, with {bound.tick.triangle-test} a triangle test",
                limits: "Of a tracker of 512 opened nodes that was never asked for a side.",
            },
            note("bound.tick.base"),
            note("bound.tick.root"),
            note("bound.tick.triangle-test"),
            Promise {
                id: "bound.tick-depth.node-test",
                says: "The same with side and depth, of a closed surface",
                criterion: TIMING,
                bound: Bound::Informs,
                unit: "instructions, after {bound.tick-depth.base}, with {bound.tick-depth.triangle-test} a triangle test",
                limits: "Of one root, without flat triangles, with at most 16 around a vertex; the axis anywhere.",
            },
            note("bound.tick-depth.base"),
            note("bound.tick-depth.root"),
            note("bound.tick-depth.triangle-test"),
            note("bound.sphere.base"),
            note("bound.sphere.root"),
            note("bound.sphere.node-test"),
            note("bound.sphere.triangle-test"),
            note("bound.capsule.base"),
            note("bound.capsule.root"),
            note("bound.capsule.node-test"),
            note("bound.capsule.triangle-test"),
        ]
    };
}

/// A kind's constants as a sum: for further roots, node tests and triangle tests.
macro_rules! constants {
    ($($kind:literal),*) => {
        concat!(
            "{bound.", $($kind,)* ".base} + {bound.", $($kind,)* ".root} a + {bound.", $($kind,)* ".node-test} n + {bound.",
            $($kind,)* ".triangle-test} t",
        )
    };
}

pub const CHECK: Check = Check {
    name: "path bound",
    run: check,
    promises: promises! {
        "moving", "a surface between two frames", "";
        "embedded", "a surface that nodes carry",
        "Counted and traced in a tree of one root alone: no query has tried the part of a further root.";
        "modal", "a surface that eight modes move", "Each test of a plane may blend ten vertices.";
        "sided", "a closed surface with side, the axis outside",
        "Of one root, without flat triangles, with at most 16 around a vertex. Work in f64 counts as node tests, and takes most.";
    },
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let [probe, tracker] = ["probe", "bound"].map(|name| build_for_board(&board()?, name));
    let found = findings([&probe?, &tracker?], effort.bounds, effort.bound_traces)?;
    if effort.is_record {
        write(&found, &Run::now(effort.size()))?;
    }
    let sum = |of: fn(&Row) -> usize| found.rows.iter().map(of).sum::<usize>() as f64;
    figures.note("bound.queries", sum(|row| row.counted.queries));
    figures.note("bound.above", sum(|row| row.counted.above));
    figures.note("bound.traced", sum(|row| row.traced.queries));
    figures.note("bound.broken", sum(|row| row.traced.broken.len()));
    figures.note("bound.planted", found.planted as f64);
    figures.note("bound.unnoticed", found.unnoticed as f64);
    let count = |is_certified| {
        found.core.iter().filter(|item| item.is_certified == is_certified).count() as f64
    };
    for item in found.core.iter().filter(|item| item.is_certified.is_none()) {
        println!("core_subset.txt lacks {} {}", item.file, item.name);
    }
    figures.note("bound.core.items", found.core.len() as f64);
    figures.note("bound.core.unlisted", count(None));
    figures.note("bound.core.outside", count(Some(false)));
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
