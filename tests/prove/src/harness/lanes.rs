//! Two lanes of checks: most wait for one emulator, which occupies one core. Sanitizers, fuzzers, the model checker and
//! others without an emulator run in a second process, whose output is shown once both have ended.

use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};
use xtask::steps::{FAILED, Outcome, Steps};
use xtask::workspace;

use super::figures::Figures;
use super::run::Run;
use super::{Check, Effort, Measured};
use crate::checks::{BESIDE, CHECKS};
use crate::demo;

/// Files through which the two processes communicate.
const EFFORT: &str = "effort.json";
const WANTED: &str = "checks.json";
const FOUND: &str = "found.json";
const STEPS: &str = "steps.txt";
const LOG: &str = "log.txt";

/// Time that the second process may take after the first has ended.
const PATIENCE: Duration = Duration::from_mins(12);

/// The results of the second process.
#[derive(Serialize, Deserialize)]
struct Found {
    figures: Figures,
    skipped: Vec<String>,
}

/// The second process.
pub struct Beside {
    process: Child,
    folder: PathBuf,
}

impl Beside {
    pub fn start(effort: &Effort, left_out: &[&str]) -> Result<Self> {
        let folder = workspace::target().join("beside");
        // Removed, so that no file of an earlier run is mistaken for this one's.
        if folder.exists() {
            fs::remove_dir_all(&folder)?;
        }
        let wanted: Vec<&str> =
            BESIDE.into_iter().filter(|name| !left_out.contains(name)).collect();
        let mut command = command(&env::current_exe()?, &folder, effort, &wanted)?;
        let log = File::create(folder.join(LOG))?;
        command.stdout(log.try_clone()?).stderr(log);
        Ok(Self { process: command.spawn()?, folder })
    }

    /// Waits for it, and adds its figures and steps.
    pub fn join(mut self, measured: &mut Measured, steps: &mut Steps) -> Result<()> {
        let end = Instant::now() + PATIENCE;
        let status = loop {
            let status = self.process.try_wait()?;
            if status.is_some() || Instant::now() > end {
                break status;
            }
            thread::sleep(Duration::from_millis(100));
        };
        if status.is_none() {
            self.process.kill()?;
        }
        let log = fs::read(self.folder.join(LOG))?;
        print!("{}", String::from_utf8_lossy(&log));
        let status = status.context("the last check above does not end")?;
        ensure!(status.success(), "the process ended with {status}");
        steps.read(&self.folder.join(STEPS))?;
        let found: Found = read(&self.folder.join(FOUND))?;
        measured.figures.append(found.figures);
        let names = CHECKS.iter().map(|check| check.name);
        measured
            .skipped
            .extend(names.filter(|&name| found.skipped.iter().any(|skipped| skipped == name)));
        Ok(())
    }
}

/// The second process, or the process of a part of `cargo xtask evidence`: runs checks, with this program.
pub fn command(program: &Path, folder: &Path, effort: &Effort, checks: &[&str]) -> Result<Command> {
    fs::create_dir_all(folder)?;
    fs::write(folder.join(EFFORT), serde_json::to_string(effort)?)?;
    fs::write(folder.join(WANTED), serde_json::to_string(checks)?)?;
    let mut command = Command::new(program);
    command.arg("beside").arg(folder);
    Ok(command)
}

/// The outcome of the process of one check. It is an error if a figure is missing, for whatever reason.
pub fn outcome(folder: &Path, check: &Check) -> Result<Outcome> {
    let steps = fs::read_to_string(folder.join(STEPS))?;
    ensure!(!steps.starts_with(FAILED), "{steps}");
    let figures = figures(folder)?.context("no figures")?;
    let missing: Vec<&str> = check.promises.iter().map(|promise| promise.id).collect();
    let missing: Vec<&str> = missing.into_iter().filter(|id| figures.get(id).is_none()).collect();
    ensure!(missing.is_empty(), "without {}: {steps}", missing.join(", "));
    let found: Found = read(&folder.join(FOUND))?;
    Ok(if found.skipped.is_empty() { Outcome::Passed } else { Outcome::Skipped(steps) })
}

/// The figures that a process found, if the folder is of one.
pub fn figures(folder: &Path) -> Result<Option<Figures>> {
    let file = folder.join(FOUND);
    if !file.is_file() {
        return Ok(None);
    }
    Ok(Some(read::<Found>(&file)?.figures))
}

/// Does the work of the second process.
pub fn run(folder: &Path) -> Result<()> {
    let effort: Effort = read(&folder.join(EFFORT))?;
    let wanted: Vec<String> = read(&folder.join(WANTED))?;
    let mut steps = Steps::default();
    let mut measured = Measured::new(Run::now(effort.size()));
    measured.run_each(&effort, |name| wanted.iter().any(|one| one == name), &mut steps);
    if !effort.is_record {
        steps.run("demo on this computer", || demo::on_host(effort.demo_seconds));
    }
    let skipped = measured.skipped.iter().map(|&name| name.to_owned()).collect();
    let found = Found { figures: measured.figures, skipped };
    fs::write(folder.join(FOUND), serde_json::to_string(&found)?)?;
    steps.write(&folder.join(STEPS))
}

fn read<T: for<'de> Deserialize<'de>>(file: &Path) -> Result<T> {
    let text = fs::read_to_string(file).with_context(|| format!("no {}", file.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is not whole", file.display()))
}
