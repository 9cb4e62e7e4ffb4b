//! Marching tetrahedra: a first, rough but always closed and manifold mesh of an implicit surface.

use std::collections::HashMap;

use glam::{DVec3, IVec3};

/// Triangulates the zero set of `field` (negative inside) within the box from `low` to `high`, which must contain it,
/// on a grid of about the given `step`. Triangles face outwards.
pub(super) fn contour(
    field: impl Fn(DVec3) -> f64,
    low: DVec3,
    high: DVec3,
    step: f64,
) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let counts = ((high - low) / step).ceil().max(DVec3::ONE);
    let spacing = (high - low) / counts;
    let cells = counts.to_array().map(|count| count as usize);
    let nodes = cells.map(|count| count + 1);
    let at = |node: usize| {
        let (column, layer) = (node / nodes[0], node / (nodes[0] * nodes[1]));
        let place = [node % nodes[0], column % nodes[1], layer].map(|index| index as f64);
        low + spacing * DVec3::from_array(place)
    };
    let values: Vec<f64> = (0..nodes.iter().product()).map(|node| field(at(node))).collect();

    // Cube corners are numbered by bits (x = 1, y = 2, z = 4); an edge of any tetrahedron runs from
    // a corner to one whose bits include it.
    let offset = |corner: usize| {
        (corner & 1) + nodes[0] * (((corner >> 1) & 1) + nodes[1] * ((corner >> 2) & 1))
    };
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    let mut crossings: HashMap<(usize, usize), u32> = HashMap::new();
    for z in 0..cells[2] {
        for y in 0..cells[1] {
            for x in 0..cells[0] {
                let base = x + nodes[0] * (y + nodes[1] * z);
                let inside = |corner: usize| values[base + offset(corner)] < 0.0;
                if (0..8).all(inside) || !(0..8).any(inside) {
                    continue;
                }
                let mut crossing = |a: usize, b: usize| {
                    let (a, b) = (base + offset(a), base + offset(b));
                    let (a, b) = (a.min(b), a.max(b));
                    *crossings.entry((a, b)).or_insert_with(|| {
                        // Kept away from the grid's nodes, so that no triangle has zero area.
                        let t = (values[a] / (values[a] - values[b])).clamp(0.05, 0.95);
                        points.push(at(a).lerp(at(b), t));
                        points.len() as u32 - 1
                    })
                };
                for middle in [[1, 3], [2, 3], [1, 5], [4, 5], [2, 6], [4, 6]] {
                    march([0, middle[0], middle[1], 7], inside, &mut crossing, &mut triangles);
                }
            }
        }
    }
    (points, triangles)
}

/// The triangles of one tetrahedron, given by cube corners.
fn march(
    corners: [usize; 4],
    inside: impl Fn(usize) -> bool,
    mut crossing: impl FnMut(usize, usize) -> u32,
    triangles: &mut Vec<[u32; 3]>,
) {
    let mut sorted = corners;
    sorted.sort_by_key(|&corner| !inside(corner));
    let count = corners.iter().filter(|&&corner| inside(corner)).count();
    let [a, b, c, d] = sorted;
    let place = |corner: usize| {
        IVec3::new(corner as i32 & 1, (corner as i32 >> 1) & 1, (corner as i32 >> 2) & 1)
    };
    let [ab, ac, ad] = [b, c, d].map(|corner| place(corner) - place(a));
    let positive = ab.dot(ac.cross(ad)) > 0;
    let mut emit =
        |[i, j, k]: [u32; 3]| triangles.push(if positive { [i, j, k] } else { [i, k, j] });
    match count {
        1 => emit([crossing(a, b), crossing(a, c), crossing(a, d)]),
        2 => {
            let (ac, ad, bd, bc) = (crossing(a, c), crossing(a, d), crossing(b, d), crossing(b, c));
            emit([ac, ad, bd]);
            emit([ac, bd, bc]);
        }
        // Seen from d, the only corner outside: an odd permutation of (a, b, c, d) starts with d.
        3 => emit([crossing(d, a), crossing(d, b), crossing(d, c)]),
        _ => {}
    }
}
