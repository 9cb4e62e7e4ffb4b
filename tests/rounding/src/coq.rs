//! Coq, which checks the proofs that Gappa finds, and the equations that Gappa is given.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use xtask::apt;
use xtask::process::quiet;

/// The theorems about a rounding that the goals assume.
const MODEL: &str = include_str!("model.v");

/// How a certificate begins.
const LIBRARY: &str = "Require Import Gappa.Gappa_library.\n";

/// Proves an equation: numbers become fractions, the rest is algebra.
const TACTIC: &str = "Require Import Reals Flocq.Core.Core.
Ltac equation :=
  intros;
  unfold Float1, float2R, float10R, Defs.F2R in *;
  simpl Defs.Fnum in *; simpl Defs.Fexp in *; simpl Fnum in *; simpl Fexp in *;
  simpl Fnum10 in *; simpl Fexp10 in *; simpl bpow in *;
  repeat match goal with
  | |- context [Z.pow_pos ?b ?p] =>
      let v := eval vm_compute in (Z.pow_pos b p) in change (Z.pow_pos b p) with v
  end;
  field; assumption.
";

/// The last lemma of a certificate: that the preconditions exclude the contrary.
const LAST: &str = "l1";

/// Names of the axioms of Coq's real numbers begin so.
const AXIOMS: [&str; 3] = [
    "ClassicalDedekindReals.sig_",
    "FunctionalExtensionality.functional_",
    "Classical_Prop.classic",
];

/// A proof takes at most a quarter of a minute on an idle core.
const LIMIT: Duration = Duration::from_secs(250);

/// Finds Coq with Gappa's and Flocq's theorems, or installs them.
///
/// # Errors
/// If they can be neither found nor installed.
pub fn find() -> Result<()> {
    if compile("found", LIBRARY).is_err() {
        let packages = ["coq", "libcoq-flocq", "libcoq-gappa"];
        apt::install(&packages).context("no coq: sudo apt-get install coq libcoq-gappa")?;
    }
    Ok(())
}

/// Checks the theorems about a rounding.
///
/// # Errors
/// If one does not hold.
pub fn check_model() -> Result<()> {
    assumes_only_reals("model", &compile("model", MODEL)?)
}

/// Checks a proof.
///
/// # Errors
/// If it is none, or admits something.
pub fn check(name: &str, proof: &str) -> Result<()> {
    assumes_only_reals(name, &compile(name, proof)?)
}

/// A certificate with a proof of each equation, which Gappa admits.
///
/// # Errors
/// If it is not written as expected.
pub fn proven(certificate: &str) -> Result<String> {
    let Some(rest) = certificate.strip_prefix(LIBRARY) else { bail!("an unknown certificate") };
    let mut proof = [LIBRARY, TACTIC].concat();
    for line in rest.lines() {
        proof += &match line.strip_prefix("Hypothesis ") {
            Some(equation) => format!("Lemma {equation}\nProof.\n equation.\nQed.\n"),
            None => format!("{line}\n"),
        };
    }
    proof += &format!("Print Assumptions {LAST}.\n");
    Ok(proof)
}

/// Reads what `Print Assumptions` says: an axiom begins a line, its text is indented.
fn assumes_only_reals(name: &str, said: &str) -> Result<()> {
    ensure!(said.starts_with("Axioms:"), "{name}: no assumptions printed");
    for line in said.lines().filter(|line| !line.starts_with(' ') && *line != "Axioms:") {
        ensure!(AXIOMS.iter().any(|axiom| line.starts_with(axiom)), "{name}: assumes {line}");
    }
    Ok(())
}

fn compile(name: &str, text: &str) -> Result<String> {
    let folder = tempfile::tempdir()?;
    let file = Path::new(name).with_extension("v");
    fs::write(folder.path().join(&file), text)?;
    quiet(Command::new("coqc").arg("-q").arg(&file).current_dir(&folder), LIMIT)
}
