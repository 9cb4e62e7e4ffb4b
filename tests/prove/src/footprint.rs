//! The board's program: its sections and symbols.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, elf};

/// The memory that a linked program needs.
pub struct Footprint {
    /// Code, constants and the initial values of variables.
    pub flash: u64,
    /// Variables, without the stack.
    pub ram: u64,
    /// Names of allocator functions, of which there must be none.
    pub allocators: Vec<String>,
    /// Names of functions that panic, of which there must be none.
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

/// True for `__rust_alloc`, `__rg_dealloc`, `malloc`, `_sbrk`, but not for a name that only contains the word.
fn is_allocator(name: &str, word: &str) -> bool {
    let bare = name.trim_start_matches('_');
    bare == word
        || ["rust_", "rg_", "rdl_", "rustc_"]
            .iter()
            .any(|prefix| bare.strip_prefix(prefix).is_some_and(|rest| rest.contains(word)))
}
