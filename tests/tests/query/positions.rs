//! A position that is not finite: a query names its vertex, or its answer is finite.

// Requirement: A-07

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Options, Proximity, Query, QueryError, Sphere};
use fastrand::Rng;

#[test]
fn a_position_that_is_not_finite_is_named() {
    let mesh = generate::heart(1_280).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rest = built.to_rows(&mesh.positions);
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut rng = Rng::with_seed(1);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut named = [0; 4];
        for _ in 0..400 {
            let vertex = rng.usize(..rest.len());
            let mut rows = rest.clone();
            rows[vertex][rng.usize(..3)] = bad;
            let near = rest[vertex] * 1.1;
            let (sphere, capsule) = (Sphere::new(near, 1.0), Capsule::new(near, near * 2.0, 1.0));
            let (sphere, capsule) = (sphere.expect("valid"), capsule.expect("valid"));
            let (rows, options) = (rows.as_slice(), &Options::cold());
            let answers: [Result<Proximity, QueryError>; 4] = [
                query.closest(rows, &sphere, options),
                query.closest_wide(rows, &sphere, options),
                query.closest(rows, &capsule, options),
                query.closest_wide(rows, &capsule, options),
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
        assert!(named.iter().all(|&named| named > 100), "{bad}: {named:?}");
    }
}
