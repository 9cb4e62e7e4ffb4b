//! Radii of trees whose surface a volume moves.

// Requirement: F-07

use dibs_build::generate;
use dibs_nostd::nodes::Nodes;
use dibs_tests::embedded::{Carried, all, node_tests, rest, rows, sections};
use fastrand::Rng;

#[test]
fn radii_through_the_volume_take_fewer_node_tests() {
    let brain = |triangles| generate::brain(triangles).expect("a valid size");
    let heart = generate::heart(10_272).expect("a valid size").mesh;
    let meshes = [
        ("brain of 5,000", brain(5_000), 0.85),
        ("brain of 50,000", brain(50_000), 0.7),
        ("heart", heart, 0.75),
    ];
    for (name, mesh, most) in meshes {
        let [through, along] = node_tests(&mesh);
        let ratio = through as f64 / along as f64;
        println!("{name}: {through} instead of {along} node tests, {ratio:.3}");
        assert!(ratio <= most, "{name}: {ratio}");
    }
}

/// The largest radius of a section over the straight line from its pin to its farthest vertex; 1 where all are straight.
fn detour(carried: &Carried) -> f64 {
    let tree = carried.built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let at = rows(&nodes.surface(&rest(&nodes)[..]));
    let unit = carried.built.blob()[32..36].try_into().expect("four bytes");
    let unit = f64::from(f32::from_le_bytes(unit));
    let longer = sections(&tree).into_iter().map(|section| {
        let pin = at[section.pin as usize].as_dvec3();
        let farthest = section.covered.iter().map(|&row| at[row as usize].as_dvec3().distance(pin));
        let farthest = farthest.fold(0.0, f64::max);
        // Radii are rounded up to a multiple of this unit.
        (section.radius - unit) / farthest
    });
    longer.fold(0.0, f64::max)
}

/// A box of cells holds every straight line between two vertices; a volume with gaps does not.
#[test]
fn radii_in_a_box_of_cells_are_straight_lines() {
    let shapes = all(&mut Rng::with_seed(0));
    let of = |name| detour(shapes.iter().find(|shape| shape.name == name).expect("in the list"));
    for name in ["heart in a lattice", "brain in a cell", "needles", "several in a lattice"] {
        let most = of(name);
        assert!(most < 1.0 + 1e-5, "{name}: {most}");
    }
    for name in ["rolled sheet", "brain in a hull"] {
        let most = of(name);
        assert!(most > 1.1, "{name}: {most}");
    }
}
