//! A short list of contacts states correctly how far it is complete: compared with one with room for every triangle.

// Requirement: S-05

use dibs_build::{Builder, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Contact, Contacts, Options, Query, Side, Sphere, Tool, TriangleRow};
use dibs_tests::deform::unit;
use dibs_tests::sample;
use dibs_tests::surfaces::sheet;
use fastrand::Rng;
use glam::Vec3;

/// Directions (radians) of two contacts within this angle may count as one, including the library's rounding.
const ALIKE: f32 = 0.14;

/// Poses for each mesh and size of the list.
const POSES: usize = 12_000;

/// The vertices next to each vertex, by rows.
fn neighbours(corners: impl Iterator<Item = [u32; 3]>, vertices: usize) -> Vec<Vec<u32>> {
    let mut next = vec![Vec::new(); vertices];
    for [a, b, c] in corners {
        for (from, to) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            next[from as usize].extend(to);
        }
    }
    next
}

/// Contacts below the short list's bound that are not in it.
fn missing<const NEAR: usize>(mesh: &Mesh, seed: u64) -> Vec<String> {
    let built = Builder::new().build(mesh).unwrap();
    let tree = built.tree::<u16>().unwrap();
    let rows = built.to_rows(&mesh.positions);
    let corners = (0..tree.triangle_count()).map(|row| tree.corners(TriangleRow(row)).unwrap());
    let next = neighbours(corners, rows.len());
    let mut query = Query::<u16, MAX_STACK>::new(&tree).unwrap();
    let (mut all, mut few) = (Contacts::<128, 4096>::new(), Contacts::<128, NEAR>::new());
    let (mut rng, mut bounds, mut missing) = (Rng::with_seed(seed), 0, Vec::new());
    for pose in 0..sample(POSES) {
        let at = rows[rng.usize(..rows.len())] + unit(&mut rng) * 12.0 * rng.f32();
        let along = unit(&mut rng) * [0.0, 20.0, 60.0][rng.usize(..3)];
        let tool = Capsule::new(at, at + along, 1.0).unwrap();
        let margin = [3.0, 8.0, 20.0, 40.0][rng.usize(..4)];
        let cold = Options::cold();
        query.contacts(rows.as_slice(), &tool, margin, &cold, &mut all).unwrap();
        let found = query.contacts(rows.as_slice(), &tool, margin, &cold, &mut few).unwrap();
        if found.side != Side::Outside || few.bound() >= margin {
            continue;
        }
        bounds += 1;
        let slack = 2.0 * all.accuracy();
        let promised = |one: &&Contact| one.separation < few.bound() - slack;
        for contact in all.iter().filter(promised) {
            let stands_for = |one: &Contact| {
                one.separation <= contact.separation + slack
                    && one.normal.dot(contact.normal) > ALIKE.cos()
            };
            // Across a corner and along an edge, the surface leads further downhill.
            let distance = contact.separation + tool.radius();
            let level = (distance * (1.0 + 1.0 / 512.0)).max(distance + margin / 128.0);
            let height = |row: u32| tool.axis_distance_squared(rows[row as usize]).sqrt();
            let leads_down = |&row: &u32| {
                height(row) <= level && next[row as usize].iter().any(|&to| height(to) < distance)
            };
            if !few.iter().any(stands_for) && !contact.corners.iter().any(leads_down) {
                let (at, bound) = (contact.separation, few.bound());
                missing.push(format!("pose {pose}, {NEAR} places: {at} below {bound}"));
            }
        }
    }
    assert!(bounds > 0, "no list of {NEAR} places was short");
    missing
}

#[test]
fn no_wall_is_missing_below_a_short_lists_bound() {
    let brain = generate::brain(2_000).unwrap();
    let heart = generate::heart(1_000).unwrap().mesh;
    let waves = sheet(30, 60.0, |x, y| 2.5 * (0.4 * x).sin() * (0.3 * y).cos());
    let found: Vec<String> = [(brain, 1), (heart, 2), (waves, 3)]
        .iter()
        .flat_map(|(mesh, seed)| {
            [missing::<8>(mesh, *seed), missing::<16>(mesh, *seed), missing::<40>(mesh, *seed)]
        })
        .flatten()
        .collect();
    assert!(found.is_empty(), "{} missing, as {:?}", found.len(), found.first());
}

#[test]
fn a_basin_whose_saddle_is_an_edge_with_something_lower_beyond_is_a_contact() {
    // Seen from above, the triangle's corner at the edge is obtuse, and the opposite edge is nearest to the tool.
    let [corner, along, third] = [[2.0, 0.0], [1.0, 6.0], [2.02, -2.0]];
    let flat = |[x, y]: [f32; 2]| Vec3::new(x, y, -6.0);
    let positions = vec![flat(corner), flat(along), flat(third), Vec3::new(4.0, 2.0, -2.0)];
    let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [0, 3, 1]], ..Mesh::default() };
    let built = Builder::new().build(&mesh).unwrap();
    let tree = built.tree::<u16>().unwrap();
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).unwrap();
    let mut contacts = Contacts::<16, 64>::new();
    let tool = Sphere::new(Vec3::ZERO, 0.5).unwrap();
    query.contacts(rows.as_slice(), &tool, 7.0, &Options::cold(), &mut contacts).unwrap();
    assert_eq!(contacts.len(), 2, "{:?}", contacts.iter().collect::<Vec<_>>());
}
