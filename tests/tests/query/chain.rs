//! Several tools and several surfaces: the answers of queries one by one, for a fraction of their tests.

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, NoSide, Options, Proximity, Query, Side, Sphere, Tool};
use dibs_tests::deform::{deformed, unit};
use fastrand::Rng;
use glam::Vec3;

/// The joints of a chain that begins near the surface and goes anywhere.
fn chain(rows: &[Vec3], rng: &mut Rng) -> Vec<Capsule> {
    let links = rng.usize(1..=8);
    let size = 30.0 * rng.f32();
    let mut joint = rows[rng.usize(..rows.len())] + unit(rng) * size * rng.f32();
    let mut link = || {
        let start = joint;
        joint += unit(rng) * (1.0 + size) * rng.f32();
        Capsule::new(start, joint, 4.0 * rng.f32()).expect("finite")
    };
    (0..links).map(|_| link()).collect()
}

#[test]
fn the_answer_of_a_chain_is_that_of_its_tools_one_by_one() {
    let mut rng = Rng::with_seed(1);
    let (mut inside, mut crossing, mut outside, mut saved) = (0, 0, 0, [0_u64; 2]);
    for seed in 0..4 {
        let (_, built, frames) = deformed(4, seed);
        let tree = built.tree::<u16>().expect("16-bit indices");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for positions in &frames {
            let rows = built.to_rows(positions);
            for _ in 0..150 {
                let chain = chain(&rows, &mut rng);
                let each: Vec<Proximity> = chain
                    .iter()
                    .map(|tool| {
                        query.closest(&rows[..], tool, &Options::cold()).expect("an answer")
                    })
                    .collect();
                let options = if rng.bool() { Options::cold() } else { Options::new() };
                let (number, found) = query
                    .closest_of(&rows[..], &chain, f32::INFINITY, &options)
                    .expect("an answer")
                    .expect("one");
                let least = each.iter().map(|one| one.separation).fold(f32::INFINITY, f32::min);
                let lower = each.iter().map(|one| one.lower).fold(f32::INFINITY, f32::min);
                let length = chain.iter().map(Tool::axis_length).fold(0.0, f32::max);
                let tolerance = if found.side == Side::Crossing { length / 512.0 } else { 0.0 };
                let off = 2.0 * found.accuracy + tolerance;
                assert!((found.separation - least).abs() <= off, "{found:?} {each:?}");
                assert!((each[number].separation - least).abs() <= off, "{number} {each:?}");
                assert!((found.lower - lower).abs() <= off, "{found:?} {each:?}");
                match found.side {
                    Side::Inside => inside += 1,
                    Side::Crossing => crossing += 1,
                    _ => outside += 1,
                }
                if found.side == Side::Outside {
                    saved[0] += u64::from(found.node_tests);
                    saved[1] += each.iter().map(|one| u64::from(one.node_tests)).sum::<u64>();
                }
            }
        }
    }
    println!(
        "{outside} outside, {inside} inside, {crossing} crossing; node tests outside {saved:?}"
    );
    assert!(outside > 300 && inside > 50 && crossing > 300);
    assert!(saved[0] < saved[1], "{saved:?}");
}

#[test]
fn a_budget_of_a_chain_is_kept_and_its_interval_holds() {
    let mut rng = Rng::with_seed(2);
    let (_, built, frames) = deformed(3, 9);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut cut_short = 0;
    for positions in &frames {
        let rows = built.to_rows(positions);
        for _ in 0..400 {
            let chain = chain(&rows, &mut rng);
            let unsigned = Options::cold().unsigned();
            let ask =
                |tool| query.closest(&rows[..], tool, &unsigned).expect("an answer").separation;
            let least = chain.iter().map(ask).fold(f32::INFINITY, f32::min);
            let budget = Budget { node_tests: rng.u32(..300), triangle_tests: rng.u32(..20) };
            let found =
                query.closest_of(&rows[..], &chain, f32::INFINITY, &unsigned.budget(budget));
            let (_, found) = found.expect("a short budget is no error").expect("one");
            assert!(found.node_tests <= budget.node_tests + chain.len() as u32, "{found:?}");
            assert!(found.triangle_tests <= budget.triangle_tests, "{found:?}");
            assert!(found.lower <= least + 2.0 * found.accuracy, "{found:?} {least}");
            assert!(found.separation >= least - 2.0 * found.accuracy, "{found:?} {least}");
            cut_short += u32::from(found.lower < found.separation);
        }
    }
    println!("{cut_short} cut short");
    assert!(cut_short > 200);
}

#[test]
fn nothing_within_a_limit_is_missed() {
    let mut rng = Rng::with_seed(3);
    let (_, built, frames) = deformed(4, 5);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut beyond, mut within) = (0, 0);
    for positions in &frames {
        let rows = built.to_rows(positions);
        for _ in 0..1_000 {
            let near = rows[rng.usize(..rows.len())];
            let tool = Sphere::new(near + unit(&mut rng) * 40.0 * rng.f32(), rng.f32() * 3.0);
            let tool = tool.expect("finite");
            let cold = Options::cold();
            let truth = query.closest(&rows[..], &tool, &cold.unsigned()).expect("an answer");
            let limit = truth.separation + (rng.f32() - 0.5) * 10.0_f32.powi(rng.i32(-6..2));
            let options = if rng.bool() { cold } else { Options::new() };
            let found = query.closest_within(&rows[..], &tool, limit, &options);
            let found = found.expect("an answer");
            let apart = (found.separation.abs() - truth.separation.abs()).abs();
            if truth.separation + 2.0 * truth.accuracy < limit && limit > -tool.radius() {
                assert!(found.side != Side::Undefined(NoSide::CutShort), "{limit} {found:?}");
                let is_inside = found.side == Side::Inside;
                let reach = if is_inside { 2.0 * tool.radius() } else { 0.0 };
                assert!(apart <= reach + 2.0 * found.accuracy, "{limit} {found:?} {truth:?}");
                within += 1;
            } else if truth.separation - 8.0 * truth.accuracy > limit {
                assert!(found.lower <= truth.separation + found.accuracy, "{limit} {found:?}");
                assert!(found.separation >= truth.separation - found.accuracy, "{found:?}");
                let least = limit.max(-tool.radius()) - found.accuracy;
                assert!(found.lower >= least, "{limit} {found:?}");
                beyond += 1;
            }
        }
    }
    println!("{within} within the limit, {beyond} beyond");
    assert!(within > 500 && beyond > 500);
    let (rows, tool) = (built.to_rows(&frames[0]), Sphere::new(Vec3::ZERO, 1.0).expect("finite"));
    let nan = query.closest_within(&rows[..], &tool, f32::NAN, &Options::cold());
    assert!(nan.is_ok_and(|found| found.side != Side::Undefined(NoSide::CutShort)));
}

/// A scene of organs, and an instrument of four capsules that wanders among them.
#[test]
fn thirteen_surfaces_and_four_capsules_cost_three_queries() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let (organs, mut rng) = (organs(&mesh, &built), Rng::with_seed(4));
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut queries = vec![Query::<u16, MAX_STACK>::new(&tree).expect("deep enough"); organs.len()];
    let mut single = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut at, mut heading, mut last) = (Vec3::new(150.0, 150.0, 0.0), Vec3::X, 0);
    let (mut whole, mut one) = (0_u64, 0_u64);
    for tick in 0..2_000 {
        heading = (heading + 0.05 * unit(&mut rng)).normalize();
        at += 0.2 * heading;
        if at.abs().max_element() > 300.0 {
            heading = -at.normalize();
        }
        let joints = [0.0_f32, 60.0, 75.0, 85.0, 95.0].map(|along| at - (95.0 - along) * heading);
        let instrument = [0, 1, 2, 3]
            .map(|link| Capsule::new(joints[link], joints[link + 1], 3.0).expect("finite"));
        let mut best: Option<(usize, Proximity)> = None;
        let others = (0..organs.len()).filter(|&organ| organ != last);
        for organ in [last].into_iter().chain(others) {
            let limit = best.map_or(f32::INFINITY, |(_, best)| best.separation);
            let options = Options::new().unsigned();
            let rows = &organs[organ][..];
            let found = queries[organ].closest_of(rows, &instrument, limit, &options);
            let (_, found) = found.expect("an answer").expect("one");
            whole += u64::from(found.node_tests + 4 * found.triangle_tests);
            if best.is_none_or(|(_, best)| found.separation < best.separation) {
                best = Some((organ, found));
            }
        }
        let (organ, best) = best.expect("an organ");
        last = organ;
        // One query of one capsule on the surface that is closest.
        let options = Options::new().unsigned();
        let found =
            single.closest(&organs[organ][..], &instrument[3], &options).expect("an answer");
        one += u64::from(found.node_tests + 4 * found.triangle_tests);
        if tick % 50 == 0 {
            let cold = Options::cold().unsigned();
            let mut each =
                organs.iter().flat_map(|rows| instrument.iter().map(move |tool| (rows, tool)));
            let all = each.try_fold(f32::INFINITY, |least, (rows, tool)| {
                single.closest(&rows[..], tool, &cold).map(|found| found.separation.min(least))
            });
            let all = all.expect("answers");
            assert!((all - best.separation).abs() <= 2.0 * best.accuracy, "{all} {best:?}");
        }
    }
    let share = whole as f64 / one as f64;
    println!("52 pairs cost {share:.2} queries of one");
    assert!(share <= 3.0, "{share}");
}

/// Thirteen hearts in a grid, each turned differently.
fn organs(mesh: &Mesh, built: &BuiltTree) -> Vec<Vec<Vec3>> {
    let place = |number: usize| {
        let turn = glam::Quat::from_rotation_y(number as f32);
        let [x, y, z] = [number % 3, number / 3 % 3, number / 9].map(|cell| cell as f32 - 1.0);
        let positions: Vec<Vec3> =
            mesh.positions.iter().map(|&p| turn * p + 180.0 * Vec3::new(x, y, z)).collect();
        built.to_rows(&positions)
    };
    (0..13).map(place).collect()
}
