//! An axis at the surface, where the side is below the accuracy: no contact's stated depth is too small, and a labelled
//! part keeps its margin.

// Requirement: S-04

use dibs_build::{Builder, BuiltTree, Mesh};
use dibs_nostd::constraint::{ConstraintState, Proxy, SpringDamper};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Capsule, Contact, Contacts, NoSide, Odometer, Options, Query, Side, Tracker, TriangleRow,
};
use dibs_tests::deform::unit;
use dibs_tests::oracle::{Instrument, exhaustive, least_distance};
use dibs_tests::sample;
use dibs_tests::sides::winding_number;
use dibs_tests::surfaces::{self, ball, cuboid};
use fastrand::Rng;
use glam::Vec3;

const RADIUS: f32 = 2.5;
const MARGIN: f32 = 5.0;
const TOLERANCE: f32 = 0.02;
const PART: u8 = 2;

/// Solids of whose triangles half are one labelled part.
fn solids() -> [(Mesh, BuiltTree); 3] {
    let (corners, triangles) = cuboid(Vec3::splat(-20.0), Vec3::new(20.0, 17.0, 9.0));
    let block = Mesh { positions: corners.into(), triangles: triangles.into(), ..Mesh::default() };
    [block, ball(0), ball(2)].map(|mut mesh| {
        let turn = glam::Quat::from_rotation_y(0.6) * glam::Quat::from_rotation_x(0.2);
        mesh.positions.iter_mut().for_each(|at| *at = turn * *at);
        let labels = (0..mesh.triangles.len()).map(|row| 1 + (row % 2) as u8).collect();
        let built = Builder::new().labels(labels).build(&mesh).expect("a valid mesh");
        (mesh, built)
    })
}

/// A list of contacts, its accuracy, and the side that it assumes.
struct Listed {
    contacts: Vec<Contact>,
    accuracy: f32,
    side: Side,
}

/// Searches contacts of tools within a few accuracies of a triangle, on both sides: with a query and a tracker.
fn at_the_surface(
    options: &Options,
    mut check: impl FnMut(&BuiltTree, &[Vec3], [Vec3; 2], &Listed),
) {
    for (seed, (mesh, built)) in (1..).zip(solids()) {
        let mut rng = Rng::with_seed(seed);
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut tracker =
            Tracker::<u16, MAX_STACK, 256, 256>::with_range(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(rows.as_slice());
        let mut list = Contacts::<32>::new();
        for number in 0..if cfg!(debug_assertions) { 2_000 } else { sample(20_000) } {
            let [a, b, c] = triangles[rng.usize(..triangles.len())].map(|v| rows[v as usize]);
            let across = (b - a).cross(c - a).normalize();
            let at = a.lerp(b, rng.f32()).lerp(c, rng.f32()) + across * (rng.f32() - 0.5) * 3e-3;
            let long = if number % 2 == 0 { 0.0 } else { 0.01 * rng.f32() };
            let ends = [at, at + unit(&mut rng) * long];
            let tool = Capsule::new(ends[0], ends[1], RADIUS).expect("a valid tool");
            let found = query.contacts(rows.as_slice(), &tool, MARGIN, options, &mut list);
            let side = found.expect("an answer").side;
            assert!(list.within(MARGIN).is_ok_and(|all| all.is_complete()));
            let contacts = list.iter().copied().collect();
            check(&built, &rows, ends, &Listed { contacts, accuracy: list.accuracy(), side });
            let found = tracker.contacts(&surface, &tool, MARGIN, options, &mut list);
            let side = found.expect("an answer").closest.side;
            assert!(list.within(MARGIN).is_ok_and(|all| all.is_complete()));
            let contacts = list.iter().copied().collect();
            check(&built, &rows, ends, &Listed { contacts, accuracy: list.accuracy(), side });
        }
    }
}

#[test]
fn no_contact_is_less_deep_than_the_axis_may_be() {
    let (mut undefined, mut tight) = (0, 0);
    let options = Options::cold().depth_tolerance(TOLERANCE);
    at_the_surface(&options, |built, rows, [from, to], found| {
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let separation = |at: Vec3| {
            let pair = exhaustive(rows, &triangles, &Instrument::sphere(at, RADIUS));
            let distance = pair.expect("a pair").axis_distance;
            let is_inside = winding_number(rows, &triangles, at.as_dvec3()) > 0.5;
            (if is_inside { -distance } else { distance }) - f64::from(RADIUS)
        };
        // Between the samples the separation may be smaller.
        let samples = (0..=4).map(|n| separation(from.lerp(to, n as f32 / 4.0)));
        let truth = samples.fold(f64::INFINITY, f64::min);
        let deepest = f64::from(found.contacts.first().expect("the closest").separation);
        let accuracy = f64::from(found.accuracy);
        assert!(deepest <= truth + accuracy, "{truth} {accuracy} {:?}", found.contacts);
        // For an axis outside, the stated separation is too low by twice its distance from the surface.
        let spare = 6.0 * accuracy + 2.0 * f64::from(TOLERANCE);
        assert!(deepest >= truth - spare, "{truth} {accuracy} {:?}", found.contacts);
        undefined += usize::from(found.side == Side::Undefined(NoSide::BelowAccuracy));
        tight += usize::from(deepest > truth);
    });
    println!("{undefined} below the accuracy");
    assert!(undefined > sample(1_000) && tight > sample(100), "{undefined} {tight}");
}

/// A tool on a neighbour of the part has the same distance from the part as beside the surface.
#[test]
fn a_part_keeps_its_margin_beside_a_tool_at_the_surface() {
    let (mut undefined, mut near) = (0, 0);
    at_the_surface(&Options::cold().contacts_of(PART), |built, rows, ends, found| {
        let [from, to] = ends.map(Vec3::as_dvec3);
        if !matches!(found.side, Side::Outside | Side::Undefined(NoSide::BelowAccuracy)) {
            return;
        }
        let tree = built.tree::<u16>().expect("16-bit indices");
        let of_part = (0..).zip(surfaces::triangles(&tree)).filter_map(|(row, corners)| {
            let corners = corners.map(|row| rows[row as usize].as_dvec3());
            (tree.label(TriangleRow(row)) == Some(PART)).then_some(corners)
        });
        let truth = least_distance(from, to, of_part) - f64::from(RADIUS);
        if truth > f64::from(MARGIN) - 1e-2 {
            return;
        }
        let accuracy = f64::from(found.accuracy);
        let deepest = found.contacts.first().expect("the part's").separation;
        let over = f64::from(deepest) - truth;
        assert!(over <= accuracy && over >= -6.0 * accuracy - 0.02, "{over} {:?}", found.contacts);
        undefined += usize::from(found.side != Side::Outside);
        near += usize::from(truth > 0.1 - f64::from(RADIUS));
    });
    println!("{undefined} below the accuracy, {near} beside the part");
    assert!(undefined > 300 && near > 300, "{undefined} {near}");
}

/// The walls of a plate as thin as the rounding of coordinates have no clear normal at their rim: a tool whose axis
/// crosses there gets the hold, although no contact has a direction.
#[test]
fn a_tool_without_a_direction_is_held() {
    let plate =
        |thickness: f32| cuboid(Vec3::new(-30.0, -20.0, 0.0), Vec3::new(30.0, 20.0, thickness));
    let (positions, triangles) = plate(1.0);
    let rest = Mesh { positions: positions.into(), triangles: triangles.into(), ..Mesh::default() };
    let built = Builder::new().build(&rest).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let spring = SpringDamper::stiffness(1.0).max_force(50.0);
    let proxy = Proxy::new(spring, MARGIN).expect("a valid margin");
    let mut list = Contacts::<32>::new();
    let (mut rng, mut without) = (Rng::with_seed(7), 0);
    for _ in 0..if cfg!(debug_assertions) { 4_000 } else { sample(40_000) } {
        let turn =
            glam::Quat::from_rotation_y(6.0 * rng.f32()) * glam::Quat::from_rotation_x(rng.f32());
        let (positions, _) = plate(1e-6 * rng.f32());
        let rows = built.to_rows(&positions.map(|at| turn * at));
        let [a, b] = [rng.usize(..8), rng.usize(..8)].map(|row| rows[row]);
        let on = a.lerp(b, rng.f32());
        let along = unit(&mut rng) * 4.0;
        let tool = Capsule::new(on - along * rng.f32(), on + along, 0.5).expect("a valid tool");
        let found = query.contacts(rows.as_slice(), &tool, MARGIN, &Options::cold(), &mut list);
        let found = found.expect("an answer");
        if !matches!(found.side, Side::Crossing | Side::Inside) {
            continue;
        }
        without += usize::from(found.direction == Vec3::ZERO);
        let force = proxy.wrench(list.within(MARGIN), list.accuracy(), on, Vec3::ZERO, Vec3::ZERO);
        assert_ne!(force.state, ConstraintState::Inactive, "{found:?}");
    }
    println!("{without} without a direction");
    assert!(without > 3, "{without}");
}
