//! Contacts compared with an exhaustive list in f64, and their force and inequalities.
//!
//! One file, because all tests compare with the same list.

// Requirement: S-04

mod basins;

use std::sync::Mutex;

use basins::{LIKE, MARGIN, Surroundings, basins, least_prominence};
use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, Proxy, SpringDamper, VelocityRow};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Contact, Contacts, Options, Query, QueryError, Side, Sphere, Unavailable,
};
use dibs_tests::oracle::closest_pair;
use dibs_tests::surfaces::{self, ball, sheet};
use fastrand::Rng;
use glam::Vec3;

fn build(mesh: &Mesh) -> (BuiltTree, Vec<Vec3>) {
    let built = Builder::new().stretch(1.5).build(mesh).expect("a valid mesh");
    let rows = built.to_rows(&mesh.positions);
    (built, rows)
}

#[test]
fn no_contact_is_missing_and_none_is_doubled() {
    let shapes = [
        ("organ", generate::heart(1_000).expect("a valid size").mesh),
        ("folds", generate::brain(1_000).expect("a valid size")),
        ("convex", ball(3)),
        ("flat", sheet(20, 60.0, |_, _| 0.0)),
        ("concave", sheet(24, 60.0, |x, y| 0.01 * (x * x + y * y))),
        ("waves", sheet(40, 60.0, |x, y| 2.5 * (0.4 * x).sin() * (0.3 * y).cos())),
        ("rough", sheet(40, 60.0, |x, y| ((12.9898 * x + 78.233 * y).sin() * 43_758.547).fract())),
    ];
    let poses = if cfg!(debug_assertions) { 10 } else { 120 };
    let (mut checked, mut crossing, mut open, mut several) = (0, 0, 0, 0);
    for (seed, (name, mesh)) in (1..).zip(shapes) {
        let mut rng = Rng::with_seed(seed);
        let (built, rows) = build(&mesh);
        let tree = built.tree::<u16>().expect("valid");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut contacts = Contacts::<128, 2048>::new();
        for _ in 0..poses {
            let [a, b, c] = triangles[rng.usize(..triangles.len())].map(|v| rows[v as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let mut any = || Vec3::new(rng.f32() - 0.5, rng.f32() - 0.5, rng.f32() - 0.5);
            let from = a + normal * 5.0 + any() * 4.0;
            let to = from + any() * 40.0;
            let radius = 1.5;
            let tool = Capsule::new(from, to, radius).expect("valid");
            let closest = query
                .contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut contacts)
                .expect("an answer");
            let is_crossing = closest.side == Side::Crossing;
            if !is_crossing && closest.side != Side::Outside {
                continue;
            }
            checked += 1;
            crossing += usize::from(is_crossing);
            if let Some(first) = contacts.iter().next().filter(|_| is_crossing) {
                assert_eq!(first.separation, closest.lower, "{name}: {closest:?}");
                open += usize::from(closest.lower < closest.separation);
            }
            let (truth, label) = basins(&rows, &triangles, [from, to]);
            // An axis that crosses may be inside in several parts, but only one of these has a contact.
            let is_bounded = is_crossing && contacts.bound() == closest.lower;
            assert!((contacts.bound() >= MARGIN || is_bounded) && !contacts.is_full());
            let surroundings = Surroundings::of(&rows, &triangles, [from, to]);
            let mut found = vec![Vec::new(); truth.len()];
            // The first contact of a crossing axis is its deepest point, and represents the whole crossing.
            let accuracy = f64::from(contacts.accuracy());
            for contact in contacts.iter().skip(usize::from(is_crossing)) {
                let basin = label[contact.triangle.0 as usize];
                // Walls in other directions are separate contacts, and separate those beside them.
                let is_same = |other: &Contact| {
                    let rows = [contact, other].map(|at| at.triangle.0 as usize);
                    contact.normal.distance(other.normal) < LIKE && surroundings.connect(rows)
                };
                assert!(!found[basin].iter().any(is_same), "{name}: twice {:?}", truth[basin]);
                found[basin].push(*contact);
                let corners =
                    triangles[contact.triangle.0 as usize].map(|v| rows[v as usize].as_dvec3());
                let pair = closest_pair(from.as_dvec3(), to.as_dvec3(), corners);
                let off = f64::from(contact.separation + radius) - pair.distance;
                let off = off.abs() - f64::from(contacts.accuracy());
                assert!(off <= 0.0, "{name}: {contact:?} {:?}", truth[basin]);
                let apart = contact.point_on_tool - contact.point_on_surface;
                assert!(
                    (apart.dot(contact.normal) - contact.separation).abs() < 1e-3,
                    "{contact:?}"
                );
            }
            let slack = 0.01;
            for (listed, basin) in found.iter().zip(&truth) {
                let reach = f64::from(MARGIN + radius);
                let is_apart = !is_crossing || basin.distance > accuracy;
                let is_clear = is_apart && basin.distance < reach - slack && basin.up > 0.05;
                let is_parted = basin.prominence > least_prominence(basin.distance) + slack;
                assert!(!is_clear || !is_parted || !listed.is_empty(), "{name}: no {basin:?}");
            }
            several += usize::from(contacts.len() > 1);
        }
    }
    println!("{checked} poses, {crossing} cross, {several} with several contacts");
    assert!(checked > poses * 3 && crossing > checked / 20 && several > checked / 20);
    assert!(open > 0, "no interval that is longer than a point");
}

/// Most of the several thousand triangles within the margin lead downhill to a contact, and are not stored.
#[test]
fn a_fine_surface_needs_little_room() {
    let waves = |x: f32, y: f32| 2.5 * (0.4 * x).sin() * (0.3 * y).cos();
    let (from, to) = (Vec3::new(-25.0, 1.0, 4.0), Vec3::new(25.0, 3.0, 4.5));
    let tool = Capsule::new(from, to, 1.0).expect("valid");
    let found = |cells| {
        let (built, rows) = build(&sheet(cells, 60.0, waves));
        let tree = built.tree::<u16>().expect("valid");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut contacts = Contacts::<32, 2048>::new();
        let answer =
            query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut contacts);
        answer.expect("an answer");
        assert!(contacts.bound() >= MARGIN, "{cells}: only within {}", contacts.bound());
        contacts.len()
    };
    // Facets move ridges, which separate contacts or do not; but 40 times as many triangles do not make more contacts.
    let counts = [20, 40, 80, 126].map(found);
    assert!(counts.iter().all(|count| (4..=12).contains(count)), "{counts:?}");
}

#[test]
fn a_flat_wall_along_a_capsule_is_one_contact() {
    let (built, rows) = build(&sheet(30, 60.0, |_, _| 0.0));
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    for (from, to) in
        [((-20.0, -20.0), (20.0, 20.0)), ((-20.0, 1.0), (21.0, 1.0)), ((0.0, 0.0), (9.0, 7.0))]
    {
        let at = |(x, y): (f32, f32)| Vec3::new(x, y, 4.0);
        let tool = Capsule::new(at(from), at(to), 1.0).expect("valid");
        let answer = query.contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut contacts);
        answer.expect("an answer");
        assert_eq!(contacts.len(), 1, "{contacts:?}");
        let contact = contacts.iter().next().expect("one");
        assert!((contact.separation - 3.0).abs() < 1e-4 && contact.normal.z > 0.999);
    }
}

/// At the tip of a cone the axis is on the inner side of the triangles behind it, which are as close as those in front.
#[test]
fn the_tip_of_a_cone_is_a_contact_from_all_around() {
    let around = |at: u32| {
        let (sin, cos) = (std::f32::consts::TAU * at as f32 / 8.0).sin_cos();
        Vec3::new(2.0 * cos, 2.0 * sin, 0.0)
    };
    let tip = Vec3::Z * 10.0;
    let positions = [tip, Vec3::ZERO].into_iter().chain((0..8).map(around)).collect();
    let sides = (0..8).map(|at| [0, 2 + at, 2 + (at + 1) % 8]);
    let base = (0..8).map(|at| [1, 2 + (at + 1) % 8, 2 + at]);
    let cone = Mesh { positions, triangles: sides.chain(base).collect(), ..Mesh::default() };
    let (built, rows) = build(&cone);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    for turn in 0..64 {
        for tilt in 0..7 {
            let (sin, cos) = (0.2 * tilt as f32).sin_cos();
            let (y, x) = (0.1 * turn as f32).sin_cos();
            let centre = tip + 2.0 * Vec3::new(sin * x, sin * y, cos);
            let tool = Sphere::new(centre, 0.5).expect("valid");
            let answer =
                query.contacts(rows.as_slice(), &tool, 3.0, &Options::cold(), &mut contacts);
            assert_eq!(answer.expect("an answer").side, Side::Outside);
            assert_eq!(contacts.len(), 1, "{turn} {tilt}: {contacts:?}");
            let contact = contacts.iter().next().expect("one");
            assert!((contact.separation - 1.5).abs() < 1e-4, "{contact:?}");
        }
    }
}

/// The far side of a thin plate is within the margin, but faces away from the tool.
#[test]
fn the_far_side_of_a_thin_plate_is_no_contact() {
    let top = sheet(12, 30.0, |_, _| 0.0);
    let mut plate = top.clone();
    let count = top.positions.len() as u32;
    plate.positions.extend(top.positions.iter().map(|p| *p - Vec3::Z));
    plate
        .triangles
        .extend(top.triangles.iter().map(|t| [t[0] + count, t[2] + count, t[1] + count]));
    // The plate's rim.
    let edges: Vec<(u32, u32)> =
        top.triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
    for &(a, b) in edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a))) {
        plate.triangles.extend([[b, a, a + count], [b, a + count, b + count]]);
    }
    assert_eq!(dibs_build::check_winding(&plate), Ok(()));
    let (built, rows) = build(&plate);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    let tool = Sphere::new(Vec3::new(0.3, 0.2, 2.0), 1.0).expect("valid");
    query
        .contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut contacts)
        .expect("an answer");
    assert_eq!(contacts.len(), 1);
    let tool = Sphere::new(Vec3::new(0.3, 0.2, -0.4), 1.0).expect("valid");
    let inside = query
        .contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut contacts)
        .expect("an answer");
    assert_eq!((contacts.len(), inside.side), (1, Side::Inside));
    assert!(contacts.iter().all(|contact| contact.normal.z > 0.99 && contact.separation < -1.0));
}

#[test]
fn a_short_list_and_a_short_budget_state_what_still_holds() {
    let (built, rows) = build(&sheet(40, 60.0, |x, y| 2.5 * (0.4 * x).sin() * (0.3 * y).cos()));
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool =
        Capsule::new(Vec3::new(-25.0, 1.0, 4.0), Vec3::new(25.0, 3.0, 4.5), 1.0).expect("valid");
    let mut all = Contacts::<64, 4096>::new();
    query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut all).expect("an answer");
    assert!(all.len() > 3 && !all.is_full(), "{}", all.len());
    let holds = |few: &[f32], bound: f32| {
        let below = all.iter().filter(|contact| contact.separation < bound);
        below.clone().for_each(|contact| {
            assert!(few.contains(&contact.separation), "{bound}: {contact:?} {few:?}");
        });
        below.count()
    };
    let mut few = Contacts::<3, 4096>::new();
    query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut few).expect("an answer");
    assert!(few.is_full() && few.bound() < MARGIN && few.len() == 3);
    assert_eq!(few.within(MARGIN).expect("the deepest are known").count(), 3);
    let farther = few.within(2.0 * MARGIN).err();
    let margin = QueryError::Margin { bits: (2.0 * MARGIN).to_bits() };
    assert_eq!(farther, Some(Unavailable::Query(margin)));
    assert_eq!(Contacts::<3>::new().within(0.0).err(), Some(Unavailable::CutShort));
    assert_eq!(holds(&few.iter().map(|c| c.separation).collect::<Vec<_>>(), few.bound()), 3);
    let mut near = Contacts::<64, 60>::new();
    query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut near).expect("an answer");
    assert!(near.bound() < MARGIN);
    holds(&near.iter().map(|c| c.separation).collect::<Vec<_>>(), near.bound());
    // With room for a single triangle no wall is known completely, but the closest pair is in the list.
    let mut one = Contacts::<64, 1>::new();
    let closest = query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut one);
    let closest = closest.expect("an answer");
    let deepest = one.iter().next().expect("the closest pair").separation;
    assert!((deepest - closest.lower).abs() <= 2.0 * closest.accuracy, "{deepest} {closest:?}");
    assert!(one.bound() < MARGIN, "{}", one.bound());
    holds(&one.iter().map(|c| c.separation).collect::<Vec<_>>(), one.bound());
    let mut cut_short = 0;
    for node_tests in (0..4_000).step_by(23).chain(0..200) {
        let options = Options::cold().budget(Budget::new(node_tests));
        query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut near).expect("an answer");
        cut_short += usize::from(near.bound() < MARGIN);
        let refused = near.within(MARGIN).err();
        assert!(
            refused.is_none() || refused == Some(Unavailable::CutShort) && near.bound() < MARGIN
        );
        holds(&near.iter().map(|c| c.separation).collect::<Vec<_>>(), near.bound());
    }
    assert!(cut_short > 20, "{cut_short}");
    // Without a side the closest pair may be uncertain: the list begins with the least separation, and up to the bound it is
    // known that nothing is missing.
    let (mut uncertain, deepest) = (0, all.iter().next().expect("a contact").separation);
    for node_tests in 0..200 {
        let options = Options::cold().unsigned().budget(Budget::new(node_tests));
        let closest = query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut near);
        let Some(_) = closest.expect("an answer").triangle else {
            assert_eq!(near.within(MARGIN).err(), Some(Unavailable::CutShort));
            let known = near.within(near.bound()).expect("what is below the bound is known");
            holds(&known.map(|c| c.separation).collect::<Vec<_>>(), near.bound());
            continue;
        };
        let first = near.within(MARGIN).expect("nothing is deeper").next().expect("a contact");
        assert!(first.separation <= deepest + all.accuracy(), "{node_tests}: {first:?}");
        let list = near.within(near.bound().min(MARGIN)).expect("nothing is deeper");
        assert!(list.is_complete(), "{node_tests}: {}", near.bound());
        uncertain += u32::from(first.separation < deepest - 0.1);
    }
    assert!(uncertain > 20, "{uncertain}");
}

/// A contact at a vertex is found once its neighbours are seen, which a budget may prevent.
#[test]
fn no_budget_hides_a_contact_at_a_vertex() {
    let spikes = sheet(12, 40.0, |x, y| 2.0 * (7.1 * x).sin() * (5.3 * y).cos());
    let (built, rows) = build(&spikes);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = |y, node_tests| {
        let (start, end) = (Vec3::new(-15.0, y, 4.0), Vec3::new(15.0, y + 2.0, 4.5));
        let tool = Capsule::new(start, end, 1.0).expect("valid");
        let options = Options::cold().budget(Budget::new(node_tests));
        let mut found = Contacts::<64>::new();
        query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut found).expect("an answer");
        (found.iter().map(|at| at.separation).collect::<Vec<_>>(), found.bound())
    };
    let mut bounded = 0;
    for y in (-36..36).map(|y| 0.5 * y as f32) {
        let (all, _) = contacts(y, u32::MAX);
        for budget in 0..800 {
            let (found, bound) = contacts(y, budget);
            let below = all.iter().filter(|&&at| at < bound);
            assert!(
                below.clone().all(|at| found.contains(at)),
                "{y} {budget} {bound}: {found:?} {all:?}"
            );
            bounded += usize::from(bound < MARGIN && below.count() > 0);
        }
    }
    assert!(bounded > 20, "{bounded}");
}

/// A list of a label's part is only accepted if its deepest contact is certain, also where the closest pair is of another
/// part, and the budget ends around a contact at a vertex.
#[test]
fn no_budget_hides_the_deepest_contact_of_a_part() {
    const PART: u8 = 1;
    let spikes = sheet(12, 40.0, |x, y| 2.0 * (7.1 * x).sin() * (5.3 * y).cos());
    let is_of_part = |rows: &[u32; 3]| {
        let at = rows.map(|row| spikes.positions[row as usize].x);
        u8::from(at.iter().sum::<f32>() > 12.0) * PART
    };
    let labels = spikes.triangles.iter().map(is_of_part).collect();
    let built = Builder::new().labels(labels).build(&spikes).expect("a valid mesh");
    let rows = built.to_rows(&spikes.positions);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut deepest = |y, node_tests| {
        let (start, end) = (Vec3::new(-15.0, y, 4.0), Vec3::new(15.0, y + 2.0, 4.5));
        let tool = Capsule::new(start, end, 1.0).expect("valid");
        let options = Options::cold().contacts_of(PART).budget(Budget::new(node_tests));
        let mut found = Contacts::<64>::new();
        let closest = query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut found);
        let row = closest.expect("an answer").triangle;
        let is_other = row.is_some_and(|row| tree.label(row) != Some(PART));
        let list = found.within(MARGIN);
        (list.map(|mut list| list.next().map_or(MARGIN, |first| first.separation)), is_other)
    };
    let (mut refused, mut accepted) = (0, 0);
    for y in (-36..36).map(|y| 0.5 * y as f32) {
        let (truth, is_other) = deepest(y, u32::MAX);
        let truth = truth.expect("complete");
        if !is_other {
            continue;
        }
        for budget in 0..800 {
            match deepest(y, budget).0 {
                Ok(first) => {
                    assert!(first <= truth + 1e-3, "{y} {budget}: {first} {truth}");
                    accepted += 1;
                }
                Err(error) => {
                    assert_eq!(error, Unavailable::CutShort);
                    refused += 1;
                }
            }
        }
    }
    assert!(accepted > 100 && refused > 100, "{accepted} {refused}");
}

/// Inside, the nearest triangle found within a small budget may be on the far side: its force would point inwards.
#[test]
fn no_budget_turns_the_force_inwards() {
    let mesh = ball(4);
    let (built, rows) = build(&mesh);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    let spring = SpringDamper::stiffness(1.0).max_force(50.0);
    let (wall, proxy) = (ForbiddenRegion::new(spring, 5.0), Proxy::new(spring, 5.0));
    let (wall, proxy) = (wall.expect("a valid margin"), proxy.expect("a valid margin"));
    let out = Vec3::new(0.3, 0.2, 0.9).normalize();
    let (mut held, mut pushed) = (0, 0);
    for height in [-12.0, -3.0, -0.5, 0.5, 4.0] {
        let tool = Sphere::new(out * (40.0 + height), 1.0).expect("valid");
        for node_tests in (0..900).step_by(3) {
            let budget = Budget::new(node_tests);
            let options = Options::cold().budget(budget);
            let closest = query.contacts(rows.as_slice(), &tool, 5.0, &options, &mut contacts);
            let closest = closest.expect("a short budget is no error");
            let alone = wall.force(&Ok(closest), Vec3::ZERO);
            let accuracy = contacts.accuracy();
            let within = contacts.within(5.0);
            let all = proxy.wrench(within, accuracy, tool.centre(), Vec3::ZERO, Vec3::ZERO);
            let forces = [(alone.force, alone.state), (all.force, all.state)];
            for (force, state) in forces {
                if state == ConstraintState::Safe(Unavailable::CutShort) {
                    held += 1;
                    continue;
                }
                pushed += 1;
                let enough = 0.9 * (5.0 - (height - 1.0));
                assert!(
                    force.dot(out) > enough.max(0.0),
                    "{height}, {budget:?}: {force} {closest:?}"
                );
            }
        }
    }
    assert!(held > 50 && pushed > 50, "{held} {pushed}");
}

/// The basin around a contact has triangles that no search has seen.
#[test]
fn a_vertex_beyond_a_contacts_triangle_that_is_not_finite_is_named() {
    // A long triangle whose tip is under the tool, and a small one at its far end.
    let corners = [[0.0, -1.0, 0.0], [50.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-4.0, -4.0, 0.0]];
    let positions = corners.map(Vec3::from).to_vec();
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]], ..Mesh::default() };
    let built = Builder::new().leaf_triangles(1).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let mut rows = built.to_rows(&mesh.positions);
    let vertex = rows.iter().position(|&row| row == mesh.positions[3]).expect("a row");
    rows[vertex].z = f32::NAN;
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<4>::new();
    let tool = Sphere::new(Vec3::new(45.0, 0.0, 3.0), 1.0).expect("valid");
    let closest = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("it is far away");
    assert_eq!((closest.side, closest.separation), (Side::Outside, 2.0));
    // Within the larger margin the search itself reads it.
    for margin in [5.0, 60.0] {
        let refused =
            query.contacts(rows.as_slice(), &tool, margin, &Options::cold(), &mut contacts);
        let vertex = vertex as u32;
        assert_eq!(refused.err(), Some(QueryError::Position { vertex }), "{margin}");
        assert!(contacts.is_empty());
    }
}

/// More triangles than 16 bits can count. Its memory is too large for a test's stack.
static TOO_MANY: Mutex<Contacts<4, 65_535>> = Mutex::new(Contacts::new());

#[test]
fn what_cannot_be_asked_is_named() {
    let mesh = ball(2);
    let (built, mut rows) = build(&mesh);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool = Sphere::new(Vec3::X * 45.0, 1.0).expect("valid");
    let mut none = Contacts::<0>::new();
    let refused = query.contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut none);
    assert_eq!(refused.err(), Some(QueryError::Contacts { capacity: 0, near: 512 }));
    let mut none = Contacts::<4, 0>::new();
    let refused = query.contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut none);
    assert_eq!(refused.err(), Some(QueryError::Contacts { capacity: 4, near: 0 }));
    let mut many = TOO_MANY.lock().expect("no other user");
    let refused = query.contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut many);
    assert_eq!(refused.err(), Some(QueryError::Contacts { capacity: 4, near: 65_535 }));
    let mut contacts = Contacts::<4>::new();
    for margin in [-1.0, f32::NAN, f32::INFINITY] {
        let refused =
            query.contacts(rows.as_slice(), &tool, margin, &Options::cold(), &mut contacts);
        assert_eq!(refused.err(), Some(QueryError::Margin { bits: margin.to_bits() }));
    }
    let bare = Builder::new().with_adjacency(false).build(&mesh).expect("a valid mesh");
    let bare = bare.tree::<u16>().expect("valid");
    let mut other = Query::<u16, MAX_STACK>::new(&bare).expect("deep enough");
    let refused = other.contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut contacts);
    assert_eq!(refused.err(), Some(QueryError::NoAdjacency));
    query
        .contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut contacts)
        .expect("an answer");
    let short: &[Vec3] = &[Vec3::X];
    assert!(matches!(contacts.move_with(short), Err(QueryError::VertexCount { .. })));
    let still = vec![Vec3::new(1.0, 2.0, 3.0); rows.len()];
    contacts.move_with(still.as_slice()).expect("a velocity each");
    assert!(contacts.iter().all(|contact| contact.velocity.distance(still[0]) < 1e-5));
    let nearest = contacts.iter().next().expect("one").corners[0];
    rows[nearest as usize].y = f32::NAN;
    let refused = query.contacts(rows.as_slice(), &tool, 5.0, &Options::cold(), &mut contacts);
    assert!(matches!(refused, Err(QueryError::Position { .. })), "{refused:?}");
    assert!(contacts.is_empty());
}

/// Several contacts with one wall push like that wall, up to the compliance.
#[test]
fn one_wall_is_never_two() {
    let mesh = sheet(20, 60.0, |_, _| 0.0);
    let (built, rows) = build(&mesh);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    let spring = SpringDamper::stiffness(1.0).max_force(50.0);
    let proxy = Proxy::new(spring, 3.0).expect("a valid margin");
    let tool = Sphere::new(Vec3::new(0.2, 0.1, 2.0), 1.0).expect("valid");
    query
        .contacts(rows.as_slice(), &tool, 3.0, &Options::cold(), &mut contacts)
        .expect("an answer");
    let contact = *contacts.iter().next().expect("one");
    for count in [1, 2, 5, 8] {
        let same = std::iter::repeat_n(&contact, count);
        let found = proxy.wrench(Ok(same), 0.0, tool.centre(), Vec3::ZERO, Vec3::ZERO);
        let part = found.force.z / 2.0;
        assert!((0.99..1.07).contains(&part), "{count}: {part}");
    }
    // A wall that approaches the tool has the same effect as the opposite, on the damper and on the row.
    let damped = Proxy::new(SpringDamper::stiffness(1.0).damping(0.01).max_force(50.0), 3.0);
    let mut moving = contact;
    moving.velocity = Vec3::Z * 40.0;
    let still = std::iter::once(&contact);
    let one = damped.expect("a valid margin");
    let pushed = one.wrench(Ok(still), 0.0, tool.centre(), Vec3::Z * -40.0, Vec3::ZERO);
    let met = one.wrench(Ok(std::iter::once(&moving)), 0.0, tool.centre(), Vec3::ZERO, Vec3::ZERO);
    assert!(pushed.force.distance(met.force) < 1e-5 && pushed.force.z > 2.3, "{pushed:?} {met:?}");
    let row = VelocityRow::new(&moving, 0.0, tool.centre()).stand_off(0.5).gain(10.0);
    // The wall's 40 mm/s, minus 10 a second times the remaining half millimetre.
    assert!(row.allows(Vec3::Z * 35.1, Vec3::ZERO) && !row.allows(Vec3::Z * 34.9, Vec3::ZERO));
}
