//! The budgets in the README's and the guide's examples are sufficient. If a budget ended a query, it would have no
//! side, and the wall would not push.

// Requirement: A-05

use std::fs;

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Cost, NoSide, Options, Query, Side, Sphere, Tool, measure_stretch};
use dibs_tests::method::Probe;
use dibs_tests::streams::Beat;

/// Number of queries, and ticks between them: the last tool is close enough for a warm start.
const ASKED: u32 = 300;
const APART: u32 = 23;

/// The budgets in a page: their instructions, and the names of their cost models.
fn shown(page: &str) -> Vec<(u32, String)> {
    let path = format!("{}/../{page}", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).expect("a page");
    let budgets = text.split("Budget::for_instructions(").skip(1).filter_map(|rest| {
        let (number, model) = rest.split_once(')')?.0.split_once(", &Cost::")?;
        Some((number.replace('_', "").parse().expect("a number"), model.to_owned()))
    });
    budgets.collect()
}

#[test]
fn the_budgets_shown_are_enough_for_the_heart() {
    let budgets = [shown("README.md"), shown("docs/guide.md")].concat();
    assert_eq!(budgets.len(), 4, "{budgets:?}");
    let generate::MovingMesh { mesh, motion } = generate::heart(10_272).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let (beat, mut positions) = (Beat::new(&motion), Vec::new());
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
            (query, Budget::for_instructions(*instructions, &model), name.ends_with("SPHERE"), 0)
        })
        .collect();
    for tick in (0..ASKED).map(|number| number * APART) {
        beat.deform(tick, &mut positions);
        let rows = built.to_rows(&positions);
        let measured = measure_stretch(&tree, rows.as_slice()).expect("within the limit");
        let Probe::Capsule(capsule) = beat.tool(tick) else { panic!("a capsule") };
        let sphere = Sphere::new(capsule.start(), capsule.radius()).expect("a valid sphere");
        for (query, budget, is_sphere, cut_short) in &mut queries {
            let options = Options::new().budget(*budget).stretch(measured);
            let found = match is_sphere {
                true => query.closest(rows.as_slice(), &sphere, &options),
                false => query.closest(rows.as_slice(), &capsule, &options),
            };
            let side = found.expect("an answer").side;
            *cut_short += u32::from(side == Side::Undefined(NoSide::CutShort));
        }
    }
    let cut_short: Vec<u32> = queries.iter().map(|query| query.3).collect();
    assert!(cut_short.iter().all(|&count| count == 0), "{budgets:?}: {cut_short:?} of {ASKED}");
}
