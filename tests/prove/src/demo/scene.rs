//! The surface, its motion and its tree, as in the firmware.

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, BuiltTree, Mesh, Motion, Unit, generate};
use dibs_nostd::{Index, measure_stretch};
use xtask::firmware::{HEART_STRETCH, Surface};

use super::Options;

/// Triangles of the generated heart: those of the paper's.
const HEART_TRIANGLES: u32 = 10_272;
/// Margin above the largest stretch of a recorded motion.
const MARGIN: f32 = 1.02;
/// A limit beyond any motion, for the tree that measures a motion's stretch.
const ANY_STRETCH: f32 = 1_000.0;

/// The moving surface, and the firmware's tree of it.
pub struct Scene {
    /// The surface's name.
    name: String,
    /// The input of the firmware's build script.
    pub surface: Surface,
    /// The tree; the firmware builds the same one, byte for byte.
    pub tree: BuiltTree,
    /// The motion, in the mesh's order of vertices.
    pub motion: Motion,
    /// Frames a second at which the motion was recorded.
    pub rate: f32,
    /// The mesh's triangles by rows of the vertex table, not taken from the tree.
    pub triangles: Vec<[u32; 3]>,
}

impl Scene {
    /// Reads or generates everything.
    pub fn load(options: &Options) -> Result<Self> {
        let (mesh, motion) = match (&options.mesh, &options.motion) {
            (Some(mesh), Some(motion)) => {
                let mesh = dibs_build::read(mesh)?.mesh;
                let motion = Motion::read_around(motion, Unit::default(), mesh.origin)?;
                (mesh, motion)
            }
            _ => {
                let heart = generate::heart(HEART_TRIANGLES)?;
                (heart.mesh, heart.motion)
            }
        };
        motion.check_fits(&mesh)?;
        ensure!(!motion.frames.is_empty(), "the motion has no frame");
        let stretch = match (options.stretch, &options.mesh) {
            (Some(stretch), _) => stretch,
            (None, None) => HEART_STRETCH,
            (None, Some(_)) => needed_stretch(&mesh, &motion)?,
        };
        let tree = Builder::new().stretch(stretch).build(&mesh)?;
        let mut row = vec![0; mesh.positions.len()];
        for (place, &vertex) in (0..).zip(tree.vertex_order()) {
            row[vertex as usize] = place;
        }
        let path = options.mesh.as_deref().map(std::path::absolute).transpose()?;
        let given = options.mesh.as_ref().map(|path| path.display().to_string());
        Ok(Self {
            name: given.unwrap_or_else(|| "generated heart".to_owned()),
            surface: Surface { mesh: path, stretch },
            rate: if motion.rate > 0.0 { motion.rate } else { 25.0 },
            triangles: mesh.triangles.iter().map(|t| t.map(|v| row[v as usize])).collect(),
            tree,
            motion,
        })
    }

    /// One line for the user.
    pub fn describe(&self) -> String {
        let summary = self.tree.summary();
        format!(
            "{}: {} triangles, {} vertices, {} frames of motion, stretch limit {}",
            self.name,
            summary.triangles,
            summary.vertices,
            self.motion.frames.len(),
            summary.stretch
        )
    }
}

/// The stretch limit that a motion needs.
fn needed_stretch(mesh: &Mesh, motion: &Motion) -> Result<f32> {
    let tree = Builder::new().stretch(ANY_STRETCH).build(mesh)?;
    let largest = match tree.index_bits() {
        16 => largest_stretch::<u16>(&tree, motion),
        _ => largest_stretch::<u32>(&tree, motion),
    }?;
    Ok((largest * MARGIN * 100.0).ceil() / 100.0)
}

fn largest_stretch<I: Index>(built: &BuiltTree, motion: &Motion) -> Result<f32> {
    let tree = built.tree::<I>()?;
    let mut largest = 1.0_f32;
    for (number, frame) in motion.frames.iter().enumerate() {
        let measured = measure_stretch(&tree, &built.to_rows(frame)[..])
            .with_context(|| format!("frame {number} of the motion"))?;
        largest = largest.max(measured.sigma());
    }
    Ok(largest)
}
