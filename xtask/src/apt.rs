//! Installs Debian packages, if this needs no password.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, bail};

use crate::process::quiet;

/// Longer than the two timeouts below together.
const LIMIT: Duration = Duration::from_secs(620);

/// Timeout of an installation, in seconds.
const INSTALL: &str = "600";

/// Timeout of an update, in seconds, and the number of attempts. An update takes some ten seconds.
const UPDATE: &str = "90";
const TRIES: usize = 3;

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
    // `timeout` also ends what `sudo` started, so that no lock remains for the next attempt.
    let apt = |seconds: &str, arguments: &[&str]| {
        let mut command = Command::new(if root { "timeout" } else { "sudo" });
        if !root {
            command.args(["-n", "timeout"]);
        }
        command.args(["--kill-after=10", seconds, "apt-get"]);
        command.args(arguments).env("DEBIAN_FRONTEND", "noninteractive");
        quiet(&mut command, LIMIT)
    };
    eprintln!("installing {} ...", packages.join(" "));
    let install = [&["install", "--yes", "--no-install-recommends"], packages].concat();
    if apt(INSTALL, &install).is_err() {
        // The package lists of a new machine are old or absent.
        let mut updated = apt(UPDATE, &["update"]);
        for _ in 1..TRIES {
            updated = updated.or_else(|_| apt(UPDATE, &["update"]));
        }
        updated?;
        apt(INSTALL, &install)?;
    }
    Ok(())
}
