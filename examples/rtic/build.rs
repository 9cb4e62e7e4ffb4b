//! Builds the tree of a small heart, and passes the emulated board's memory map to the linker.

use std::path::PathBuf;
use std::{env, error, fs};

fn main() -> Result<(), Box<dyn error::Error>> {
    dibs_build::tree(dibs_build::generate::heart(500)?.mesh).emit("heart");
    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        let out = PathBuf::from(env::var("OUT_DIR")?);
        println!("cargo:rerun-if-changed=../../memory.x");
        fs::copy("../../memory.x", out.join("memory.x"))?;
        // There are no interrupt handlers except those of `main.rs`.
        fs::write(out.join("device.x"), "")?;
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rustc-link-arg=-Tlink.x");
        println!("cargo:rustc-link-arg=--nmagic");
    }
    Ok(())
}
