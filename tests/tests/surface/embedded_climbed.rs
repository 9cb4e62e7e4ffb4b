//! Surfaces that a volume's nodes move, searched for failures by climbing.
//!
//! `DIBS_EMBEDDED_QUERIES` sets the number of queries.

// Requirement: F-07

use dibs_nostd::nodes::Nodes;
use dibs_tests::embedded::{Tally, all, exact, judge, rest};
use dibs_tests::sample;
use fastrand::Rng;

/// No vertex leaves its sphere, no answer is off by more than its accuracy, and no frame is admitted whose stretch is
/// above the limit, however near to it the climbs come.
#[test]
fn nothing_fails() {
    let shapes = all(&mut Rng::with_seed(90));
    let asked = std::env::var("DIBS_EMBEDDED_QUERIES").ok();
    let asked = asked.map_or(sample(80_000), |text| text.parse().expect("a number of queries"));
    let (mut sum, mut seed) = (Tally::default(), 0);
    while sum.queries < asked {
        shapes.iter().for_each(|shape| sum += judge(shape, seed));
        seed += 1;
    }
    println!("{sum:?}");
    assert!(sum.uncovered == 0 && sum.wrong == 0 && sum.beyond == 0, "{sum:?}");
    assert!(sum.farthest > 0.999 && sum.off > 0.3 && sum.most > 0.999, "{sum:?}");
}

/// Weights hold a vertex, at rest, as near to its position in the mesh as the tree states.
#[test]
fn vertices_at_rest_are_those_of_the_mesh() {
    for shape in all(&mut Rng::with_seed(91)) {
        let tree = shape.built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let frame = rest(&nodes);
        for row in 0..nodes.vertex_count() {
            let number = tree.vertex_number(row).expect("ordered").0;
            let position = shape.mesh.positions[number as usize].as_dvec3();
            let away = exact(&nodes, &frame, row).distance(position);
            let most = f64::from(tree.position_error() / tree.stretch());
            assert!(away <= most, "{}: vertex {number} is off by {away} mm", shape.name);
        }
    }
}
