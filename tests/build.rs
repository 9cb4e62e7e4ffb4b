//! The README's `build.rs`, with a generated mesh instead of a file: the README's control loop is a
//! documentation example of this package. And the same with modes, for their tests.

#[cfg(not(feature = "builder"))]
fn main() {
    println!("cargo:rerun-if-changed=build.rs");
}

#[cfg(feature = "builder")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mesh, motion) = dibs_build::generate::heart(1_000)?;
    let tree = dibs_build::tree(mesh.clone()).stretch(1.5).try_emit("heart")?;
    let fit = dibs_build::modes::ModalFit::new(&mesh, &motion)?;
    let out = std::env::var("OUT_DIR")?;
    tree.with_modes(&fit, 2)?.write_rust(format!("{out}/modal_heart.rs"), "modal_heart")?;
    Ok(())
}
