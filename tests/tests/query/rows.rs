//! Velocity rows of tools that are inside or cross, compared with finite differences of the deepest distance in f64.

// Requirement: S-06

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::constraint::VelocityRow;
use dibs_nostd::filter::MotionRow;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, Contacts, Options, Query, Side, measure_stretch};
use dibs_tests::deform::unit;
use dibs_tests::oracle::{closest_pair, least_distance};
use dibs_tests::sample;
use dibs_tests::side_poses::bent;
use dibs_tests::sides::winding_number;
use dibs_tests::surfaces::{ball, cuboid};
use fastrand::Rng;
use glam::{DQuat, DVec3, Vec3};

/// Radius of the tools (mm).
const RADIUS: f32 = 1.0;
/// Time step of the differences (s): the tool moves by less than half a micrometre.
const STEP: f64 = 1e-5;
/// Least depth (mm) for which rows are checked, larger than the reference's grid along the axis.
const LEAST_DEPTH: f64 = 1.0;
/// Largest error of a row (mm/s), at speeds of some 10 to 40.
const WORST: f64 = 0.01;
/// Largest difference of the two one-sided rates (mm/s). Beyond it three triangles tie within the step.
const SMOOTH: f64 = 0.01;
/// Slope below which the depth is constant along the axis: any of its points is the deepest within the accuracy.
const LEVEL: f64 = 1e-3;

/// The number of poses of each case: `DIBS_POSES`, if set.
fn poses() -> usize {
    let asked = std::env::var("DIBS_POSES").ok().map(|n| n.parse().expect("a number of poses"));
    asked.unwrap_or(if cfg!(debug_assertions) { 10 } else { sample(200) })
}

fn torus(large: f32, small: f32, around: u32, across: u32) -> Mesh {
    let angle = |at: u32, of: u32| at as f32 / of as f32 * std::f32::consts::TAU;
    let mut mesh = Mesh::default();
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    for (i, j) in (0..around).flat_map(|i| (0..across).map(move |j| (i, j))) {
        let ((y, x), (z, out)) = (angle(i, around).sin_cos(), angle(j, across).sin_cos());
        let out = large + small * out;
        mesh.positions.push(Vec3::new(out * x, out * y, small * z));
        mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    mesh
}

fn block(half: f32) -> Mesh {
    let (positions, triangles) = cuboid(Vec3::splat(-half), Vec3::splat(half));
    Mesh { positions: positions.to_vec(), triangles: triangles.to_vec(), ..Mesh::default() }
}

fn moved(mut mesh: Mesh, by: Vec3) -> Mesh {
    mesh.positions.iter_mut().for_each(|p| *p += by);
    mesh
}

/// A surface, and the number of triangles of its first solid.
struct Case {
    name: &'static str,
    mesh: Mesh,
    first: usize,
    is_lattice: bool,
}

fn cases() -> Vec<Case> {
    let case = |name, mesh: Mesh, is_lattice| {
        let first = mesh.triangles.len();
        Case { name, mesh, first, is_lattice }
    };
    let mut two = case("two solids", moved(ball(2), Vec3::X * 25.0), false);
    let (other, count) = (moved(ball(2), Vec3::X * -25.0), two.mesh.positions.len() as u32);
    two.mesh.positions.extend(other.positions);
    two.mesh.triangles.extend(other.triangles.iter().map(|t| t.map(|v| v + count)));
    vec![
        case("ball", ball(2), false),
        case("cube on a lattice", block(20.0), true),
        case("ball on a lattice", ball(2), true),
        case("torus", torus(30.0, 10.0, 24, 10), false),
        case("heart", generate::heart(320).expect("a valid size").mesh, false),
        case("brain", generate::brain(500).expect("a valid size"), false),
        two,
    ]
}

/// A closed surface in f64.
struct Solid<'a> {
    positions: &'a [Vec3],
    triangles: &'a [[u32; 3]],
    corners: Vec<[DVec3; 3]>,
}

impl Solid<'_> {
    /// The largest depth of an axis' points, and its point; `None` if it is less than [`LEAST_DEPTH`].
    fn deepest(&self, [start, end]: [DVec3; 2]) -> Option<(f64, DVec3)> {
        const PARTS: usize = 60;
        let point = |at: f64| start.lerp(end, at);
        let distances: Vec<f64> =
            (0..=PARTS).map(|at| distance(point(share(at, PARTS)), &self.corners)).collect();
        let step = start.distance(end) / PARTS as f64;
        let mut best: Option<(f64, DVec3)> = None;
        for (at, &depth) in distances.iter().enumerate() {
            let beside = [at.checked_sub(1), Some(at + 1)].into_iter().flatten();
            let is_top = beside.filter_map(|at| distances.get(at)).all(|&other| other <= depth);
            let may_be_best = depth + step > best.map_or(LEAST_DEPTH, |(depth, _)| depth);
            let middle = point(share(at, PARTS));
            if !is_top
                || !may_be_best
                || winding_number(self.positions, self.triangles, middle) < 0.5
            {
                continue;
            }
            let is_near = |corners: &&[DVec3; 3]| {
                closest_pair(middle, middle, **corners).distance <= depth + 2.0 * step
            };
            let near: Vec<[DVec3; 3]> = self.corners.iter().filter(is_near).copied().collect();
            let found =
                highest(share(at, PARTS), 1.0 / PARTS as f64, |at| distance(point(at), &near));
            if best.is_none_or(|(depth, _)| found.0 > depth) {
                best = Some((found.0, point(found.1)));
            }
        }
        best.filter(|&(depth, _)| depth > LEAST_DEPTH)
    }
}

fn share(at: usize, of: usize) -> f64 {
    at as f64 / of as f64
}

fn distance(point: DVec3, corners: &[[DVec3; 3]]) -> f64 {
    least_distance(point, point, corners.iter().copied())
}

/// The largest value within `reach` of a parameter, and its parameter: the best of a grid, then by ternary search.
fn highest(middle: f64, reach: f64, value: impl Fn(f64) -> f64) -> (f64, f64) {
    const PARTS: usize = 40;
    let at = |at: f64| (value(at.clamp(0.0, 1.0)), at.clamp(0.0, 1.0));
    let highest = |a: (f64, f64), b: (f64, f64)| if b.0 > a.0 { b } else { a };
    let grid = (0..=PARTS).map(|row| at(middle + reach * (2.0 * share(row, PARTS) - 1.0)));
    let mut best = grid.reduce(highest).expect("has points");
    let step = 2.0 * reach / PARTS as f64;
    let (mut low, mut high) = (best.1 - step, best.1 + step);
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        let (a, b) = (at(low + third), at(high - third));
        if a.0 < b.0 {
            low += third;
        } else {
            high -= third;
        }
        best = highest(highest(best, a), b);
    }
    best
}

/// A row's rate equals that of the separation, for tools that are inside or cross, wherever their deepest point is.
#[test]
fn rows_of_deep_tools_have_the_rate_of_the_separation() {
    let (mut judged, mut inside, mut within, mut skipped, mut worst) = (0, 0, 0, 0, 0.0_f64);
    for Case { name, mesh, first, is_lattice } in cases() {
        let mut rng = Rng::with_seed(11);
        let built = Builder::new().stretch(4.0).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut contacts = Contacts::<4>::new();
        for pose in 0..poses() {
            let positions = if is_lattice || pose % 4 == 0 {
                mesh.positions.clone()
            } else {
                bent(&mesh, &mut rng)
            };
            let rows = built.to_rows(&positions);
            // Three poses of four on a surface that moves.
            let (wave, spin) = (unit(&mut rng) * 0.05, unit(&mut rng) * 0.3);
            let push = unit(&mut rng) * if pose % 4 == 1 { 0.0 } else { 10.0 };
            let velocity =
                |p: &Vec3| push * wave.dot(*p).sin() + spin.cross(*p) * push.length() * 0.1;
            let velocities: Vec<Vec3> = positions.iter().map(velocity).collect();
            let on_lattice = |v: Vec3| if is_lattice { v.round() } else { v };
            let from = positions[rng.usize(..positions.len())] * 0.7 * rng.f32();
            let length = if rng.bool() { 80.0 } else { 15.0 };
            let mut span = unit(&mut rng) * length * rng.f32();
            if is_lattice && pose % 2 == 0 {
                span.z = 0.0;
            }
            let (start, end) = (on_lattice(from), on_lattice(from + span));
            let Ok(tool) = Capsule::new(start, end, RADIUS) else { continue };
            let Ok(stretch) = measure_stretch(&tree, rows.as_slice()) else { continue };
            let options = Options::cold().stretch(stretch).depth_tolerance(1e-4);
            let found = query
                .contacts(rows.as_slice(), &tool, 5.0, &options, &mut contacts)
                .expect("an answer");
            if !matches!(found.side, Side::Crossing | Side::Inside) {
                continue;
            }
            contacts.move_with(built.to_rows(&velocities).as_slice()).expect("a velocity each");
            let contact = contacts.iter().next().expect("the deepest pair");
            let origin = unit(&mut rng) * 20.0;
            let (v, w) = (unit(&mut rng) * 10.0, unit(&mut rng) * 0.5);
            let row = VelocityRow::new(contact, 0.0, origin);
            let rate = Vec3::from(row.linear).dot(v) + Vec3::from(row.angular).dot(w) - row.least;
            let deepest = |time: f64| {
                let turn = DQuat::from_scaled_axis(w.as_dvec3() * time);
                let origin = origin.as_dvec3();
                let axis = [start, end]
                    .map(|p| origin + turn * (p.as_dvec3() - origin) + v.as_dvec3() * time);
                let (one, other) = mesh.triangles.split_at(first);
                let of = |triangles: &[[u32; 3]]| {
                    let corner = |v: u32| {
                        let v = v as usize;
                        positions[v].as_dvec3() + velocities[v].as_dvec3() * time
                    };
                    let corners = triangles.iter().map(|t| t.map(corner)).collect();
                    Solid { positions: &positions, triangles, corners }.deepest(axis)
                };
                [of(one), of(other)].into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let times = [-STEP, 0.0, STEP].map(deepest);
            let [Some((before, _)), Some((now, point)), Some((after, _))] = times else { continue };
            let (back, forth) = ((before - now) / STEP, (now - after) / STEP);
            let along = (tool.end() - tool.start()).normalize().as_dvec3();
            let corners = tree.corners(contact.triangle).expect("a triangle");
            let corners = corners.map(|v| rows[v as usize].as_dvec3());
            let to_surface = closest_pair(point, point, corners).on_surface - point;
            let is_level = to_surface.normalize().dot(along).abs() < LEVEL;
            if (back - forth).abs() > SMOOTH || is_level {
                skipped += 1;
                continue;
            }
            let off = (f64::from(rate) - (back + forth) / 2.0).abs();
            worst = off.max(worst);
            assert!(
                off <= WORST,
                "{name} {pose}: {tool:?} {contact:?} rate {rate}, true {back} {forth}"
            );
            judged += 1;
            inside += usize::from(found.side == Side::Inside);
            within += usize::from(contact.axis_parameter > 0.0 && contact.axis_parameter < 1.0);
        }
    }
    println!(
        "{judged} rows, {inside} of tools inside, {within} deepest within the axis; {skipped} skipped; worst {worst}"
    );
    let enough = poses() * 2;
    assert!(judged > enough && within > enough / 2 && inside > enough / 4 && skipped < judged / 2);
}

/// Without a budget for the other triangle, the row is that of the closest triangle.
#[test]
fn a_row_without_budget_is_that_of_the_contact() {
    let mesh = ball(3);
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<4>::new();
    let tool = Capsule::new(Vec3::new(-45.0, 11.0, 5.0), Vec3::new(46.0, 9.0, -3.0), RADIUS)
        .expect("valid");
    let whole = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
    let mut kinds = [0; 2];
    for more in [0, 10, 100, 10_000] {
        let node_tests = whole.work() + more;
        let budget = Budget::new(node_tests);
        let options = Options::cold().budget(budget);
        let found = query.contacts(rows.as_slice(), &tool, 5.0, &options, &mut contacts);
        assert_eq!(found.expect("an answer").side, Side::Crossing);
        let contact = contacts.iter().next().expect("the deepest pair");
        let row = VelocityRow::new(contact, 0.0, Vec3::ZERO);
        let kept = row.stand_off(1.0).gain(20.0);
        let motion = MotionRow::of_velocity(&kept, 0.25);
        assert_eq!((motion.linear, motion.angular), (kept.linear, kept.angular));
        assert!(kept.least != 0.0 && motion.least == kept.least * 0.25, "{motion:?}");
        kinds[usize::from(row.linear != contact.normal.to_array())] += 1;
        let along = (tool.end() - tool.start()).normalize();
        let is_level = Vec3::from(row.linear).dot(along).abs() < 1e-4;
        assert!(is_level || row.linear == contact.normal.to_array(), "{more}: {row:?}");
    }
    assert_eq!(kinds.map(|count| count > 0), [true, true], "{kinds:?}");
}
