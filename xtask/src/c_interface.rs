//! The C interface's static library for the board.

// Requirements: P-01, P-06

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::process::run;
use crate::steps::Outcome;
use crate::toolchain::{self, Cross};
use crate::workspace;

/// Builds the library with features of `dibs-c`.
pub fn build(cross: &Cross, features: &str) -> Result<PathBuf> {
    let mut cargo = cross.cargo("rustc");
    cargo.args(["--quiet", "--package", "dibs-c", "--lib", "--crate-type", "staticlib"]);
    cargo.args(["--profile", "firmware", "--features", features]);
    run(&mut cargo).context("the C interface does not build for the board")?;
    Ok(cross.program("firmware", "libdibs_c.a"))
}

/// Links every function of the header. A panic path that the compiler did not remove calls a symbol that does not
/// exist, so the link fails. With a planted panic path it must fail: otherwise the check proves nothing.
pub fn has_no_panic_path(cross: &Cross) -> Result<Outcome> {
    let header = fs::read_to_string(workspace::root().join("bindings/c/include/dibs.h"))?;
    let functions = functions(&header);
    ensure!(functions.len() > 20, "the header has no functions");

    let planted = [&functions[..], &["dibs_planted_panic"]].concat();
    let said = link(&build(cross, "planted-panic")?, &planted)?.unwrap_or_default();
    let is_noticed = said.contains("dibs_a_panic_path_survived");
    ensure!(is_noticed, "a planted panic path did not break the link:\n{said}");

    let said = link(&build(cross, "")?, &functions)?;
    ensure!(said.is_none(), "the C interface has a panic path:\n{}", said.unwrap_or_default());
    println!("{} functions, and no panic path", functions.len());
    Ok(Outcome::Passed)
}

/// The functions that a header declares for the board; the sender is for a host computer only.
fn functions(header: &str) -> Vec<&str> {
    let declarations = header.lines().filter(|line| !line.starts_with([' ', '#', '/']));
    let names = declarations.filter_map(|line| {
        let (before, _) = line.split_once('(')?;
        let name = before.rsplit([' ', '*']).next()?;
        (name.starts_with("dibs_") && !name.starts_with("dibs_sender_")).then_some(name)
    });
    names.collect()
}

/// Links functions of a library. Returns the linker's errors, or `None` on success.
fn link(library: &PathBuf, functions: &[&str]) -> Result<Option<String>> {
    let mut linker = Command::new(toolchain::linker()?);
    linker.args(["-flavor", "gnu", "--gc-sections", "--entry", "0"]);
    // `--undefined` makes it an error if the library lacks a function.
    linker.args(functions.iter().map(|function| format!("--undefined={function}")));
    linker.args(functions.iter().map(|function| format!("--defsym=has_{function}={function}")));
    linker.arg(library).arg("-o").arg(workspace::target().join("dibs-c-linked"));
    let output = linker.output().context("cannot start the linker")?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    Ok((!output.status.success()).then_some(said))
}
