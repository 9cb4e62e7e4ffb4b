//! Queries any tree that passes validation, with any floats as vertices, tool and options. The outcome is an error, or
//! an answer whose interval is in order and whose tests are within the budget and a bound by the tree's records.
#![no_main]

use std::sync::LazyLock;

use dibs_build::{Builder, IndexWidth, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Budget, Capsule, NoSide, Options, Query, Side, Sphere, Tool, Tree, TriangleRow, measure_stretch,
};
use dibs_tests::tree_bytes::reseal;
use libfuzzer_sys::fuzz_target;

/// Node tests that a depth may take in any tree (`LEAST_WORK` in the core's `query/depth/mod.rs`).
const LEAST_WORK: u32 = 4_608;

/// Node tests that the order of ties in f32 and then in f64 takes for a triangle, and for one around a vertex
/// (`query/precision.rs`).
const DISTANCE_COST: u32 = 4 + 136;
const RING_COST: u32 = 3 + 68;

/// A valid tree and its rows. They are built before the first input: on a busy machine they would use up its time
/// limit.
static SOUND: LazyLock<(Vec<u8>, Vec<Vec3>)> = LazyLock::new(|| {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().index(IndexWidth::Bits16).build(&mesh).expect("a valid mesh");
    (built.blob().into(), built.to_rows(&mesh.positions))
});

/// Words of the input, zeros after its end.
struct Words<'a>(&'a [u8]);

impl Words<'_> {
    fn next(&mut self) -> u32 {
        let (word, rest) = self.0.split_at(self.0.len().min(4));
        self.0 = rest;
        let mut bytes = [0; 4];
        bytes[..word.len()].copy_from_slice(word);
        u32::from_le_bytes(bytes)
    }

    fn float(&mut self) -> f32 {
        f32::from_bits(self.next())
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }
}

fuzz_target!(init: LazyLock::force(&SOUND), |input: &[u8]| {
    let mut words = Words(input);
    let (mut bytes, mut rows) = SOUND.clone();
    let places = bytes.len() / 4;
    for _ in 0..words.next() % 8 {
        let at = words.next() as usize % places * 4;
        bytes[at..at + 4].copy_from_slice(&words.next().to_le_bytes());
    }
    reseal(&mut bytes);
    let Ok(tree) = Tree::<u16>::from_bytes(&bytes) else { return };
    let Ok(mut query) = Query::<_, MAX_STACK>::new(&tree) else { return };

    for _ in 0..words.next() % 8 {
        let row = words.next() as usize % rows.len();
        rows[row] = words.point();
    }
    let mut options = Options::cold();
    let flags = words.next();
    let budget = Budget::new(words.next() % 2_000);
    if flags & 1 != 0 {
        options = options.budget(budget);
    }
    if flags & 2 != 0 {
        options = options.warm_start(Some(TriangleRow(words.next())));
    }
    if flags & 4 != 0
        && let Ok(measured) = measure_stretch(&tree, rows.as_slice())
    {
        options = options.stretch(measured);
    }
    if flags & 16 != 0 {
        options = options.unsigned();
    }
    let budget = if flags & 1 != 0 { budget } else { Budget::UNLIMITED };
    if flags & 8 != 0 {
        if let Ok(tool) = Sphere::new(words.point(), words.float()) {
            ask(&mut query, &rows, &tool, &options, budget);
        }
    } else if let Ok(tool) = Capsule::new(words.point(), words.point(), words.float()) {
        ask(&mut query, &rows, &tool, &options, budget);
    }
});

fn ask(
    query: &mut Query<'_, u16, MAX_STACK>,
    rows: &[Vec3],
    tool: &impl Tool,
    options: &Options,
    budget: Budget,
) {
    let tree = *query.tree();
    let plain = options.unsigned();
    let answers = [
        query.closest(rows, tool, options),
        query.closest_batched(rows, tool, options),
        query.closest(rows, tool, &plain),
        query.closest_batched(rows, tool, &plain),
    ];
    for answer in answers.into_iter().flatten() {
        let (nodes, triangles) = most(&tree, tool, answer.side);
        assert!(answer.node_tests <= nodes && answer.triangle_tests <= triangles);
        assert!(answer.work() <= budget.tests().saturating_add(1 + Budget::TRIANGLE));
        assert!(answer.lower <= answer.separation);
        let is_signed = is_depth(tool, answer.side) || answer.side == Side::Inside;
        assert!(is_signed || answer.lower >= -tool.radius());
        assert!(answer.separation.is_finite() && answer.accuracy > 0.0);
        assert!(answer.corners.iter().all(|&corner| corner < tree.vertex_count()));
    }
}

/// Whether an answer with this side may have searched points of the axis for the deepest.
fn is_depth(tool: &impl Tool, side: Side) -> bool {
    let is_near = side == Side::Undefined(NoSide::BelowAccuracy);
    matches!(side, Side::Inside | Side::Crossing) && tool.axis_length() > 0.0 || is_near
}

/// The most tests of an answer with this side, without a budget.
fn most(tree: &Tree<'_, u16>, tool: &impl Tool, side: Side) -> (u32, u32) {
    let (nodes, triangles) = (tree.node_count(), tree.triangle_count());
    // The closest pair.
    let search = 3 * nodes + triangles;
    let (mut node_tests, mut triangle_tests) = (search + 1, triangles + 1);
    if matches!(side, Side::Undefined(NoSide::NotAsked | NoSide::NoAdjacency)) {
        return (node_tests, triangle_tests);
    }
    // Too many ties to remember are searched again, once for f32 and once for f64. At most all triangles tie, each at a
    // vertex.
    let mut around = vec![0; tree.vertex_count() as usize];
    let corners: Vec<_> = (0..triangles).filter_map(|row| tree.corners(TriangleRow(row))).collect();
    corners.iter().flatten().for_each(|&vertex| around[vertex as usize] += 1);
    let ring = |&row: &u32| around[row as usize];
    let rings: u32 = corners.iter().filter_map(|rows| rows.iter().map(ring).max()).sum();
    node_tests += 2 * search + DISTANCE_COST * triangles + RING_COST * rings;
    triangle_tests += 2 * triangles;
    if is_depth(tool, side) {
        let depth = (nodes + nodes / 2).max(LEAST_WORK);
        node_tests += depth;
        triangle_tests += depth / Budget::TRIANGLE;
    }
    (node_tests, triangle_tests)
}
