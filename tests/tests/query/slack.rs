//! The rounding slacks of a query, each on surfaces and poses that need it: radii that are nearly exhausted,
//! coordinates far from the origin, axes along long triangles.

// Requirement: A-01

use dibs_build::{Builder, BuiltTree, Mesh};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    ACCURACY, Contacts, Odometer, Options, Query, Side, Sphere, Tracker, measure_stretch,
};
use dibs_tests::ask;
use dibs_tests::deform::unit;
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::surfaces;
use fastrand::Rng;
use glam::Vec3;

/// A number between `low` and `high`, with all decades equally likely.
fn decades(rng: &mut Rng, low: f32, high: f32) -> f32 {
    low * (high / low).powf(rng.f32())
}

/// A tree, its surface's present rows, and the largest error of a query so far in units of its accuracy.
struct Searched<'b> {
    built: &'b BuiltTree,
    rows: Vec<Vec3>,
    worst: f64,
}

impl<'b> Searched<'b> {
    fn new(built: &'b BuiltTree, positions: &[Vec3]) -> Self {
        Self { built, rows: built.to_rows(positions), worst: 0.0 }
    }

    /// Compares both searches with exhaustive search: with the tree's limit, with the measured stretch, and with a warm
    /// start from the triangle closest to `known`.
    fn check(&mut self, tool: &Instrument, known: &Instrument) {
        let tree = self.built.tree::<u16>().expect("valid");
        let rows = self.rows.as_slice();
        let measured = measure_stretch(&tree, rows).expect("within the limit");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
        let truth = exhaustive(rows, &surfaces::triangles(&tree), tool).expect("has triangles");
        let options = Options::cold().stretch(measured);
        let known = ask::closest(&mut query, rows, known, &options).expect("an answer").triangle;
        for options in [Options::cold(), options, options.warm_start(known)] {
            let both = [
                ask::closest(&mut query, rows, tool, &options),
                ask::closest_batched(&mut query, rows, tool, &options),
            ];
            for found in both {
                let found = found.unwrap_or_else(|error| panic!("{tool:?}: {error}"));
                let off = (f64::from(found.separation) - truth.separation).abs();
                let off = off / f64::from(found.accuracy);
                assert!(off <= 1.0, "{off:.1} accuracies off: {tool:?}\n{found:?}\n{truth:?}");
                self.worst = self.worst.max(off);
            }
        }
    }
}

/// A ladder of `cells` rectangles along the first axis.
fn ladder(cells: usize, length: f32, width: f32) -> Mesh {
    let places = (0..=cells).flat_map(|i| [0.0, width].map(|z| (i, z)));
    let positions = places.map(|(i, z)| Vec3::new(i as f32 * length, 0.0, z)).collect();
    let cell = |i: usize| {
        let a = 2 * i as u32;
        [[a, a + 2, a + 1], [a + 1, a + 2, a + 3]]
    };
    Mesh { positions, triangles: (0..cells).flat_map(cell).collect(), ..Mesh::default() }
}

/// Straight bands, stretched nearly to their limit, whose first edge is the closest to `end`: every sphere around it
/// extends hardly farther. The band's other half runs back past the tool, hardly farther away. Calls `check(built,
/// positions, end, radius)` for each.
fn for_each_band(number: usize, mut check: impl FnMut(&BuiltTree, &[Vec3], Vec3, f32)) {
    const LIMIT: f32 = 1.5;
    let (cells, cell, width) = (100, 2.0, 1.0);
    let mesh = ladder(cells, cell, width);
    let built = Builder::new().stretch(LIMIT).build(&mesh).expect("a valid mesh");
    let mut rng = Rng::with_seed(51);
    for _ in 0..number {
        let apart = 4.0 + 20.0 * rng.f32();
        // The band runs straight to a corner, up by `apart`, and back above itself, beyond its start.
        let straight = 40.0 * cell * (1.0 + rng.f32() * 0.1) * LIMIT;
        let place = |along: f32| {
            let past = along - straight;
            match past {
                ..=0.0 => (along, 0.0),
                _ if past <= apart => (straight, past),
                _ => (straight - (past - apart), apart),
            }
        };
        let positions: Vec<Vec3> = mesh
            .positions
            .iter()
            .map(|p| {
                let (x, y) = place(p.x * LIMIT * 0.9995);
                Vec3::new(x, y, p.z)
            })
            .collect();
        let before = apart - decades(&mut rng, 1e-3, 0.3);
        let end = Vec3::new(-before, 0.0, width * rng.f32());
        check(&built, &positions, end, 0.5 * rng.f32());
    }
}

#[test]
fn a_radius_is_used_in_full() {
    let mut worst: f64 = 0.0;
    for_each_band(400, |built, positions, end, radius| {
        let mut searched = Searched::new(built, positions);
        // To a sphere above the tool, the other half is closer.
        let above = Instrument::sphere(end + Vec3::Y, radius);
        searched.check(&Instrument::sphere(end, radius), &above);
        searched.check(&Instrument::capsule(end, end + Vec3::Z * 0.1, radius), &above);
        worst = worst.max(searched.worst);
    });
    println!("largest error: {worst:.2} of the stated accuracy");
}

/// The same with a tracker, at its first tick and as its tool approaches the band's end, and with contacts within a
/// margin hardly larger than the separation.
#[test]
fn tracker_and_contacts_use_a_radius_in_full() {
    for_each_band(100, |built, positions, end, radius| {
        let tree = built.tree::<u16>().expect("valid");
        let rows = built.to_rows(positions);
        let surface = Odometer::new(&tree).start(rows.as_slice());
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
        let options = Options::cold();
        for steps in [0, 20] {
            let mut tracker =
                Tracker::<u16, MAX_STACK, 64>::new(&tree).expect("enough for any tree");
            for step in (0..=steps).rev() {
                let center = end + Vec3::Y * (step as f32 * 0.05);
                let tool = Sphere::new(center, radius).expect("valid");
                let whole = query.closest(&surface, &tool, &options).expect("an answer");
                let found = tracker.closest(&surface, &tool, &options).expect("an answer");
                // Above the rim the complete query has no side, and the tracker keeps the last one.
                if found.is_kept {
                    assert!(matches!(whole.side, Side::Undefined(_)), "{whole:?}");
                    continue;
                }
                let found = found.closest;
                let off = (found.separation - whole.separation).abs();
                assert!(off <= found.accuracy + whole.accuracy, "{found:?}\n{whole:?}");
            }
        }
        let tool = Sphere::new(end, radius).expect("valid");
        let whole = query.closest(&surface, &tool, &options).expect("an answer");
        let mut contacts = Contacts::<4>::new();
        let margin = whole.separation + 2.0 * whole.accuracy;
        query.contacts(&surface, &tool, margin, &options, &mut contacts).expect("room for all");
        let nearest = contacts.iter().map(|contact| contact.separation).reduce(f32::min);
        let nearest = nearest.expect("the closest pair is a contact");
        assert!((nearest - whole.separation).abs() <= whole.accuracy, "{nearest}: {whole:?}");
    });
}

/// Coordinates of millions, at which the mesh's integer coordinates are still exact. Near the centre of a ball every
/// leaf is nearly the closest, so planes need their slack.
#[test]
fn planes_allow_for_large_coordinates() {
    let mut rng = Rng::with_seed(52);
    let mut worst: f64 = 0.0;
    let mut mesh = surfaces::ball(3);
    mesh.positions.iter_mut().for_each(|p| *p = (*p * 2.0).round());
    let whole = |rng: &mut Rng, size: f32| {
        Vec3::from([(); 3].map(|()| (size * (2.0 * rng.f32() - 1.0)).round()))
    };
    for leaf in [1, 4] {
        let built = Builder::new().stretch(1.1).leaf_triangles(leaf).build(&mesh).expect("valid");
        for _ in 0..60 {
            let offset = whole(&mut rng, 4_194_304.0);
            let positions: Vec<Vec3> = mesh.positions.iter().map(|p| p + offset).collect();
            let mut searched = Searched::new(&built, &positions);
            for _ in 0..12 {
                let far = if rng.bool() { 3.0 } else { 60.0 };
                let start = offset + whole(&mut rng, far);
                let sphere = Instrument::sphere(start, 0.0);
                searched.check(&sphere, &sphere);
                let capsule = Instrument::capsule(start, start + whole(&mut rng, 30.0), 0.0);
                searched.check(&capsule, &sphere);
            }
            worst = worst.max(searched.worst);
        }
    }
    println!("largest error: {worst:.2} of the stated accuracy");
}

/// A long tube, folded so that its ridges run along an axis in its middle, all about equally close. The shortest vector
/// to one end of a ridge is rounded, and so tilted along the axis; the tube's length amplifies this.
#[test]
fn planes_allow_for_a_tilt_along_the_axis() {
    let mut rng = Rng::with_seed(53);
    let mut worst: f64 = 0.0;
    for _ in 0..200 {
        let (length, radius) = (200.0, decades(&mut rng, 0.01, 3.0));
        let rough = decades(&mut rng, 0.0003, 0.1);
        let turn = glam::Quat::from_axis_angle(unit(&mut rng), rng.f32());
        let corners = 32;
        let mut positions = Vec::new();
        for corner in 0..corners {
            let (sin, cos) = (std::f32::consts::TAU * corner as f32 / corners as f32).sin_cos();
            for z in [0.0, length] {
                let inner = radius + rough * rng.f32();
                let radius = if corner % 2 == 0 { inner } else { 3.0 * inner };
                positions.push(turn * Vec3::new(radius * cos, radius * sin, z));
            }
        }
        let side = |corner: u32| {
            let (a, b) = (2 * corner, 2 * ((corner + 1) % corners));
            [[a, b, a + 1], [b, b + 1, a + 1]]
        };
        let mesh =
            Mesh { positions, triangles: (0..corners).flat_map(side).collect(), ..Mesh::default() };
        let leaf = 1 + rng.usize(..2);
        let built = Builder::new().stretch(1.1).leaf_triangles(leaf).build(&mesh).expect("valid");
        let mut searched = Searched::new(&built, &mesh.positions);
        for round in 0..20 {
            let mut end = |z: f32| {
                let off = unit(&mut rng) * rough;
                turn * Vec3::new(off.x, off.y, z)
            };
            // If the axis ends beyond the ridge, the vector starts far from the axis' start: the largest amplification.
            let reach = if round % 2 == 0 { length + 10.0 } else { length * 0.8 };
            let (start, end) = (end(-10.0), end(reach));
            let capsule = Instrument::capsule(start, end, 0.0);
            searched.check(&capsule, &Instrument::sphere(capsule.start, 0.0));
        }
        worst = worst.max(searched.worst);
    }
    println!("largest error: {worst:.2} of the stated accuracy");
}

/// An answer's accuracy covers the kernels' accuracy on a triangle, at any distance of the tool.
#[test]
fn the_accuracy_covers_the_kernels() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]], ..Mesh::default() };
    let built = Builder::new().stretch(1.0).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&corners);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("enough for any tree");
    let mut rng = Rng::with_seed(54);
    for _ in 0..1_000 {
        let center = unit(&mut rng) * decades(&mut rng, 1e-3, 1e6);
        let sphere = Sphere::new(center, 0.0).expect("valid");
        let found = query.closest(rows.as_slice(), &sphere, &Options::cold()).expect("an answer");
        let size = corners.iter().map(|corner| corner.distance(center)).fold(0.0, f32::max);
        // The epsilon is for the root of the square.
        assert!(found.accuracy >= (ACCURACY + f32::EPSILON) * size, "{center}: {found:?}");
    }
}
