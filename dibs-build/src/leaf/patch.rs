//! Patches: triangles that edges connect.

/// The parts of a set of triangles that edges connect, ordered by their first triangles.
///
/// Cost: quadratic in the set, which is hardly larger than a leaf.
pub(crate) fn connected_by_edges(mesh: &[[u32; 3]], triangles: &[u32]) -> Vec<Vec<u32>> {
    let mut left = triangles.to_vec();
    let mut parts = Vec::new();
    while !left.is_empty() {
        let mut part = vec![left.remove(0)];
        while let Some(next) = left
            .iter()
            .position(|&t| part.iter().any(|&p| are_neighbours(mesh[t as usize], mesh[p as usize])))
        {
            part.push(left.remove(next));
        }
        parts.push(part);
    }
    parts
}

/// Whether two triangles share an edge.
fn are_neighbours(a: [u32; 3], b: [u32; 3]) -> bool {
    a.iter().filter(|corner| b.contains(corner)).count() >= 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fan of four triangles around vertex 0, an isolated triangle, and one that touches the fan at a vertex only.
    const MESH: [[u32; 3]; 6] =
        [[0, 1, 2], [0, 3, 4], [3, 0, 2], [4, 5, 0], [7, 8, 9], [5, 10, 11]];

    #[test]
    fn parts_are_connected_by_edges() {
        let all: Vec<u32> = (0..6).collect();
        assert_eq!(connected_by_edges(&MESH, &all), [vec![0, 2, 1, 3], vec![4], vec![5]]);
    }
}
