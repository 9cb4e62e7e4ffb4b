//! Divides a section in two by distance along the surface.

use super::section::{Searches, Section, Surface};
use crate::leaf::connected_by_edges;

/// Each side of a split gets at least this fraction of the triangles, which bounds the depth.
const LEAST_SHARE: f64 = 0.05;

/// After the split of a section up to this size, triangles that are cut off from their side move to the other. Larger
/// sections are mended further down the tree, in less time.
const MEND_BELOW: usize = 64;

/// Assigns each triangle to the nearer of the two far seeds that the search for the pin left in `searches`.
///
/// Unlike a plane, this separates the two walls of a fold, which are close in space and far apart along the surface.
/// With `even` each side gets half of the triangles.
pub(crate) fn by_geodesic(
    surface: &Surface<'_>,
    section: &Section,
    searches: &Searches,
    even: bool,
) -> [Vec<u32>; 2] {
    let [first, second] = &searches.seeds;
    // Vertices that no seed reached are assigned to neither; the difference of two infinite distances would be NaN.
    let reached = |distance: f64| distance.min(f64::from(f32::MAX));
    let nearer = |v: u32| reached(first.get(v)) - reached(second.get(v));
    by_key(&surface.mesh.triangles, section, nearer, even)
}

/// Assigns each triangle to a side by the sign of the sum of its vertices' keys.
pub(super) fn by_key(
    mesh: &[[u32; 3]],
    section: &Section,
    key: impl Fn(u32) -> f64,
    even: bool,
) -> [Vec<u32>; 2] {
    let of = |t: u32| -> f64 { mesh[t as usize].into_iter().map(&key).sum() };
    let keyed = section.triangles.iter().map(|&t| (of(t), t)).collect();
    let share = if even { 0.5 } else { LEAST_SHARE };
    let sides = at_zero(keyed, share);
    if section.triangles.len() <= MEND_BELOW && !even {
        let [left, right] = sides.map(|side| mainland(mesh, &side));
        [[left.0, right.1], [right.0, left.1]].map(|parts| {
            let mut side = parts.concat();
            side.sort_unstable();
            side
        })
    } else {
        sides
    }
}

/// The largest part that edges connect, and the rest: border triangles that touch their side only at a corner. Those
/// move to the other side; otherwise each would become a separate leaf.
fn mainland(mesh: &[[u32; 3]], side: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut parts = connected_by_edges(mesh, side);
    let sizes = parts.iter().map(Vec::len).enumerate();
    let largest = sizes.max_by_key(|&(at, size)| (size, std::cmp::Reverse(at)));
    let mainland = parts.swap_remove(largest.map_or(0, |(at, _)| at));
    (mainland, parts.concat())
}

/// Divides by the sign of the key; either side gets at least `least_share` of the triangles.
pub(crate) fn at_zero(mut keyed: Vec<(f64, u32)>, least_share: f64) -> [Vec<u32>; 2] {
    keyed.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let count = keyed.len();
    let least = ((count as f64 * least_share) as usize).clamp(1, count / 2);
    let at = keyed.partition_point(|&(key, _)| key <= 0.0).clamp(least, count - least);
    let (left, right) = keyed.split_at(at);
    [left, right].map(|side| {
        let mut triangles: Vec<u32> = side.iter().map(|&(_, t)| t).collect();
        triangles.sort_unstable();
        triangles
    })
}
