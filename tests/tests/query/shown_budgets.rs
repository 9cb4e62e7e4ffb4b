//! The budgets in the README's and the guide's examples are sufficient. If a budget ended a query, it would have no
//! side, and the wall would not push. A tick's budget is given to a tracker.

// Requirement: A-05

use std::fs;

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Cost, NoSide, Odometer, Options, Query, Side, Sphere, Tool, Tracker, measure_stretch,
};
use dibs_tests::method::Probe;
use dibs_tests::streams::Beat;
use glam::Vec3;

/// Number of queries, and ticks between them: the last tool is close enough for a warm start. A tracker jumps so far that
/// it searches most of its front anew.
const ASKED: u32 = 300;
const APART: u32 = 23;

/// The budgets in a page, a guard's too: their instructions, and the names of their cost models.
fn shown(page: &str) -> Vec<(u32, String)> {
    let path = format!("{}/../{page}", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).expect("a page");
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
