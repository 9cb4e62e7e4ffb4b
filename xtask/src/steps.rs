//! Steps that are run one after the other, whatever fails, and listed at the end.

use std::process::Command;
use std::time::Instant;

use anyhow::Result;

use crate::process::run;
use crate::workspace;

/// Lines of an error that the list repeats: a list of broken promises starts with a heading.
const REASON_LINES: usize = 4;

/// What a step came to.
pub enum Outcome {
    Passed,
    /// It could not run here; the reason.
    Skipped(String),
}

/// The steps so far.
#[derive(Default)]
pub struct Steps {
    lines: Vec<String>,
    passed: usize,
    failed: usize,
}

impl Steps {
    /// Runs cargo.
    pub fn cargo(&mut self, name: &str, arguments: &[&str], variables: &[(&str, &str)]) {
        self.run(name, || {
            let mut command = Command::new("cargo");
            command.args(arguments).envs(variables.iter().copied()).current_dir(workspace::root());
            run(&mut command).map(|()| Outcome::Passed)
        });
    }

    /// Runs a step.
    pub fn run(&mut self, name: &str, step: impl FnOnce() -> Result<Outcome>) {
        println!("\n=== {name}");
        let start = Instant::now();
        let result = step();
        let seconds = start.elapsed().as_secs();
        let line = match result {
            Ok(Outcome::Passed) => {
                self.passed += 1;
                format!("passed   {seconds:4} s  {name}")
            }
            Ok(Outcome::Skipped(reason)) => format!("skipped  {seconds:4} s  {name}: {reason}"),
            Err(error) => {
                self.failed += 1;
                eprintln!("error: {error:#}");
                let reason = format!("{error:#}");
                let lines: Vec<_> = reason.lines().map(str::trim).take(REASON_LINES).collect();
                format!("FAILED   {seconds:4} s  {name}: {}", lines.join(" "))
            }
        };
        self.lines.push(line);
    }

    /// Lists the steps; ends the program where one failed.
    pub fn finish(self) {
        println!("\n{}", self.lines.join("\n"));
        println!("{} passed, {} failed", self.passed, self.failed);
        // The list above says what; a message of its own would no longer be its last line.
        if self.failed > 0 {
            std::process::exit(1);
        }
    }
}
