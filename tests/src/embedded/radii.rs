//! Radii through a volume beside radii along the surface: the node tests of the same queries, at the same stretch.

use dibs_build::{Builder, Mesh, Volume};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Options, Query};
use fastrand::Rng;
use glam::Vec3;

use super::{NodeMotion, rows};
use crate::ask;
use crate::oracle::Instrument;

/// The limit on stretch of both trees.
const STRETCH: f32 = 1.1;

/// A sphere or a capsule outside of the surface, most of them within 30 mm.
fn beside(at: &[Vec3], middle: Vec3, rng: &mut Rng) -> Instrument {
    // The sum of twelve numbers is almost normal.
    let normal = |rng: &mut Rng| (0..12).map(|_| rng.f32()).sum::<f32>() - 6.0;
    let random = |rng: &mut Rng| Vec3::from([(); 3].map(|()| normal(rng)));
    let near = at[rng.usize(..at.len())];
    let away = (near - middle).normalize() * 30.0 * normal(rng).abs();
    let start = near + away + 5.0 * random(rng);
    let end = if rng.bool() { start } else { start + 20.0 * random(rng) };
    Instrument::capsule(start, end, 2.5)
}

/// Node tests on a surface in a lattice of about two thousand nodes, and those with geodesics along the surface, both
/// with the same limit on stretch, on the frames of nodes in motion.
///
/// # Panics
/// If no tree can be built for the mesh.
#[must_use]
pub fn node_tests(mesh: &Mesh) -> [u64; 2] {
    let mut rng = Rng::with_seed(8);
    let lattice = Volume::lattice(mesh, [14, 12, 10]).expect("a lattice");
    let embedded = Builder::new().stretch(STRETCH).nodes(&lattice).build(mesh).expect("held");
    let plain = Builder::new().stretch(STRETCH).build(mesh).expect("valid");
    let trees = [&embedded, &plain].map(|built| built.tree::<u16>().expect("valid"));
    let mut queries =
        trees.each_ref().map(|tree| Query::<u16, MAX_STACK>::new(tree).expect("deep enough"));
    let nodes = Nodes::of(&trees[0]).expect("valid");
    let mut counts = [0_u64; 2];
    for _ in 0..20 {
        let frame = NodeMotion::Waves.apply(&nodes, &mut rng);
        // The other tree has its own order of vertices.
        let mut of_mesh = mesh.positions.clone();
        for (&vertex, at) in embedded.vertex_order().iter().zip(rows(&nodes.surface(&frame[..]))) {
            of_mesh[vertex as usize] = at;
        }
        let tables = [&embedded, &plain].map(|built| built.to_rows(&of_mesh));
        let middle = of_mesh.iter().sum::<Vec3>() / of_mesh.len() as f32;
        for _ in 0..100 {
            let tool = beside(&of_mesh, middle, &mut rng);
            for ((query, table), count) in queries.iter_mut().zip(&tables).zip(&mut counts) {
                let options = Options::cold().unsigned();
                let answer = ask::closest(query, &table[..], &tool, &options).expect("sound");
                *count += u64::from(answer.node_tests);
            }
        }
    }
    counts
}
