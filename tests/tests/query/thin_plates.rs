//! Plates thinner than the rounding of their coordinates. A stated side is wrong only where a plate intersects itself,
//! by exact predicates.

// Requirement: S-01

use dibs_build::{Builder, Mesh};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Odometer, Options, Proximity, Query, Side, Sphere, Tracker};
use dibs_tests::deform::unit;
use dibs_tests::sample;
use fastrand::Rng;
use glam::{Quat, Vec3};

/// Coordinates are multiples of 1 / SCALE, and so exact as integers.
const SCALE: f64 = 16_777_216.0;

type Point = [i128; 3];

/// The sign of a tetrahedron's volume.
fn orientation(a: Point, b: Point, c: Point, d: Point) -> i128 {
    let from_a = |p: Point| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let [u, v, w] = [b, c, d].map(from_a);
    let minor = |i: usize, j: usize| v[i] * w[j] - v[j] * w[i];
    (u[0] * minor(1, 2) - u[1] * minor(0, 2) + u[2] * minor(0, 1)).signum()
}

/// Whether a segment crosses a triangle or ends on it.
fn passes(start: Point, end: Point, [a, b, c]: [Point; 3]) -> bool {
    let sides = [start, end].map(|point| orientation(a, b, c, point));
    let around = [(a, b), (b, c), (c, a)].map(|(a, b)| orientation(start, end, a, b));
    sides[0] != sides[1]
        && sides[0] * sides[1] <= 0
        && (around.iter().all(|&sign| sign >= 0) || around.iter().all(|&sign| sign <= 0))
}

/// Whether two triangles without a common vertex meet.
fn cuts_itself(mesh: &Mesh) -> bool {
    let exact = |at: &Vec3| at.to_array().map(|x| (f64::from(x) * SCALE) as i128);
    let points: Vec<Point> = mesh.positions.iter().map(exact).collect();
    let corners = |rows: &[u32; 3]| rows.map(|row| points[row as usize]);
    let meet = |one: [Point; 3], other: [Point; 3]| {
        (0..3).any(|a| {
            let b = (a + 1) % 3;
            passes(one[a], one[b], other) || passes(other[a], other[b], one)
        })
    };
    mesh.triangles.iter().enumerate().any(|(number, one)| {
        let apart = |other: &&[u32; 3]| !one.iter().any(|row| other.contains(row));
        let others = mesh.triangles[number + 1..].iter().filter(apart);
        others.into_iter().any(|other| meet(corners(one), corners(other)))
    })
}

/// A plate of 40 mm with `n` squares an edge, rotated and uneven, with rounded vertices.
fn plate(n: u32, thickness: f32, rng: &mut Rng) -> Mesh {
    let turn = Quat::from_axis_angle(unit(rng), 6.0 * rng.f32());
    let shift = unit(rng) * 5.0;
    let row = |top: u32, i: u32, j: u32| (top * (n + 1) + i) * (n + 1) + j;
    let mut mesh = Mesh::default();
    for (top, i, j) in (0..2 * (n + 1) * (n + 1))
        .map(|row| (row / (n + 1) / (n + 1), row / (n + 1) % (n + 1), row % (n + 1)))
    {
        let is_inner = (1..n).contains(&i) && (1..n).contains(&j);
        let aside = if is_inner { [rng.f32() - 0.5, rng.f32() - 0.5] } else { [0.0; 2] };
        let [x, y] = [i as f32 + 0.5 * aside[0], j as f32 + 0.5 * aside[1]]
            .map(|at| at / n as f32 * 40.0 - 20.0);
        let at = turn * Vec3::new(x, y, top as f32 * thickness) + shift;
        let rounded = |x: f32| ((f64::from(x) * SCALE).round() / SCALE) as f32;
        mesh.positions.push(Vec3::from(at.to_array().map(rounded)));
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        for [a, b, c] in [[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]] {
            let [a, b, c] = [a, b, c].map(|(di, dj)| (i + di, j + dj));
            mesh.triangles.push([row(1, a.0, a.1), row(1, b.0, b.1), row(1, c.0, c.1)]);
            mesh.triangles.push([row(0, a.0, a.1), row(0, c.0, c.1), row(0, b.0, b.1)]);
        }
    }
    let border = (0..n).flat_map(|k| {
        [
            [(k, 0), (k + 1, 0)],
            [(n, k), (n, k + 1)],
            [(n - k, n), (n - k - 1, n)],
            [(0, n - k), (0, n - k - 1)],
        ]
    });
    for [a, b] in border {
        let [low_a, low_b] = [a, b].map(|(i, j)| row(0, i, j));
        let [high_a, high_b] = [a, b].map(|(i, j)| row(1, i, j));
        mesh.triangles.extend([[low_a, low_b, high_b], [low_a, high_b, high_a]]);
    }
    mesh
}

#[test]
fn a_certain_side_is_wrong_only_where_a_plate_cuts_itself() {
    let mut rng = Rng::with_seed(2);
    let is_wrong = |found: &Proximity| {
        let is_in = matches!(found.side, Side::Inside | Side::Crossing);
        is_in && found.axis_distance > 3.0 * found.accuracy
    };
    let (mut whole, mut cut, mut asked, mut wrong) = (0, 0, 0, 0);
    for number in 0..sample(2_000) {
        let thickness = [4e-7, 7e-7, 1e-6, 1.4e-6, 3e-6, 2e-5][number % 6];
        let mesh = plate(2 + rng.u32(..4), thickness, &mut rng);
        // A plate that rounding turned inside out is refused.
        let Ok(built) = Builder::new().build(&mesh) else { continue };
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let is_cut = cuts_itself(&mesh);
        *if is_cut { &mut cut } else { &mut whole } += 1;
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(rows.as_slice());
        for _ in 0..if cfg!(debug_assertions) { 60 } else { 300 } {
            let off = 10_f32.powf(rng.f32() * 4.0 - 2.5);
            let at = rows[rng.usize(..rows.len())].lerp(rows[rng.usize(..rows.len())], rng.f32());
            let tool = Sphere::new(at + unit(&mut rng) * off, 0.5).expect("valid");
            let found = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
            let tracked = tracker.closest(&surface, &tool, &Options::new()).expect("an answer");
            asked += 2;
            for found in [found, tracked.closest] {
                assert!(is_cut || !is_wrong(&found), "{thickness}: {found:?}");
                wrong += u32::from(is_wrong(&found));
            }
        }
    }
    println!(
        "{cut} of {} plates cut themselves; {wrong} of {asked} sides wrong, all there",
        cut + whole
    );
    assert!(whole > 100 && cut > 0);
}
