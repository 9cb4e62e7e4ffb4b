//! The README's `build.rs`, with a generated mesh instead of a file: its control loop is a
//! documentation example of this package. And the same with modes, for their tests.

#[cfg(not(feature = "builder"))]
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
}

#[cfg(feature = "builder")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let (mesh, motion) = dibs_build::generate::heart(1_000)?;
    let tree = dibs_build::Builder::new().stretch(1.5).build(&mesh)?;
    let out = std::env::var("OUT_DIR")?;
    tree.write_rust(format!("{out}/heart.rs"), "HEART")?;
    let fit = dibs_build::modes::ModalFit::new(&mesh, &motion)?;
    tree.with_modes(&fit, 2)?.write_rust(format!("{out}/modal_heart.rs"), "HEART")?;
    Ok(())
}
