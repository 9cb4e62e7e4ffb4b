//! Checks whether triangles are parts of given faces.

use std::collections::{HashMap, VecDeque};

/// Index of the first triangle that is no part of a face; `None` if each is part of one. A face of `n` corners covers
/// at most `n - 2` triangles, as many as its triangulation has: otherwise one face of all corners would cover every
/// mesh.
pub(crate) fn first_without_face(
    triangles: &[[u32; 3]],
    vertices: usize,
    faces: &[Vec<u32>],
) -> Option<usize> {
    let mut faces = Faces::of(faces, vertices, triangles.len());
    (0..triangles.len()).find(|&triangle| !faces.place(triangle, triangles))
}

/// Faces, and the triangles assigned to each.
struct Faces {
    /// Each face's corners, sorted and without duplicates, so that faces of many corners take no longer.
    corners: Vec<Vec<u32>>,
    /// The faces at each vertex, by index.
    at: Vec<Vec<u32>>,
    /// Triangles assigned to each face.
    given: Vec<Vec<usize>>,
    /// The face that each triangle is assigned to.
    face_of: Vec<Option<usize>>,
    /// Triangles that may still be visited in searches for augmenting paths.
    left: usize,
}

/// Most visits of triangles in those searches, for each triangle: a mesh has few faces that share three corners, and a
/// peer must not cause hours of work.
const LOOKS: usize = 64;

impl Faces {
    fn of(faces: &[Vec<u32>], vertices: usize, triangles: usize) -> Self {
        let sorted = |face: &Vec<u32>| {
            let mut corners = face.clone();
            corners.sort_unstable();
            corners.dedup();
            corners
        };
        let corners: Vec<Vec<u32>> = faces.iter().map(sorted).collect();
        let mut at: Vec<Vec<u32>> = vec![Vec::new(); vertices];
        for (number, face) in (0..).zip(&corners) {
            for &corner in face {
                if let Some(at) = at.get_mut(corner as usize) {
                    at.push(number);
                }
            }
        }
        let given = vec![Vec::new(); corners.len()];
        Self { corners, at, given, face_of: vec![None; triangles], left: LOOKS * triangles }
    }

    /// Faces that have these three corners, the smallest first.
    fn around(&self, corners: [u32; 3]) -> Vec<usize> {
        // Of the three corners, take the one with the fewest faces.
        let few = corners.iter().filter_map(|&corner| self.at.get(corner as usize));
        let few = few.min_by_key(|at| at.len()).map_or(&[][..], Vec::as_slice);
        let has = |&face: &usize| {
            corners.iter().all(|corner| self.corners[face].binary_search(corner).is_ok())
        };
        let mut faces: Vec<usize> = few.iter().map(|&face| face as usize).filter(has).collect();
        faces.sort_by_key(|&face| self.corners[face].len());
        faces
    }

    /// Assigns a triangle to a face. Where two faces share three corners, the first may have been assigned the other's
    /// triangle: then triangles move to another of their faces along the shortest augmenting path of the matching,
    /// found breadth first.
    fn place(&mut self, triangle: usize, triangles: &[[u32; 3]]) -> bool {
        let mut wanted_by: HashMap<usize, usize> = HashMap::new();
        let mut waiting = VecDeque::from([triangle]);
        while let Some(next) = waiting.pop_front() {
            let Some(left) = self.left.checked_sub(1) else { return false };
            self.left = left;
            for face in self.around(triangles[next]) {
                if wanted_by.contains_key(&face) {
                    continue;
                }
                wanted_by.insert(face, next);
                if self.given[face].len() + 2 < self.corners[face].len() {
                    self.move_along(face, &wanted_by);
                    return true;
                }
                waiting.extend(&self.given[face]);
            }
        }
        false
    }

    /// Assigns face `room` to the triangle that wants it. That triangle leaves its old face, which the previous
    /// triangle on the path wants; the path ends at the new triangle, which had no face.
    fn move_along(&mut self, room: usize, wanted_by: &HashMap<usize, usize>) {
        let mut free = Some(room);
        while let Some(face) = free {
            let triangle = wanted_by[&face];
            free = self.face_of[triangle].replace(face);
            self.given[face].push(triangle);
            if let Some(left) = free {
                self.given[left].retain(|&other| other != triangle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::first_without_face;
    use fastrand::Rng;

    /// Vertex 3 belongs to the first quad alone; both quads have the corners 0, 1 and 2.
    const TWO_QUADS: [[u32; 4]; 2] = [[0, 1, 2, 3], [0, 1, 2, 4]];

    fn misses(triangles: &[[u32; 3]], faces: &[&[u32]]) -> Option<usize> {
        let faces: Vec<Vec<u32>> = faces.iter().map(|face| face.to_vec()).collect();
        first_without_face(triangles, 8, &faces)
    }

    #[test]
    fn quads_that_share_three_corners_have_their_triangles_in_every_order() {
        let quads = TWO_QUADS.each_ref().map(<[u32; 4]>::as_slice);
        let own = [[0, 1, 2], [0, 2, 3], [0, 1, 4], [1, 2, 4]];
        for first in 0..4 {
            for second in 0..4 {
                let mut triangles = own;
                triangles.swap(0, first);
                triangles.swap(1, second);
                assert_eq!(misses(&triangles, &quads), None, "{triangles:?}");
                assert_eq!(misses(&triangles, &[quads[1], quads[0]]), None, "{triangles:?}");
            }
        }
    }

    #[test]
    fn triangles_move_along_a_chain_of_faces() {
        // Each face shares three corners with the next, and the triangle that is added last fits the first face alone.
        let chain: [&[u32]; 4] = [&[0, 1, 2, 3], &[1, 2, 3, 4], &[2, 3, 4, 5], &[3, 4, 5]];
        let taken = [[1, 2, 3], [0, 1, 2], [2, 3, 4], [1, 2, 4], [3, 4, 5], [2, 4, 5]];
        assert_eq!(misses(&taken, &chain), None);
        // The faces have seven places, and both places of the first one are then taken.
        assert_eq!(misses(&[&taken[..], &[[0, 1, 3]]].concat(), &chain), None);
        assert_eq!(misses(&[&taken[..], &[[0, 1, 3], [0, 2, 3]]].concat(), &chain), Some(7));
    }

    /// Small random faces and triangles, compared with an exhaustive search for an assignment.
    #[test]
    fn what_fits_in_some_way_is_taken() {
        fn fits(triangles: &[[u32; 3]], faces: &[Vec<u32>], room: &mut [usize]) -> bool {
            let Some(([a, b, c], rest)) = triangles.split_first() else { return true };
            (0..faces.len()).any(|face| {
                let has = [a, b, c].iter().all(|corner| faces[face].contains(corner));
                if !has || room[face] == 0 {
                    return false;
                }
                room[face] -= 1;
                let is_fit = fits(rest, faces, room);
                room[face] += 1;
                is_fit
            })
        }
        let mut rng = Rng::with_seed(7);
        let mut corners = |count: usize| rng.choose_multiple(0..6_u32, count);
        let mut taken = [0; 2];
        for _ in 0..2_000 {
            let faces: Vec<Vec<u32>> = (0..5).map(|face| corners(3 + face % 3)).collect();
            let mut triangles = Vec::new();
            let mut room: Vec<usize> = faces.iter().map(|face| face.len() - 2).collect();
            for _ in 0..9 {
                let three = corners(3);
                triangles.push([three[0], three[1], three[2]]);
                let missing = triangles.len() - 1;
                let found = first_without_face(&triangles, 6, &faces);
                let is_fit = fits(&triangles, &faces, &mut room);
                assert_eq!(found, (!is_fit).then_some(missing), "{triangles:?} of {faces:?}");
                taken[usize::from(is_fit)] += 1;
                if !is_fit {
                    triangles.pop();
                }
            }
        }
        assert!(taken.iter().all(|&count| count > 1_000), "{taken:?}");
    }

    #[test]
    fn a_face_has_no_more_triangles_than_its_corners_make() {
        let all: &[u32] = &[0, 1, 2, 3, 4];
        let three = [[0, 1, 2], [0, 2, 3], [0, 3, 4]];
        assert_eq!(misses(&three, &[all]), None);
        assert_eq!(misses(&[three[0], three[1], three[2], [1, 2, 3]], &[all]), Some(3));
        // A duplicate corner adds no place.
        assert_eq!(misses(&three[..2], &[&[0, 1, 2, 2]]), Some(1));
        assert_eq!(misses(&[[0, 1, 9]], &[all]), Some(0), "a vertex that no face has");
    }
}
