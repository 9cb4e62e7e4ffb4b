//! The solids of a surface of several parts: which closed part is an outer shell, and which are its cavities.

// Requirement: S-02

use dibs_nostd::Index;
use dibs_nostd::format::no_neighbour;

use crate::Mesh;
use crate::leaf::StoredTriangle;
use crate::orient::{volume, winds};

/// In place of a solid's number, for a part that bounds no solid.
const OPEN: u32 = u32::MAX;

/// The part of the surface below one root.
struct Part {
    /// The row of its first triangle.
    first: u32,
    /// Its triangles in the mesh.
    triangles: Vec<usize>,
    /// The volume that it encloses, negative if it faces inwards; `None` if it is open.
    volume: Option<f64>,
}

/// The solids section: for each root its first triangle, and the root of the outer shell of its solid. A closed part
/// that faces outwards is an outer shell. A closed part that faces inwards is a cavity of the smallest outer shell
/// around it at rest; if there is none, it bounds no solid, as an open part does.
pub(super) fn solids<I: Index>(
    mesh: &Mesh,
    counts: impl Iterator<Item = u32>,
    rows: &[StoredTriangle],
    adjacency: &[u8],
) -> Vec<u8> {
    let mut first = 0;
    let parts: Vec<Part> = counts
        .map(|count| {
            let range = first as usize..(first + count) as usize;
            let triangles: Vec<usize> =
                rows[range.clone()].iter().map(|placed| placed.triangle as usize).collect();
            let codes = &adjacency[range.start * 3 * I::BYTES..range.end * 3 * I::BYTES];
            let none = &no_neighbour::<I>().to_le_bytes()[..I::BYTES];
            let is_closed = codes.chunks_exact(I::BYTES).all(|code| code != none);
            let volume = is_closed.then(|| volume(mesh, triangles.iter().copied()));
            let part = Part { first, triangles, volume };
            first += count;
            part
        })
        .collect();
    let solid_of = |root: usize| match parts[root].volume {
        Some(volume) if volume >= 0.0 => root as u32,
        Some(_) => holder(mesh, &parts, root).map_or(OPEN, |root| root as u32),
        None => OPEN,
    };
    let rows = (0..parts.len()).flat_map(|root| [parts[root].first, solid_of(root)]);
    rows.flat_map(u32::to_le_bytes).collect()
}

/// The smallest closed part facing outwards that contains another part.
fn holder(mesh: &Mesh, parts: &[Part], root: usize) -> Option<usize> {
    let [vertex, ..] = mesh.triangles[parts[root].triangles[0]];
    let point = mesh.positions[vertex as usize].as_dvec3();
    let shells = parts.iter().enumerate().filter_map(|(at, part)| {
        let volume = part.volume.filter(|&volume| volume >= 0.0)?;
        winds(mesh, &part.triangles, point).then_some((at, volume))
    });
    shells.min_by(|(_, one), (_, other)| one.total_cmp(other)).map(|(at, _)| at)
}
