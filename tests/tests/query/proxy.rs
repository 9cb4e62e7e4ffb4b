//! The proxy's force compared with a search of all active sets in f64. It is the same force, it points outward, it is
//! continuous, and no wall counts twice.

// Requirement: C-03

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::constraint::{ConstraintState, Proxy, SpringDamper, Wrench};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Contact, Contacts, Options, Query, Side, Sphere, Unavailable};
use dibs_tests::deform::unit;
use dibs_tests::sample;
use dibs_tests::surfaces::sheet;
use fastrand::Rng;
use glam::{DMat3, DVec3, Vec3};

const MARGIN: f32 = 3.0;
const COMPLIANCE: f64 = 1.0 / 16.0;
/// A wall whose depth is less than the largest depth divided by this has a smaller activation.
const SHALLOW: f64 = 16.0;
/// Relative to the largest depth: f32 errors, which the compliance may multiply by 16.
const TOLERANCE: f64 = 2e-4;

/// The number of tested sets of walls: `DIBS_POSES`, if set.
fn cases() -> usize {
    let asked = std::env::var("DIBS_POSES").ok().map(|n| n.parse().expect("a number of cases"));
    asked.unwrap_or(if cfg!(debug_assertions) { 300 } else { 20_000 })
}

/// A contact whose copies become walls.
fn contact() -> Contact {
    let mesh = sheet(4, 20.0, |_, _| 0.0);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<1>::new();
    let tool = Sphere::new(Vec3::new(0.2, 0.1, 2.0), 1.0).expect("valid");
    let found = query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut contacts);
    found.expect("an answer");
    *contacts.iter().next().expect("one")
}

#[derive(Clone, Copy, Debug)]
struct Wall {
    normal: Vec3,
    depth: f32,
    at: Vec3,
}

/// The library's force and torque for a spring of 1 N/mm that never saturates: the displacement, and its moment.
fn found(template: &Contact, walls: &[Wall]) -> [DVec3; 2] {
    let spring = SpringDamper::stiffness(1.0).max_force(1e9);
    let wrench = pushed(template, walls, spring, Vec3::ZERO);
    [wrench.force.as_dvec3(), wrench.torque.as_dvec3()]
}

/// The wrench of walls on a tool with this velocity.
fn pushed(template: &Contact, walls: &[Wall], spring: SpringDamper, velocity: Vec3) -> Wrench {
    let proxy = Proxy::new(spring, MARGIN).expect("a valid margin");
    let contacts: Vec<Contact> = walls
        .iter()
        .map(|wall| {
            let mut contact = *template;
            contact.normal = wall.normal;
            contact.separation = MARGIN - wall.depth;
            contact.point_on_tool = wall.at;
            contact
        })
        .collect();
    proxy.wrench(Ok(contacts.iter()), 0.0, Vec3::ZERO, velocity, Vec3::ZERO)
}

/// The true displacement and moment, and the walls' pushes, by trying every active set.
fn truth(walls: &[Wall]) -> ([DVec3; 2], Vec<f64>) {
    let depth = |wall: &Wall| f64::from(MARGIN - (MARGIN - wall.depth));
    let wanted = |wall: &Wall| depth(wall) * (1.0 + COMPLIANCE);
    let deepest = walls.iter().map(depth).fold(0.0, f64::max);
    let weight = |wall: &Wall| {
        let activation = (SHALLOW * depth(wall) / deepest).min(1.0);
        COMPLIANCE * activation / (1.0 + COMPLIANCE - activation)
    };
    let walls: Vec<Wall> = walls.iter().copied().filter(|wall| depth(wall) > 0.0).collect();
    for set in 0..1_u32 << walls.len() {
        let acts = |row: usize| set >> row & 1 == 1;
        let mut matrix = DMat3::from_diagonal(DVec3::splat(COMPLIANCE));
        let mut right = DVec3::ZERO;
        for (_, wall) in walls.iter().enumerate().filter(|&(row, _)| acts(row)) {
            let normal = wall.normal.as_dvec3();
            let weighed = normal * weight(wall);
            matrix += DMat3::from_cols(weighed * normal.x, weighed * normal.y, weighed * normal.z);
            right += weighed * wanted(wall);
        }
        let moved = matrix.inverse() * right;
        let left: Vec<f64> =
            walls.iter().map(|wall| wanted(wall) - wall.normal.as_dvec3().dot(moved)).collect();
        let is_right = |(row, &left): (usize, &f64)| {
            if acts(row) { left >= -1e-10 } else { left <= 1e-10 }
        };
        if left.iter().enumerate().all(is_right) {
            let push = |(wall, left): (&Wall, &f64)| weight(wall) * left.max(0.0) / COMPLIANCE;
            let pushes: Vec<f64> = walls.iter().zip(&left).map(push).collect();
            let moment = walls
                .iter()
                .zip(&pushes)
                .map(|(wall, push)| wall.at.as_dvec3().cross(wall.normal.as_dvec3() * push));
            return ([moved, moment.sum()], pushes);
        }
    }
    panic!("one set is right: {walls:?}");
}

/// Up to eight walls: random ones, nearly equal ones, pairs that face each other, or walls around a groove's axis.
fn walls(rng: &mut Rng) -> Vec<Wall> {
    let kind = rng.u32(..4);
    let (axis, main) = (unit(rng), unit(rng));
    let count = rng.usize(1..=8);
    let mut walls: Vec<Wall> = (0..count)
        .map(|row| {
            let other = unit(rng);
            let normal = match kind {
                0 => other,
                1 => (main + other * 10_f32.powf(-rng.f32() * 5.0)).normalize(),
                2 => (main * [1.0, -1.0][row % 2] + other * 0.1 * rng.f32()).normalize(),
                _ => (other - axis * axis.dot(other) * (1.0 + 0.1 * rng.f32())).normalize(),
            };
            let depth = if rng.bool() { 2.0 } else { 10_f32.powf(rng.f32() * 4.0 - 3.0) };
            // Some walls are outside the margin.
            let depth = if row > 0 && rng.u32(..4) == 0 { -depth } else { depth };
            Wall { normal, depth, at: other * 5.0 }
        })
        .collect();
    // Contacts in a list have this order.
    walls.sort_by(|a, b| b.depth.total_cmp(&a.depth));
    walls
}

#[test]
fn the_force_is_that_of_the_best_of_all_active_sets() {
    let template = contact();
    let mut rng = Rng::with_seed(1);
    let (mut worst, mut several) = ([0.0_f64; 2], 0);
    for _ in 0..cases() {
        let walls = walls(&mut rng);
        let ([moved, moment], pushes) = truth(&walls);
        let [force, torque] = found(&template, &walls);
        let deepest = f64::from(walls[0].depth);
        let all: f64 = pushes.iter().sum();
        // If pushes nearly cancel, the torque's error is relative to the sum of their magnitudes.
        let off = [force.distance(moved) / deepest, torque.distance(moment) / (5.0 * all)];
        assert!(off[0] < TOLERANCE && off[1] < TOLERANCE, "{off:?} {walls:?} {force} {moved}");
        worst = [worst[0].max(off[0]), worst[1].max(off[1])];
        several += usize::from(pushes.iter().filter(|&&push| push > 0.0).count() > 2);
        // If no two walls face each other, each wall with activation 1 is kept off by at least its own depth.
        let face = |a: &Wall| walls.iter().any(|b| a.normal.dot(b.normal) < 0.0);
        if !walls.iter().any(face) {
            let is_whole = |wall: &&Wall| SHALLOW * f64::from(wall.depth) > 1.001 * deepest;
            for wall in walls.iter().filter(is_whole) {
                let out = force.dot(wall.normal.as_dvec3()) - f64::from(wall.depth);
                assert!(out > -TOLERANCE * deepest, "{wall:?} of {walls:?}: {out}");
            }
        }
        // Of two walls that face each other, the deeper one prevails.
        if let [one, other] = walls[..] {
            let out = force.dot((one.normal - other.normal).as_dvec3());
            assert!(out > -TOLERANCE * deepest, "{walls:?}: {out}");
        }
    }
    println!("{several} of {} with more than two walls that act, worst {worst:?}", cases());
    assert!(several * 5 > cases());
}

/// A small change of the walls changes the force little. The compliance bounds the change: by `by_depths` times a
/// change of the depths alone, and by `by_normals` times a change of the normals as well. A shallow wall's activation
/// grows by 16 over the deepest depth, and may move the proxy by three depths. One of depth 0 changes nothing.
#[test]
fn the_force_is_continuous() {
    let template = contact();
    let mut rng = Rng::with_seed(2);
    let wanted = 1.0 + COMPLIANCE;
    let by_depths = wanted * 8_f64.sqrt() / (2.0 * COMPLIANCE.sqrt()) + 2.0 * 3.0 * SHALLOW;
    let by_normals = wanted * (16.0 / COMPLIANCE + 8.0) * (8.0 / COMPLIANCE).sqrt();
    let mut steepest = [0.0_f64; 2];
    for number in 0..cases() {
        let walls = walls(&mut rng);
        let small = 1e-3;
        let mut near = walls.clone();
        for wall in &mut near {
            wall.depth += small * (rng.f32() * 2.0 - 1.0);
            if number % 2 == 1 {
                wall.normal = (wall.normal + unit(&mut rng) * small * rng.f32()).normalize();
            }
        }
        let [one, _] = found(&template, &walls);
        // Sometimes a wall at the margin is added: in any direction, it has no effect.
        if near.len() < 8 && rng.bool() {
            let depth = -1e-6;
            near.push(Wall { normal: unit(&mut rng), depth, at: Vec3::ZERO });
        }
        let [other, _] = found(&template, &near);
        let change = one.distance(other) / f64::from(small);
        let scale = [1.0, 1.0 + f64::from(walls[0].depth)][number % 2];
        steepest[number % 2] = steepest[number % 2].max(change / scale);
    }
    println!("the force changes by at most {steepest:?} times as much as the walls do");
    assert!(steepest[0] < by_depths && steepest[1] < by_normals, "{by_depths} {by_normals}");
}

/// Any number of contacts with one wall push like that wall, up to the compliance.
#[test]
fn one_wall_is_never_two() {
    let template = contact();
    let mut rng = Rng::with_seed(3);
    for _ in 0..cases() / 20 {
        let wall = Wall { normal: unit(&mut rng), depth: 0.01 + rng.f32() * 9.0, at: Vec3::ZERO };
        for count in 1..=8 {
            let [force, _] = found(&template, &vec![wall; count]);
            let times = force.length() / f64::from(wall.depth);
            let most = 1.0 + COMPLIANCE;
            assert!((1.0 - TOLERANCE..most + TOLERANCE).contains(&times), "{count}: {times}");
        }
    }
}

/// A force, and the contacts and pose that it comes from.
#[derive(Clone, Debug)]
struct Held {
    force: Vec3,
    #[allow(dead_code, reason = "printed")]
    contacts: Vec<(f32, Vec3)>,
}

/// A capsule's ends, and their steps (mm), during which a contact on a brain ended with activation 1. Two low triangles
/// there have similar directions and lie beside each other, with a high edge between them.
const ENDED: [[Vec3; 4]; 3] = [
    [
        Vec3::new(0.638_053_36, 59.497_116, 19.683_912),
        Vec3::new(-25.352_804, 28.686_636, 88.786_66),
        Vec3::new(-0.194_020_2, -0.047_921_18, -0.223_740_34),
        Vec3::new(0.020_231_986, -0.186_831_44, 0.233_847_56),
    ],
    [
        Vec3::new(23.646_627, -62.219_353, 16.624_096),
        Vec3::new(-12.034_849, -122.536_545, -21.959_179),
        Vec3::new(0.032_920_3, 0.290_359, 0.067_881_69),
        Vec3::new(-0.091_922_134, -0.261_625, 0.114_467_03),
    ],
    [
        Vec3::new(15.373_539, -69.311_13, 9.917_008),
        Vec3::new(80.908_6, -113.061_8, -3.904_564_9),
        Vec3::new(0.258_738_46, -0.003_200_652_5, 0.151_803_1),
        Vec3::new(0.282_318_53, 0.091_354_54, 0.044_165_563),
    ],
];

/// Outside a surface, steps between whose ends the force differs are halved down to some nanometres: no contact that
/// begins or ends makes the force jump. What remains are walls whose directions hardly differ.
#[test]
fn no_force_jumps_where_a_wall_begins_or_ends() {
    const RADIUS: f32 = 2.5;
    // Closer to an edge, directions change within less than a step.
    const NEAREST: f32 = 0.02;
    let waves = |x: f32, y: f32| 2.5 * (0.4 * x).sin() * (0.3 * y).cos();
    let folds = |x: f32, y: f32| 4.0 * ((x * 0.2).rem_euclid(2.0) - 1.0).abs() - 0.3 * y.abs();
    let meshes: [(&str, Mesh); 4] = [
        ("heart", generate::heart(1_000).expect("a valid size").mesh),
        ("brain", generate::brain(2_000).expect("a valid size")),
        ("waves", sheet(40, 60.0, waves)),
        ("folds", sheet(12, 60.0, folds)),
    ];
    let proxy = Proxy::new(SpringDamper::stiffness(1.0).max_force(1e9), MARGIN);
    let proxy = proxy.expect("a valid margin");
    let (mut worst, mut worst_size, mut halved) = (0.0_f32, 0.0_f32, 0);
    for (name, mesh) in meshes {
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut list = Contacts::<32>::new();
        let mut hold = |[start, end]: [Vec3; 2]| {
            let options = Options::cold();
            let found = if start == end {
                let tool = Sphere::new(start, RADIUS).expect("valid");
                query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut list)
            } else {
                let tool = Capsule::new(start, end, RADIUS).expect("valid");
                query.contacts(rows.as_slice(), &tool, MARGIN, &options, &mut list)
            };
            let found = found.expect("an answer");
            let (within, accuracy) = (list.within(MARGIN), list.accuracy());
            let is_complete = within.as_ref().is_ok_and(dibs_nostd::ContactIter::is_complete);
            let wrench = proxy.wrench(within, accuracy, start, Vec3::ZERO, Vec3::ZERO);
            let contacts = list.iter().map(|at| (at.separation, at.normal)).collect();
            let held = Held { force: wrench.force, contacts };
            let is_clear = found.side == Side::Outside && found.axis_distance > NEAREST;
            assert!(is_complete || !is_clear, "{found:?}");
            is_clear.then_some(held)
        };
        let mut rng = Rng::with_seed(11);
        for number in 0..if cfg!(debug_assertions) { 4_000 } else { sample(100_000) } {
            let from = rows[rng.usize(..rows.len())] + unit(&mut rng) * 5.5 * rng.f32();
            let long = if number % 4 == 0 { unit(&mut rng) * 60.0 } else { Vec3::ZERO };
            let step = [(); 2].map(|()| unit(&mut rng) * 0.3);
            let step = if number % 4 == 0 { step } else { [step[0]; 2] };
            let known = ENDED.get(number).filter(|_| name == "brain");
            let (from, long, step) = match known {
                Some(&[from, to, at_from, at_to]) => (from, to - from, [at_from, at_to]),
                None => (from, long, step),
            };
            let tool = |t: f32| [from + step[0] * t, from + long + step[1] * t];
            let (mut low, mut high) = (0.0_f32, 1.0_f32);
            let (Some(mut one), Some(mut other)) = (hold(tool(low)), hold(tool(high))) else {
                continue;
            };
            if one.force.distance(other.force) < 0.3 {
                continue;
            }
            while high - low > 2e-5 {
                let middle = 0.5 * (low + high);
                let Some(held) = hold(tool(middle)) else { break };
                if held.force.distance(one.force) > held.force.distance(other.force) {
                    (high, other) = (middle, held);
                } else {
                    (low, one) = (middle, held);
                }
            }
            if high - low > 2e-5 {
                continue;
            }
            halved += 1;
            let sizes = [one.force.length(), other.force.length()];
            let most = sizes[0].max(sizes[1]);
            let jump = one.force.distance(other.force) / most;
            let size = (sizes[0] - sizes[1]).abs() / most;
            assert!(jump < 0.25 && size < 1.0 / 12.0, "{name}: {jump} {size} {one:?} {other:?}");
            worst = worst.max(jump);
            worst_size = worst_size.max(size);
        }
    }
    println!("{halved} steps: of the force, {worst} at most, {worst_size} of the size");
    assert!(halved > 500);
}

/// A force that is not finite is not applied. Walls that balance each other give none, whatever the speed.
#[test]
fn a_force_beyond_its_numbers_is_not_given() {
    let template = contact();
    let wall = |x: f32, at: Vec3| Wall { normal: Vec3::X * x, depth: 1.0, at };
    let one = [wall(1.0, Vec3::ZERO)];
    let spring = SpringDamper::stiffness(1.0).max_force(1e9);
    let held = ConstraintState::Safe(Unavailable::NotFinite);
    let away = spring.damping(10.0);
    // The damper's force alone is infinite.
    let wrench = pushed(&template, &one, away, Vec3::X * 3e38);
    assert_eq!((wrench.state, wrench.torque), (held, Vec3::ZERO));
    // Two walls that face each other, at rest and at a speed whose shares of the damper are infinite.
    let two = [wall(1.0, Vec3::ZERO), wall(-1.0, Vec3::ZERO)];
    for speed in [0.0, 1.0, 3e38] {
        let wrench = pushed(&template, &two, away, Vec3::X * speed);
        let none = (Vec3::ZERO, Vec3::ZERO, ConstraintState::Active);
        assert_eq!((wrench.force, wrench.torque, wrench.state), none, "at {speed} mm/s");
    }
    // A force within the limit over a length so short that their ratio is infinite.
    let strong = SpringDamper::stiffness(1.0).damping(1.0).max_force(1e38);
    let shallow = [Wall { depth: 1e-6, ..one[0] }];
    let wrench = pushed(&template, &shallow, strong, Vec3::X * -2e38);
    assert_eq!((wrench.state, wrench.torque), (held, Vec3::ZERO));
    // A lever so long that only the torque is infinite.
    let far = [wall(1.0, Vec3::Y * 1e35)];
    let wrench = pushed(&template, &far, SpringDamper::stiffness(1e9).max_force(1e9), Vec3::ZERO);
    assert_eq!((wrench.state, wrench.torque), (held, Vec3::ZERO));
}
