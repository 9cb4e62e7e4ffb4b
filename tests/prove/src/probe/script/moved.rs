//! Scripts for surfaces that modes, nodes or two frames define.

use dibs_build::modes::ModalFit;
use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, Motion, Volume, generate};
use dibs_nostd::modes::{MAX_MODES, Modes};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Budget, VertexTable};
use dibs_tests::motions::trembling;
use dibs_tests::oracle::Instrument;
use dibs_tests::poses::pose;
use dibs_tests::surfaces;
use fastrand::Rng;
use glam::Vec3;
use probe::command;

use super::{Draw, Record, Script, Table, about, build};

/// Frames of a motion that are asked about.
const FRAMES: usize = 8;

impl Script {
    /// A heart with this many modes: each frame as rows, as weights, and as weights with a cache of positions, and the
    /// same queries on each.
    pub fn modal(modes: usize, queries: usize, seed: u64) -> Self {
        let (mesh, motion) = trembling(10_272, modes.div_ceil(2), seed);
        Self::modal_of(&mesh, &motion, modes, queries, Draw::Exhausting, seed)
    }

    /// The same for any surface, with generated queries.
    pub fn modal_of(
        mesh: &Mesh,
        motion: &Motion,
        modes: usize,
        queries: usize,
        draw: Draw,
        seed: u64,
    ) -> Self {
        let mut rng = Rng::with_seed(seed);
        let fit = ModalFit::new(mesh, motion).expect("a motion");
        let built = build(mesh, 8).with_modes(&fit, modes).expect("so many");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let shape = Modes::of(&tree).expect("with modes");
        let triangles = surfaces::triangles(&tree);
        let mut script = Self::default();
        script.tree(&built);
        for weights in built.modal_motion().expect("with modes").weights.iter().step_by(3) {
            let surface = shape.surface::<MAX_MODES>(weights).expect("recorded");
            let rows = 0..tree.vertex_count();
            let rows: Vec<Vec3> = rows.filter_map(|row| surface.position(row)).collect();
            let tools: Vec<Instrument> =
                (0..queries).map(|number| about(&rows, &triangles, number, &mut rng)).collect();
            for table in [None, Some(0), Some(1)] {
                match table {
                    None => script.rows(&rows, triangles.len() as u32),
                    Some(remembers) => {
                        script.words.extend([command::WEIGHTS, remembers, weights.len() as u32]);
                        script.words.extend(weights.iter().map(|weight| weight.to_bits()));
                        script.table = [Table::Modes, Table::Memory][remembers as usize];
                        script.records.push(Record::Bound);
                        script.records.push(Record::Positions(rows.len() as u32));
                    }
                }
                // The same queries each time.
                let mut rng = rng.clone();
                for tool in &tools {
                    let is_capsule = tool.start != tool.end;
                    let (warm, budget) = match draw {
                        Draw::Exhausting => (u32::MAX, Budget::UNLIMITED),
                        _ => {
                            let warm = Draw::warm(tree.triangle_count(), &mut rng);
                            (warm, draw.budget(is_capsule, &mut rng).0)
                        }
                    };
                    script.query(tool, is_capsule, true, warm, budget, None);
                }
            }
        }
        script.words.push(command::END);
        script
    }

    /// A surface interpolated between the frames of a motion, and extrapolated beyond them.
    pub fn moving_of(mesh: &Mesh, motion: &Motion, queries: usize, draw: Draw, seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let built = build(mesh, 8);
        let mut script = Self::default();
        script.tree(&built);
        for pair in motion.frames.windows(2).step_by(motion.frames.len().div_ceil(FRAMES)) {
            let [before, after] = [0, 1].map(|frame| built.to_rows(&pair[frame]));
            let t = 3.0 * rng.f32();
            let between: Vec<Vec3> =
                before.iter().zip(&after).map(|(a, b)| *a + (*b - *a) * t).collect();
            script.rows(&before, mesh.triangles.len() as u32);
            script.words.push(command::MOVE);
            script.positions(&after);
            script.words.push(t.to_bits());
            script.table = Table::Moving;
            script.drawn(&built, &between, queries.div_ceil(FRAMES), draw, &mut rng);
        }
        script.words.push(command::END);
        script
    }

    /// A surface that the nodes of a lattice move, with this many cells along each axis.
    pub fn embedded_of(mesh: &Mesh, cells: u32, queries: usize, draw: Draw, seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let volume = Volume::lattice(mesh, [cells; 3]).expect("a lattice");
        let at_rest: Vec<Vec3> = volume.nodes().iter().map(|node| node.as_vec3()).collect();
        let builder = Builder::new().index(IndexWidth::Bits16).stretch(1.5).leaf_triangles(8);
        let built = builder.nodes(&volume).build(mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let nodes = Nodes::of(&tree).expect("with nodes");
        let mut script = Self::default();
        script.tree(&built);
        let motion = generate::beat(&at_rest);
        for frame in motion.frames.iter().step_by(motion.frames.len().div_ceil(FRAMES)) {
            let surface = nodes.surface(&frame[..]);
            let rows = 0..tree.vertex_count();
            let rows: Vec<Vec3> = rows.filter_map(|row| surface.position(row)).collect();
            script.words.push(command::NODES);
            script.positions(frame);
            script.table = Table::Nodes;
            script.drawn(&built, &rows, queries.div_ceil(FRAMES), draw, &mut rng);
        }
        script.words.push(command::END);
        script
    }

    /// Queries on a surface with these positions: half of the tools wander around it.
    fn drawn(
        &mut self,
        built: &BuiltTree,
        rows: &[Vec3],
        queries: usize,
        draw: Draw,
        rng: &mut Rng,
    ) {
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        for number in 0..queries {
            let tool = if rng.bool() {
                about(rows, &triangles, number, rng)
            } else {
                pose(rows, &triangles, rng)
            };
            let is_capsule = tool.start != tool.end || rng.u32(..8) == 0;
            let warm = Draw::warm(tree.triangle_count(), rng);
            let (budget, deadline) = draw.budget(is_capsule, rng);
            self.query(&tool, is_capsule, false, warm, budget, deadline);
        }
    }
}
