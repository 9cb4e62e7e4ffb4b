//! Builds the surface's tree, and passes the board's memory map to the linker.

// Requirement: P-12

use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result, bail};
use dibs_build::{TreeScript, Volume, generate};

fn main() -> Result<()> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    surface()?;
    // A program for another board that only uses this library has its own memory map.
    let has_program = ["CARGO_FEATURE_BOARD", "CARGO_FEATURE_CYCLES"].map(env::var_os);
    if env::var("CARGO_CFG_TARGET_OS")? == "none" && has_program.iter().any(Option::is_some) {
        link(&out)?;
    }
    Ok(())
}

/// The tree in flash: of the generated heart, or of the mesh file in `DIBS_MESH`; for a stretch limit of 1.5, or the
/// one in `DIBS_STRETCH`, or the limits in the file `DIBS_LIMITS`. With `DIBS_NODES`, the cells of a lattice such as
/// `9,8,7`, the lattice's nodes move the surface.
fn surface() -> Result<()> {
    for variable in ["DIBS_MESH", "DIBS_STRETCH", "DIBS_LIMITS", "DIBS_NODES"] {
        println!("cargo::rerun-if-env-changed={variable}");
    }
    println!("cargo:rustc-check-cfg=cfg(nodes)");
    let path = env::var_os("DIBS_MESH").map(PathBuf::from);
    let tree = match (path, env::var("DIBS_NODES")) {
        (None, Err(_)) => dibs_build::tree(generate::heart(10_272)?.mesh),
        (Some(path), Err(_)) => dibs_build::tree(path),
        (None, Ok(_)) => bail!("DIBS_NODES takes a mesh, in DIBS_MESH"),
        (Some(path), Ok(cells)) => {
            println!("cargo:rustc-cfg=nodes");
            carried(path, &cells)?
        }
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

/// The tree of a mesh that a lattice's nodes move.
fn carried(path: PathBuf, cells: &str) -> Result<TreeScript> {
    let cells = cells.split(',').map(str::parse).collect::<Result<Vec<u32>, _>>();
    let cells = cells.ok().and_then(|cells| cells.try_into().ok());
    let cells = cells.context("DIBS_NODES holds three numbers of cells, as in 9,8,7")?;
    let volume = Volume::lattice(&dibs_build::read(&path)?.mesh, cells)?;
    Ok(dibs_build::tree(path).with(|tree| tree.nodes(&volume).with_rest_shape(false)))
}

/// Passes the linker scripts of the binaries `board` and `cycles`: `memory.x` at the top of the repository is the
/// board's memory map.
fn link(out: &Path) -> Result<()> {
    println!("cargo:rerun-if-changed=../memory.x");
    fs::copy("../memory.x", out.join("memory.x")).context("memory.x at the repository's top")?;
    // There are no interrupt handlers except those of `vectors.rs`.
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
