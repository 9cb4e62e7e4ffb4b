//! Builds the surface's tree, and hands the board's memory map to the linker.

use std::path::{Path, PathBuf};
use std::{env, fs};

use anyhow::{Context, Result};
use dibs_build::{Builder, Mesh, generate};
use glam::Vec3;

fn main() -> Result<()> {
    let out = PathBuf::from(env::var("OUT_DIR")?);
    surface(&out)?;
    if env::var("CARGO_CFG_TARGET_OS")? == "none" {
        link(&out)?;
    }
    Ok(())
}

/// The tree in flash: of the generated heart, or of the mesh file in `DIBS_MESH`; for a stretch of
/// 1.5, or what `DIBS_STRETCH` says.
fn surface(out: &Path) -> Result<()> {
    println!("cargo:rerun-if-env-changed=DIBS_MESH");
    println!("cargo:rerun-if-env-changed=DIBS_STRETCH");
    let mesh = match env::var_os("DIBS_MESH") {
        Some(path) => {
            println!("cargo:rerun-if-changed={}", Path::new(&path).display());
            dibs_build::read(Path::new(&path))?.mesh
        }
        None => generate::heart(10_272)?.0,
    };
    let stretch = match env::var("DIBS_STRETCH") {
        Ok(text) => text.parse().with_context(|| format!("DIBS_STRETCH=`{text}`"))?,
        Err(_) => 1.5,
    };
    let tree = Builder::new().stretch(stretch).build(&mesh)?;
    let bits = tree.index_bits();
    let (center, reach) = extent(&mesh);
    let [x, y, z] = center.to_array();
    let rust = tree.rust("SURFACE")?;
    fs::write(
        out.join("surface.rs"),
        format!(
            "{rust}
/// Width of the surface's indices.
pub type SurfaceIndex = u{bits};

/// Centre of the surface's bounding box at rest, in mm.
pub const SURFACE_CENTER: Vec3 = Vec3::new({x:?}, {y:?}, {z:?});

/// Half the longest side of that box, in mm.
pub const SURFACE_REACH: f32 = {reach:?};
"
        ),
    )?;
    Ok(())
}

fn extent(mesh: &Mesh) -> (Vec3, f32) {
    let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
    ((low + high) / 2.0, (high - low).max_element() / 2.0)
}

/// The linker scripts of the binaries `board` and `cycles`: `memory.x` at the top of the repository is the board.
fn link(out: &Path) -> Result<()> {
    println!("cargo:rerun-if-changed=../memory.x");
    fs::copy("../memory.x", out.join("memory.x")).context("memory.x at the repository's top")?;
    // The interrupts have no default handlers but those of `vectors.rs`.
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
