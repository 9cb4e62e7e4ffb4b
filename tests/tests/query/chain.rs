//! Several tools and several surfaces: the answers of queries one by one, for a fraction of their tests.
//!
//! One file, because all tests compare with the same queries one by one.

// Requirement: A-09

use dibs_build::{Builder, BuiltTree, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Contact, Contacts, NoSide, Options, Proximity, Query, QueryError, Side,
    Sphere, Tool, TriangleRow, Unavailable,
};
use dibs_tests::deform::{deformed, unit};
use dibs_tests::surfaces::{Inexact, ball};
use fastrand::Rng;
use glam::Vec3;

/// A chain's joints: it starts near the surface and continues in random directions.
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
                let closest = query.closest_of(&rows[..], &chain, &options);
                let closest = closest.expect("an answer").expect("one");
                let (number, found) = (closest.tool, closest.proximity);
                let least = each.iter().map(|one| one.separation).fold(f32::INFINITY, f32::min);
                let lower = each.iter().map(|one| one.lower).fold(f32::INFINITY, f32::min);
                let length = chain.iter().map(Tool::axis_length).fold(0.0, f32::max);
                let is_deep = matches!(found.side, Side::Crossing | Side::Inside);
                let tolerance = if is_deep { length / 512.0 } else { 0.0 };
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
            let budget = Budget::new(rng.u32(..460));
            let found = query.closest_of(&rows[..], &chain, &unsigned.budget(budget));
            let found = found.expect("a short budget is no error").expect("one").proximity;
            assert!(found.work() <= budget.tests() + chain.len() as u32, "{found:?}");
            assert!(found.lower <= least + 2.0 * found.accuracy, "{found:?} {least}");
            assert!(found.separation >= least - 2.0 * found.accuracy, "{found:?} {least}");
            cut_short += u32::from(found.lower < found.separation);
        }
    }
    println!("{cut_short} cut short");
    assert!(cut_short > 200);
}

/// The interval of a search that a budget ended contains the signed separation as well, or the answer has no side.
#[test]
fn a_side_that_a_budget_left_open_is_not_stated() {
    let mut rng = Rng::with_seed(8);
    let (_, built, frames) = deformed(3, 9);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut open, mut stated) = (0, 0);
    for positions in &frames {
        let rows = built.to_rows(positions);
        for _ in 0..400 {
            let chain = chain(&rows, &mut rng);
            let cold = Options::cold();
            let ask = |tool| query.closest(&rows[..], tool, &cold).expect("an answer").lower;
            let least = chain.iter().map(ask).fold(f32::INFINITY, f32::min);
            let longest = chain.iter().map(Tool::axis_length).fold(0.0, f32::max);
            let budget = Budget::new(rng.u32(..5_400));
            let found = query.closest_of(&rows[..], &chain, &cold.budget(budget));
            let found = found.expect("a short budget is no error").expect("one").proximity;
            if found.side == Side::Undefined(NoSide::CutShort) {
                open += 1;
            } else {
                let off = 2.0 * found.accuracy + longest / 256.0;
                assert!(found.lower <= least + off, "{least} {found:?}");
                stated += 1;
            }
        }
    }
    println!("{open} sides left open, {stated} stated");
    assert!(open > 200 && stated > 200);
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

#[test]
fn a_warm_triangle_beyond_the_limit_is_not_tested() {
    let mut rng = Rng::with_seed(6);
    let (_, built, frames) = deformed(3, 7);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let rows = built.to_rows(&frames[0]);
    let budget = Budget::new(8);
    for _ in 0..1_000 {
        let row = TriangleRow(rng.u32(..tree.triangle_count()));
        let corner = rows[tree.corners(row).expect("a row")[0] as usize];
        let (distance, radius) = (5.0 + 20.0 * rng.f32(), 0.5 + 4.0 * rng.f32());
        let tool = Sphere::new(corner + distance * unit(&mut rng), radius).expect("finite");
        let options = Options::new().unsigned().warm_start(Some(row)).budget(budget);
        for (beyond, tests) in [(-0.01, 0), (0.01, 1)] {
            let limit = distance - radius + beyond;
            let found = query.closest_within(&rows[..], &tool, limit, &options);
            assert_eq!(found.expect("an answer").triangle_tests, tests, "{distance} {radius}");
        }
    }
}

/// A scene of organs, and an instrument of four capsules that wanders among them.
#[test]
fn thirteen_surfaces_and_four_capsules_cost_three_queries() {
    let (built, organs) = organs(180.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut rng = Rng::with_seed(4);
    let mut queries = vec![Query::<u16, MAX_STACK>::new(&tree).expect("deep enough"); organs.len()];
    let mut single = queries[0].clone();
    let surfaces: Vec<&[Vec3]> = organs.iter().map(Vec::as_slice).collect();
    let (mut at, mut heading) = (Vec3::new(150.0, 150.0, 0.0), Vec3::X);
    let (mut whole, mut one) = (0_u64, 0_u64);
    let cost = |found: &Proximity| u64::from(found.node_tests + 4 * found.triangle_tests);
    for tick in 0..2_000 {
        heading = (heading + 0.05 * unit(&mut rng)).normalize();
        at += 0.2 * heading;
        if at.abs().max_element() > 300.0 {
            heading = -at.normalize();
        }
        let instrument = instrument(at, heading, 95.0);
        let options = Options::new().unsigned();
        let mut scene: Vec<_> = queries.iter_mut().zip(surfaces.iter().copied()).collect();
        let best = Query::closest_in_scene(&mut scene, &instrument, &options);
        let best = best.expect("an answer").expect("one");
        whole += cost(&best.proximity);
        // Compared with one query of one capsule on the closest surface.
        let found = single.closest(surfaces[best.surface], &instrument[3], &options);
        one += cost(&found.expect("an answer"));
        if tick % 50 == 0 {
            let all = least(&mut single, &surfaces, &instrument, &Options::cold().unsigned());
            let found = best.proximity;
            assert!((all - found.separation).abs() <= 2.0 * found.accuracy, "{all} {best:?}");
        }
    }
    let share = whole as f64 / one as f64;
    println!("52 pairs cost {share:.2} queries of one");
    assert!(share <= 3.0, "{share}");
}

/// Instruments in and across organs: a tool deep inside one surface is far from it, and another surface may be closer.
#[test]
fn no_tool_inside_a_surface_of_a_scene_is_missed() {
    let (built, organs) = organs(60.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut rng = Rng::with_seed(5);
    let mut queries = vec![Query::<u16, MAX_STACK>::new(&tree).expect("deep enough"); organs.len()];
    let mut single = queries[0].clone();
    let surfaces: Vec<&[Vec3]> = organs.iter().map(Vec::as_slice).collect();
    let mut sides = [0; 3];
    for _ in 0..1_000 {
        let near = organs[rng.usize(..organs.len())][rng.usize(..tree.vertex_count() as usize)];
        let instrument = instrument(near + 30.0 * unit(&mut rng), unit(&mut rng), 15.0);
        let options = if rng.bool() { Options::cold() } else { Options::new() };
        let mut scene: Vec<_> = queries.iter_mut().zip(surfaces.iter().copied()).collect();
        let best = Query::closest_in_scene(&mut scene, &instrument, &options);
        let best = best.expect("an answer").expect("one");
        let all = least(&mut single, &surfaces, &instrument, &Options::cold());
        let found = best.proximity;
        let off = 2.0 * found.accuracy + 10.0 / 512.0;
        assert!((all - found.separation).abs() <= off, "{all} {best:?}");
        let own = single.closest(surfaces[best.surface], &instrument[best.tool], &options);
        assert!((own.expect("an answer").separation - found.separation).abs() <= off, "{best:?}");
        match found.side {
            Side::Outside => sides[0] += 1,
            Side::Inside => sides[1] += 1,
            _ => sides[2] += 1,
        }
    }
    println!("{sides:?} outside, inside, crossing");
    assert!(sides.into_iter().all(|side| side > 20), "{sides:?}");
}

#[test]
fn without_a_surface_or_a_tool_there_is_no_closest_pair() {
    let (built, organs) = organs(180.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let no_tools: [Sphere; 0] = [];
    assert_eq!(query.closest_of(organs[0].as_slice(), &no_tools, &Options::new()), Ok(None));
    let tool = [Sphere::new(Vec3::ZERO, 1.0).expect("finite")];
    let none =
        Query::<u16, MAX_STACK>::closest_in_scene::<[Vec3], _>(&mut [], &tool, &Options::new());
    assert_eq!(none, Ok(None));
}

/// Contacts of pairs, each with its surface and its tool, deepest first for each pair.
type Found = Vec<(usize, usize, f32)>;

fn in_order(mut found: Found) -> Found {
    found.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
    found
}

fn listed(contacts: &Contacts<256, 4096>) -> Found {
    let at = |contact: &Contact| (contact.surface, contact.tool, contact.separation);
    in_order(contacts.iter().map(at).collect())
}

/// One call finds the contacts of every pair, including those of a tool inside a far surface.
#[test]
fn the_contacts_of_a_scene_are_those_of_its_pairs() {
    const MARGIN: f32 = 20.0;
    let (built, organs) = organs(120.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut rng = Rng::with_seed(6);
    let mut queries = vec![Query::<u16, MAX_STACK>::new(&tree).expect("deep enough"); organs.len()];
    let mut single = queries[0].clone();
    let surfaces: Vec<&[Vec3]> = organs.iter().map(Vec::as_slice).collect();
    let (mut contacts, mut own) = (Contacts::<256, 4096>::new(), Contacts::<256, 4096>::new());
    let (mut compared, mut of_several, mut beyond) = (0, 0, 0);
    for _ in 0..if cfg!(debug_assertions) { 20 } else { 400 } {
        let near = organs[rng.usize(..organs.len())][rng.usize(..tree.vertex_count() as usize)];
        let instrument = instrument(near + 40.0 * unit(&mut rng), unit(&mut rng), 25.0);
        let options = Options::cold();
        let mut scene: Vec<_> = queries.iter_mut().zip(surfaces.iter().copied()).collect();
        let best =
            Query::contacts_in_scene(&mut scene, &instrument, MARGIN, &options, &mut contacts);
        let best = best.expect("an answer").expect("one");
        let mut expected = Found::new();
        let (mut least, mut least_bound) = (f32::INFINITY, MARGIN);
        for (surface, rows) in surfaces.iter().enumerate() {
            for (tool, capsule) in instrument.iter().enumerate() {
                let closest = single.contacts(*rows, capsule, MARGIN, &options, &mut own);
                least = least.min(closest.expect("an answer").separation);
                expected.extend(own.iter().map(|contact| (surface, tool, contact.separation)));
                least_bound = least_bound.min(own.bound());
            }
        }
        let off = (least - best.proximity.separation).abs();
        assert!(off < 2.0 * best.proximity.accuracy + 0.1, "{least} {best:?}");
        beyond += usize::from(least > MARGIN);
        let (found, expected) = (listed(&contacts), in_order(expected));
        assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
        for (one, other) in found.iter().zip(&expected) {
            // Two searches may find the depth of a crossing axis at different points.
            let is_same = (one.0, one.1) == (other.0, other.1) && (one.2 - other.2).abs() < 0.1;
            assert!(is_same, "{one:?} {other:?}");
        }
        let bound = contacts.bound();
        assert!((bound - least_bound).abs() < 0.1, "{bound} {least_bound}");
        assert!(contacts.within(MARGIN * 0.99).is_ok(), "{bound}");
        compared += found.len();
        of_several += usize::from(found.windows(2).any(|pair| pair[0].0 != pair[1].0));
    }
    println!(
        "{compared} contacts; {of_several} scenes with several surfaces, {beyond} with none near"
    );
    if !cfg!(debug_assertions) {
        assert!(compared > 1_500 && of_several > 50 && beyond > 10);
    }
}

/// A budget for all pairs together: every contact below the stated bound is in the list.
#[test]
fn a_budget_of_a_scenes_contacts_is_kept_and_their_bound_holds() {
    const MARGIN: f32 = 15.0;
    let (built, organs) = organs(120.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut rng = Rng::with_seed(7);
    let mut queries = vec![Query::<u16, MAX_STACK>::new(&tree).expect("deep enough"); 4];
    let surfaces: Vec<&[Vec3]> = organs.iter().take(4).map(Vec::as_slice).collect();
    let (mut whole, mut part) = (Contacts::<256, 4096>::new(), Contacts::<256, 4096>::new());
    let (mut cut_short, mut deepest_known, mut bounded) = (0, 0, 0);
    for round in 0..if cfg!(debug_assertions) { 20 } else { 600 } {
        let near = organs[rng.usize(..4)][rng.usize(..tree.vertex_count() as usize)];
        let instrument = instrument(near + 20.0 * unit(&mut rng), unit(&mut rng), 25.0);
        let most = 1 << rng.u32(4..20);
        let tests = rng.u32(..most);
        let budget = Budget::new(tests);
        let mut scene: Vec<_> = queries.iter_mut().zip(surfaces.iter().copied()).collect();
        let mut ask = |options: &Options, contacts: &mut Contacts<256, 4096>| {
            Query::contacts_in_scene(&mut scene, &instrument, MARGIN, options, contacts)
        };
        ask(&Options::cold(), &mut whole).expect("an answer");
        ask(&Options::cold().budget(budget), &mut part).expect("an answer");
        let error = whole.accuracy() + part.accuracy() + 0.1;
        let found = listed(&part);
        for contact in listed(&whole).into_iter().filter(|it| it.2 < part.bound() - error) {
            let is_listed = found.iter().any(|it| {
                (it.0, it.1) == (contact.0, contact.1) && (it.2 - contact.2).abs() < error
            });
            assert!(is_listed, "{round}: {contact:?} {} {found:?}", part.bound());
            bounded += 1;
        }
        if part.bound() < MARGIN * 0.99 {
            match part.within(MARGIN) {
                Ok(within) => {
                    assert!(!within.is_complete(), "{round}");
                    // None is deeper than the first.
                    let deepest = |list: &Contacts<256, 4096>| {
                        list.iter().next().map_or(MARGIN, |contact| contact.separation)
                    };
                    let (all, known) = (deepest(&whole), deepest(&part));
                    assert!(known < all + error, "{round}: {all} {known}");
                    deepest_known += u32::from(known > all - error);
                }
                Err(error) => assert_eq!(error, Unavailable::CutShort),
            }
            cut_short += 1;
        }
    }
    println!(
        "{cut_short} cut short, {deepest_known} with the deepest contact, {bounded} contacts below their bounds"
    );
    if !cfg!(debug_assertions) {
        assert!(cut_short > 100 && bounded > 300 && deepest_known > 5);
    }
}

#[test]
fn contacts_of_a_scene_refuse_what_those_of_a_pair_do() {
    let (built, organs) = organs(180.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    let tools = [Sphere::new(organs[0][0], 1.0).expect("finite")];
    let mut scene = [(&mut query, organs[0].as_slice())];
    let mut ask = |margin, contacts: &mut Contacts<8>| {
        Query::contacts_in_scene(&mut scene, &tools, margin, &Options::new(), contacts)
    };
    ask(5.0, &mut contacts).expect("an answer");
    assert!(!contacts.is_empty());
    let refused = ask(f32::NAN, &mut contacts);
    assert!(matches!(refused, Err(QueryError::Margin { .. })), "{refused:?}");
    assert!(contacts.is_empty() && contacts.within(0.0).is_err());
    // After an error in the middle no contacts of the earlier surfaces remain.
    let mut broken = organs[0].clone();
    broken.truncate(7);
    let mut other = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut scene = [(&mut query, organs[0].as_slice()), (&mut other, broken.as_slice())];
    let refused = Query::contacts_in_scene(&mut scene, &tools, 5.0, &Options::new(), &mut contacts);
    assert!(matches!(refused, Err(QueryError::VertexCount { .. })), "{refused:?}");
    assert!(contacts.is_empty() && contacts.within(0.0).is_err());
}

/// Contacts of a later pair replace farther ones of an earlier pair.
#[test]
fn a_full_list_of_a_scene_keeps_the_deepest() {
    const MARGIN: f32 = 20.0;
    let (built, organs) = organs(120.0);
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut rng = Rng::with_seed(9);
    let mut queries = vec![Query::<u16, MAX_STACK>::new(&tree).expect("deep enough"); organs.len()];
    let surfaces: Vec<&[Vec3]> = organs.iter().map(Vec::as_slice).collect();
    let (mut whole, mut few) = (Contacts::<256, 4096>::new(), Contacts::<3, 4096>::new());
    let mut full = 0;
    for _ in 0..if cfg!(debug_assertions) { 20 } else { 200 } {
        let near = organs[rng.usize(..organs.len())][rng.usize(..tree.vertex_count() as usize)];
        let instrument = instrument(near + 20.0 * unit(&mut rng), unit(&mut rng), 25.0);
        let options = Options::cold();
        let mut scene: Vec<_> = queries.iter_mut().zip(surfaces.iter().copied()).collect();
        Query::contacts_in_scene(&mut scene, &instrument, MARGIN, &options, &mut whole)
            .expect("an answer");
        Query::contacts_in_scene(&mut scene, &instrument, MARGIN, &options, &mut few)
            .expect("an answer");
        let all: Vec<f32> = whole.iter().map(|contact| contact.separation).collect();
        let kept: Vec<f32> = few.iter().map(|contact| contact.separation).collect();
        assert_eq!(kept.as_slice(), &all[..all.len().min(3)], "{all:?}");
        // The nearest one that is left out is the bound.
        let next = all.get(3).copied().unwrap_or(f32::INFINITY);
        assert_eq!((few.bound(), few.is_full()), (whole.bound().min(next), all.len() > 3));
        full += usize::from(few.is_full());
    }
    println!("{full} lists are full");
    assert!(full > 5, "{full}");
}

/// A chain of more tools than may be passed over: those beyond are searched without a limit.
#[test]
fn a_tool_inside_is_found_anywhere_in_a_long_chain() {
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let sphere = |x: f32| Sphere::new(Vec3::X * x, 1.0).expect("finite");
    for inside in [1, 63, 64, 69] {
        let tools: [Sphere; 70] = std::array::from_fn(|number| match number {
            0 => sphere(42.0),
            _ if number == inside => sphere(5.0),
            _ => sphere(100.0 + number as f32),
        });
        let alone = query.closest(rows.as_slice(), &tools[inside], &Options::cold());
        let alone = alone.expect("an answer");
        let found = query.closest_of(rows.as_slice(), &tools, &Options::cold());
        let found = found.expect("an answer").expect("one");
        assert_eq!((found.tool, found.proximity.side), (inside, Side::Inside));
        let off = (found.proximity.separation - alone.separation).abs();
        assert!(off <= 2.0 * found.proximity.accuracy, "{inside}: {found:?} {alone:?}");
    }
}

/// Without adjacency no tool has a side, and the chain is searched as if none were asked for.
#[test]
fn a_chain_at_a_surface_without_sides_takes_the_tests_of_an_unsigned_one() {
    let mesh = ball(3);
    let built = Builder::new().with_adjacency(false).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let instrument = instrument(Vec3::X * 42.0, Vec3::NEG_X, 95.0);
    let [mut bare, unsigned] = [Options::cold(), Options::cold().unsigned()].map(|options| {
        let found = query.closest_of(rows.as_slice(), &instrument, &options);
        found.expect("an answer").expect("one")
    });
    let sides = [NoSide::NoAdjacency, NoSide::NotAsked].map(Side::Undefined);
    assert_eq!([bare.proximity.side, unsigned.proximity.side], sides);
    assert_eq!(bare.tool, 3);
    bare.proximity.side = unsigned.proximity.side;
    assert_eq!(bare, unsigned);
}

/// A tool outside that is nearer to the surface than the error of its positions proves no other tool outside.
#[test]
fn a_link_beside_an_inexact_surface_does_not_hide_one_inside() {
    let mesh = ball(4);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let [a, b, c] = mesh.triangles[7].map(|vertex| mesh.positions[vertex as usize]);
    let (middle, outward) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize());
    let sphere = |height: f32| Sphere::new(middle + outward * height, 0.25).expect("finite");
    let tools = [sphere(0.5), sphere(-1.5)];
    for error in [0.0, 3.0] {
        let table = Inexact(&rows, error);
        let found = query.closest_of(&table, &tools, &Options::cold());
        let found = found.expect("an answer").expect("one");
        assert_eq!((found.tool, found.proximity.side), (1, Side::Inside), "{error}: {found:?}");
        assert!((found.proximity.separation + 1.75).abs() < 1e-3, "{error}: {found:?}");
    }
}

/// Four capsules behind a tip, with this total length (mm).
fn instrument(tip: Vec3, heading: Vec3, length: f32) -> [Capsule; 4] {
    let joints = [1.0, 0.37, 0.21, 0.1, 0.0].map(|behind: f32| tip - behind * length * heading);
    [0, 1, 2, 3].map(|link| Capsule::new(joints[link], joints[link + 1], 3.0).expect("finite"))
}

/// The least separation of all pairs, searched one by one.
fn least(
    query: &mut Query<'_, u16, MAX_STACK>,
    surfaces: &[&[Vec3]],
    instrument: &[Capsule],
    options: &Options,
) -> f32 {
    let mut each = surfaces.iter().flat_map(|rows| instrument.iter().map(move |tool| (rows, tool)));
    let least = each.try_fold(f32::INFINITY, |least, (rows, tool)| {
        query.closest(*rows, tool, options).map(|found| found.separation.min(least))
    });
    least.expect("answers")
}

/// Thirteen hearts in a grid of this spacing (mm), each rotated differently; below 150 mm they overlap.
fn organs(spacing: f32) -> (BuiltTree, Vec<Vec<Vec3>>) {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let place = |number: usize| {
        let turn = glam::Quat::from_rotation_y(number as f32);
        let [x, y, z] = [number % 3, number / 3 % 3, number / 9].map(|cell| cell as f32 - 1.0);
        let positions: Vec<Vec3> =
            mesh.positions.iter().map(|&p| turn * p + spacing * Vec3::new(x, y, z)).collect();
        built.to_rows(&positions)
    };
    let organs = (0..13).map(place).collect();
    (built, organs)
}
