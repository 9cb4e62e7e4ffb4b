//! One design choice at a time, on the same streams, with exact counts.

use anyhow::Result;
use dibs_build::{Builder, BuiltTree, Construction, Mesh, Paths};
use dibs_tests::dibs::{Knowledge, queries, unordered_queries};
use dibs_tests::streams::Stream;

use super::brain::{Frames, STRETCH, TOOLS};
use super::measure::{Contender, Race, Update};
use super::plan::{Plan, Progress};
use super::record::{Cell, Record, Records};
use super::subjects;

/// The stream of this experiment.
const SEED: u64 = 2_000;

/// A tree and its queries' options.
struct Variant {
    name: &'static str,
    tree: BuiltTree,
    knowledge: Knowledge,
    ordered: bool,
}

impl Variant {
    fn contender(&self) -> Contender<'_> {
        let Self { name, tree, knowledge, ordered } = self;
        let method = if *ordered { queries(tree, *knowledge) } else { unordered_queries(tree) };
        let update = if knowledge.measured { Update::Measure } else { Update::Nothing };
        Contender::new(name, update, method)
    }
}

pub fn run(plan: &Plan, records: &mut Records) -> Result<()> {
    for &triangles in &plan.ablation_brains {
        let subject = subjects::brain(triangles)?;
        one(plan, &subject.name, &subject.mesh, records)?;
    }
    let Some(heart) = subjects::hearts(plan.heart_triangles)?.pop() else { return Ok(()) };
    one(plan, &heart.name, &heart.mesh, records)
}

/// The default comes first; every other variant differs from it as its name says.
fn variants(mesh: &Mesh) -> Result<Vec<Variant>> {
    let default = || Builder::new().stretch(STRETCH);
    let surface = |crossings| default().paths(Paths::Surface { crossings });
    let trees = [
        ("default", default()),
        ("paths: mesh edges only", default().paths(Paths::Edges)),
        ("paths: chords across 1 edge", surface(1)),
        ("paths: chords across up to 2 edges", surface(2)),
        ("paths: chords across up to 3 edges", surface(3)),
        ("pin: middle of the coordinates", default().construction(Construction::MidRangePin)),
        ("split: a plane", default().construction(Construction::PlaneSplit)),
        ("leaves of 1 triangle", default().leaf_triangles(1)),
        ("leaves of up to 2 triangles", default().leaf_triangles(2)),
        ("leaves of up to 4 triangles", default().leaf_triangles(4)),
        ("leaves of up to 8 triangles", default().leaf_triangles(8)),
        ("the paper's construction", default().construction(Construction::Paper)),
        (
            "the paper's construction, leaves of up to 4 triangles",
            default().construction(Construction::Paper).leaf_triangles(4),
        ),
    ];
    let mut variants = Vec::new();
    for (name, builder) in trees {
        let tree = builder.build(mesh)?;
        variants.push(Variant { name, tree, knowledge: Knowledge::default(), ordered: true });
    }
    let default = variants[0].tree.clone();
    let knowing = |name, measured, warm| {
        let knowledge = Knowledge { measured, warm };
        Variant { name, tree: default.clone(), knowledge, ordered: true }
    };
    variants.extend([
        knowing("measured stretch", true, false),
        knowing("warm start", false, true),
        knowing("measured stretch and warm start", true, true),
        Variant { ordered: false, ..knowing("vertices in the mesh's order", false, false) },
    ]);
    Ok(variants)
}

fn one(plan: &Plan, name: &str, mesh: &Mesh, records: &mut Records) -> Result<()> {
    let size = mesh.triangles.len();
    let progress = Progress::start(&format!("ablation, {name} of {size} triangles: building"), 0);
    let variants = variants(mesh)?;
    progress.finish();
    let progress = Progress::start(
        &format!("ablation, {name} of {size} triangles"),
        plan.ablation_queries as u64,
    );
    // Each tool has a separate race, so that a warm start is from the same tool's last query.
    for (tool, tool_name) in TOOLS.into_iter().enumerate() {
        let mut race = Race::new(variants.iter().map(Variant::contender).collect(), 1);
        let mut frames = Frames::new(&variants[0].tree);
        let mut stream = Stream::new(&mesh.positions, SEED);
        for _ in 0..plan.ablation_queries {
            let (positions, tools) = frames.next(&mut stream)?;
            race.step(positions, &tools[tool..=tool])?;
            progress.one();
        }
        race.finish()?;
        let cell = Cell::new("ablation", name, size, tool_name);
        race.record(&cell, 0, records);
        for variant in &variants {
            let bytes = variant.tree.summary().query_bytes_per_triangle;
            let record = Record::number(&cell, variant.name, "flash", bytes, "bytes a triangle");
            records.push(record);
        }
    }
    progress.finish();
    Ok(())
}
