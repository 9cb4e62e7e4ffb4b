//! Builds the surface's tree, and passes the board's memory map to the linker.

use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result};
use dibs_build::generate;

fn main() -> Result<()> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    surface()?;
    // A board that takes only the library has a memory map of its own.
    let has_program = ["CARGO_FEATURE_BOARD", "CARGO_FEATURE_CYCLES"].map(env::var_os);
    if env::var("CARGO_CFG_TARGET_OS")? == "none" && has_program.iter().any(Option::is_some) {
        link(&out)?;
    }
    Ok(())
}

/// The tree in flash: of the generated heart, or of the mesh file in `DIBS_MESH`; for a stretch of 1.5, that in
/// `DIBS_STRETCH`, or the limits of the file in `DIBS_LIMITS`.
fn surface() -> Result<()> {
    for variable in ["DIBS_MESH", "DIBS_STRETCH", "DIBS_LIMITS"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    let tree = match env::var_os("DIBS_MESH") {
        Some(path) => dibs_build::tree(&path),
        None => dibs_build::tree(generate::heart(10_272)?.mesh),
    };
    let tree = match (env::var_os("DIBS_LIMITS"), env::var("DIBS_STRETCH")) {
        (Some(file), _) => tree.limits(file),
        (None, Ok(text)) => {
            tree.stretch(text.parse().with_context(|| format!("DIBS_STRETCH=`{text}`"))?)
        }
        (None, Err(_)) => tree.stretch(1.5),
    };
    tree.emit("surface");
    Ok(())
}

/// The linker scripts of the binaries `board` and `cycles`: `memory.x` at the top of the repository is the board.
fn link(out: &Path) -> Result<()> {
    println!("cargo:rerun-if-changed=../memory.x");
    fs::copy("../memory.x", out.join("memory.x")).context("memory.x at the repository's top")?;
    // The interrupts have only the handlers of `vectors.rs`.
    fs::write(out.join("device.x"), "")?;
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bin=board={argument}");
    }
    for argument in ["--nmagic", "-Tlink.x"] {
        println!("cargo:rustc-link-arg-bin=cycles={argument}");
    }
    println!("cargo:rustc-env=DEFMT_LOG=info");
    Ok(())
}
