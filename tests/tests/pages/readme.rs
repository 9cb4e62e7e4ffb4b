//! Checks that the README's figures are those of the records. `DIBS_WRITE=1` writes them again.

// Requirements: E-02, P-11

use std::{env, fs};

use serde_json::Value;

use crate::page::{records, thousands};

const README: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../README.md");
const BEGIN: &str =
    "<!-- figures: written by `DIBS_WRITE=1 cargo test -p dibs-tests --test pages readme` -->\n";
const END: &str = "<!-- end of figures -->\n";

#[test]
fn the_figures_are_those_of_the_records() {
    let readme = fs::read_to_string(README).expect("the README");
    let (before, rest) = readme.split_once(BEGIN).expect("the marker before the figures");
    let (block, after) = rest.split_once(END).expect("the marker after the figures");
    let expected = figures();
    if env::var_os("DIBS_WRITE").is_some() {
        fs::write(README, format!("{before}{BEGIN}{expected}{END}{after}")).expect("writable");
    } else {
        assert_eq!(block, expected, "write the figures anew: DIBS_WRITE=1");
    }
}

/// Methods and metrics of the columns.
const COLUMNS: [(&str, &str); 6] = [
    ("dibs", "total"),
    ("dibs-measured", "total_with_measuring"),
    ("aabb-hybrid", "total"),
    ("aabb-refit", "total"),
    ("obvhs", "total"),
    ("parry-bvh", "total"),
];

fn figures() -> String {
    let benchmarks = records("benchmarks.json");
    let mut block = "
| mean µs a query, refitting included | dibs | dibs, every triangle's stretch measured before each query | hybrid AABB | refitted AABB | obvhs | parry3d |
|---|---|---|---|---|---|---|
"
    .to_owned();
    for (experiment, mesh, triangles, tool) in [
        ("heart", "human heart", 10_272, "capsule"),
        ("brain", "human brain", 5_000, "sphere"),
        ("brain", "human brain", 50_000, "sphere"),
        ("brain", "human brain", 500_000, "sphere"),
    ] {
        let cells = COLUMNS.map(|(method, metric)| {
            let is_row = |row: &&Value| {
                row["experiment"] == experiment
                    && row["mesh"] == mesh
                    && row["triangles"] == triangles
                    && row["tool"] == tool
                    && row["method"] == method
                    && row["metric"] == metric
            };
            let row = benchmarks.iter().find(is_row);
            let row = row.unwrap_or_else(|| panic!("{mesh} {triangles} {method} {metric}"));
            short(row["mean"].as_f64().expect("a number"))
        });
        let triangles = thousands(triangles);
        block += &format!("| {mesh}, {triangles} triangles, {tool} | {} |\n", cells.join(" | "));
    }
    let guarantees = records("guarantees.json");
    let figure = |id: &str| {
        let row = guarantees.iter().find(|row| row["id"] == id);
        let figure = &row.unwrap_or_else(|| panic!("{id}"))["figure"];
        let figure = figure.as_f64().or_else(|| figure.as_str()?.parse().ok());
        thousands(figure.expect("a number").round() as u32)
    };
    block += &format!(
        "
One measurement of the stretch serves every query until the next frame.
On an emulated Cortex-M7, generated heart of 10,272 triangles, warm start: **{} instructions** a query on average,
{} at most, in {} ticks. From [docs/evidence/benchmarks.md](docs/evidence/benchmarks.md), which also says where
refitted trees win, and [docs/evidence/guarantees.md](docs/evidence/guarantees.md).
",
        figure("m7.warm.mean"),
        figure("m7.warm.largest"),
        figure("m7.warm.queries"),
    );
    block
}

/// One decimal below 10, otherwise none.
fn short(value: f64) -> String {
    match value {
        _ if value < 10.0 => format!("{value:.1}"),
        _ => thousands(value.round() as u32),
    }
}
