//! Scripts for the probe: surfaces, frames and queries, as words.
//!
//! One file, because a script and its words belong together; [`moved`] has those for surfaces that are not a table of
//! rows, [`sided`] those with side.

mod moved;
mod sided;

pub use sided::{are_clear, bounded};

use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, Motion, generate};
use dibs_nostd::{Budget, Cost, Options, Query, Tool};
use dibs_tests::deform::Deformation;
use dibs_tests::method::Probe;
use dibs_tests::oracle::Instrument;
use dibs_tests::poses::pose;
use dibs_tests::streams::Beat;
use dibs_tests::surfaces;
use fastrand::Rng;
use glam::Vec3;
use probe::{command, how};

/// A script, and the kinds of its answers.
#[derive(Default)]
pub struct Script {
    words: Vec<u32>,
    /// The options of every query, except the measured stretch.
    how: u32,
    /// Roots of the last tree besides the first.
    roots: u32,
    /// The table of the last frame.
    table: Table,
    /// The kind of each answer, in order.
    pub records: Vec<Record>,
}

/// A question to the probe.
#[derive(Clone, Copy, Debug)]
pub enum Record {
    /// The stretch of a frame of this many triangles.
    Stretch(u32),
    /// The bound of a modal frame's stretch.
    Bound,
    /// Every position of a modal frame of this many vertices.
    Positions(u32),
    Query {
        /// Whether the tool is a capsule.
        is_capsule: bool,
        /// Roots of the tree besides the first.
        roots: u32,
        table: Table,
        /// Whether it asks for the side.
        is_signed: bool,
        /// Number of instructions that the budget was made for, if any.
        deadline: Option<u32>,
    },
}

/// The source of a query's positions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Table {
    /// The rows of a frame.
    #[default]
    Rows,
    /// The rows of two frames.
    Moving,
    Nodes,
    Modes,
    /// Modes, with a cache of positions.
    Memory,
}

/// Ticks until the tool of table 3 repeats its path, approximately: 77 s.
const PATH_TICKS: u32 = 77_000;
/// Most frames of the heart's motion that poses are tried on.
const FRAMES_OF_POSES: usize = 10;

/// How the queries of a script are generated.
#[derive(Clone, Copy)]
pub enum Draw {
    /// Every option at random.
    Any,
    /// The same, half of the queries batched, and half of them signed.
    EitherWay,
    /// Without a budget: complete searches.
    Exhausting,
    /// With a budget of a few tests, so that the most expensive tests dominate.
    Short,
    /// With a budget made for a random number of instructions, by these cost models of a sphere and a capsule.
    Deadline([Cost; 2]),
}

impl Draw {
    /// A triangle for a warm start; sometimes one that the tree does not have.
    fn warm(triangles: u32, rng: &mut Rng) -> u32 {
        if rng.bool() { u32::MAX } else { rng.u32(..triangles + 2) }
    }

    /// A budget, and the number of instructions that it was made for, if any.
    fn budget(self, is_capsule: bool, rng: &mut Rng) -> (Budget, Option<u32>) {
        match self {
            Self::Any | Self::EitherWay if rng.bool() => (Budget::new(rng.u32(..780)), None),
            Self::Short => (Budget::new(rng.u32(..72)), None),
            Self::Deadline(costs) => {
                let cost = costs[usize::from(is_capsule)];
                let instructions = cost.base + rng.u32(..100_000);
                (Budget::for_instructions(instructions, &cost), Some(instructions))
            }
            _ => (Budget::UNLIMITED, None),
        }
    }
}

/// The information that a query starts from.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// None, with the tree's stretch limit.
    Cold,
    /// The last tick's triangle, and the frame's measured stretch.
    Warm,
}

/// The results that a query must find.
#[derive(Clone, Copy)]
pub enum Asks {
    /// The unsigned distance.
    Distance,
    /// Side and signed separation too.
    Side,
    /// And contacts within [`probe::MARGIN`].
    Contacts,
}

impl Asks {
    fn how(self) -> u32 {
        match self {
            Self::Distance => 0,
            Self::Side => how::SIGNED,
            Self::Contacts => how::SIGNED | how::CONTACTS,
        }
    }
}

/// A surface, and the largest number of triangles in a leaf of its tree.
pub struct Subject {
    pub name: &'static str,
    mesh: Mesh,
    leaf: usize,
}

impl Subject {
    pub fn new(name: &'static str, mesh: Mesh, leaf: usize) -> Self {
        Self { name, mesh, leaf }
    }
}

impl Script {
    /// Small surfaces of every kind in every deformation, with adversarial tools: close, on and inside, at centres and
    /// mid-planes, where all distances are equal.
    pub fn adversarial(queries: usize, draw: Draw, seed: u64) -> Self {
        let subjects = [
            Subject::new("heart", generate::heart(1_280).expect("a valid size").mesh, 8),
            Subject::new("brain", generate::brain(1_200).expect("a valid size"), 4),
            Subject::new("ball", surfaces::ball(3), 8),
            Subject::new("slivers", surfaces::slivers(60), 1),
        ];
        Self::about_all(&subjects, false, queries, draw, seed)
    }

    /// The same for these surfaces; with `wandering`, half of the tools wander around the surface.
    pub fn about_all(
        subjects: &[Subject],
        wandering: bool,
        queries: usize,
        draw: Draw,
        seed: u64,
    ) -> Self {
        let mut rng = Rng::with_seed(seed);
        let mut script = Self::default();
        let of_each = queries.div_ceil(subjects.len());
        // So few queries for each frame that every mesh has every deformation twice.
        let of_frame = (of_each / (2 * Deformation::ALL.len())).clamp(1, 100);
        for Subject { mesh, leaf, .. } in subjects {
            let built = build(mesh, *leaf);
            let tree = built.tree::<u16>().expect("16-bit indices");
            script.tree(&built);
            let end = script.queries() + of_each;
            while script.queries() < end {
                for deformation in Deformation::ALL {
                    let left = end.saturating_sub(script.queries()).min(of_frame);
                    let (paths, limit) = (tree.paths(), tree.stretch());
                    let moved = deformation.apply(mesh, paths, limit, &mut rng);
                    script.frame(&built, &moved, wandering, left, draw, &mut rng);
                }
            }
        }
        script.words.push(command::END);
        script
    }

    /// A script that begins with the tree of the firmware's heart.
    fn heart() -> (Self, BuiltTree, Motion) {
        let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
        let built = build(&mesh, 8);
        let mut script = Self::default();
        script.tree(&built);
        (script, built, motion)
    }

    /// The moving heart of the firmware, and a tool that wanders around it: the typical case.
    pub fn usual(queries: usize, seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let (mut script, built, motion) = Self::heart();
        let triangles = surfaces::triangles(&built.tree::<u16>().expect("16-bit indices"));
        for positions in motion.frames.iter().step_by(motion.frames.len().div_ceil(8)) {
            let rows = built.to_rows(positions);
            script.rows(&rows, triangles.len() as u32);
            for number in 0..queries.div_ceil(8) {
                let tool = about(&rows, &triangles, number, &mut rng);
                script.query(&tool, number % 2 == 1, true, u32::MAX, Budget::UNLIMITED, None);
            }
        }
        script.words.push(command::END);
        script
    }

    /// The beating generated heart and the capsule of table 3, at ticks spread over the whole path: each on the surface
    /// of its own tick.
    pub fn beating(ticks: u32, start: Start, asks: Asks) -> Self {
        let (mut script, built, motion) = Self::heart();
        script.how = asks.how();
        let tree = built.tree::<u16>().expect("16-bit indices");
        let beat = Beat::new(&motion);
        let mut query = Query::<_, 512>::new(&tree).expect("a stack that is large enough");
        let mut positions = Vec::new();
        for tick in (1..PATH_TICKS).step_by((PATH_TICKS / ticks) as usize) {
            let mut at = |tick| {
                beat.deform(tick, &mut positions);
                let Probe::Capsule(tool) = beat.tool(tick) else { panic!("a capsule") };
                (built.to_rows(&positions), tool)
            };
            let (rows, tool) = at(tick - 1);
            let before =
                query.closest(&rows[..], &tool, &Options::cold().unsigned()).expect("a query");
            let (rows, tool) = at(tick);
            script.rows(&rows, tree.triangle_count());
            let tool = Instrument::capsule(tool.start(), tool.end(), tool.radius());
            let is_warm = start == Start::Warm;
            let first = before.triangle.filter(|_| is_warm).map_or(u32::MAX, |triangle| triangle.0);
            script.query(&tool, true, is_warm, first, Budget::UNLIMITED, None);
        }
        script.words.push(command::END);
        script
    }

    /// The same moving heart with adversarial capsules: on, in, through and far from it.
    pub fn poses(queries: usize, asks: Asks, seed: u64) -> Self {
        let mut rng = Rng::with_seed(seed);
        let (mut script, built, motion) = Self::heart();
        script.how = asks.how();
        let triangles = surfaces::triangles(&built.tree::<u16>().expect("16-bit indices"));
        let frames = motion.frames.iter().step_by(motion.frames.len().div_ceil(FRAMES_OF_POSES));
        let of_each = queries.div_ceil(frames.len());
        for positions in frames {
            let rows = built.to_rows(positions);
            script.rows(&rows, triangles.len() as u32);
            for _ in 0..of_each {
                let tool = pose(&rows, &triangles, &mut rng);
                script.query(&tool, true, true, u32::MAX, Budget::UNLIMITED, None);
            }
        }
        script.words.push(command::END);
        script
    }

    /// Capsules beside a ball, with one subnormal coordinate: a processor that flushes subnormals to zero answers with
    /// another point of the axis.
    pub fn subnormal() -> Self {
        let mesh = surfaces::ball(1);
        let built = build(&mesh, 8);
        let tree = built.tree::<u16>().expect("16-bit indices");
        let mut script = Self::default();
        script.tree(&built);
        script.rows(&built.to_rows(&mesh.positions), tree.triangle_count());
        for number in 0..64 {
            let tiny = f32::from_bits(1 << (number % 23));
            let height = 45.0 + 0.1 * number as f32;
            let (start, end) = (Vec3::new(tiny, -60.0, height), Vec3::new(tiny, 50.0, height));
            let tool = Instrument::capsule(start, end, 2.5);
            script.query(&tool, true, true, u32::MAX, Budget::UNLIMITED, None);
        }
        script.words.push(command::END);
        script
    }

    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// Queries so far.
    pub fn queries(&self) -> usize {
        self.records.iter().filter(|record| matches!(record, Record::Query { .. })).count()
    }

    fn tree(&mut self, built: &BuiltTree) {
        let blob = built.blob();
        self.roots = built.tree::<u16>().expect("16-bit indices").roots() - 1;
        self.words.extend([command::TREE, blob.len() as u32]);
        self.words.extend(super::padded(blob));
    }

    fn frame(
        &mut self,
        built: &BuiltTree,
        moved: &[Vec3],
        wandering: bool,
        queries: usize,
        draw: Draw,
        rng: &mut Rng,
    ) {
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let rows = built.to_rows(moved);
        self.rows(&rows, tree.triangle_count());
        for number in 0..queries {
            let tool = if wandering && rng.bool() {
                about(&rows, &triangles, number, rng)
            } else {
                pose(&rows, &triangles, rng)
            };
            // A capsule of length zero is a capsule as well.
            let is_capsule = tool.start != tool.end || rng.u32(..8) == 0;
            let warm = Draw::warm(tree.triangle_count(), rng);
            let measured = rng.bool();
            let (budget, deadline) = draw.budget(is_capsule, rng);
            if matches!(draw, Draw::EitherWay) {
                self.how = if number % 2 == 1 { how::SIGNED } else { 0 };
            }
            if matches!(draw, Draw::EitherWay) && rng.bool() {
                self.words.push(command::QUERY_IN_ROUNDS);
            } else {
                self.words.push(command::QUERY);
            }
            self.asked(&tool, is_capsule, measured, warm, budget, deadline);
        }
    }

    fn rows(&mut self, rows: &[Vec3], triangles: u32) {
        self.words.push(command::FRAME);
        self.positions(rows);
        self.records.push(Record::Stretch(triangles));
        self.table = Table::Rows;
    }

    fn positions(&mut self, rows: &[Vec3]) {
        self.words.extend(rows.iter().flat_map(|row| row.to_array().map(f32::to_bits)));
    }

    fn query(
        &mut self,
        tool: &Instrument,
        is_capsule: bool,
        measured: bool,
        warm: u32,
        budget: Budget,
        deadline: Option<u32>,
    ) {
        self.words.push(command::QUERY);
        self.asked(tool, is_capsule, measured, warm, budget, deadline);
    }

    fn asked(
        &mut self,
        tool: &Instrument,
        is_capsule: bool,
        measured: bool,
        warm: u32,
        budget: Budget,
        deadline: Option<u32>,
    ) {
        let points = [tool.start, tool.end].map(|p| p.to_array().map(f32::to_bits));
        self.words.extend(points.as_flattened());
        self.words.push(tool.radius.to_bits());
        let how = self.how | if measured { how::MEASURED } else { 0 };
        let is_signed = how & how::SIGNED != 0;
        self.words.extend([u32::from(is_capsule), how, warm, budget.tests()]);
        let (roots, table) = (self.roots, self.table);
        self.records.push(Record::Query { is_capsule, roots, table, is_signed, deadline });
    }
}

/// A tool that wanders around a surface: alternately a sphere and a capsule.
fn about(rows: &[Vec3], triangles: &[[u32; 3]], number: usize, rng: &mut Rng) -> Instrument {
    let [a, ..] = triangles[rng.usize(..triangles.len())].map(|v| rows[v as usize]);
    let away = a.normalize_or(Vec3::Z) * 60.0 * rng.f32();
    match number % 2 {
        0 => Instrument::sphere(a + away, 2.5),
        _ => Instrument::capsule(a + away, a + away * 1.5 + Vec3::Z * 60.0, 2.5),
    }
}

fn build(mesh: &Mesh, leaf: usize) -> BuiltTree {
    let builder = Builder::new().index(IndexWidth::Bits16).stretch(1.5).leaf_triangles(leaf);
    builder.build(mesh).expect("a valid mesh")
}
