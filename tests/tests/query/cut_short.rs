//! Depths whose search is ended by a limit: by the budget, or by the largest work for a depth.

// Requirements: A-03, S-03

use dibs_build::{Builder, Mesh};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Budget, Capsule, Odometer, Options, Proximity, Query, Side, Tracker};
use dibs_tests::deform::unit;
use dibs_tests::sample;
use dibs_tests::surfaces::ball;
use fastrand::Rng;
use glam::Vec3;

/// Two balls of 40 mm beside each other.
fn two_balls() -> Mesh {
    let one = ball(3);
    let count = one.positions.len() as u32;
    let beside = one.positions.iter().map(|&p| p + Vec3::X * 100.0);
    let positions = one.positions.iter().copied().chain(beside).collect();
    let other = one.triangles.iter().map(|corners| corners.map(|v| v + count));
    let triangles = one.triangles.iter().copied().chain(other).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// An axis that meets the surface in several places: wherever the budget ends the search, the interval contains the
/// result of the complete search.
#[test]
fn an_axis_through_several_walls_is_as_deep_under_any_budget() {
    let meshes = [two_balls(), ball(2)];
    let (mut cut, mut crossing) = (0, 0);
    for mesh in &meshes {
        let built = Builder::new().stretch(2.0).build(mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for slope in 0..12 {
            let lean = Vec3::new(0.0, 3.0 * slope as f32, 1.7 * slope as f32 - 9.0);
            let (from, to) = (Vec3::X * -60.0 + lean, Vec3::X * 170.0 - 0.7 * lean);
            let tool = Capsule::new(from, to, 1.0).expect("a valid tool");
            let whole = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
            for budget in (0..300).map(|tests| Budget::new(3 * tests)) {
                let options = Options::cold().budget(budget);
                let found = query.closest(rows.as_slice(), &tool, &options).expect("an answer");
                cut += usize::from(found.lower < whole.lower);
                crossing += usize::from(found.side == Side::Crossing);
                let (true_interval, interval) = (whole.interval(), found.interval());
                assert!(
                    interval.lower <= true_interval.upper && true_interval.lower <= interval.upper,
                    "{slope} {budget:?}: {whole:?} {found:?}"
                );
            }
        }
    }
    assert!(cut > 500 && crossing > 500, "{cut} {crossing}");
}

/// A row of bodies with leaves of different sizes.
fn row_of_bodies(count: usize, rng: &mut Rng) -> Mesh {
    let mut row = Mesh::default();
    for place in 0..count {
        let body = ball(rng.u32(..3));
        let first = row.positions.len() as u32;
        let (size, aside) = (0.2 + 0.8 * rng.f32(), unit(rng) * 5.0);
        let aside = aside + Vec3::X * 90.0 * place as f32;
        let spikes = if rng.bool() { 1.2 } else { 0.0 };
        let mut move_to = |at: &Vec3| *at * size * (1.0 - 0.6 * spikes * rng.f32()) + aside;
        row.positions.extend(body.positions.iter().map(&mut move_to));
        row.triangles.extend(body.triangles.iter().map(|at| at.map(|row| row + first)));
    }
    row
}

/// A capsule somewhere along such a row.
fn along_a_row(rng: &mut Rng) -> Capsule {
    let [from, to] =
        [(); 2].map(|()| Vec3::X * (500.0 * rng.f32() - 100.0) + unit(rng) * 40.0 * rng.f32());
    Capsule::new(from, to, 0.5).expect("a valid tool")
}

/// Whether the interval of an answer that a budget ended contains the complete search's.
fn holds(part: &Proximity, whole: &Proximity) -> bool {
    let (all, part) = (whole.interval(), part.interval());
    part.lower <= all.upper && all.lower <= part.upper
}

/// If a search ends between two bodies that the axis crosses, a few tests are left, enough for one end of the axis:
/// what is between that end and the first body was not searched.
#[test]
fn a_search_that_ended_knows_not_where_the_axis_meets_the_surface() {
    let (mut cut, mut rng) = (0, Rng::with_seed(3));
    for number in 0..sample(1_000) {
        let row = row_of_bodies(2 + number % 3, &mut rng);
        let built = Builder::new().stretch(1.1).build(&row).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&row.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        for _ in 0..20 {
            let tool = along_a_row(&mut rng);
            let whole = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
            if whole.side != Side::Crossing {
                continue;
            }
            for budget in (0..300).map(|tests| Budget::new(4 * tests)) {
                let options = Options::cold().budget(budget);
                let found = query.closest(rows.as_slice(), &tool, &options).expect("an answer");
                cut += usize::from(found.lower < whole.lower);
                assert!(holds(&found, &whole), "{budget:?}: {whole:?} {found:?}");
            }
        }
    }
    assert!(cut > 1_000, "{cut}");
}

/// A flat, wavy body along x: an axis along it enters and leaves it several times.
fn waves(splits: u32, rng: &mut Rng) -> Mesh {
    let mut mesh = ball(splits);
    let (thin, high) = (2.0 + 8.0 * rng.f32(), 15.0 + 20.0 * rng.f32());
    let (often, first) = (0.05 + 0.1 * rng.f32(), std::f32::consts::TAU * rng.f32());
    for at in &mut mesh.positions {
        let Vec3 { x, y, z } = *at / 40.0;
        let x = 120.0 * x;
        let thick = thin * (1.0 + 0.8 * (0.03 * x + first).sin());
        *at = Vec3::new(x, 30.0 * y, z * thick + high * (often * x + first).sin());
    }
    mesh
}

/// The same for a tracker's tick that runs out of stored triangles: beyond the single one that it knows, the axis would
/// count as outside.
#[test]
fn a_tick_that_ended_knows_not_where_the_axis_meets_the_surface() {
    let (mut cut, mut rng) = (0, Rng::with_seed(5));
    for number in 0..if cfg!(debug_assertions) { 16 } else { sample(60) } {
        let mesh = waves(2 + number as u32 % 2, &mut rng);
        let leaf = 1 + number / 2 % 8;
        let built = Builder::new().stretch(1.1).leaf_triangles(leaf).build(&mesh);
        let built = built.expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let rows = built.to_rows(&mesh.positions);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let surface = odometer.start(rows.as_slice());
        for _ in 0..20 {
            let [from, to] = [-140.0, 140.0]
                .map(|x| Vec3::new(x * rng.f32(), 10.0 * rng.f32(), 20.0 * (rng.f32() - 0.5)));
            let tool = Capsule::new(from, to, 0.5).expect("a valid tool");
            let whole = query.closest(rows.as_slice(), &tool, &Options::cold()).expect("an answer");
            if whole.side != Side::Crossing {
                continue;
            }
            for tests in 0..200 {
                let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(&tree).expect("deep enough");
                if tests % 2 == 0 {
                    let aside = unit(&mut rng) * 3.0;
                    let beside = Capsule::new(from + aside, to + aside, 0.5).expect("a valid tool");
                    tracker.closest(&surface, &beside, &Options::new()).expect("an answer");
                }
                let budget = Budget::new(5 * tests);
                let options = Options::new().budget(budget);
                let found = tracker.closest(&surface, &tool, &options).expect("an answer").closest;
                cut += usize::from(found.lower < whole.lower);
                assert!(holds(&found, &whole), "{budget:?}: {whole:?} {found:?}");
            }
        }
    }
    assert!(cut > 1_000, "{cut}");
}

/// Near a ball's centre all vertices are equally far, so that each point of the axis needs a search of the whole tree.
#[test]
fn a_depth_takes_no_more_work_than_it_states() {
    let mesh = ball(5);
    let built = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let tool = Capsule::new(Vec3::X * -3.0, Vec3::new(3.0, 0.1, 0.0), 1.0).expect("a valid tool");
    let options = Options::cold().depth_tolerance(0.0);
    let closest = query.closest(rows.as_slice(), &tool, &options.unsigned()).expect("an answer");
    let found = query.closest(rows.as_slice(), &tool, &options).expect("an answer");
    let most = (tree.node_count() * 3 / 2).max(4_608);
    println!("{} of {most}, beside {}", found.work(), closest.work());
    assert_eq!(found.side, Side::Inside);
    // The work for the side comes first.
    assert!(found.work() <= closest.work() + most + 512, "{found:?} {closest:?} {most}");
    assert!(found.work() > closest.work() + most / 2, "the limit was not met");
}
