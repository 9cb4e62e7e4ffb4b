//! The surface, its motion and its tree, as in the firmware.

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, BuiltTree, Motion, MotionStretch, Paths, Unit, generate, write_limits};
use dibs_nostd::Tool;
use glam::Vec3;
use xtask::firmware::{HEART_STRETCH, Limits, Surface};
use xtask::workspace;

use super::Options;

/// Triangles of the generated heart: those of the paper's.
const HEART_TRIANGLES: u32 = 10_272;
/// Frames a second where a motion's file does not say it.
const RATE: f32 = 25.0;
/// Margin of the limits that are learned from a motion.
const MARGIN: f32 = 0.1;

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
        let corner = |of: fn(Vec3, Vec3) -> Vec3| mesh.positions.iter().copied().reduce(of);
        let size = corner(Vec3::max).zip(corner(Vec3::min)).map(|(high, low)| high - low);
        let size = size.unwrap_or_default().max_element();
        let thick = 2.0 * Tool::radius(&controller::instrument(0)?);
        ensure!(
            size > thick,
            "the surface is {size} mm across, less than the instrument's {thick} mm: the demo takes mm; scale a mesh in \
             another unit, and its motion"
        );
        ensure!(!motion.frames.is_empty(), "the motion has no frame");
        let recorded = if motion.rate > 0.0 { motion.rate } else { RATE };
        let rate = options.motion_rate.unwrap_or(recorded);
        ensure!(
            rate > 0.0 && rate.is_finite(),
            "{rate} frames a second; give a --motion-rate above 0"
        );
        let (limits, builder) = match (options.stretch, &options.mesh) {
            (None, Some(_)) => {
                let needed = MotionStretch::new(&mesh, &motion, Paths::default(), &|_| ())
                    .context("measuring the motion")?;
                let each = needed.limits(MARGIN);
                let file = workspace::target().join("demo-limits.txt");
                write_limits(&file, &mesh, &each, "Learned by `cargo xtask demo`")?;
                (Limits::File(file), Builder::new().limits(each))
            }
            (stretch, _) => {
                let stretch = stretch.unwrap_or(HEART_STRETCH);
                (Limits::Stretch(stretch), Builder::new().stretch(stretch))
            }
        };
        let tree = builder.build(&mesh)?;
        let mut row = vec![0; mesh.positions.len()];
        for (place, &vertex) in (0..).zip(tree.vertex_order()) {
            row[vertex as usize] = place;
        }
        let path = options.mesh.as_deref().map(std::path::absolute).transpose()?;
        let given = options.mesh.as_ref().map(|path| path.display().to_string());
        Ok(Self {
            name: given.unwrap_or_else(|| "generated heart".to_owned()),
            surface: Surface { mesh: path, limits },
            rate,
            triangles: mesh.triangles.iter().map(|t| t.map(|v| row[v as usize])).collect(),
            tree,
            motion,
        })
    }

    /// One line for the user.
    pub fn describe(&self) -> String {
        let summary = self.tree.summary();
        let limits = match self.surface.limits {
            Limits::Stretch(stretch) => format!("stretch limit {stretch}"),
            Limits::File(_) => format!("limits learned, {} at most", summary.stretch),
        };
        format!(
            "{}: {} triangles, {} vertices, {} frames of motion, {limits}",
            self.name,
            summary.triangles,
            summary.vertices,
            self.motion.frames.len(),
        )
    }
}
