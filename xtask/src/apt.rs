//! Installs Debian packages where this needs no password.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, bail};

use crate::process::quiet;

const LIMIT: Duration = Duration::from_secs(600);

/// Installs packages, as root or by a `sudo` without a password.
pub fn install(packages: &[&str]) -> Result<()> {
    if !Path::new("/usr/bin/apt-get").exists() {
        bail!("this system has no apt-get");
    }
    let seconds = Duration::from_secs(10);
    let root = quiet(Command::new("id").arg("-u"), seconds).is_ok_and(|id| id.trim() == "0");
    if !root && quiet(Command::new("sudo").args(["-n", "true"]), seconds).is_err() {
        bail!("installing packages needs root, and `sudo -n` asks for a password");
    }
    let apt = |arguments: &[&str]| {
        let mut command = if root { Command::new("apt-get") } else { Command::new("sudo") };
        if !root {
            command.args(["-n", "apt-get"]);
        }
        command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        quiet(&mut command, LIMIT)
    };
    eprintln!("installing {} ...", packages.join(" "));
    let install = [&["install", "--yes", "--no-install-recommends"], packages].concat();
    if apt(&install).is_err() {
        // The package lists of a new machine are old or absent.
        apt(&["update"])?;
        apt(&install)?;
    }
    Ok(())
}
