//! Contacts against an exhaustive list in f64, and what a force of all of them holds that one of them does not.

use std::collections::HashMap;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::constraint::{ForbiddenRegion, Proxy, SpringDamper, VelocityRow};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, Contacts, Options, Query, QueryError, Side, Sphere};
use dibs_tests::oracle::closest_pair;
use dibs_tests::surfaces::{self, ball};
use fastrand::Rng;
use glam::Vec3;

const MARGIN: f32 = 6.0;
/// As the library has it, but for its accuracy.
const RIDGE: f64 = MARGIN as f64 / 64.0;

/// A valley of the distance over the surface.
#[derive(Clone, Copy, Debug)]
struct Valley {
    distance: f64,
    /// Height of the lowest ridge to a lower valley, above this one.
    ridge: f64,
    /// Product of the axis' direction with the normal of the lowest triangle.
    up: f64,
}

/// Every valley in f64, and the valley of every triangle, where ridges up to [`RIDGE`] do not count.
fn valleys(rows: &[Vec3], triangles: &[[u32; 3]], tool: [Vec3; 2]) -> (Vec<Valley>, Vec<usize>) {
    let mut across = HashMap::new();
    for (row, &[a, b, c]) in triangles.iter().enumerate() {
        for edge in [(a, b), (b, c), (c, a)] {
            across.insert(edge, row);
        }
    }
    let at = |row: usize| triangles[row].map(|v| rows[v as usize].as_dvec3());
    let [start, end] = tool.map(Vec3::as_dvec3);
    let pairs: Vec<_> = (0..triangles.len()).map(|row| closest_pair(start, end, at(row))).collect();
    let mut order: Vec<usize> = (0..triangles.len()).collect();
    order.sort_by(|&a, &b| pairs[a].distance.total_cmp(&pairs[b].distance));
    // Of each triangle the valley that it drains into: of all, and of those that count as one.
    let (mut all, mut one) = (vec![usize::MAX; order.len()], vec![usize::MAX; order.len()]);
    let bottom = |of: &[usize], mut row: usize| {
        while of[row] != row {
            row = of[row];
        }
        row
    };
    let mut ridges: HashMap<usize, f64> = HashMap::new();
    for &row in &order {
        let [a, b, c] = triangles[row];
        let known = [(b, a), (c, b), (a, c)].into_iter().filter_map(|edge| across.get(&edge));
        let known: Vec<usize> = known.copied().filter(|&other| all[other] != usize::MAX).collect();
        let mut bottoms: Vec<usize> = known.iter().map(|&other| bottom(&all, other)).collect();
        bottoms.sort_by(|&a, &b| pairs[a].distance.total_cmp(&pairs[b].distance));
        bottoms.dedup();
        (all[row], one[row]) = (row, row);
        let Some(&lowest) = bottoms.first() else { continue };
        all[row] = lowest;
        let near = known.iter().find(|&&other| bottom(&all, other) == lowest);
        one[row] = bottom(&one, *near.expect("it is known"));
        for &valley in &bottoms[1..] {
            let ridge = pairs[row].distance - pairs[valley].distance;
            ridges.insert(valley, ridge);
            all[valley] = lowest;
            if ridge <= RIDGE {
                let into = bottom(&one, row);
                one[valley] = into;
            }
        }
    }
    let lowest: Vec<usize> = (0..triangles.len()).filter(|&row| one[row] == row).collect();
    let labels = (0..triangles.len())
        .map(|row| lowest.iter().position(|&l| l == bottom(&one, row)).expect("a valley"))
        .collect();
    let found = lowest.iter().map(|&row| {
        let [a, b, c] = at(row);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let towards = (pairs[row].on_axis - pairs[row].on_surface).normalize_or_zero();
        let ridge = ridges.get(&row).copied().unwrap_or(f64::INFINITY);
        Valley { distance: pairs[row].distance, ridge, up: normal.dot(towards) }
    });
    (found.collect(), labels)
}

/// A grid of squares, each cut in two, bent by a function of x and y.
fn sheet(cells: u32, size: f32, height: impl Fn(f32, f32) -> f32) -> Mesh {
    let at = |x: u32, y: u32| y * (cells + 1) + x;
    let mut mesh = Mesh::default();
    for y in 0..=cells {
        for x in 0..=cells {
            let place = |n: u32| (n as f32 / cells as f32 - 0.5) * size;
            let (px, py) = (place(x), place(y));
            mesh.positions.push(Vec3::new(px, py, height(px, py)));
            if x < cells && y < cells {
                let (a, b, c, d) = (at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1));
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }
    mesh
}

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
    ];
    let poses = if cfg!(debug_assertions) { 10 } else { 120 };
    let (mut checked, mut several) = (0, 0);
    for (seed, (name, mesh)) in (1..).zip(shapes) {
        let mut rng = Rng::with_seed(seed);
        let (built, rows) = build(&mesh);
        let tree = built.tree::<u16>().expect("valid");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut contacts = Contacts::<32, 2048>::new();
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
            if closest.side != Side::Outside {
                continue;
            }
            checked += 1;
            let (truth, label) = valleys(&rows, &triangles, [from, to]);
            assert!(contacts.bound() >= MARGIN && !contacts.is_full());
            let mut found = vec![0; truth.len()];
            for contact in contacts.iter() {
                let valley = label[contact.triangle as usize];
                found[valley] += 1;
                let off = f64::from(contact.separation + radius) - truth[valley].distance;
                let off = off.abs() - f64::from(contacts.accuracy());
                assert!(off <= 0.0, "{name}: {contact:?} {:?}", truth[valley]);
                let apart = contact.point_on_tool - contact.point_on_surface;
                assert!(
                    (apart.dot(contact.normal) - contact.separation).abs() < 1e-3,
                    "{contact:?}"
                );
            }
            let slack = 0.01;
            for (count, valley) in found.iter().zip(&truth) {
                let reach = f64::from(MARGIN + radius);
                let is_clear = valley.distance < reach - slack && valley.up > 0.05;
                let is_parted = valley.ridge > RIDGE + slack;
                assert!(!is_clear || !is_parted || *count == 1, "{name}: {count} of {valley:?}");
                assert!(*count <= 1, "{name}: {count} of {valley:?}");
            }
            several += usize::from(contacts.len() > 1);
        }
    }
    println!("{checked} poses outside, {several} with several contacts");
    assert!(checked > poses * 3 && several > checked / 20);
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

/// The far side of a thin organ is as near as its margin, but on the tool's other side.
#[test]
fn the_far_side_of_a_thin_plate_is_no_contact() {
    let top = sheet(12, 30.0, |_, _| 0.0);
    let mut plate = top.clone();
    let count = top.positions.len() as u32;
    plate.positions.extend(top.positions.iter().map(|p| *p - Vec3::Z));
    plate
        .triangles
        .extend(top.triangles.iter().map(|t| [t[0] + count, t[2] + count, t[1] + count]));
    // Its rim.
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
    assert_eq!(holds(&few.iter().map(|c| c.separation).collect::<Vec<_>>(), few.bound()), 3);
    let mut near = Contacts::<64, 60>::new();
    query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut near).expect("an answer");
    assert!(near.bound() < MARGIN);
    holds(&near.iter().map(|c| c.separation).collect::<Vec<_>>(), near.bound());
    let mut cut_short = 0;
    for node_tests in (0..4_000).step_by(23) {
        let options = Options::cold().budget(Budget { node_tests, triangle_tests: node_tests / 4 });
        query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut near).expect("an answer");
        cut_short += usize::from(near.bound() < MARGIN);
        holds(&near.iter().map(|c| c.separation).collect::<Vec<_>>(), near.bound());
    }
    assert!(cut_short > 20, "{cut_short}");
}

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

const TICK: f32 = 0.001;
/// N, below the saturation.
const PUSH: f32 = 2.0;
const MOST: f32 = 5.0;

/// A hand of 200 g that pushes a sphere down into something for four seconds. Returns the least signed separation and
/// how much the force changed from one tick to the next at most, after first contact.
fn pushed(mesh: &Mesh, from: Vec3, by_all: bool) -> (f32, f32) {
    let (built, rows) = build(mesh);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    let spring = SpringDamper::new(2.0, 0.002, MOST).expect("valid gains");
    let proxy = Proxy::new(spring, 3.0).expect("a valid margin");
    let alone = ForbiddenRegion::new(spring, 3.0).expect("a valid margin");
    let (mass, damping) = (2e-4, 0.006);
    let (mut at, mut velocity, mut least, mut step) = (from, Vec3::ZERO, f32::INFINITY, 0.0);
    let mut before: Option<Vec3> = None;
    for _ in 0..4_000 {
        let tool = Sphere::new(at, 1.0).expect("valid");
        let closest = query
            .contacts(rows.as_slice(), &tool, 3.0, &Options::cold(), &mut contacts)
            .expect("an answer");
        least = f32::min(least, closest.separation);
        let force = if by_all {
            let accuracy = contacts.accuracy();
            proxy.wrench(Ok(contacts.iter()), accuracy, at, velocity, Vec3::ZERO).force
        } else {
            alone.force(&Ok(closest), velocity).force
        };
        if let Some(before) = before {
            step = f32::max(step, before.distance(force));
        }
        before = Some(force).filter(|force| force.length() > 0.0);
        let all = force - Vec3::Z * PUSH - velocity * damping;
        velocity += all * (TICK / mass);
        at += velocity * TICK;
        if at.z < -20.0 {
            break;
        }
    }
    (least, step)
}

/// A narrow groove: its walls lean 12 degrees from upright, so one of them alone cannot bear the hand.
#[test]
fn a_hand_does_not_get_through() {
    let flat = sheet(20, 60.0, |_, _| 0.0);
    let groove = sheet(40, 40.0, |x, _| 4.7 * x.abs());
    let corner = sheet(40, 40.0, |x, y| x.abs() + y.abs());
    let mut results = Vec::new();
    for (name, mesh, from) in [
        ("flat wall", &flat, Vec3::new(0.3, 0.2, 4.6)),
        ("sphere", &ball(4), Vec3::new(0.4, 0.3, 44.6)),
        ("corner", &corner, Vec3::new(0.5, 0.4, 12.0)),
        ("groove", &groove, Vec3::new(0.2, 0.3, 30.0)),
    ] {
        for by_all in [true, false] {
            let (least, step) = pushed(mesh, from, by_all);
            let which = if by_all { "all contacts" } else { "closest pair" };
            println!(
                "{name:10} {which}: separation at least {least:.3} mm, largest step {step:.3} N"
            );
            results.push((name, by_all, least));
        }
    }
    for &(name, by_all, least) in &results {
        assert!(!by_all || least > -1.0, "{name}: the centre went through, {least}");
    }
    assert!(results.iter().any(|&(_, by_all, least)| !by_all && least < -1.0));
}

/// Twice the same wall is that wall, and no force where nothing is near.
#[test]
fn one_wall_is_never_two() {
    let mesh = sheet(20, 60.0, |_, _| 0.0);
    let (built, rows) = build(&mesh);
    let tree = built.tree::<u16>().expect("valid");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<8>::new();
    let spring = SpringDamper::new(1.0, 0.0, 50.0).expect("valid gains");
    let proxy = Proxy::new(spring, 3.0).expect("a valid margin");
    let tool = Sphere::new(Vec3::new(0.2, 0.1, 2.0), 1.0).expect("valid");
    query
        .contacts(rows.as_slice(), &tool, 3.0, &Options::cold(), &mut contacts)
        .expect("an answer");
    let contact = *contacts.iter().next().expect("one");
    for count in [1, 2, 5, 8] {
        let same = std::iter::repeat_n(&contact, count);
        let found = proxy.wrench(Ok(same), 0.0, tool.center(), Vec3::ZERO, Vec3::ZERO);
        let part = found.force.z / 2.0;
        assert!((0.99..1.07).contains(&part), "{count}: {part}");
    }
    // A wall that comes at the tool is a tool that comes at the wall, for damper and row alike.
    let damped = Proxy::new(SpringDamper::new(1.0, 0.01, 50.0).expect("valid gains"), 3.0);
    let mut moving = contact;
    moving.velocity = Vec3::Z * 40.0;
    let still = std::iter::once(&contact);
    let one = damped.expect("a valid margin");
    let pushed = one.wrench(Ok(still), 0.0, tool.center(), Vec3::Z * -40.0, Vec3::ZERO);
    let met = one.wrench(Ok(std::iter::once(&moving)), 0.0, tool.center(), Vec3::ZERO, Vec3::ZERO);
    assert!(pushed.force.distance(met.force) < 1e-5 && pushed.force.z > 2.3, "{pushed:?} {met:?}");
    let row = VelocityRow::new(&moving, 0.0, tool.center(), 0.5, 10.0);
    // 40 mm/s with the wall, and 10 a second of the half mm that is left.
    assert!(row.allows(Vec3::Z * 35.1, Vec3::ZERO) && !row.allows(Vec3::Z * 34.9, Vec3::ZERO));
}
