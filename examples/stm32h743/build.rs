//! Passes the linker the memory map, and the script that places the controller's parts in it.

use std::error::Error;
use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    for script in ["memory.x", "places.x"] {
        println!("cargo:rerun-if-changed={script}");
        fs::copy(script, out.join(script))?;
    }
    println!("cargo:rustc-link-search={}", out.display());
    // Before link.x, whose patterns would match all sections.
    println!("cargo:rustc-link-arg-bin=stm32h743=-Tplaces.x");
    println!("cargo:rustc-link-arg-bins=--nmagic");
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    Ok(())
}
