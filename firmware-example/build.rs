//! Builds the surface's tree, and hands the board's memory map to the linker.

use std::path::Path;
use std::{env, fs};

fn main() {
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    let out = Path::new(&out);
    if env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("none") {
        link(out);
    }
}

/// The linker scripts of the binary `board`: `memory.x` at the top of the repository is the board.
fn link(out: &Path) {
    println!("cargo:rerun-if-changed=../memory.x");
    fs::copy("../memory.x", out.join("memory.x")).expect("memory.x at the top of the repository");
    // The interrupts have no default handlers but those of `vectors.rs`.
    fs::write(out.join("device.x"), "").expect("OUT_DIR is writable");
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bin=board={argument}");
    }
    println!("cargo:rustc-env=DEFMT_LOG=info");
}
