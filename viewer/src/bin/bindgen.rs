//! Writes the page's half of the session's interface: `bindgen IN.wasm FOLDER`.
//!
//! wasm-bindgen's own generator as a library, of the version that `Cargo.lock` pins: nothing has to be installed.

use std::path::PathBuf;

use anyhow::{Context, Result};
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<()> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let mut next = || arguments.next().context("usage: bindgen IN.wasm FOLDER");
    let (input, folder) = (next()?, next()?);
    let mut bindgen = Bindgen::new();
    bindgen.input_path(&input).out_name("session").web(true)?.typescript(false);
    bindgen.omit_default_module_path(true).remove_name_section(true);
    bindgen.remove_producers_section(true).generate(&folder)
}
