//! What a list of contacts says of those that it lacks, and of a tool on the surface; and a vertex of too many triangles.

// Requirements: S-01, S-04

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Contact, Contacts, Cost, NoSide, Odometer, Options, Query, Side, Sphere,
    Tracker,
};
use dibs_tests::deform::unit;
use dibs_tests::sample;
use dibs_tests::surfaces::{Inexact, ball, joined, moved};
use fastrand::Rng;
use glam::Vec3;

type Tracked<'t> = Tracker<'t, u16, MAX_STACK, 256>;

/// A list says how far it is complete: no contact nearer than that is missing.
#[test]
fn no_contact_below_the_bound_is_missing() {
    let ball = ball(2);
    let size = ball.positions[0].length();
    let axes = [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z];
    let balls: Vec<Mesh> =
        (2..).zip(axes).map(|(gap, axis)| moved(&ball, axis * (size + gap as f32))).collect();
    let mesh = joined(&balls);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool = Sphere::new(Vec3::ZERO, 1.0).expect("valid");
    let mut all = Contacts::<16>::new();
    let mut few = Contacts::<3>::new();
    let options = Options::cold();
    query.contacts(rows.as_slice(), &tool, 9.0, &options, &mut all).expect("an answer");
    query.contacts(rows.as_slice(), &tool, 9.0, &options, &mut few).expect("an answer");
    let all: Vec<Contact> = all.within(9.0).expect("complete").copied().collect();
    assert_eq!(all.len(), axes.len(), "one of each ball");
    let list = few.within(9.0).expect("the deepest is in the list");
    assert!(!list.is_complete());
    assert_eq!(list.size_hint(), (3, Some(3)));
    let bound = list.bound();
    let kept: Vec<f32> = list.map(|contact| contact.separation).collect();
    let below: Vec<f32> =
        all.iter().map(|contact| contact.separation).filter(|&apart| apart < bound).collect();
    assert_eq!(kept, below);
    assert!(bound > kept[2] && bound <= all[3].separation, "{bound} {kept:?}");
}

/// An error of the positions widens the answer. It removes no contact, and moves none: it would hide a wall in another
/// direction wherever it is as large as the distance.
#[test]
fn contacts_do_not_depend_on_the_positions_error() {
    let heart = generate::heart(2_000).expect("a valid size").mesh;
    let surfaces = [heart, generate::brain(2_000).expect("a valid size")];
    let (mut near, mut several) = (0, 0);
    for (seed, mesh) in (1..).zip(surfaces) {
        let mut rng = Rng::with_seed(seed);
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut lists = [const { Contacts::<32, 1024>::new() }; 2];
        for trial in 0..sample(3_200) {
            let from = rows[rng.usize(..rows.len())] + unit(&mut rng) * 6.0;
            let tool = Capsule::new(from, from + unit(&mut rng) * 20.0, 1.5).expect("finite");
            let error = 3.0 * rng.f32();
            for (list, error) in lists.iter_mut().zip([0.0, error]) {
                let table = Inexact(&rows, error);
                let options = Options::cold();
                if trial % 2 == 0 {
                    query.contacts(&table, &tool, 4.0, &options, list).expect("an answer");
                } else {
                    let mut tracker = Tracked::new(&tree).expect("deep enough");
                    let surface = Odometer::new(&tree).start(&table);
                    tracker.contacts(&surface, &tool, 4.0, &options, list).expect("an answer");
                }
                assert!(list.accuracy() >= error, "{}", list.accuracy());
            }
            let [exact, inexact] = lists.each_ref().map(|list| {
                let place = |at: &Contact| (at.separation, at.normal, at.point_on_surface);
                list.iter().map(place).collect::<Vec<_>>()
            });
            assert_eq!(exact, inexact, "{error}");
            near += exact.len();
            several += usize::from(exact.len() > 1);
        }
    }
    assert!(near > 200 && several > 30, "{near} contacts, {several} lists of several");
}

/// A search that a budget ends leaves the closest pair in the list, however uncertain the positions are.
#[test]
fn a_budget_leaves_the_closest_pair_of_uncertain_positions() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let mut rng = Rng::with_seed(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut list = Contacts::<32, 1024>::new();
    let (mut cut, mut several) = (0, 0);
    for _ in 0..sample(40_000) {
        let from = rows[rng.usize(..rows.len())] + unit(&mut rng) * 6.0;
        let tool = Capsule::new(from, from + unit(&mut rng) * 20.0, 1.5).expect("finite");
        let error = 3.0 * rng.f32();
        let options = Options::cold().budget(Budget::new(rng.u32(200..2_000)));
        let closest = query.contacts(&Inexact(&rows, error), &tool, 4.0, &options, &mut list);
        let closest = closest.expect("an answer");
        if closest.side != Side::Outside || closest.separation > 4.0 {
            continue;
        }
        let Some(first) = list.iter().next() else { continue };
        let apart = 2.0 * (closest.accuracy - error);
        assert!(first.separation <= closest.lower + apart, "{closest:?} {first:?}");
        cut += usize::from(list.bound() < 4.0);
        several += usize::from(list.len() > 1);
    }
    assert!(cut > 300 && several > 100, "{cut} lists cut short, {several} of several contacts");
}

/// A list that the budget ends while the tool is outside begins with the least separation that is possible, at the closest
/// pair that was found: it never says less than the answer.
#[test]
fn a_list_that_the_budget_ends_has_the_closest_pair_found() {
    let mesh = generate::heart(10_272).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut tracker, mut odometer) =
        (Tracked::new(&tree).expect("deep enough"), Odometer::new(&tree));
    let mut list = Contacts::<32, 1024>::new();
    let mut rng = Rng::with_seed(23);
    let (mut uncertain, mut from, mut along) = (0, Vec3::ZERO, Vec3::X);
    for tick in 0..sample(40_000) {
        if tick % 100 == 0 {
            let at = rng.usize(..rows.len());
            (from, along) = (rows[at] + rows[at].normalize() * 4.0, unit(&mut rng));
        }
        from += unit(&mut rng) * 0.3;
        let tool = Capsule::new(from, from + along * 40.0, 1.5).expect("finite");
        let surface = odometer.step(rows.as_slice(), rows.as_slice()).after();
        let budget =
            if tick % 100 == 0 { Budget::UNLIMITED } else { Budget::new(rng.u32(20..150)) };
        let options = Options::new().budget(budget);
        let tracked = tracker.contacts(&surface, &tool, 5.0, &options, &mut list);
        let closest = tracked.expect("an answer").closest;
        if closest.side != Side::Outside || closest.lower > 5.0 {
            continue;
        }
        let first = list.within(5.0).expect("the side is known").next().copied();
        let truth = query.closest(rows.as_slice(), &tool, &Options::new()).expect("an answer");
        let separation = first.expect("a contact within the margin").separation;
        assert!(separation >= closest.lower - closest.accuracy, "{tick}: {separation} {closest:?}");
        assert!(separation <= truth.separation + truth.accuracy, "{tick}: {separation} {truth:?}");
        uncertain += u32::from(separation < truth.separation - 0.1);
    }
    assert!(uncertain > 50, "{uncertain} lists of an uncertain pair");
}

/// The tracker's pair is less exact than a query's. Its list is not: it parts the same basins.
#[test]
fn a_tracked_list_has_the_contacts_of_a_query() {
    let mesh = generate::heart(10_272).expect("a valid size").mesh;
    let mut rng = Rng::with_seed(11);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut odometer = Odometer::new(&tree);
    let mut lists = [const { Contacts::<32, 1024>::new() }; 2];
    let (mut several, mut outside) = (0, 0);
    for _ in 0..sample(200_000) {
        let from = rows[rng.usize(..rows.len())] + unit(&mut rng) * 6.0;
        let tool = Capsule::new(from, from + unit(&mut rng) * 60.0, 2.5).expect("finite");
        let [own, tracked] = &mut lists;
        let options = Options::cold();
        let closest = query.contacts(rows.as_slice(), &tool, 8.0, &options, own);
        let side = closest.expect("an answer").side;
        if own.len() < 2 {
            continue;
        }
        let mut tracker = Tracked::new(&tree).expect("deep enough");
        let surface = odometer.start(rows.as_slice());
        tracker.contacts(&surface, &tool, 8.0, &options, tracked).expect("an answer");
        let bound = own.bound().min(tracked.bound());
        let [own, tracked] = lists.each_ref().map(|list| {
            // An axis that crosses has several closest pairs, and where it nearly does, either may call it so.
            let is_apart = |at: &&Contact| -2.49 < at.separation && at.separation < bound;
            let place = |at: &Contact| (at.triangle, at.separation, at.normal);
            list.iter().filter(is_apart).map(place).collect::<Vec<_>>()
        });
        assert_eq!(own, tracked, "{side:?}");
        several += 1;
        outside += usize::from(side == Side::Outside);
    }
    assert!(several > 2_000 && outside > 200, "{several} lists of several, {outside} outside");
}

/// A tool whose axis meets the surface has no side of its own, but the side of the tick before.
#[test]
fn contacts_of_a_tool_that_arrives_at_the_surface_stay_known() {
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let [a, b, c] = mesh.triangles[7].map(|vertex| mesh.positions[vertex as usize]);
    let (middle, outward) = ((a + b + c) / 3.0, (b - a).cross(c - a).normalize());
    let mut tracker = Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<4>::new();
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let mut sides = Vec::new();
    for height in [1e-2, 0.0] {
        let tool = Sphere::new(middle + outward * height, 1.0).expect("valid");
        let options = Options::new();
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let plain = query.closest(rows.as_slice(), &tool, &options).expect("an answer");
        let found = tracker.contacts(&surface, &tool, 2.0, &options, &mut contacts);
        let found = found.expect("an answer");
        sides.push((plain.side, found.closest.side));
        let first = contacts.within(2.0).expect("it has a side").next().expect("one");
        assert!((first.separation - (height - 1.0)).abs() < 2e-3, "{first:?}");
        assert!(first.normal.dot(outward) > 0.99, "{first:?}");
    }
    let outside = (Side::Outside, Side::Outside);
    let kept = (Side::Undefined(NoSide::BelowAccuracy), Side::Either);
    assert_eq!(sides, [outside, kept]);
}

/// A pleated cone with this many triangles at its tip: every other one is in a plane with its axis.
fn pleated(around: u32) -> Mesh {
    let angle = |at: u32| (at / 2) as f32 / (around / 2) as f32 * std::f32::consts::TAU;
    let low = |at: u32| Vec3::Z * (at % 2) as f32 * -5.0;
    let rim =
        (0..around).map(|at| Vec3::new(angle(at).cos(), angle(at).sin(), 0.0) * 20.0 + low(at));
    let mut mesh = Mesh { positions: rim.collect(), ..Mesh::default() };
    mesh.positions.extend([Vec3::Z * 20.0, Vec3::Z * -20.0]);
    for at in 0..around {
        let next = (at + 1) % around;
        mesh.triangles.extend([[at, next, around], [next, at, around + 1]]);
    }
    mesh
}

/// A cone whose tip joins more triangles than a side looks at, alone and around a small cavity far below the tip.
#[test]
fn a_vertex_of_too_many_triangles_has_no_side() {
    let mut cavity = ball(1);
    cavity.positions.iter_mut().for_each(|at| *at = *at * 0.05 - Vec3::Z * 5.0);
    cavity.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    let below = Side::Undefined(NoSide::BelowAccuracy);
    let none = Side::Undefined(NoSide::Degenerate);
    for (around, expected) in [(200, [Side::Outside, below]), (300, [none, none])] {
        let cone = pleated(around);
        for mesh in [joined(&[cone.clone(), cavity.clone()]), cone] {
            let built = Builder::new().build(&mesh).expect("a valid mesh");
            let tree = built.tree::<u16>().expect("valid");
            let rows = built.to_rows(&mesh.positions);
            let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
            // Above the tip, and at it.
            for (height, side) in [5.0, 0.0].into_iter().zip(expected) {
                let tool = Sphere::new(Vec3::Z * (20.0 + height), 1.0).expect("valid");
                let found = query.closest(rows.as_slice(), &tool, &Options::cold());
                let found = found.expect("an answer");
                assert!((found.separation - (height - 1.0)).abs() <= 1e-4, "{found:?}");
                assert_eq!(found.side, side, "{around} triangles, {height}");
            }
        }
    }
}

/// A tool that comes to a vertex without a side is still outside, and so it is next to the vertex, where its distance
/// gives no direction.
#[test]
fn contacts_at_a_vertex_without_a_side_have_that_of_the_tick_before() {
    let mesh = pleated(300);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let surface = Odometer::new(&tree).start(rows.as_slice());
    let tick = |tracker: &mut Tracker<'_, u16, MAX_STACK, 256>, at: Vec3, margin: f32| {
        let tool = Sphere::new(at, 1.0).expect("valid");
        let mut contacts = Contacts::<4>::new();
        let found = tracker.contacts(&surface, &tool, margin, &Options::new(), &mut contacts);
        let all = contacts.within(margin).expect("it has a side").copied().collect::<Vec<_>>();
        (found.expect("an answer"), all)
    };
    let mut tracker = Tracker::new(&tree).expect("deep enough");
    let (beside, none) = tick(&mut tracker, Vec3::new(16.0, 0.0, 24.0), 10.0);
    assert_eq!((beside.closest.side, beside.is_kept, none.len()), (Side::Outside, false, 0));
    let above = Vec3::Z * 28.0;
    let tool = Sphere::new(above, 1.0).expect("valid");
    let plain = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
    assert_eq!(plain.side, Side::Undefined(NoSide::Degenerate));
    let (over, all) = tick(&mut tracker, above, 10.0);
    let (again, none) = tick(&mut tracker, above, 5.0);
    assert!(again.is_kept && none.is_empty(), "{again:?} {none:?}");
    // The distance of four accuracies is more than the side needs, but less than a direction does.
    let height = 4.0 * over.closest.accuracy;
    let (next, nearer) = tick(&mut tracker, Vec3::Z * (20.0 + height), 10.0);
    for (found, all, separation) in [(over, all, 7.0), (next, nearer, height - 1.0)] {
        assert!(found.is_kept && found.closest.side == Side::Outside, "{found:?}");
        assert!(found.closest.direction.dot(Vec3::Z) > 0.999, "{found:?}");
        assert_eq!(all.len(), 1, "{all:?}");
        assert!((all[0].separation - separation).abs() < 2e-3, "{separation}: {all:?}");
    }
    // After a step that may have led inside, the only contact is as deep as the distance.
    let mut tracker = Tracker::new(&tree).expect("deep enough");
    let (beside, _) = tick(&mut tracker, Vec3::new(40.0, 0.0, 24.0), 10.0);
    assert_eq!(beside.closest.side, Side::Outside);
    let (over, all) = tick(&mut tracker, Vec3::Z * 23.0, 10.0);
    assert!(over.is_kept && over.closest.side == Side::Either, "{over:?}");
    assert_eq!(all.len(), 1, "{all:?}");
    assert_eq!(all[0].separation, over.closest.lower, "{all:?}");
    assert!((all[0].separation + 4.0).abs() < 2e-3, "{all:?}");
}

/// Tests that cost nothing need no budget.
#[test]
fn free_tests_have_no_budget() {
    let free = Cost { node_test: 0, triangle_test: 0, ..Cost::M7_CAPSULE };
    assert_eq!(Budget::for_instructions(1, &free), Budget::UNLIMITED);
    assert_ne!(Budget::for_instructions(1, &Cost::M7_CAPSULE), Budget::UNLIMITED);
}

/// Two links meet at a joint near the surface, so both have their contact at the same point of it: where a budget leaves
/// their closest pairs uncertain, the list still begins with the least separation of both, and lacks none below its bound.
#[test]
fn no_budget_drops_the_contact_of_a_link_that_shares_its_point() {
    const MARGIN: f32 = 15.0;
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut whole, mut part) = (Contacts::<16>::new(), Contacts::<16>::new());
    let (mut accepted, mut rng) = (0, Rng::with_seed(9));
    for round in 0..20 {
        let near = rows[rng.usize(..rows.len())];
        let joint = near * 1.08;
        let ends = [0, 1].map(|_| joint + 30.0 * (near.normalize() + 0.8 * unit(&mut rng)));
        let [one, other] = [[2.0, 0.5], [0.5, 2.0]][round % 2];
        let chain = [(ends[0], one), (ends[1], other)]
            .map(|(end, radius)| Capsule::new(joint, end, radius).expect("finite"));
        let mut ask = |options: &Options, contacts: &mut Contacts<16>| {
            let mut scene = [(&mut query, rows.as_slice())];
            let best = Query::contacts_in_scene(&mut scene, &chain, MARGIN, options, contacts);
            best.expect("an answer").expect("one").proximity
        };
        ask(&Options::cold().unsigned(), &mut whole);
        let at = |tool| whole.iter().find(|one| one.tool == tool).expect("one").point_on_surface;
        assert!(at(0).distance(at(1)) < 0.01, "{round}");
        for tests in 0..800 {
            let budget = Options::cold().unsigned().budget(Budget::new(tests));
            let best = ask(&budget, &mut part);
            let error = whole.accuracy() + part.accuracy();
            for contact in whole.iter().filter(|one| one.separation < part.bound() - error) {
                let is_listed = part.iter().any(|one| {
                    one.tool == contact.tool && one.separation <= contact.separation + error
                });
                assert!(is_listed, "{round}, {tests}: {} {}", contact.tool, contact.separation);
            }
            if let Ok(mut list) = part.within(MARGIN) {
                let first = list.next().map_or(MARGIN, |one| one.separation);
                assert!(first <= best.lower + error, "{round}, {tests}: {first} {}", best.lower);
                accepted += u32::from(best.lower < best.separation);
            }
        }
    }
    assert!(accepted > 100, "{accepted}");
}
