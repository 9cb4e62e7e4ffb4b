//! Steps that run in order, even after a failure, and are listed at the end.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::process::run;
use crate::workspace;

/// Most lines of an error in the list. One line is not enough: a list of broken promises starts with a heading.
const REASON_LINES: usize = 4;

const PASSED: &str = "passed";
/// How the line of a step that failed begins.
pub const FAILED: &str = "FAILED";

/// The result of a step.
pub enum Outcome {
    /// It succeeded.
    Passed,
    /// It could not run here, for this reason.
    Skipped(String),
}

/// The steps so far.
#[derive(Default)]
pub struct Steps {
    lines: Vec<String>,
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
            Ok(Outcome::Passed) => format!("{PASSED}   {seconds:4} s  {name}"),
            Ok(Outcome::Skipped(reason)) => format!("skipped  {seconds:4} s  {name}: {reason}"),
            Err(error) => {
                eprintln!("error: {error:#}");
                let reason = format!("{error:#}");
                let lines: Vec<_> = reason.lines().map(str::trim).take(REASON_LINES).collect();
                format!("{FAILED}   {seconds:4} s  {name}: {}", lines.join(" "))
            }
        };
        self.lines.push(line);
    }

    /// Writes the steps to a file, for the parent process.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, file: &Path) -> Result<()> {
        fs::write(file, self.lines.join("\n"))
            .with_context(|| format!("cannot write {}", file.display()))
    }

    /// Adds another thread's steps.
    pub fn append(&mut self, mut other: Self) {
        self.lines.append(&mut other.lines);
    }

    /// Adds the steps in another program's file.
    ///
    /// # Errors
    /// If there is no such file.
    pub fn read(&mut self, file: &Path) -> Result<()> {
        let list = fs::read_to_string(file)
            .with_context(|| format!("no list of steps in {}", file.display()))?;
        self.lines.extend(list.lines().map(str::to_owned));
        Ok(())
    }

    /// Lists the steps; exits if one failed.
    pub fn finish(self) {
        let count = |word| self.lines.iter().filter(|line| line.starts_with(word)).count();
        println!("\n{}", self.lines.join("\n"));
        println!("{} passed, {} failed", count(PASSED), count(FAILED));
        // The list names the failures, so it must be the last output.
        if count(FAILED) > 0 {
            std::process::exit(1);
        }
    }
}
