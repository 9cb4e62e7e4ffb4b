//! The boundary of volume cells: the surface of a simulation mesh that has no triangles of its own.

use super::ReadErrorKind;
use super::groups::FaceGroups;
use super::raw::Raw;
use glam::DVec3;

/// A volume cell with plane or bilinear faces, its corners numbered as VTK and Gmsh number them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    Tetrahedron,
    Pyramid,
    Wedge,
    Hexahedron,
    PentagonalPrism,
    HexagonalPrism,
}

impl Shape {
    pub fn corners(self) -> usize {
        match self {
            Self::Tetrahedron => 4,
            Self::Pyramid => 5,
            Self::Wedge => 6,
            Self::Hexahedron => 8,
            Self::PentagonalPrism => 10,
            Self::HexagonalPrism => 12,
        }
    }

    /// Faces, all counterclockwise as seen from inside, or all clockwise.
    fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Tetrahedron => &[&[0, 2, 1], &[0, 1, 3], &[1, 2, 3], &[2, 0, 3]],
            Self::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
            Self::Wedge => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[1, 2, 5, 4], &[2, 0, 3, 5]],
            Self::Hexahedron => &[
                &[0, 3, 2, 1],
                &[4, 5, 6, 7],
                &[0, 1, 5, 4],
                &[1, 2, 6, 5],
                &[2, 3, 7, 6],
                &[3, 0, 4, 7],
            ],
            Self::PentagonalPrism => &[
                &[0, 4, 3, 2, 1],
                &[5, 6, 7, 8, 9],
                &[0, 1, 6, 5],
                &[1, 2, 7, 6],
                &[2, 3, 8, 7],
                &[3, 4, 9, 8],
                &[4, 0, 5, 9],
            ],
            Self::HexagonalPrism => &[
                &[0, 5, 4, 3, 2, 1],
                &[6, 7, 8, 9, 10, 11],
                &[0, 1, 7, 6],
                &[1, 2, 8, 7],
                &[2, 3, 9, 8],
                &[3, 4, 10, 9],
                &[4, 5, 11, 10],
                &[5, 0, 6, 11],
            ],
        }
    }
}

/// Most corners of a face.
const MOST: usize = 6;

/// The volume cells of a file.
#[derive(Default)]
pub(super) struct Volumes {
    cells: Vec<(Shape, f64)>,
    corners: Vec<u32>,
    /// Cells with curved faces, whose boundary is not extracted.
    pub curved: usize,
}

impl Volumes {
    #[cfg(feature = "formats")]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty() && self.curved == 0
    }

    /// Adds a cell and its group. False if the number of corners does not match the shape.
    pub fn push(&mut self, shape: Shape, corners: &[u32], group: f64) -> bool {
        self.cells.push((shape, group));
        self.corners.extend(corners);
        corners.len() == shape.corners()
    }

    /// Adds the boundary as faces if the file has no faces, with a remark; `remedy` is for files of curved cells alone.
    pub fn finish(
        self,
        raw: &mut Raw,
        has_groups: bool,
        remedy: &str,
    ) -> Result<(), ReadErrorKind> {
        let count = self.cells.len() + self.curved;
        raw.tetrahedra = self.tetrahedra();
        raw.other_cells = count - raw.tetrahedra.len();
        if !raw.ends.is_empty() {
            raw.remark(
                count,
                "volume cell was left out, since the file has a surface",
                "volume cells were left out, since the file has a surface",
            );
            return Ok(());
        }
        if self.curved > 0 {
            return Err(ReadErrorKind::Foreign {
                what: "a mesh of volume cells with curved faces".to_owned(),
                remedy: remedy.to_owned(),
            });
        }
        self.add_skin(raw, has_groups);
        raw.remark(
            count,
            "volume cell and no triangles: the surface is its skin",
            "volume cells and no triangles: the surface is their skin",
        );
        Ok(())
    }

    fn tetrahedra(&self) -> Vec<[u32; 4]> {
        let mut rest = &self.corners[..];
        let of = |&(shape, _): &(Shape, f64)| {
            let (corners, after) = rest.split_at_checked(shape.corners())?;
            rest = after;
            <[u32; 4]>::try_from(corners).ok().filter(|_| shape == Shape::Tetrahedron)
        };
        self.cells.iter().filter_map(of).collect()
    }

    /// Adds the faces that belong to one cell only: each turned outwards, in the order of the cells.
    fn add_skin(&self, raw: &mut Raw, has_groups: bool) {
        let mut faces = Vec::new();
        let mut rest = &self.corners[..];
        for (cell, (shape, _)) in (0..).zip(&self.cells) {
            let Some((corners, after)) = rest.split_at_checked(shape.corners()) else { break };
            rest = after;
            let is_inside_out = volume(*shape, corners, &raw.positions) < 0.0;
            for face in shape.faces() {
                let mut face: Vec<u32> = face.iter().map(|&at| corners[at]).collect();
                // Cells are degenerated to simpler shapes by repeating a corner.
                face.dedup();
                if face.len() > 1 && face.first() == face.last() {
                    face.pop();
                }
                if is_inside_out {
                    face.reverse();
                }
                if face.len() >= 3 {
                    faces.push((key(&face), faces.len(), face, cell));
                }
            }
        }
        faces.sort_unstable();
        let single = faces.chunk_by(|a, b| a.0 == b.0).filter_map(|same| match same {
            [one] => Some(one),
            _ => None,
        });
        let mut skin: Vec<_> = single.collect();
        skin.sort_unstable_by_key(|(_, number, ..)| *number);
        for (.., face, cell) in skin {
            raw.corners.extend(face);
            raw.end_face();
            if has_groups {
                let groups: &mut FaceGroups = raw.groups.get_or_insert_default();
                groups.of_face.push(self.cells[*cell].1);
            }
        }
    }
}

/// Equal for faces with the same corners.
fn key(face: &[u32]) -> [u32; MOST] {
    let mut key = [u32::MAX; MOST];
    for (to, &from) in key.iter_mut().zip(face) {
        *to = from;
    }
    key.sort_unstable();
    key
}

/// Six times the volume: negative where the corners are numbered inside out.
fn volume(shape: Shape, corners: &[u32], positions: &[[f64; 3]]) -> f64 {
    // A corner that refers to no vertex is left to another check.
    let at = |corner: usize| {
        let position = positions.get(corners[corner] as usize).copied().unwrap_or_default();
        DVec3::from(position)
    };
    let apex = at(0);
    let fan = |face: &&[usize]| {
        let sides = face[1..].windows(2);
        sides
            .map(|s| (at(face[0]) - apex).dot((at(s[0]) - apex).cross(at(s[1]) - apex)))
            .sum::<f64>()
    };
    shape.faces().iter().map(fan).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One cell of each shape: on the unit circle, or above it.
    fn cell(shape: Shape) -> Vec<[f64; 3]> {
        let ring = |count: usize, z: f64| {
            (0..count).map(move |i| {
                let angle = i as f64 / count as f64 * std::f64::consts::TAU;
                [angle.cos(), angle.sin(), z]
            })
        };
        let apex = || std::iter::once([0.0, 0.0, 1.0]);
        match shape {
            Shape::Tetrahedron => ring(3, 0.0).chain(apex()).collect(),
            Shape::Pyramid => ring(4, 0.0).chain(apex()).collect(),
            prism => {
                let count = prism.corners() / 2;
                ring(count, 0.0).chain(ring(count, 1.0)).collect()
            }
        }
    }

    const ALL: [Shape; 6] = [
        Shape::Tetrahedron,
        Shape::Pyramid,
        Shape::Wedge,
        Shape::Hexahedron,
        Shape::PentagonalPrism,
        Shape::HexagonalPrism,
    ];

    #[test]
    fn the_skin_of_a_cell_is_closed_and_faces_outwards() {
        for shape in ALL {
            for is_mirrored in [false, true] {
                let mut raw = Raw::new(0);
                raw.positions = cell(shape);
                if is_mirrored {
                    raw.positions.iter_mut().for_each(|p| p[2] = -p[2]);
                }
                let mut volumes = Volumes::default();
                let corners: Vec<u32> = (0..shape.corners() as u32).collect();
                assert!(volumes.push(shape, &corners, 0.0));
                volumes.finish(&mut raw, false, "").unwrap();
                let mut edges = std::collections::HashSet::new();
                let centre = raw.positions.iter().map(|&p| DVec3::from(p)).sum::<DVec3>()
                    / raw.positions.len() as f64;
                for face in raw.faces() {
                    let at = |i: usize| DVec3::from(raw.positions[face[i] as usize]);
                    let normal = (at(1) - at(0)).cross(at(2) - at(0));
                    assert!(normal.dot(at(0) - centre) > 0.0, "{shape:?} {face:?}");
                    for (i, &from) in face.iter().enumerate() {
                        assert!(edges.insert((from, face[(i + 1) % face.len()])), "{shape:?}");
                    }
                }
                assert!(edges.iter().all(|&(from, to)| edges.contains(&(to, from))), "{shape:?}");
            }
        }
    }

    /// A cube of five tetrahedra, some of which are numbered inside out.
    #[test]
    fn each_cell_has_a_sign_of_its_own() {
        let corner = |at: usize| [1, 2, 4].map(|bit| if at & bit == 0 { 0.0 } else { 1.0 });
        let cells = [[0, 1, 2, 4], [3, 2, 1, 7], [5, 4, 7, 1], [6, 7, 4, 2], [1, 2, 4, 7]];
        for mirrored in 0..32 {
            let mut raw = Raw::new(0);
            raw.positions = (0..8).map(corner).collect();
            let mut volumes = Volumes::default();
            for (number, [a, b, c, d]) in cells.into_iter().enumerate() {
                let cell = if mirrored >> number & 1 == 1 { [a, b, d, c] } else { [a, b, c, d] };
                assert!(volumes.push(Shape::Tetrahedron, &cell, 0.0));
            }
            volumes.finish(&mut raw, false, "").unwrap();
            assert_eq!(raw.ends.len(), 12);
            for face in raw.faces() {
                let at = |i: usize| DVec3::from(raw.positions[face[i] as usize]);
                let normal = (at(1) - at(0)).cross(at(2) - at(0));
                assert!(normal.dot(at(0) - DVec3::splat(0.5)) > 0.0, "{mirrored:b} {face:?}");
            }
        }
    }

    #[test]
    fn faces_between_cells_are_no_skin() {
        let mut raw = Raw::new(0);
        raw.positions =
            vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
        let mut volumes = Volumes::default();
        assert!(volumes.push(Shape::Tetrahedron, &[0, 1, 2, 3], 4.0));
        assert!(volumes.push(Shape::Tetrahedron, &[0, 1, 2, 4], 5.0));
        assert!(!Volumes::default().push(Shape::Tetrahedron, &[0, 1, 2], 0.0));
        volumes.finish(&mut raw, true, "").unwrap();
        assert_eq!(raw.ends.len(), 6);
        assert_eq!(raw.groups.unwrap().of_face, [4.0, 4.0, 4.0, 5.0, 5.0, 5.0]);
        assert_eq!(raw.remarks, ["2 volume cells and no triangles: the surface is their skin"]);
    }
}
