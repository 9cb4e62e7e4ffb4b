//! The page without data: found beside this program, or made once by the checkout that this program was built in.

use anyhow::{Context, Result, anyhow, bail, ensure};
use dibs_build::write_atomically;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The page, as `cargo xtask viewer` writes it.
const PAGE: &str = "dibs-viewer.html";
/// Where the data are inserted in it.
const MARK: &str = "<!--data-->";

/// The command that makes the page.
const MAKER: &str = "cargo xtask viewer";

/// The page's file: the given one, or the one beside this program.
pub struct Page {
    pub path: PathBuf,
    /// The program that makes the page if it is missing; `None` for a page that is given.
    maker: Option<PathBuf>,
}

impl Page {
    pub fn new(given: Option<&Path>) -> Result<Self> {
        if let Some(path) = given {
            return Ok(Self { path: path.to_path_buf(), maker: None });
        }
        let program = std::env::current_exe()
            .context("this program's folder is unknown; give the page with --page")?;
        Ok(Self { path: program.with_file_name(PAGE), maker: Some(program) })
    }

    /// The page's text with this data inserted.
    pub fn filled(&self, data: &str) -> Result<String> {
        match &self.maker {
            Some(program) if !self.path.is_file() => make(program, &self.path)?,
            _ => (),
        }
        Ok(read(&self.path)?.replacen(MARK, data, 1))
    }
}

fn read(path: &Path) -> Result<String> {
    let name = path.display();
    let page = std::fs::read_to_string(path)
        .with_context(|| format!("{name}: cannot be read; `{MAKER}` in the repository writes it, and --page names another"));
    // One sentence that ends with the system's reason.
    let page = page.map_err(|error| anyhow!("{error:#}"))?;
    ensure!(
        page.contains(MARK),
        "{name}: no page without data; give the {PAGE} that `{MAKER}` writes"
    );
    Ok(page)
}

/// Makes the page in the checkout whose target folder this program is in, or else in the one where it was compiled. The
/// page appears completely or not at all.
fn make(program: &Path, page: &Path) -> Result<()> {
    let name = page.display();
    // Neither the current folder nor any other folder above this program's may decide which program is run.
    let is_own = |folder: &&Path| is_checkout(folder) && program.starts_with(folder.join("target"));
    let compiled = Path::new(env!("CARGO_MANIFEST_DIR")).parent();
    // That folder may be another project's by now.
    let compiled = compiled.filter(|folder| is_checkout(folder));
    let Some(root) = program.ancestors().find(is_own).or(compiled) else {
        bail!(
            "{name} is missing; `{MAKER}` in a checkout of the repository writes {PAGE}: put it there, or give it with --page"
        );
    };
    for needed in ["node", "npm", "cargo"] {
        ensure!(
            starts(needed),
            "{name} is missing, and making it needs `{needed}`: install Node.js with npm, and Rust, or give a page with --page"
        );
    }
    let checkout = root.display();
    eprintln!(
        "making {name}, once: `{MAKER}` in {checkout} compiles the query for WebAssembly, and fetches the page's libraries by npm"
    );
    let mut maker = Command::new("cargo");
    maker.args(["xtask", "viewer"]).current_dir(root);
    // Standard output is reserved for this command's results.
    let status = maker.stdin(Stdio::null()).stdout(io::stderr()).status();
    let status = status.with_context(|| format!("`{MAKER}` did not start"))?;
    if status.success() {
        put(&target(root).join("viewer").join(PAGE), page)?;
    }
    ensure!(
        status.success() && page.is_file(),
        "`{MAKER}` in {checkout} did not write {name}: see above, or give a page with --page"
    );
    Ok(())
}

/// Copies the page that was made to its place. The command itself puts it beside the programs in the checkout's target
/// folder only, and not beside an installed one.
fn put(made: &Path, page: &Path) -> Result<()> {
    if page.is_file() || !made.is_file() {
        return Ok(());
    }
    let text = read(made)?;
    write_atomically(page, |out| out.write_all(text.as_bytes()))
        .map_err(|error| anyhow!("{error}, or give the made page with --page {}", made.display()))
}

/// Cargo's target folder in a checkout, as `cargo xtask` has it.
fn target(root: &Path) -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |dir| root.join(dir))
}

fn is_checkout(folder: &Path) -> bool {
    ["Cargo.toml", "viewer/build.mjs", "xtask/Cargo.toml", "dibs-nostd/Cargo.toml"]
        .iter()
        .all(|file| folder.join(file).is_file())
}

fn starts(program: &str) -> bool {
    let mut version = Command::new(program);
    version.arg("--version").stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    version.status().is_ok_and(|status| status.success())
}
