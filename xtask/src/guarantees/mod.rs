//! `cargo xtask guarantees`: every promise measured, and docs/guarantees.* written from it.

mod bits;
mod cost;
mod figures;
mod modes;
mod probe;
mod script;

use anyhow::Result;

use crate::toolchain::Cross;
use figures::Figures;

/// Measures every promise, and writes docs/guarantees.json and docs/guarantees.md.
#[derive(clap::Args)]
pub struct Options {
    /// Fits the constants of the cost model anew before they are checked.
    #[arg(long)]
    fit: bool,
    /// Queries of the cost model's check and the comparison of bits.
    #[arg(long, default_value_t = 100_000)]
    queries: usize,
}

pub fn run(options: &Options) -> Result<()> {
    let cross = Cross::find()?;
    let mut figures = Figures::default();
    if options.fit {
        return cost::fit(&cross, 4_000);
    }
    bits::check(&cross, options.queries, &mut figures)?;
    cost::check(&cross, options.queries, &mut figures)?;
    modes::check(&cross, &mut figures)?;
    Ok(())
}
