//! Queries any tree that passes validation, with any floats as vertices, tool and options. The outcome is an error, or
//! an answer whose interval is in order and whose tests are within the budget and the tree's number of records.
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

/// Most searches of a query: one for the closest pair, the others for the depth of an axis (`POINTS` in the core's
/// `query/depth.rs`).
const MOST_LOOKS: u32 = 28;

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
    let budget = Budget { node_tests: words.next() % 1_000, triangle_tests: words.next() % 100 };
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
    let both = [query.closest(rows, tool, options), query.closest_wide(rows, tool, options)];
    for answer in both.into_iter().flatten() {
        // Tests of one search. A query makes one search, or many where the tool's axis crosses the surface.
        let most = 3 * tree.node_count() + tree.triangle_count() + 1;
        let is_depth =
            answer.side == Side::Crossing || answer.side == Side::Undefined(NoSide::BelowAccuracy);
        let looks = if is_depth { MOST_LOOKS } else { 1 };
        assert!(answer.node_tests <= budget.node_tests.saturating_add(1).min(looks * most));
        let most = tree.triangle_count() + 1;
        assert!(answer.triangle_tests <= budget.triangle_tests.min(looks * most));
        assert!(answer.lower <= answer.separation);
        let is_signed = is_depth || answer.side == Side::Inside;
        assert!(is_signed || answer.lower >= -tool.radius());
        assert!(answer.separation.is_finite() && answer.accuracy > 0.0);
        assert!(answer.corners.iter().all(|&corner| corner < tree.vertex_count()));
    }
}
