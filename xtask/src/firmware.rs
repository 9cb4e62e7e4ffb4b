//! The board's program: building it, and what its file says about it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, elf};

use crate::process::run;
use crate::toolchain::Cross;

/// The surface that the firmware is built for.
pub struct Surface {
    /// A mesh file, or the generated heart.
    pub mesh: Option<PathBuf>,
    /// The limit on stretch.
    pub stretch: f32,
}

/// Limit on stretch of the generated heart, whose motion keeps to it: the paper's.
pub const HEART_STRETCH: f32 = 1.5;

impl Default for Surface {
    fn default() -> Self {
        Self { mesh: None, stretch: HEART_STRETCH }
    }
}

/// Builds the firmware; it links only if no panic path survived.
pub fn build(cross: &Cross, surface: &Surface) -> Result<PathBuf> {
    run(&mut command(cross, surface)).context("the firmware does not build")?;
    Ok(cross.program("firmware", "board"))
}

/// The command that builds the firmware.
pub fn command(cross: &Cross, surface: &Surface) -> Command {
    let mut cargo = cross.cargo("build");
    cargo.args(["--quiet", "--package", "firmware-example", "--bin", "board"]);
    cargo.args(["--features", "board", "--profile", "firmware"]);
    surface.describe_to(&mut cargo);
    cargo
}

impl Surface {
    /// Tells the build script which surface to build in. Says nothing where that is the one it takes
    /// anyway: cargo would rebuild for any change of these variables.
    pub fn describe_to(&self, cargo: &mut Command) {
        match &self.mesh {
            Some(mesh) => cargo.env("DIBS_MESH", mesh),
            None => cargo.env_remove("DIBS_MESH"),
        };
        if self.stretch == HEART_STRETCH {
            cargo.env_remove("DIBS_STRETCH");
        } else {
            cargo.env("DIBS_STRETCH", self.stretch.to_string());
        }
    }

    /// Whether this is what the build script takes unless it is told otherwise.
    pub fn is_default(&self) -> bool {
        self.mesh.is_none() && self.stretch == HEART_STRETCH
    }
}

/// What a linked program needs of the board.
pub struct Footprint {
    /// Code, constants and the initial values of variables.
    pub flash: u64,
    /// Variables, without the stack.
    pub ram: u64,
    /// Names of allocator functions, of which there must be none.
    pub allocators: Vec<String>,
    /// Names of functions that panic, of which there must be none either.
    pub panics: Vec<String>,
}

impl Footprint {
    /// Reads the program's sections and symbols.
    pub fn read(program: &Path) -> Result<Self> {
        let bytes = fs::read(program)
            .with_context(|| format!("cannot read the firmware {}", program.display()))?;
        let file = object::File::parse(&*bytes)?;
        let (mut flash, mut ram) = (0, 0);
        for section in file.sections() {
            let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
                bail!("{} is not an ELF file", program.display());
            };
            if sh_flags & elf::SHF_ALLOC == elf::SectionFlags(0) {
                continue;
            }
            let zeroed = section.kind() == SectionKind::UninitializedData;
            if !zeroed {
                flash += section.size();
            }
            if sh_flags & elf::SHF_WRITE != elf::SectionFlags(0) {
                ram += section.size();
            }
        }
        let mut names: Vec<String> =
            file.symbols().filter_map(|s| s.name().ok().map(str::to_owned)).collect();
        let panics = names.extract_if(.., |name| name.contains("panicking")).collect();
        names
            .retain(|name| ["alloc", "malloc", "sbrk"].iter().any(|word| is_allocator(name, word)));
        Ok(Self { flash, ram, allocators: names, panics })
    }
}

/// `__rust_alloc`, `__rg_dealloc`, `malloc`, `_sbrk`, but not a name that merely contains the word.
fn is_allocator(name: &str, word: &str) -> bool {
    let bare = name.trim_start_matches('_');
    bare == word
        || ["rust_", "rg_", "rdl_", "rustc_"]
            .iter()
            .any(|prefix| bare.strip_prefix(prefix).is_some_and(|rest| rest.contains(word)))
}
