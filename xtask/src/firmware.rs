//! The board's program.

use std::path::PathBuf;
use std::process::Command;

use anyhow::{Context, Result};

use crate::process::run;
use crate::toolchain::Cross;

/// The firmware's surface.
pub struct Surface {
    /// A mesh file, or the generated heart.
    pub mesh: Option<PathBuf>,
    /// The stretch limits.
    pub limits: Limits,
    /// The cells of the lattice whose nodes move it, if any.
    pub nodes: Option<[u32; 3]>,
}

/// How far a surface may be stretched.
pub enum Limits {
    /// One limit for all triangles.
    Stretch(f32),
    /// A file with a limit for each triangle.
    File(PathBuf),
}

/// The generated heart's stretch limit, as in the paper; its motion stays within it.
pub const HEART_STRETCH: f32 = 1.5;

impl Default for Surface {
    fn default() -> Self {
        Self { mesh: None, limits: Limits::Stretch(HEART_STRETCH), nodes: None }
    }
}

/// Builds the firmware; it links only if no panic path remains.
pub fn build(cross: &Cross, surface: &Surface) -> Result<PathBuf> {
    run(&mut command(cross, surface)).context("the firmware does not build")?;
    Ok(cross.program("firmware", "board"))
}

/// The command that builds the firmware.
pub fn command(cross: &Cross, surface: &Surface) -> Command {
    let mut cargo = cross.cargo("build");
    describe(&mut cargo, surface);
    cargo
}

/// Adds the arguments for the firmware to a `cargo build`.
pub fn describe(cargo: &mut Command, surface: &Surface) {
    cargo.args(["--quiet", "--package", "firmware-example", "--bin", "board"]);
    cargo.args(["--features", "board", "--profile", "firmware"]);
    surface.describe_to(cargo);
}

impl Surface {
    /// Passes the surface to the build script. For the default surface no variable is set, because cargo rebuilds when
    /// these variables change.
    pub fn describe_to(&self, cargo: &mut Command) {
        match &self.mesh {
            Some(mesh) => cargo.env("DIBS_MESH", mesh),
            None => cargo.env_remove("DIBS_MESH"),
        };
        match self.nodes {
            Some([x, y, z]) => cargo.env("DIBS_NODES", format!("{x},{y},{z}")),
            None => cargo.env_remove("DIBS_NODES"),
        };
        cargo.env_remove("DIBS_STRETCH").env_remove("DIBS_LIMITS");
        match &self.limits {
            Limits::Stretch(HEART_STRETCH) => {}
            Limits::Stretch(stretch) => {
                cargo.env("DIBS_STRETCH", stretch.to_string());
            }
            Limits::File(file) => {
                cargo.env("DIBS_LIMITS", file);
            }
        }
    }

    /// Whether this is the build script's default.
    pub fn is_default(&self) -> bool {
        self.mesh.is_none() && matches!(self.limits, Limits::Stretch(HEART_STRETCH))
    }
}
