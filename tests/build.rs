//! The README's `build.rs`, with a generated mesh instead of a file: its control loop is a
//! documentation example of this package.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=build.rs");
    let (mesh, _motion) = dibs_build::generate::heart(1_000)?;
    let tree = dibs_build::Builder::new().stretch(1.5).build(&mesh)?;
    tree.write_rust(format!("{}/heart.rs", std::env::var("OUT_DIR")?), "HEART")?;
    Ok(())
}
