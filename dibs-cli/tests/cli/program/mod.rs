//! Runs the program.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// What the program says to a line of arguments.
pub fn dibs(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dibs"))
        .current_dir(folder)
        .args(line.split_whitespace())
        .output()
        .unwrap()
}

pub fn succeeds(folder: &Path, line: &str) -> String {
    let output = dibs(folder, line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

pub fn json(folder: &Path, line: &str) -> Value {
    serde_json::from_str(&succeeds(folder, line)).unwrap()
}

/// Exit code 1, nothing on standard output, and one line on standard error.
pub fn fails(folder: &Path, line: &str) -> String {
    let output = dibs(folder, line);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{line}: {error}");
    assert!(output.stdout.is_empty(), "{line}");
    assert_eq!(error.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{error}");
    error.lines().last().unwrap().trim_start_matches("error: ").to_owned()
}
