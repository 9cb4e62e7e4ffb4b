//! Passes the board's memory map to the linker, as the firmware's build script does.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=../../memory.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
        fs::copy("../../memory.x", out.join("memory.x"))?;
        println!("cargo:rustc-link-search={}", out.display());
        for argument in ["--nmagic", "-Tlink.x"] {
            for name in ["probe", "torn", "receive", "bus", "track", "tick"] {
                println!("cargo:rustc-link-arg-bin={name}={argument}");
            }
        }
    }
    Ok(())
}
