//! Time, machine and commit of a measurement.

use std::process::Command;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use xtask::process::quiet;
use xtask::workspace;

/// A run of this program.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Run {
    /// UTC, to the minute.
    pub date: String,
    /// With `-dirty` if anything except `docs` and the README, which a run writes itself, is uncommitted.
    pub commit: String,
    pub compiler: String,
    pub machine: String,
    pub emulator: String,
    /// `full`, `1/4` of that, or `test` for as few cases as a run of the tests uses.
    pub size: String,
}

impl Run {
    /// The run that has just begun.
    pub fn now(size: String) -> Self {
        let dirty = said("git", &["status", "--porcelain", "--", ".", ":!docs", ":!README.md"]);
        let dirty = if dirty.is_empty() { "" } else { "-dirty" };
        Self {
            date: said("date", &["-u", "+%Y-%m-%dT%H:%MZ"]),
            commit: said("git", &["rev-parse", "--short=12", "HEAD"]) + dirty,
            compiler: said("rustc", &["--version"]),
            machine: machine(),
            emulator: said("qemu-system-arm", &["--version"]).lines().next().unwrap_or("").into(),
            size,
        }
    }

    /// Whether the figures of both belong to one recording: everything except the date is equal.
    pub fn is_of_the_same(&self, other: &Self) -> bool {
        Self { date: other.date.clone(), ..self.clone() } == *other
    }

    /// Whether it is from a clean commit, with more cases than a run of the tests.
    pub fn is_whole(&self) -> bool {
        self.size != "test" && !self.commit.ends_with("-dirty") && self.commit != UNKNOWN
    }

    /// Whether it is of all cases, and from a clean commit.
    pub fn is_full(&self) -> bool {
        self.size == "full" && self.is_whole()
    }

    pub fn day(&self) -> &str {
        self.date.split('T').next().unwrap_or_default()
    }
}

/// In place of a fact that is not available.
pub const UNKNOWN: &str = "unknown";

/// The processor, its cores, and the operating system.
pub fn machine() -> String {
    let known = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = known.lines().find_map(|line| line.strip_prefix("model name")?.split_once(": "));
    let model = model.map_or(std::env::consts::ARCH, |(_, name)| name);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{model}, {cores} cores, {}", std::env::consts::OS)
}

/// Standard output of a command at the top of the repository.
pub fn said(program: &str, arguments: &[&str]) -> String {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(workspace::root());
    quiet(&mut command, Duration::from_secs(10))
        .map_or_else(|_| UNKNOWN.to_owned(), |text| text.trim().to_owned())
}
