//! Passes the board's memory map to the linker, as the firmware's build script does, with more memory on the board with a
//! Cortex-M55.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    println!("cargo:rerun-if-changed=../../memory.x");
    println!("cargo:rustc-check-cfg=cfg(m55)");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        let out = PathBuf::from(env::var_os("OUT_DIR").unwrap_or_default());
        if env::var("TARGET").is_ok_and(|target| target.starts_with("thumbv8m")) {
            println!("cargo:rustc-cfg=m55");
            println!("cargo:rerun-if-changed=m55.x");
            println!("cargo:rustc-link-arg-bin=probe=-T{}/m55.x", env!("CARGO_MANIFEST_DIR"));
        }
        fs::copy("../../memory.x", out.join("memory.x"))?;
        println!("cargo:rustc-link-search={}", out.display());
        println!("cargo:rerun-if-changed=riscv.x");
        println!("cargo:rustc-link-arg-bin=riscv=-T{}/riscv.x", env!("CARGO_MANIFEST_DIR"));
        for argument in ["--nmagic", "-Tlink.x"] {
            for name in [
                "probe", "torn", "receive", "bus", "track", "bound", "side", "chain", "filter",
                "weights", "nodes", "carried", "tick",
            ] {
                println!("cargo:rustc-link-arg-bin={name}={argument}");
            }
        }
    }
    Ok(())
}
