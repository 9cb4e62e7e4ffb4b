//! The surfaces: real anatomy if present, else generated.

use anyhow::{Context, Result};
use dibs_build::{Mesh, Motion, generate};

use dibs_prove::data::real;

/// A surface and its source.
pub struct Subject {
    pub name: String,
    pub mesh: Mesh,
}

/// A heart with its motion, and the stretch limit for it.
pub struct Heart {
    pub name: String,
    pub mesh: Mesh,
    pub motion: Motion,
    /// The limit that the motion obeys, or `None` if it must be measured.
    pub stretch: Option<f32>,
}

/// A brain of about this many triangles.
pub fn brain(triangles: u32) -> Result<Subject> {
    if let Some(folder) = real() {
        let file = match triangles {
            1_000.. => format!("brain_{}k.ply", triangles / 1_000),
            _ => format!("brain_{triangles}.ply"),
        };
        let path = folder.join(file);
        if path.is_file() {
            let mesh = dibs_build::read(&path)?.mesh;
            return Ok(Subject { name: "human brain".to_owned(), mesh });
        }
    }
    let mesh = generate::brain(triangles).context("generating a brain")?;
    Ok(Subject { name: "generated brain".to_owned(), mesh })
}

/// The generated heart, and the real one if present.
pub fn hearts(triangles: u32) -> Result<Vec<Heart>> {
    let generate::MovingMesh { mesh, motion } =
        generate::heart(triangles).context("generating a heart")?;
    let name = "generated heart".to_owned();
    let mut hearts = vec![Heart { name, mesh, motion, stretch: Some(1.5) }];
    if let Some(folder) = real() {
        let (mesh, motion) = (folder.join("heart_10272.ply"), folder.join("heart_10272.pc2"));
        if mesh.is_file() && motion.is_file() {
            let (mesh, motion) = (dibs_build::read(mesh)?.mesh, Motion::read_pc2(motion)?);
            motion.check_fits(&mesh)?;
            // Its file states no rate; the recorded figures are of a frame a second.
            let motion = Motion { rate: 1.0, ..motion };
            hearts.push(Heart { name: "human heart".to_owned(), mesh, motion, stretch: None });
        }
    }
    Ok(hearts)
}
