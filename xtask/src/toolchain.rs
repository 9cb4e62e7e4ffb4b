//! Chooses the toolchain that builds for the board; no other code does.
//!
//! It uses the first of these that works: the present toolchain has the target; `rustup target add` adds it; Debian's
//! toolchain builds it together with `core`. Otherwise a message gives the manual steps. `DIBS_CROSS=rustup|debian`
//! selects one of them, `DIBS_CROSS=none` refuses all.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};

use crate::process::quiet;
use crate::{apt, workspace};

/// The Cortex-M7 with its single-precision FPU.
pub const TARGET: &str = "thumbv7em-none-eabihf";

const MOMENT: Duration = Duration::from_secs(20);
const DOWNLOAD: Duration = Duration::from_secs(180);
const DEBIAN_CARGO: &str = "/usr/bin/cargo";
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_PACKAGES: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];

/// A toolchain that builds for the board.
pub enum Cross {
    /// The present toolchain has the target.
    Rustup,
    /// Debian's compiler with `core` built from source, and the linker of the present toolchain.
    Debian {
        /// `rust-lld`.
        linker: PathBuf,
    },
}

impl Cross {
    /// Finds a toolchain, or installs one.
    pub fn find() -> Result<Self> {
        match env::var("DIBS_CROSS").as_deref() {
            Ok("rustup") => rustup(),
            Ok("debian") => debian(),
            Ok("none") => bail!("DIBS_CROSS=none: told not to build for the board"),
            Ok(other) => bail!("DIBS_CROSS is `{other}`: it must be rustup, debian or none"),
            Err(_) => rustup()
                .or_else(|no_rustup| debian().map_err(|no_debian| by_hand(&no_rustup, &no_debian))),
        }
    }

    /// `cargo SUBCOMMAND` for the board. Each toolchain has its own target folder, so that two compilers do not discard
    /// each other's output.
    pub fn cargo(&self, subcommand: &str) -> Command {
        let mut command = self.cargo_in(&self.target_dir(), subcommand);
        command.current_dir(workspace::root());
        command
    }

    /// `cargo SUBCOMMAND` for a board whose crate is not in the workspace. It has its own target folder, so that it
    /// does not wait for other builds.
    pub fn cargo_apart(&self, folder: &str, subcommand: &str) -> Command {
        let mut command = self.cargo_in(&self.target_dir_apart(folder), subcommand);
        command.current_dir(workspace::root().join(folder));
        command
    }

    /// The path of a program of [`cargo_apart`](Self::cargo_apart).
    pub fn program_apart(&self, folder: &str, name: &str) -> PathBuf {
        self.target_dir_apart(folder).join(TARGET).join("release").join(name)
    }

    /// `cargo SUBCOMMAND` for the board in a copy of the workspace, with the copy's target folder.
    pub fn cargo_of_copy(&self, copy: &Path, subcommand: &str) -> Command {
        let mut command = self.cargo_in(&copy.join("target"), subcommand);
        command.current_dir(copy);
        command
    }

    /// The path of a program of [`cargo_of_copy`](Self::cargo_of_copy).
    pub fn program_of_copy(&self, copy: &Path, profile: &str, name: &str) -> PathBuf {
        copy.join("target").join(TARGET).join(profile).join(name)
    }

    fn target_dir_apart(&self, folder: &str) -> PathBuf {
        self.target_dir().join("apart").join(folder)
    }

    fn cargo_in(&self, target_dir: &Path, subcommand: &str) -> Command {
        let mut command = match self {
            Self::Rustup => {
                let mut command = Command::new("cargo");
                command.arg(subcommand);
                command
            }
            Self::Debian { linker } => {
                let mut command = Command::new(DEBIAN_CARGO);
                command
                    .args([subcommand, "-Zbuild-std=core"])
                    .env("RUSTC", DEBIAN_RUSTC)
                    .env("RUSTC_BOOTSTRAP", "1")
                    .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker)
                    // `tests/prove` reads the size of every function's stack frame from it.
                    .env("RUSTFLAGS", "-Zemit-stack-sizes")
                    .env_remove("RUSTUP_TOOLCHAIN");
                command
            }
        };
        command.args(["--target", TARGET, "--target-dir"]).arg(target_dir);
        command
    }

    /// The path of a program that `cargo build --profile PROFILE` writes.
    pub fn program(&self, profile: &str, name: &str) -> PathBuf {
        self.target_dir().join(TARGET).join(profile).join(name)
    }

    /// A description in one line.
    pub fn describe(&self) -> String {
        match self {
            Self::Rustup => format!("rustup toolchain with {TARGET}"),
            Self::Debian { .. } => {
                let version = quiet(Command::new(DEBIAN_RUSTC).arg("--version"), MOMENT);
                format!("Debian's {} with core from source", version.unwrap_or_default().trim())
            }
        }
    }

    fn target_dir(&self) -> PathBuf {
        match self {
            Self::Rustup => workspace::target(),
            Self::Debian { .. } => workspace::target().join("debian"),
        }
    }
}

fn rustup() -> Result<Cross> {
    add_target(TARGET).map(|()| Cross::Rustup)
}

/// Finds a target in the present toolchain, or adds it.
///
/// # Errors
/// If the target is missing and rustup cannot add it.
pub fn add_target(target: &str) -> Result<()> {
    if target_installed(target) {
        return Ok(());
    }
    eprintln!("adding the target {target} ...");
    quiet(Command::new("rustup").args(["target", "add", target]), DOWNLOAD)?;
    if !target_installed(target) {
        bail!("rustup added {target}, but not to the toolchain in use");
    }
    Ok(())
}

fn target_installed(target: &str) -> bool {
    let mut command = Command::new("rustc");
    command.args(["--print", "target-libdir", "--target", target]);
    quiet(&mut command, MOMENT).is_ok_and(|folder| Path::new(folder.trim()).is_dir())
}

fn debian() -> Result<Cross> {
    if !debian_installed() {
        apt::install(&DEBIAN_PACKAGES)?;
        if !debian_installed() {
            bail!("{} left no compiler with core's sources", DEBIAN_PACKAGES.join(" "));
        }
    }
    let version = quiet(Command::new(DEBIAN_RUSTC).arg("--version"), MOMENT)?;
    let minor = version.split('.').nth(1).and_then(|minor| minor.parse::<u32>().ok());
    let needed = env!("CARGO_PKG_RUST_VERSION").split('.').nth(1).and_then(|m| m.parse().ok());
    if minor < needed {
        bail!(
            "{DEBIAN_RUSTC} is {}, older than {}",
            version.trim(),
            env!("CARGO_PKG_RUST_VERSION")
        );
    }
    Ok(Cross::Debian { linker: linker()? })
}

fn debian_installed() -> bool {
    let sysroot = quiet(Command::new(DEBIAN_RUSTC).args(["--print", "sysroot"]), MOMENT);
    let sources = "lib/rustlib/src/rust/library/core/src/lib.rs";
    sysroot.is_ok_and(|folder| Path::new(folder.trim()).join(sources).exists())
        && Path::new(DEBIAN_CARGO).exists()
}

/// The `rust-lld` of the toolchain that builds xtask: Debian's compiler has none.
pub fn linker() -> Result<PathBuf> {
    let verbose = quiet(Command::new("rustc").arg("-vV"), MOMENT)?;
    let host = verbose
        .lines()
        .find_map(|line| line.strip_prefix("host: "))
        .context("`rustc -vV` names no host")?;
    let sysroot = quiet(Command::new("rustc").args(["--print", "sysroot"]), MOMENT)?;
    let linker = Path::new(sysroot.trim()).join("lib/rustlib").join(host).join("bin/rust-lld");
    if !linker.exists() {
        bail!("no linker at {}", linker.display());
    }
    Ok(linker)
}

fn by_hand(no_rustup: &anyhow::Error, no_debian: &anyhow::Error) -> anyhow::Error {
    anyhow!(
        "nothing here builds for {TARGET}:\n  rustup: {no_rustup:#}\n  Debian: {no_debian:#}\n\
         Do one of these, then try again:\n  rustup target add {TARGET}\n  \
         sudo apt-get install {}",
        DEBIAN_PACKAGES.join(" ")
    )
}
