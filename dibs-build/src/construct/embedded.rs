//! Sections of a surface that a volume moves: pins and splits by distances through the volume.

use glam::DVec3;

use super::paper::main_axis;
use super::pin::Pin;
use super::section::Section;
use super::{Cluster, Constructor, Content, PARALLEL_ABOVE, split};
use crate::error::BuildError;
use crate::nodes::VolumePaths;

/// Iterations for the centre of the enclosing ball: the relative error is one over their number.
const ROUNDS: u32 = 64;

/// Vertices near the centre that are tried as pins.
const TRIED: usize = 8;

impl Constructor<'_> {
    /// The tree of a section.
    pub(super) fn embedded(
        &self,
        paths: &VolumePaths<'_>,
        section: &Section,
        depth: u32,
    ) -> Result<Cluster, BuildError> {
        let pin = pin(paths, section);
        if section.triangles.len() <= self.leaf_triangles {
            return self.leaves(section, pin, true, depth);
        }
        let halvings = section.triangles.len().ilog2() + 1;
        let even = depth + halvings >= super::MAX_DEPTH - 1;
        let mesh = self.surface.mesh;
        let sides = sides(paths, &mesh.triangles, section, pin, even);
        let [left, right] = sides.map(|triangles| Section::new(mesh, triangles));
        let build = |side: &Section| self.embedded(paths, side, depth + 1);
        let (left, right) = if section.triangles.len() > PARALLEL_ABOVE {
            rayon::join(|| build(&left), || build(&right))
        } else {
            (build(&left), build(&right))
        };
        let content = Content::Inner(vec![left?, right?]);
        Ok(Cluster { pin: pin.vertex, radius: pin.radius, content })
    }
}

/// The best of the section's vertices that are nearest to the centre of the ball around it.
fn pin(paths: &VolumePaths<'_>, section: &Section) -> Pin {
    let vertices = &section.vertices;
    let at = |vertex: u32| paths.position(vertex);
    // Badoiu and Clarkson's iteration: a step towards the farthest vertex, shorter each time.
    let mut centre = vertices.iter().map(|&v| at(v)).sum::<DVec3>() / vertices.len() as f64;
    for round in 2..ROUNDS {
        let from = |&v: &u32| at(v).distance_squared(centre);
        let farthest = vertices.iter().max_by(|a, b| from(a).total_cmp(&from(b)));
        centre += (farthest.map_or(centre, |&v| at(v)) - centre) / f64::from(round);
    }
    let mut near: Vec<(f64, u32)> =
        vertices.iter().map(|&v| (at(v).distance_squared(centre), v)).collect();
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if near.len() > TRIED {
        near.select_nth_unstable_by(TRIED, order);
        near.truncate(TRIED);
    }
    near.sort_unstable_by(order);
    let tried = near.into_iter().map(|(_, vertex)| {
        let radius = paths.distances(vertex, vertices).into_iter().fold(0.0, f64::max);
        Pin { vertex, radius }
    });
    let best = tried.reduce(|best, pin| if pin.radius < best.radius { pin } else { best });
    best.unwrap_or(Pin { vertex: vertices[0], radius: f64::INFINITY })
}

/// The two halves of a section. In a box, where all distances are straight lines, a plane across the longest direction
/// cuts it. In a volume with folds the cut is midway between two far seeds, which separates the walls of a fold.
fn sides(
    paths: &VolumePaths<'_>,
    mesh: &[[u32; 3]],
    section: &Section,
    pin: Pin,
    even: bool,
) -> [Vec<u32>; 2] {
    let vertices = &section.vertices;
    if paths.is_straight_everywhere() {
        let axis = main_axis(vertices.iter().map(|&vertex| paths.position(vertex)));
        let along = |vertex: u32| paths.position(vertex).dot(axis);
        let low = vertices.iter().map(|&vertex| along(vertex)).fold(f64::INFINITY, f64::min);
        let high = vertices.iter().map(|&vertex| along(vertex)).fold(f64::NEG_INFINITY, f64::max);
        let middle = (low + high) / 2.0;
        return split::by_key(mesh, section, |vertex| along(vertex) - middle, even);
    }
    let farthest = |distances: &[f64]| {
        let far = vertices.iter().zip(distances);
        far.max_by(|a, b| a.1.total_cmp(b.1)).map_or(pin.vertex, |(&vertex, _)| vertex)
    };
    let first = farthest(&paths.distances(pin.vertex, vertices));
    let from_first = paths.distances(first, vertices);
    let from_second = paths.distances(farthest(&from_first), vertices);
    let key = |vertex: u32| match vertices.binary_search(&vertex) {
        Ok(at) => from_first[at] - from_second[at],
        Err(_) => 0.0,
    };
    split::by_key(mesh, section, key, even)
}
