//! A moving surface, the poses of an instrument around it, and whole queries of both.

use anyhow::Result;
use dibs_build::{Builder, BuiltTree, Mesh, Motion, Volume, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Budget, Capsule, Cost, Interval, MeasuredStretch, Odometer, Options, Proximity, Query, Side,
    SurfaceBlend, Tool, Tree, measure_stretch,
};
use glam::Vec3;
use probe::track::tick;

use super::force::wall;
use super::path::{path, place, through};
use crate::data::real;
use crate::probe::ticks::{Script, Tick, read};
use crate::probe::{COUNTING, board, build_for_board, run_on_board};

/// A point in a ventricle of the generated heart.
const MIDDLE: Vec3 = Vec3::new(12.0, -4.0, 38.0);

/// A tree, its frames with their stretches, and the poses of a path.
pub struct Scene {
    tree: BuiltTree,
    frames: Vec<(Vec<Vec3>, MeasuredStretch)>,
    path: Vec<Capsule>,
    /// The program on the board that reads such frames.
    program: &'static str,
}

/// The programs for frames of vertices and of nodes.
const PROGRAMS: [&str; 2] = ["chain", "carried"];

/// The result of whole queries for a tick.
pub struct Truth {
    pub lower: f32,
    pub upper: f32,
    pub accuracy: f32,
    pub side: Side,
    pub direction: Vec3,
    /// The force (N) of the demo's wall, without damping.
    pub force: Vec3,
}

impl Truth {
    /// Whether an answer's certified interval does not hold the true separation.
    pub fn is_missed_by(&self, found: &Proximity) -> bool {
        let Interval { mut lower, upper } = found.interval();
        // Without a side, `lower` is that of a tool outside.
        if matches!(found.side, Side::Undefined(_)) && self.side == Side::Outside {
            lower = found.lower - found.accuracy;
        }
        lower > self.upper + self.accuracy || upper < self.lower - self.accuracy
    }
}

impl Scene {
    /// A generated heart of this many triangles, and a path at a multiple of the usual speed.
    pub fn heart(triangles: u32, faster: f32, ticks: usize) -> Result<Self> {
        let generate::MovingMesh { mesh, motion } = generate::heart(triangles)?;
        Self::of(&mesh, &motion, 1.5, |frames| path(&frames[0], (MIDDLE, faster), ticks))
    }

    /// A generated heart, and an instrument through it, then one inside.
    pub fn through_heart(ticks: usize) -> Result<Option<Self>> {
        let generate::MovingMesh { mesh, motion } = generate::heart(10_272)?;
        Self::of(&mesh, &motion, 1.5, |frames| through(frames, MIDDLE, ticks)).map(Some)
    }

    /// A generated heart of this many triangles that a lattice's nodes move, and the path around it.
    pub fn carried(triangles: u32, cells: [u32; 3], ticks: usize) -> Result<Self> {
        let mesh = generate::heart(triangles)?.mesh;
        let volume = Volume::lattice(&mesh, cells)?;
        let nodes: Vec<Vec3> = volume.nodes().iter().map(|node| node.as_vec3()).collect();
        let tree = Builder::new().stretch(1.5).nodes(&volume).build(&mesh)?;
        let of = Nodes::of(&tree.tree::<u16>()?)?;
        let frames = generate::beat(&nodes).frames.into_iter();
        let frames = frames.map(|rows| {
            let stretch = of.measure(rows.as_slice())?;
            Ok((rows, stretch))
        });
        let frames = frames.collect::<Result<_>>()?;
        let path = path(&corners(&mesh, &mesh.positions), (MIDDLE, 1.0), ticks);
        let [_, program] = PROGRAMS;
        Ok(Self { tree, frames, path, program })
    }

    /// A human heart, if it is beside the repository. A triangle of it is stretched by 1.522.
    pub fn human(ticks: usize) -> Result<Option<Self>> {
        let Some(folder) = real() else { return Ok(None) };
        let mesh = dibs_build::read(folder.join("heart_10272.ply"))?.mesh;
        let motion = Motion::read_pc2(folder.join("heart_10272.pc2"))?;
        let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
        Self::of(&mesh, &motion, 4.0, |frames| path(&frames[0], (middle, 1.0), ticks)).map(Some)
    }

    /// A moving surface within this stretch, and a path around the triangles of its frames.
    fn of(
        mesh: &Mesh,
        Motion { frames, .. }: &Motion,
        stretch: f32,
        path: impl FnOnce(&[Vec<[Vec3; 3]>]) -> Vec<Capsule>,
    ) -> Result<Self> {
        let tree = Builder::new().stretch(stretch).build(mesh)?;
        let view = tree.tree::<u16>()?;
        let corners: Vec<_> = frames.iter().map(|frame| corners(mesh, frame)).collect();
        let path = path(&corners);
        let frames = frames.iter().map(|frame| {
            let rows = tree.to_rows(frame);
            let stretch = measure_stretch(&view, rows.as_slice())?;
            Ok((rows, stretch))
        });
        let frames = frames.collect::<Result<_>>()?;
        let [program, _] = PROGRAMS;
        Ok(Self { tree, frames, path, program })
    }

    /// The tree as the queries read it.
    pub fn tree(&self) -> Tree<'_, u16> {
        self.tree.tree().expect("16-bit indices")
    }

    /// The cost of a tick on its surface.
    pub fn cost(&self) -> Cost {
        Cost::of_tick(&self.tree())
    }

    /// The number of ticks.
    pub fn ticks(&self) -> usize {
        self.path.len()
    }

    /// Calls a function with each tick's surface, whose frames are of vertices, and pose.
    pub fn each<T>(
        &self,
        tree: &Tree<'_, u16>,
        mut ask: impl FnMut(usize, &SurfaceBlend<'_, [Vec3], [Vec3]>, &Capsule, Options) -> T,
    ) -> Vec<T> {
        let mut odometer = Odometer::new(tree);
        let mut step = None;
        let ticks = self.path.iter().enumerate().map(|(tick, tool)| {
            // From its ends, as on the board: a capsule keeps their rounded difference.
            let tool = Capsule::new(tool.start(), tool.end(), tool.radius()).expect("a valid tool");
            let (frame, share) = place(tick);
            let (rows, stretch) = &self.frames[frame % self.frames.len()];
            let (next, next_stretch) = &self.frames[(frame + 1) % self.frames.len()];
            if share == 0.0 {
                step = Some(odometer.step(rows.as_slice(), next.as_slice()));
            }
            let surface = step.as_ref().expect("a step").at(share);
            let both = stretch.or_larger(*next_stretch).expect("one tree");
            ask(tick, &surface, &tool, Options::cold().stretch(both))
        });
        ticks.collect()
    }
}

/// The corners of all triangles.
fn corners(mesh: &Mesh, positions: &[Vec3]) -> Vec<[Vec3; 3]> {
    mesh.triangles.iter().map(|rows| rows.map(|row| positions[row as usize])).collect()
}

/// The results of whole queries for each tick.
pub fn truth(scene: &Scene) -> Vec<Truth> {
    let tree = scene.tree();
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
    let wall = wall();
    scene.each(&tree, |_, surface, tool, options| {
        let options = options.depth_tolerance(0.02);
        let found = query.closest(surface, tool, &options).expect("an answer");
        let Proximity { lower, separation: upper, accuracy, side, direction, .. } = found;
        let force = wall.force(&Ok(found), Vec3::ZERO).force;
        Truth { lower, upper, accuracy, side, direction, force }
    })
}

/// All ticks except the first of a tracker on the board within a budget. `bits` selects what else the tracker must find.
pub fn on_board(scene: &Scene, bits: u32, budget: Budget) -> Result<Vec<Tick>> {
    let program = build_for_board(&board()?, scene.program)?;
    let frames = &scene.frames;
    let mut script = Script::new(&scene.tree, &frames[0].0);
    let bits = bits | tick::INTERPOLATED | tick::SIGNED | budget.tests() << tick::BUDGET;
    for (at, tool) in scene.path.iter().enumerate() {
        let (frame, share) = place(at);
        if share == 0.0 {
            script.frame(&frames[(frame + 1) % frames.len()].0);
        }
        script.tick(bits, share, tool);
    }
    let ticks = scene.path.len() as u32;
    read(&run_on_board(&program, &script.end(), COUNTING)?, ticks)
}
