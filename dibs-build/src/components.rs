//! The connected components of a set of triangles.

// Requirement: A-08

use std::collections::HashMap;

use petgraph::unionfind::UnionFind;

/// The sets of triangles that shared vertices connect, as indices of `triangles`, the largest set first. Of equal sets
/// the one with the first triangle comes first.
///
/// Cost: nearly linear.
pub(crate) fn connected_by_vertices(triangles: &[[u32; 3]]) -> Vec<Vec<usize>> {
    let mut sets = UnionFind::<usize>::new(triangles.len());
    let mut first_with = HashMap::with_capacity(triangles.len());
    for (at, corners) in triangles.iter().enumerate() {
        for &corner in corners {
            sets.union(*first_with.entry(corner).or_insert(at), at);
        }
    }
    let mut members: HashMap<usize, Vec<usize>> = HashMap::new();
    for (at, set) in sets.into_labeling().into_iter().enumerate() {
        members.entry(set).or_default().push(at);
    }
    let mut components: Vec<Vec<usize>> = members.into_values().collect();
    components.sort_by(|a, b| b.len().cmp(&a.len()).then(a[0].cmp(&b[0])));
    components
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_component_is_first() {
        let triangles = [[7, 8, 9], [0, 1, 2], [4, 5, 6], [2, 3, 10], [9, 11, 12], [10, 13, 14]];
        assert_eq!(connected_by_vertices(&triangles), [vec![1, 3, 5], vec![0, 4], vec![2]]);
        assert_eq!(connected_by_vertices(&[]), [[0; 0]; 0]);
    }
}
