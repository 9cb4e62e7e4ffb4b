//! Instructions of the hot functions on this computer, by callgrind.

// Requirement: E-01

use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use xtask::process::shown;
use xtask::steps::Outcome;
use xtask::{valgrind, workspace};

use crate::harness::figures::Figures;
use crate::harness::promise::golden;
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "instructions on this computer",
    run: check,
    promises: &[
        golden("host.sphere_closest.whole"),
        golden("host.sphere_closest.few"),
        golden("host.capsule_closest.whole"),
        golden("host.capsule_closest.warm"),
        golden("host.capsule_closest.few"),
        golden("host.sphere_closest_batched.whole"),
        golden("host.capsule_closest_batched.whole"),
        golden("host.sphere_triangle.ordinary"),
        golden("host.sphere_triangle.sliver"),
        golden("host.capsule_triangle.ordinary"),
        golden("host.capsule_triangle.sliver"),
        golden("host.stretch_of_a_thousand_triangles.heart"),
        golden("host.accept_forty_vertices.float"),
        golden("host.accept_forty_vertices.quantised"),
        golden("host.quantised_positions.hundred"),
        golden("host.force.wall"),
        golden("host.scrub.kilobyte"),
    ],
};

/// Counts the instructions of every function in `tests/callgrind/instructions.rs`.
fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    valgrind::install_runner()?;
    let mut cargo = Command::new("cargo");
    // All packages, so that cargo reuses the build of the tests.
    cargo.args(["bench", "--quiet", "--bench", "instructions"]);
    cargo.args(["--", "--output-format=json"]).current_dir(workspace::root());
    let output = cargo.stderr(Stdio::inherit()).output()?;
    ensure!(output.status.success(), "`{}` failed", shown(&cargo));
    let text = String::from_utf8(output.stdout)?;
    for line in text.lines().filter(|line| line.starts_with('{')) {
        let bench: Value = serde_json::from_str(line)?;
        let name = [&bench["function_name"], &bench["id"]].map(|v| v.as_str().unwrap_or_default());
        let count = &bench["profiles"][0]["data"]["total"]["metrics"]["Ir"]["values"]["new"];
        let count = count.as_f64().with_context(|| format!("no instructions in {line}"))?;
        figures.note(&format!("host.{}.{}", name[0], name[1]), count);
    }
    Ok(Outcome::Passed)
}
