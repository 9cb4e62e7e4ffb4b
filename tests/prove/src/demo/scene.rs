//! The surface, its motion and its tree, as in the firmware.

use std::borrow::Cow;

use anyhow::{Context, Result, ensure};
use controller::instructions;
use dibs_build::{
    Builder, BuiltTree, Format, Mesh, Motion, MotionStretch, Paths, Unit, Volume, generate,
    write_limits,
};
use dibs_nostd::nodes::{Nodes, WHOLE};
use dibs_nostd::{Budget, Cost, Index, Tool, Tree, VertexTable};
use glam::{DVec3, Vec3};
use xtask::firmware::{HEART_STRETCH, Limits, Surface};
use xtask::workspace;

use super::Options;

/// Triangles of the generated heart: the number in the paper.
const HEART_TRIANGLES: u32 = 10_272;
/// Triangles of the heart that nodes move.
const CARRIED_TRIANGLES: u32 = 50_000;
/// Frames a second if a motion's file does not state it.
const RATE: f32 = 25.0;
/// Margin of the limits that are learned from a motion.
const MARGIN: f32 = 0.1;

/// The cells of a lattice along each axis.
#[derive(Clone, Copy, Debug)]
pub struct Cells(pub [u32; 3]);

/// Reads `lattice:NX,NY,NZ`.
pub fn cells(text: &str) -> Result<Cells> {
    let numbers = text.strip_prefix("lattice:").unwrap_or_default().split(',');
    let numbers: Option<Vec<u32>> = numbers.map(|number| number.trim().parse().ok()).collect();
    let cells = numbers.and_then(|numbers| numbers.try_into().ok());
    cells.map(Cells).context("expected lattice:NX,NY,NZ, the cells along each axis")
}

/// The moving surface, and the firmware's tree of it.
pub struct Scene {
    name: String,
    /// The input of the firmware's build script.
    pub surface: Surface,
    /// The tree; the firmware builds the same one, byte for byte.
    pub tree: BuiltTree,
    /// The motion, in the mesh's order of vertices, or in that of the nodes.
    pub motion: Motion,
    /// For each vertex row of the tree, the nodes that move it and their weights; empty if rows are vertices.
    carriers: Vec<[(u32, f64); 4]>,
    /// Frames a second at which the motion was recorded.
    pub rate: f32,
    /// The mesh's triangles by rows of the vertex table, not taken from the tree.
    pub triangles: Vec<[u32; 3]>,
}

impl Scene {
    /// Reads or generates everything.
    pub fn load(options: &Options) -> Result<Self> {
        if let Some(Cells(cells)) = options.nodes {
            return Self::carried(options, cells);
        }
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
        let path = options.mesh.as_deref().map(std::path::absolute).transpose()?;
        let given = options.mesh.as_ref().map(|path| path.display().to_string());
        Ok(Self {
            name: given.unwrap_or_else(|| "generated heart".to_owned()),
            surface: Surface { mesh: path, limits, nodes: None },
            rate,
            triangles: by_rows(&mesh, &tree),
            tree,
            motion,
            carriers: Vec::new(),
        })
    }

    /// A heart that the nodes of a lattice move.
    fn carried(options: &Options, cells: [u32; 3]) -> Result<Self> {
        let mesh = generate::heart(CARRIED_TRIANGLES)?.mesh;
        let volume = Volume::lattice(&mesh, cells)?;
        let nodes: Vec<Vec3> = volume.nodes().iter().map(|node| node.as_vec3()).collect();
        let motion = generate::beat(&nodes);
        let stretch = options.stretch.unwrap_or(HEART_STRETCH);
        let builder = Builder::new().stretch(stretch).with_rest_shape(false);
        let tree = builder.nodes(&volume).build(&mesh)?;
        // The firmware's build script makes the same tree from this file. An unchanged file is not rewritten, so that
        // nothing is rebuilt.
        let path =
            workspace::target().join(format!("demo-heart-{:08x}.ply", tree.summary().mesh_id));
        if !path.exists() {
            mesh.write(&path, Format::Ply)?;
        }
        Ok(Self {
            name: format!("generated heart that {} nodes carry", nodes.len()),
            surface: Surface {
                mesh: Some(path),
                limits: Limits::Stretch(stretch),
                nodes: Some(cells),
            },
            rate: motion.rate,
            triangles: by_rows(&mesh, &tree),
            carriers: match tree.index_bits() {
                16 => carriers(&tree.tree::<u16>()?)?,
                _ => carriers(&tree.tree::<u32>()?)?,
            },
            tree,
            motion,
        })
    }

    /// The surface's vertices for a frame's rows, computed in f64 and rounded once.
    pub fn vertices<'r>(&self, rows: &'r [Vec3]) -> Cow<'r, [Vec3]> {
        if self.carriers.is_empty() {
            return Cow::Borrowed(rows);
        }
        let vertex = |carriers: &[(u32, f64); 4]| {
            let part = |&(node, weight): &(u32, f64)| rows[node as usize].as_dvec3() * weight;
            carriers.iter().map(part).sum::<DVec3>().as_vec3()
        };
        Cow::Owned(self.carriers.iter().map(vertex).collect())
    }

    /// Largest distance (mm) of a vertex that the controller computes from that of [`vertices`](Self::vertices), as the
    /// tree states it.
    pub fn rounding(&self, rows: &[Vec3]) -> Result<f64> {
        fn of<I: Index>(scene: &Scene, rows: &[Vec3]) -> Result<f64> {
            let nodes = Nodes::of(&scene.tree.tree::<I>()?)?;
            Ok(nodes.surface(rows).position_error().into())
        }
        match self.tree.index_bits() {
            _ if self.carriers.is_empty() => Ok(0.0),
            16 => of::<u16>(self, rows),
            _ => of::<u32>(self, rows),
        }
    }

    /// The firmware's budget for a tick on this surface.
    pub fn budget(&self) -> Budget {
        let has_nodes = !self.carriers.is_empty();
        let cost = if has_nodes { Cost::M7_NODES_TICK } else { Cost::M7_TICK };
        Budget::for_instructions(instructions(has_nodes), &cost)
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

/// The mesh's triangles by rows of the tree's vertices.
fn by_rows(mesh: &Mesh, tree: &BuiltTree) -> Vec<[u32; 3]> {
    let mut row = vec![0; mesh.positions.len()];
    for (place, &vertex) in (0..).zip(tree.vertex_order()) {
        row[vertex as usize] = place;
    }
    mesh.triangles.iter().map(|corners| corners.map(|vertex| row[vertex as usize])).collect()
}

/// The nodes and weights of each row.
fn carriers<I: Index>(tree: &Tree<'_, I>) -> Result<Vec<[(u32, f64); 4]>> {
    let nodes = Nodes::of(tree)?;
    let part = |(node, weight): (u32, i32)| (node, f64::from(weight) / f64::from(WHOLE));
    let of = |row| Some(nodes.weights(row)?.map(part));
    (0..tree.vertex_count()).map(of).collect::<Option<_>>().context("a row without weights")
}
