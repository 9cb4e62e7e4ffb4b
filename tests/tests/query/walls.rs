//! Every wall within the margin is in the list of contacts: hill climbing compared with f64 on thin, close, coarse and
//! lattice-aligned closed meshes, short lists, labelled parts, and the force between two walls.
//!
//! One file, because all tests compare with the same oracle.

// Requirement: S-04

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::constraint::{ConstraintState, ForbiddenRegion, Proxy, SpringDamper};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Budget, Capsule, Contact, Contacts, Odometer, Options, Query, Side, Sphere, Tracker, Tree,
    TriangleRow,
};
use dibs_tests::deform::unit;
use dibs_tests::oracle::{closest_pair, least_distance};
use dibs_tests::sample;
use dibs_tests::surfaces::{self, ball};
use fastrand::Rng;
use glam::{DVec3, Vec3};

const MARGIN: f32 = 3.0;
const RADIUS: f32 = 2.5;
/// Directions (radians) of two contacts within this angle may count as one, including the library's rounding.
const ALIKE: f64 = 0.14;

/// A box whose faces have `cells` squares an edge.
fn lattice(low: Vec3, high: Vec3, cells: [u32; 3]) -> Mesh {
    let mut rows = std::collections::HashMap::new();
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0, cells[axis]] {
            for (i, j) in (0..cells[u]).flat_map(|i| (0..cells[v]).map(move |j| (i, j))) {
                let [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[di, dj]: [u32; 2]| {
                    let mut at = [0; 3];
                    (at[axis], at[u], at[v]) = (side, i + di, j + dj);
                    *rows.entry(at).or_insert_with(|| {
                        let part =
                            Vec3::from(at.map(|n| n as f32)) / Vec3::from(cells.map(|n| n as f32));
                        mesh.positions.push(low + (high - low) * part);
                        mesh.positions.len() as u32 - 1
                    })
                });
                let both = if side > 0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                mesh.triangles.extend(both);
            }
        }
    }
    mesh
}

/// A block with a groove along z whose walls rise from the x axis by an angle each; 16 triangles.
fn groove(angle: f32) -> Mesh {
    let rim = 40.0 * angle.tan();
    let outline = [[-40.0, -10.0], [40.0, -10.0], [40.0, rim], [0.0, 0.0], [-40.0, rim]];
    let corner = |z: f32| outline.map(|[x, y]| Vec3::new(x, y, z));
    let caps = [[0, 1, 3], [1, 2, 3], [0, 3, 4]];
    let mut triangles: Vec<[u32; 3]> = caps.map(|[a, b, c]| [a, c, b]).to_vec();
    triangles.extend(caps.map(|cap| cap.map(|row| row + 5)));
    triangles.extend((0..5).flat_map(|a| {
        let b = (a + 1) % 5;
        [[a, b, b + 5], [a, b + 5, a + 5]]
    }));
    let positions = [corner(-50.0), corner(50.0)].concat();
    Mesh { positions, triangles, ..Mesh::default() }
}

fn joined(parts: &[Mesh]) -> Mesh {
    let mut all = Mesh::default();
    for part in parts {
        let base = all.positions.len() as u32;
        all.positions.extend(&part.positions);
        all.triangles.extend(part.triangles.iter().map(|corners| corners.map(|row| row + base)));
    }
    all
}

/// A wall that faces a tool outside: the middle of a triangle that faces it, or the lowest point of a part.
#[derive(Clone, Copy, Debug)]
struct Wall {
    separation: f64,
    /// Unit vector from the surface to the tool.
    towards: DVec3,
}

/// The closest points that are well inside a triangle which faces the tool: each is a local minimum.
fn walls(rows: &[Vec3], triangles: &[[u32; 3]], [start, end]: [Vec3; 2]) -> Vec<Wall> {
    let wall = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|row| rows[row as usize].as_dvec3());
        let pair = closest_pair(start.as_dvec3(), end.as_dvec3(), [a, b, c]);
        let normal = (b - a).cross(c - a);
        let area = |one: DVec3, other: DVec3| {
            (one - pair.on_surface).cross(other - pair.on_surface).dot(normal)
        };
        let least = area(a, b).min(area(b, c)).min(area(c, a)) / normal.length_squared();
        let towards = (pair.on_axis - pair.on_surface).normalize_or_zero();
        let is_wall = least > 0.02 && towards.dot(normal) > 0.5 * normal.length();
        is_wall.then_some(Wall { separation: pair.distance - f64::from(RADIUS), towards })
    };
    triangles.iter().filter_map(wall).collect()
}

/// The deepest wall below the list's bound that no contact represents.
fn missing(walls: &[Wall], contacts: &[Contact], bound: f32, accuracy: f32) -> Option<Wall> {
    let error = 2.0 * f64::from(accuracy);
    let stands_for = |wall: &Wall, contact: &Contact| {
        let angle = contact.normal.as_dvec3().angle_between(wall.towards);
        f64::from(contact.separation) <= wall.separation + error && angle < ALIKE
    };
    let is_missing = |wall: &&Wall| {
        wall.separation < f64::from(bound.min(MARGIN)) - error
            && !contacts.iter().any(|contact| stands_for(wall, contact))
    };
    let least = |one: &&Wall, other: &&Wall| one.separation.total_cmp(&other.separation);
    walls.iter().filter(is_missing).min_by(least).copied()
}

/// How close two walls in different directions are to a tie, where the nearer one changes.
fn tie(walls: &[Wall]) -> f64 {
    let pairs = walls.iter().flat_map(|one| walls.iter().map(move |other| (one, other)));
    let apart = pairs.filter(|(one, other)| one.towards.dot(other.towards) < 0.98);
    let near =
        apart.filter(|(one, other)| one.separation.max(other.separation) < f64::from(MARGIN));
    near.map(|(one, other)| (one.separation - other.separation).abs()).fold(1e3, f64::min)
}

/// Poses that climb towards ties of walls, where lists of contacts change.
#[test]
fn no_wall_is_missing_from_a_list_of_contacts() {
    let cube =
        |low: f32, high: f32, cells| lattice(Vec3::splat(low), Vec3::splat(high), [cells; 3]);
    let plate = lattice(Vec3::new(-30.0, -30.0, 0.0), Vec3::new(30.0, 30.0, 0.5), [3, 3, 1]);
    let mut beside = cube(-20.0, 20.0, 1);
    beside.positions.iter_mut().for_each(|at| at.x += 40.0);
    let meshes = [
        ("box of 12 triangles", cube(-20.0, 20.0, 1)),
        ("lattice", cube(-20.0, 20.0, 6)),
        ("octahedron", ball(0)),
        ("thin plate", plate),
        ("boxes side by side", joined(&[cube(-20.0, 20.0, 1), beside])),
        ("flat groove", groove(0.2)),
        ("groove", groove(0.8)),
        ("organ", generate::heart(1_000).expect("a valid size").mesh),
    ];
    let starts = if cfg!(debug_assertions) { 12 } else { sample(100) };
    let (mut checked, mut several, mut cut) = (0, 0, 0);
    for (seed, (name, mesh)) in (1..).zip(meshes) {
        let mut rng = Rng::with_seed(seed);
        let built = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let (rows, triangles) = (built.to_rows(&mesh.positions), surfaces::triangles(&tree));
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut tracker =
            Tracker::<u16, MAX_STACK, 256, 256>::with_range(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(rows.as_slice());
        let (mut list, mut own) = (Contacts::<64, 1024>::new(), Contacts::<64, 1024>::new());
        let mut few = Contacts::<64, 16>::new();
        for start in 0..starts {
            let corners = triangles[rng.usize(..triangles.len())].map(|row| rows[row as usize]);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize();
            let from = a.lerp(b.lerp(c, rng.f32()), rng.f32());
            let from = from + normal * (RADIUS + MARGIN) * rng.f32();
            let is_sphere = start % 2 == 0;
            let to = if is_sphere { from } else { from + unit(&mut rng) * 30.0 };
            let (mut best, mut pose, mut size) = (f64::INFINITY, [from, to], 4.0);
            for _ in 0..40 {
                let by = unit(&mut rng) * size;
                let turn = if is_sphere { by } else { by + unit(&mut rng) * size };
                let next = [pose[0] + by, pose[1] + turn];
                let tool = Capsule::new(next[0], next[1], RADIUS).expect("a valid capsule");
                let options = Options::new();
                let found = query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut list);
                let found = found.expect("an answer");
                let tracked = tracker.contacts(&surface, &tool, MARGIN, &options, &mut own);
                // A front may skip a triangle that is closer by less than the accuracy.
                assert!(
                    tracked.expect("an answer").fallback.is_some()
                        || own.accuracy() > 1.9 * list.accuracy()
                );
                query
                    .contacts(rows.as_slice(), &tool, MARGIN, &options, &mut few)
                    .expect("an answer");
                size *= 0.93;
                if found.side != Side::Outside {
                    continue;
                }
                let truth = walls(&rows, &triangles, next);
                checked += 1;
                several += usize::from(list.len() > 1);
                let is_near = found.separation <= MARGIN;
                for (kind, contacts, bound, accuracy) in [
                    ("query", list.iter(), list.bound(), list.accuracy()),
                    ("tracker", own.iter(), own.bound(), own.accuracy()),
                ] {
                    assert!(bound >= MARGIN, "{name}, {kind}: cut short without a budget, {bound}");
                    let contacts: Vec<Contact> = contacts.copied().collect();
                    let lost = missing(&truth, &contacts, bound, accuracy);
                    assert!(lost.is_none(), "{name}, {kind}: {lost:?} of {contacts:?} at {next:?}");
                }
                let within = [list.within(MARGIN), own.within(MARGIN)];
                assert!(within.into_iter().all(|all| all.is_ok_and(|all| all.is_complete())));
                let all = few.within(MARGIN).expect("the deepest contact is known");
                cut += usize::from(!all.is_complete());
                assert_eq!(all.is_complete(), few.bound() >= MARGIN);
                let contacts: Vec<Contact> = few.iter().copied().collect();
                let lost = missing(&truth, &contacts, few.bound(), few.accuracy());
                assert!(lost.is_none(), "{name}, few: {lost:?} of {contacts:?} at {next:?}");
                let deepest = contacts.first().map_or(f32::INFINITY, |contact| contact.separation);
                assert!(!is_near || deepest <= found.separation + 2.0 * found.accuracy, "{name}");
                let tied = tie(&truth);
                if tied <= best {
                    (best, pose) = (tied, next);
                }
            }
        }
    }
    println!("{checked} poses, {several} with several contacts, {cut} lists with too few places");
    assert!(checked > starts * 60 && several * 40 > checked && cut > 10);
}

/// A capsule along a fine flat wall has more triangles near it than fit in the list.
#[test]
fn a_list_with_too_few_places_still_has_the_wall() {
    let mesh = lattice(Vec3::new(-40.0, -20.0, -10.0), Vec3::new(40.0, 20.0, 0.0), [120, 60, 4]);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let spring = SpringDamper::stiffness(1.0).max_force(50.0);
    let region = ForbiddenRegion::new(spring, 5.0).expect("a valid margin");
    let proxy = Proxy::new(spring, 5.0).expect("a valid margin");
    let mut list = Contacts::<16, 64>::new();
    let mut cut_short = 0;
    for step in 0..70 {
        let z = 7.0 - 0.1 * step as f32;
        let turn = 0.01 * step as f32;
        let tool = Capsule::new(Vec3::new(-30.0, -turn, z), Vec3::new(30.0, turn, z), RADIUS)
            .expect("valid");
        for node_tests in [u32::MAX, 2_500, 2_000] {
            let options = Options::cold().budget(Budget::new(node_tests));
            let closest = query.contacts(rows.as_slice(), &tool, 5.0, &options, &mut list);
            let closest = closest.expect("an answer");
            if closest.side != Side::Outside {
                continue;
            }
            let within = list.within(5.0).expect("the deepest contact is known");
            cut_short += usize::from(!within.is_complete());
            assert_eq!(within.is_complete(), list.bound() >= 5.0);
            let alone = region.force(&Ok(closest), Vec3::ZERO).force;
            let all = proxy.wrench(Ok(within), list.accuracy(), Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
            assert_ne!(all.state, ConstraintState::Inactive, "{closest:?}");
            let ratio = all.force.z / alone.z;
            assert!((0.99..1.07).contains(&ratio), "{z}: {} for {alone}", all.force);
        }
    }
    assert!(cut_short > 20, "{cut_short}");
}

/// A shaft through two lobes of an organ has one contact, the deepest, and its list does not claim to be complete.
#[test]
fn a_shaft_through_two_lobes_has_no_complete_list() {
    let block = |low: f32, high: f32| {
        lattice(Vec3::new(low, -10.0, -10.0), Vec3::new(high, 10.0, 10.0), [6, 6, 6])
    };
    let mesh = joined(&[block(-30.0, -10.0), block(10.0, 26.0)]);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut list = Contacts::<16>::new();
    let mut ask = |from: f32, to: f32| {
        let [start, end] = [from, to].map(|x| Vec3::new(x, 1.3, 0.7));
        let tool = Capsule::new(start, end, RADIUS).expect("valid");
        let options = Options::cold();
        let closest = query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut list);
        assert_eq!(closest.expect("an answer").side, Side::Crossing);
        let deepest = list.iter().next().expect("the deepest").separation;
        (deepest, list.bound())
    };
    // The other lobe is left out: its contact would be deeper than -10.
    let (deepest, bound) = ask(-60.0, 60.0);
    assert!(deepest < -11.0 && bound == deepest, "{deepest} {bound}");
    // One end in one lobe.
    let (deepest, bound) = ask(-60.0, -15.0);
    assert!(deepest < -7.0 && bound == MARGIN, "{deepest} {bound}");
}

/// An axis that crosses ridges obliquely is below each of their faces at one of its corners, and outside of both.
#[test]
fn ridges_that_an_axis_crosses_aslant_are_contacts() {
    let roof = |y: f32| {
        let outline = [[0.0, 0.0], [10.0, -10.0], [-10.0, -10.0]];
        let at = |x: f32| outline.map(|[across, z]| Vec3::new(x, y + across, z));
        let mut triangles = vec![[0, 1, 2], [3, 5, 4]];
        triangles.extend((0..3).flat_map(|a| {
            let b = (a + 1) % 3;
            [[a, b + 3, b], [a, a + 3, b + 3]]
        }));
        let positions = [at(-40.0), at(40.0)].concat();
        Mesh { positions, triangles, ..Mesh::default() }
    };
    let mesh = joined(&[roof(-15.0), roof(15.0)]);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut list = Contacts::<8>::new();
    let reach = Vec3::new(30.0, 30.0, 0.1);
    let at = Vec3::Z * (RADIUS + 1.0);
    let tool = Capsule::new(at - reach, at + reach, RADIUS).expect("valid");
    let closest = query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut list);
    assert_eq!(closest.expect("an answer").side, Side::Outside);
    let at_ridges: Vec<f32> = list.iter().map(|contact| contact.point_on_surface.y).collect();
    assert_eq!(at_ridges.len(), 2, "{at_ridges:?}");
    assert!(at_ridges[0] < -14.0 && at_ridges[1] > 14.0, "{at_ridges:?}");
}

/// Between two walls of a groove that both face the tool, each step changes the force by at most the change of the
/// walls and their activations.
#[test]
fn the_force_between_two_walls_is_continuous() {
    const STEP: f32 = 1e-3;
    let spring = SpringDamper::stiffness(1.0).max_force(1e9);
    let proxy = Proxy::new(spring, MARGIN).expect("a valid margin");
    let mut steepest = 0.0_f32;
    for angle in [0.1, 0.25, 0.5, core::f32::consts::FRAC_PI_4, 1.2] {
        let built = Builder::new().build(&groove(angle)).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(&groove(angle).positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut list = Contacts::<16>::new();
        let mut force = |at: Vec3| {
            let tool = Sphere::new(at, RADIUS).expect("valid");
            query
                .contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut list)
                .expect("an answer");
            let all = list.within(MARGIN);
            proxy.wrench(all, list.accuracy(), at, Vec3::ZERO, Vec3::ZERO).force
        };
        let mut rng = Rng::with_seed(7);
        for _ in 0..if cfg!(debug_assertions) { 20 } else { sample(200) } {
            let depth = 0.5 + 4.5 * rng.f32();
            // Upwards in the groove's middle, at this distance from both walls.
            let mut at = Vec3::new(0.0, depth / angle.cos(), 20.0 * rng.f32());
            let (mut largest, mut size) = (0.0, 0.1);
            for _ in 0..100 {
                let from = at + unit(&mut rng) * size * rng.f32();
                let to = from + unit(&mut rng).with_z(0.0) * STEP;
                // Neither wall's closest point is at the groove's bottom, where a contact begins.
                let faces_both = |at: Vec3| at.x.abs() < 0.9 * at.y * angle.tan();
                if !faces_both(from) || !faces_both(to) {
                    continue;
                }
                let change = force(from).distance(force(to));
                if change >= largest {
                    (largest, at) = (change, from);
                } else {
                    size *= 0.95;
                }
            }
            steepest = steepest.max(largest / STEP);
            let nearest = (at.y * angle.cos() - at.x.abs() * angle.sin()).max(0.1);
            // `activation.rs` states 45 of the depth, over the distance, for flat walls. Activations are 1 only outside
            // their edges.
            let by_activation = 45.0 * (RADIUS + MARGIN - nearest) / nearest;
            let most = (20.0 + by_activation) * STEP;
            assert!(largest < most, "{angle}: {largest} N of {most} at {at} within {STEP} mm");
        }
    }
    println!("the force changes by at most {steepest} N for each mm");
}

const MUSCLE: u8 = 1;
const ARTERY: u8 = 2;

/// The example of [`Tree::label`]: the margin around an artery is kept beside muscle that is closer.
#[test]
fn a_label_keeps_its_margin_beside_a_nearer_part() {
    const WIDE: f32 = 5.0;
    let flat = lattice(Vec3::new(-30.0, -30.0, -10.0), Vec3::new(30.0, 30.0, 0.0), [7, 7, 2]);
    let meshes = [generate::heart(1_000).expect("a valid size").mesh, flat, ball(2), groove(0.6)];
    let (mut near, mut checked) = (0, 0);
    for (seed, mesh) in (1..).zip(meshes) {
        let is_artery = |corners: &[u32; 3]| {
            corners.iter().map(|&row| mesh.positions[row as usize].x).sum::<f32>() > 0.0
        };
        let label = |corners| if is_artery(corners) { ARTERY } else { MUSCLE };
        let labels = mesh.triangles.iter().map(label).collect();
        let built = Builder::new().labels(labels).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let (rows, triangles) = (built.to_rows(&mesh.positions), surfaces::triangles(&tree));
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut tracker =
            Tracker::<u16, MAX_STACK, 256, 256>::with_range(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(rows.as_slice());
        let mut rng = Rng::with_seed(seed);
        let (mut list, mut own) = (Contacts::<16>::new(), Contacts::<16>::new());
        let border: Vec<Vec3> = rows.iter().copied().filter(|at| at.x.abs() < 12.0).collect();
        for _ in 0..if cfg!(debug_assertions) { 150 } else { sample(2_000) } {
            let at = border[rng.usize(..border.len())] + unit(&mut rng) * 9.0 * rng.f32();
            let tool = Sphere::new(at, RADIUS).expect("valid");
            let options = Options::new().contacts_of(ARTERY);
            let closest = query.contacts(rows.as_slice(), &tool, WIDE, &options, &mut list);
            if closest.expect("an answer").side != Side::Outside {
                continue;
            }
            tracker.contacts(&surface, &tool, WIDE, &options, &mut own).expect("an answer");
            let of_part = (0..).zip(&triangles).filter_map(|(row, corners)| {
                let is_part = tree.label(TriangleRow(row)) == Some(ARTERY);
                is_part.then(|| corners.map(|row| rows[row as usize].as_dvec3()))
            });
            let least = least_distance(at.as_dvec3(), at.as_dvec3(), of_part);
            let least = (least - f64::from(RADIUS)) as f32;
            checked += 1;
            for found in [&list, &own] {
                let all = found.within(WIDE).expect("known");
                assert!(all.is_complete());
                assert!(found.iter().all(|one| tree.label(one.triangle) == Some(ARTERY)));
                let deepest = found.iter().next().map_or(f32::INFINITY, |one| one.separation);
                // At the surface the bound is that of an axis equally far inside.
                let distance = least + RADIUS;
                let is_at = distance <= 3.0 * found.accuracy();
                let under = found.accuracy() + if is_at { 2.0 * distance } else { 0.0 };
                let is_right = (-under..=found.accuracy()).contains(&(deepest - least));
                assert!(is_right || least.min(deepest) > WIDE - 1e-3, "{deepest} {least} at {at}");
                near += usize::from(least < WIDE);
            }
        }
    }
    println!("{checked} poses, {near} lists with the artery within its margin");
    assert!(near * 4 > checked && checked > 100);
}

/// If the list has too little room, its bound is a prominence below the farthest stored triangle.
#[test]
fn the_bound_of_a_list_leaves_room_for_a_prominence() {
    let mesh = generate::brain(2_000).expect("a valid size");
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree: Tree<'_, u16> = built.tree().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let (mut all, mut few) = (Contacts::<128, 4096>::new(), Contacts::<128, 8>::new());
    let mut rng = Rng::with_seed(3);
    let (mut bounded, mut closest_call) = (0, f32::INFINITY);
    for _ in 0..if cfg!(debug_assertions) { 400 } else { sample(5_000) } {
        let at = rows[rng.usize(..rows.len())] * (1.0 + 0.2 * rng.f32());
        let tool = Capsule::new(at, at + unit(&mut rng) * 20.0, 1.0).expect("valid");
        let margin = 20.0;
        query
            .contacts(rows.as_slice(), &tool, margin, &Options::cold(), &mut all)
            .expect("an answer");
        let found = query.contacts(rows.as_slice(), &tool, margin, &Options::cold(), &mut few);
        if found.expect("an answer").side != Side::Outside || few.bound() >= margin {
            continue;
        }
        for contact in all.iter() {
            let listed = few.iter().any(|one| {
                one.separation <= contact.separation + 2.0 * all.accuracy()
                    && one.normal.dot(contact.normal) > ALIKE.cos() as f32
            });
            if !listed {
                assert!(contact.separation >= few.bound() - 2.0 * all.accuracy(), "{contact:?}");
                closest_call = closest_call.min(contact.separation - few.bound());
                bounded += 1;
            }
        }
    }
    println!("{bounded} contacts beyond the lists' bounds, the nearest by {closest_call} mm");
    assert!(bounded > 20);
}
