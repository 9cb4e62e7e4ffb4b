//! Building and running programs in C.

use std::env;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use xtask::process::quiet;
use xtask::{apt, workspace};

/// Longest that a program may take.
pub const LIMIT: Duration = Duration::from_secs(300);

/// The host's static library, built in the profile of this test.
pub fn library() -> PathBuf {
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo.args(["rustc", "--quiet", "--package", "dibs-c", "--lib", "--profile", profile]);
    cargo.args(["--crate-type", "staticlib"]).current_dir(workspace::root());
    quiet(&mut cargo, LIMIT).expect("the static library");
    let folder = if cfg!(debug_assertions) { "debug" } else { "release" };
    workspace::target().join(folder).join("libdibs_c.a")
}

/// A tool by name, installed where it is missing.
pub fn tool(name: &str, package: &str) -> Command {
    let version = quiet(Command::new(name).arg("--version"), Duration::from_secs(20));
    if version.is_err() {
        apt::install(&[package]).unwrap_or_else(|error| panic!("no {name}: {error:#}"));
    }
    Command::new(name)
}
