//! Builds the tree of the README's control loop, which is a documentation example of this package, from a generated
//! mesh instead of a file; and trees with modes and with nodes, for their tests. Tests on real meshes are ignored where the meshes
//! are absent.

/// Real meshes, beside the repository.
const DATA: &str = "../../shared/data";

/// Sets `cfg(real_meshes)` where the real meshes are present.
fn look_for_real_meshes() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-check-cfg=cfg(real_meshes)");
    if std::path::Path::new(DATA).is_dir() {
        println!("cargo:rerun-if-changed={DATA}");
        println!("cargo:rustc-cfg=real_meshes");
    }
}

#[cfg(not(feature = "builder"))]
fn main() {
    look_for_real_meshes();
}

#[cfg(feature = "builder")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    look_for_real_meshes();
    let dibs_build::generate::MovingMesh { mesh, motion } = dibs_build::generate::heart(1_000)?;
    let tree = dibs_build::tree(mesh.clone()).stretch(1.5).try_emit("heart")?;
    let fit = dibs_build::modes::ModalFit::new(&mesh, &motion)?;
    let out = std::env::var("OUT_DIR")?;
    let volume = dibs_build::Volume::lattice(&mesh, [3, 4, 5])?;
    dibs_build::tree(mesh.clone())
        .stretch(1.3)
        .with(|builder| builder.nodes(&volume))
        .try_emit("embedded_heart")?;
    tree.with_modes(&fit, 2)?.write_rust(format!("{out}/modal_heart.rs"), "modal_heart")?;
    Ok(())
}
