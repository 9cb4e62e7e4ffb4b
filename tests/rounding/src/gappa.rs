//! Gappa, which finds the proofs.

use std::fs::File;
use std::io::Write;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use xtask::apt;
use xtask::process::quiet;

use crate::goal::Goal;
use crate::tape::Tape;

/// More than the default 60 bits: some constants are met exactly.
const PRECISION: &str = "-Eprecision=120";

/// Finds Gappa, or installs it.
///
/// # Errors
/// If it can be neither found nor installed.
pub fn find() -> Result<()> {
    if quiet(Command::new("gappa").arg("--version"), Duration::from_secs(20)).is_err() {
        apt::install(&["gappa"]).context("no gappa: sudo apt-get install gappa")?;
    }
    Ok(())
}

/// What Gappa says of a script: `None` if it proves the goal, and takes no equation on trust.
///
/// # Errors
/// If Gappa cannot be run.
pub fn refusal(script: &str) -> Result<Option<String>> {
    let (is_proven, _, said) = run(script, &[PRECISION])?;
    Ok((!is_proven || !said.trim().is_empty()).then_some(said))
}

/// The proof as a text for Coq.
///
/// # Errors
/// If there is none.
pub fn certificate(script: &str) -> Result<String> {
    let (is_proven, certificate, said) = run(script, &[PRECISION, "-Bcoq"])?;
    if !is_proven || !said.trim().is_empty() {
        bail!("no proof: {said}");
    }
    Ok(certificate)
}

fn run(script: &str, arguments: &[&str]) -> Result<(bool, String, String)> {
    let mut file = tempfile::NamedTempFile::new()?;
    file.write_all(script.as_bytes())?;
    let mut gappa = Command::new("gappa");
    let output = gappa.args(arguments).stdin(Stdio::from(File::open(file.path())?)).output()?;
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    Ok((output.status.success(), text(&output.stdout), text(&output.stderr)))
}

/// The least shares of a goal's parts, by the intervals of their coefficients.
///
/// # Errors
/// If Gappa does not answer.
pub fn least(goal: &Goal, tape: &Tape) -> Result<Vec<f64>> {
    let mut shares = vec![0.0; goal.shares.len()];
    if shares.is_empty() {
        return Ok(shares);
    }
    let (script, asked) = goal.question(tape);
    let (is_answered, _, said) = run(&script, &[PRECISION])?;
    // A line is `NAME in [EXACT {DECIMAL, POWER}, EXACT {DECIMAL, POWER}]`.
    let ends = said.lines().filter(|line| line.contains(" in [")).map(|line| {
        let ends = line.split('{').skip(1).filter_map(|end| end.split(',').next()?.parse().ok());
        ends.collect::<Vec<f64>>()
    });
    let ends: Vec<Vec<f64>> = ends.collect();
    if !is_answered || ends.len() != asked.len() {
        bail!("{}: no answer: {said}", goal.name);
    }
    for ((share, is_signed), ends) in asked.into_iter().zip(ends) {
        let [low, high] = ends[..] else { bail!("{}: not understood: {said}", goal.name) };
        let least = if is_signed { high.max(-low) } else { -low };
        shares[share] = least.max(shares[share]);
    }
    Ok(shares)
}
