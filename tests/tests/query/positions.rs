//! A position that is not finite: a query names its vertex, or its answer is finite.

// Requirement: A-07

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Capsule, Odometer, Options, Proximity, Query, QueryError, Sphere, Tool, Tracker, Tree,
};
use fastrand::Rng;
use glam::Vec3;

/// The first tick of a tracker.
fn first_tick(
    tree: &Tree<'_, u16>,
    rows: &[Vec3],
    tool: &impl Tool,
) -> Result<Proximity, QueryError> {
    let surface = Odometer::new(tree).start(rows);
    let mut tracker = Tracker::<u16, MAX_STACK, 256>::new(tree).expect("deep enough");
    tracker.closest(&surface, tool, &Options::cold()).map(|found| found.closest)
}

#[test]
fn a_position_that_is_not_finite_is_named() {
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rest = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(1);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut named = [0; 6];
        for _ in 0..400 {
            let vertex = rng.usize(..rest.len());
            let mut rows = rest.clone();
            rows[vertex][rng.usize(..3)] = bad;
            let near = rest[vertex] * 1.1;
            let (sphere, capsule) = (Sphere::new(near, 1.0), Capsule::new(near, near * 2.0, 1.0));
            let (sphere, capsule) = (sphere.expect("valid"), capsule.expect("valid"));
            let (rows, options) = (rows.as_slice(), &Options::cold());
            let answers: [Result<Proximity, QueryError>; 6] = [
                query.closest(rows, &sphere, options),
                query.closest_batched(rows, &sphere, options),
                query.closest(rows, &capsule, options),
                query.closest_batched(rows, &capsule, options),
                first_tick(&tree, rows, &sphere),
                first_tick(&tree, rows, &capsule),
            ];
            for (answer, named) in answers.into_iter().zip(&mut named) {
                match answer {
                    Ok(pair) => assert!(pair.point_on_surface.is_finite(), "{bad}: {pair:?}"),
                    Err(error) => {
                        let vertex = vertex as u32;
                        assert_eq!(error, QueryError::Position { vertex }, "{bad}");
                        *named += 1;
                    }
                }
            }
        }
        println!("{bad}: named by {named:?} of 400 queries of each kind");
        // A tick may pass over a triangle by its other corners.
        let [of_queries @ .., sphere, capsule] = named;
        assert!(of_queries.iter().all(|&named| named > 100), "{bad}: {named:?}");
        assert!(sphere > 20 && capsule > 20, "{bad}: {named:?}");
    }
}

/// The square of its distance is not finite in f32, though the position is.
#[test]
fn a_position_whose_square_is_not_finite_is_refused_or_passed_over() {
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rest = built.to_rows(&mesh.positions);
    let mut refused = 0;
    for (vertex, &at) in rest.iter().enumerate() {
        let mut rows = rest.clone();
        rows[vertex][vertex % 3] = 1e20;
        let tool = Sphere::new(at * 1.1, 1.0).expect("valid");
        match first_tick(&tree, &rows, &tool) {
            Ok(pair) => assert!(pair.point_on_surface.is_finite(), "{vertex}: {pair:?}"),
            Err(QueryError::Position { .. }) => refused += 1,
            Err(error) => assert!(matches!(error, QueryError::Uncovered { .. }), "{error:?}"),
        }
    }
    println!("{refused} of {} refused", rest.len());
    assert!(refused > 20, "{refused}");
}
