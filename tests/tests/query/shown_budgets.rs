//! The budgets in the README's and the guide's examples are sufficient. If a budget ended a query, it would have no
//! side, and the wall would not push. A tick's budget is given to a tracker. A budget by the proven constants that
//! docs/evidence/bound.md shows leaves no query above its instructions.

// Requirement: A-05

use std::array::from_fn;
use std::fs;

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Cost, NoSide, Odometer, Options, Query, Side, Sphere, Tool, Tracker,
    measure_stretch,
};
use dibs_tests::deform::unit;
use dibs_tests::method::Probe;
use dibs_tests::streams::Beat;
use dibs_tests::surfaces::{joined, moved};
use fastrand::Rng;
use glam::Vec3;

/// Number of queries, and ticks between them: the last tool is close enough for a warm start. A tracker jumps so far that
/// it searches most of its front anew.
const ASKED: u32 = 300;
const APART: u32 = 23;

fn read(page: &str) -> String {
    let path = format!("{}/../{page}", env!("CARGO_MANIFEST_DIR"));
    fs::read_to_string(path).expect("a page")
}

/// The budgets in a page, a guard's too: their instructions, and the names of their cost models.
fn shown(page: &str) -> Vec<(u32, String)> {
    let text = read(page);
    let budgets = text.split("Budget::for_instructions(").skip(1).filter_map(|rest| {
        let (number, model) = rest.split_once(')')?.0.split_once(", &Cost::")?;
        Some((number.replace('_', "").parse().expect("a number"), model.to_owned()))
    });
    let of_guards = text.split(".instructions(").skip(1).filter_map(|rest| {
        let number = rest.split_once(')')?.0.replace('_', "");
        Some((number.parse().expect("a number"), "M7_TICK".to_owned()))
    });
    budgets.chain(of_guards).collect()
}

#[test]
fn the_budgets_shown_are_enough_for_the_heart() {
    let budgets = [shown("README.md"), shown("docs/guide.md")].concat();
    assert_eq!(budgets.len(), 4, "{budgets:?}");
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let (beat, mut positions) = (Beat::new(&motion), Vec::new());
    let mut odometer = Odometer::new(&tree);
    let mut before: Option<Vec<Vec3>> = None;
    let models = [
        ("M7_SPHERE", Cost::M7_SPHERE),
        ("M7_TICK", Cost::M7_TICK),
        ("X86_64_CAPSULE", Cost::X86_64_CAPSULE),
    ];
    let mut queries: Vec<_> = budgets
        .iter()
        .map(|(instructions, name)| {
            let model = models.iter().find(|model| model.0 == name).expect("a model").1;
            let query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
            let tracker = Tracker::<u16, MAX_STACK, 512>::new(&tree).expect("enough for any tree");
            let tracker = name.ends_with("TICK").then_some(tracker);
            let budget = Budget::for_instructions(*instructions, &model);
            (query, tracker, budget, name.ends_with("SPHERE"), 0)
        })
        .collect();
    for tick in (0..ASKED).map(|number| number * APART) {
        beat.deform(tick, &mut positions);
        let rows = built.to_rows(&positions);
        let measured = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
        let Probe::Capsule(capsule) = beat.tool(tick) else { panic!("a capsule") };
        let sphere = Sphere::new(capsule.start(), capsule.radius()).expect("a valid sphere");
        let surface = odometer.step(before.as_deref().unwrap_or(&rows), rows.as_slice()).after();
        for (query, tracker, budget, is_sphere, cut_short) in &mut queries {
            let options = Options::new().budget(*budget).stretch(measured);
            let (closest, is_kept) = match tracker {
                Some(tracker) => {
                    let found = tracker.closest(&surface, &capsule, &options).expect("an answer");
                    (found.closest, found.is_kept)
                }
                None => {
                    let found = match is_sphere {
                        true => query.closest(rows.as_slice(), &sphere, &options),
                        false => query.closest(rows.as_slice(), &capsule, &options),
                    };
                    (found.expect("an answer"), false)
                }
            };
            let is_cut = closest.side == Side::Undefined(NoSide::CutShort) || is_kept;
            *cut_short += u32::from(is_cut);
        }
        before = Some(rows);
    }
    let cut_short: Vec<u32> = queries.iter().map(|query| query.4).collect();
    assert!(queries.iter().any(|query| query.1.is_some()), "{budgets:?}");
    assert!(cut_short.iter().all(|&count| count == 0), "{budgets:?}: {cut_short:?} of {ASKED}");
}

/// The proven constants of an unsigned query of a capsule, on a table of vertices in a tree with so many roots.
fn proven(roots: u32) -> Cost {
    let page = read("docs/evidence/bound.md");
    let row = page.lines().find_map(|line| line.strip_prefix("| capsule | ")).expect("a row");
    let mut cells = row.split(" | ").map(|cell| cell.parse::<u32>().expect("a constant"));
    let [base, root, node_test, triangle_test] = from_fn(|_| cells.next().expect("a constant"));
    Cost { base: base + (roots - 1) * root, node_test, triangle_test }
}

#[test]
fn a_budget_by_proven_constants_is_kept() {
    const INSTRUCTIONS: u32 = 40_000;
    let heart = generate::heart(1_280).expect("a valid size").mesh;
    let beside = |number: u8| moved(&heart, Vec3::X * 150.0 * f32::from(number));
    let mut rng = Rng::with_seed(1);
    for count in [1, 3] {
        let mesh = joined(&(0..count).map(beside).collect::<Vec<_>>());
        let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
        let proven = proven(tree.roots());
        let budget = Budget::for_instructions(INSTRUCTIONS, &proven);
        assert!(proven.instructions_within(budget) <= u64::from(INSTRUCTIONS));
        let options = Options::cold().unsigned().budget(budget);
        let (mut cut_short, mut before) = (0, None);
        for _ in 0..400 {
            let start = mesh.positions[rng.usize(..mesh.positions.len())] + unit(&mut rng) * 60.0;
            let tool = Capsule::new(start, start + unit(&mut rng) * 60.0, 2.5).expect("a capsule");
            let found = query.closest(rows.as_slice(), &tool, &options.warm_start(before));
            let found = found.expect("an answer");
            let most = proven.instructions(found.node_tests, found.triangle_tests);
            assert!(most <= u64::from(INSTRUCTIONS), "{found:?}: {most}");
            cut_short += u32::from(found.lower < found.separation);
            before = found.triangle;
        }
        assert!(cut_short > 0, "no query needs the budget");
    }
}
