//! `cargo xtask rounding`: proves every goal by Gappa, checks every proof by Coq, and prints what is proven of which
//! constant.

use std::fs;
use std::time::Instant;

use anyhow::{Context, Error, Result, ensure};
use rayon::prelude::*;
use xtask::workspace;

use crate::kernels::{Stated, goals};
use crate::{coq, gappa, planted, provable};

/// Proves, checks and prints; the scripts and proofs are left in the target folder.
///
/// # Errors
/// If a goal is not proven, a proof is not accepted, or a wrong constant is.
pub fn report() -> Result<()> {
    let start = Instant::now();
    gappa::find()?;
    coq::find()?;
    let folder = workspace::target().join("rounding");
    fs::create_dir_all(&folder)?;
    coq::check_model()?;
    println!("the model of a rounding: checked by Coq");
    let goals = goals(&Stated::shipped());
    goals.par_iter().try_for_each(|(goal, tape)| {
        let (name, script) = (&goal.name, goal.script(tape));
        let file = folder.join(name);
        fs::write(file.with_extension("g"), &script)?;
        let proof = gappa::certificate(&script).and_then(|found| coq::proven(&found));
        let proof = proof.with_context(|| name.clone())?;
        fs::write(file.with_extension("v"), &proof)?;
        let start = Instant::now();
        coq::check(name, &proof)?;
        let seconds = start.elapsed().as_secs_f64();
        println!("{name}: proven by Gappa, checked by Coq in {seconds:.1} s");
        Ok::<(), Error>(())
    })?;
    let wrong = planted()?;
    ensure!(wrong.iter().all(|&(_, is_refused)| is_refused), "wrong, but proven: {wrong:?}");
    println!("{} wrong constants: refused", wrong.len());
    println!("\nconstant, stated and proven in units of u");
    for (constant, stated, proven) in provable(&goals)? {
        println!("{constant}: {stated}, {proven:.2}");
    }
    println!(
        "\n{} goals, in {}, in {} s",
        goals.len(),
        folder.display(),
        start.elapsed().as_secs()
    );
    Ok(())
}
