//! The positions and the triangles in a message's content.

use super::message::{take, u16_of, u32_of};

/// Size of an element of POINT, and the bytes before its position.
const POINT: (usize, usize) = (136, 100);

/// Scalar types allowed for an array of positions.
const FLOAT32: u8 = 10;
const FLOAT64: u8 = 11;

/// Types of messages that contain positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    PolyData,
    Point,
    Array,
}

/// Positions, in the source's order and unit.
#[derive(Debug, PartialEq)]
pub struct Content<'a> {
    pub positions: Vec<[f64; 3]>,
    /// The cells that connect them, for POLYDATA.
    pub cells: Option<Cells<'a>>,
}

/// Cells of POLYDATA as they are sent: for each a count and so many points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cells<'a> {
    pub polygons: &'a [u8],
    pub strips: &'a [u8],
}

impl Kind {
    pub fn of(name: &str) -> Option<Self> {
        match name {
            "POLYDATA" => Some(Self::PolyData),
            "POINT" => Some(Self::Point),
            "NDARRAY" => Some(Self::Array),
            _ => None,
        }
    }

    /// `None` if the content violates the protocol. Memory is only allocated for bytes that were received.
    pub fn read(self, content: &[u8]) -> Option<Content<'_>> {
        match self {
            Self::PolyData => poly_data(content),
            Self::Point => points(content),
            Self::Array => array(content),
        }
    }
}

fn poly_data(mut rest: &[u8]) -> Option<Content<'_>> {
    let points = u32_of(&mut rest)?;
    // A number of cells and their size in bytes, four times; the number is redundant.
    let mut sizes = [0; 4];
    for size in &mut sizes {
        u32_of(&mut rest)?;
        *size = u32_of(&mut rest)? as usize;
    }
    let _attributes = u32_of(&mut rest)?;
    let positions = take(&mut rest, (points as usize).checked_mul(12)?)?;
    let [vertices, lines, polygons, strips] = sizes;
    take(&mut rest, vertices)?;
    take(&mut rest, lines)?;
    let cells = Cells { polygons: take(&mut rest, polygons)?, strips: take(&mut rest, strips)? };
    Some(Content { positions: floats(positions), cells: Some(cells) })
}

fn points(content: &[u8]) -> Option<Content<'_>> {
    let (size, before) = POINT;
    if !content.len().is_multiple_of(size) {
        return None;
    }
    let position = |element: &[u8]| floats(element.get(before..)?.get(..12)?).pop();
    let positions = content.chunks_exact(size).map(position).collect::<Option<_>>()?;
    Some(Content { positions, cells: None })
}

fn array(mut rest: &[u8]) -> Option<Content<'_>> {
    let [scalar, dimensions] = *take(&mut rest, 2)? else { return None };
    let sizes: Option<Vec<usize>> =
        (0..dimensions).map(|_| u16_of(&mut rest).map(usize::from)).collect();
    // Dimensions points x 3, or frames x points x 3, where a dimension of one is ignored.
    let sizes: Vec<usize> = sizes?.into_iter().filter(|&size| size != 1).collect();
    let points = match sizes[..] {
        [points, 3] => points,
        [3] => 1,
        _ => return None,
    };
    let positions = match scalar {
        FLOAT32 if rest.len() == 12 * points => floats(rest),
        FLOAT64 if rest.len() == 24 * points => {
            let (numbers, _) = rest.as_chunks::<8>();
            let (points, _) = numbers.as_chunks::<3>();
            points.iter().map(|point| point.map(f64::from_be_bytes)).collect()
        }
        _ => return None,
    };
    Some(Content { positions, cells: None })
}

fn floats(bytes: &[u8]) -> Vec<[f64; 3]> {
    let (numbers, _) = bytes.as_chunks::<4>();
    let (points, _) = numbers.as_chunks::<3>();
    points.iter().map(|point| point.map(|x| f32::from_be_bytes(x).into())).collect()
}

impl Cells<'_> {
    /// The faces, with strips cut into triangles. `None` if a cell ends early, or refers to a missing point, or if
    /// there are more than `most` faces.
    pub fn faces(&self, points: usize, most: usize) -> Option<Vec<Vec<u32>>> {
        let mut faces = Vec::new();
        each_cell(self.polygons, points, |cell| {
            faces.push(cell);
            faces.len() <= most
        })?;
        each_cell(self.strips, points, |strip| {
            let triangles = strip.windows(3).enumerate();
            // Every other triangle of a strip is wound the other way.
            let triangles = triangles.map(|(number, corners)| match (number % 2, corners) {
                (1, &[a, b, c]) => vec![b, a, c],
                _ => corners.to_vec(),
            });
            let is_room = triangles.len() <= most.saturating_sub(faces.len());
            if is_room {
                faces.extend(triangles);
            }
            is_room
        })?;
        Some(faces)
    }
}

/// Calls `take_cell` for each cell that has a face, until it returns false.
fn each_cell(
    mut rest: &[u8],
    points: usize,
    mut take_cell: impl FnMut(Vec<u32>) -> bool,
) -> Option<()> {
    while !rest.is_empty() {
        let count = u32_of(&mut rest)? as usize;
        let bytes = take(&mut rest, count.checked_mul(4)?)?;
        let (words, _) = bytes.as_chunks::<4>();
        let cell: Vec<u32> = words.iter().map(|&word| u32::from_be_bytes(word)).collect();
        let is_right = cell.iter().all(|&point| (point as usize) < points);
        if !is_right || cell.len() > 2 && !take_cell(cell) {
            return None;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn words(words: &[u32]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_be_bytes()).collect()
    }

    #[test]
    fn a_strip_turns_every_other_triangle() {
        let (polygons, strips) = (words(&[4, 0, 1, 2, 3]), words(&[5, 0, 1, 2, 3, 4]));
        let cells = Cells { polygons: &polygons, strips: &strips };
        let faces = [vec![0, 1, 2, 3], vec![0, 1, 2], vec![2, 1, 3], vec![2, 3, 4]];
        assert_eq!(cells.faces(5, 4), Some(faces.to_vec()));
        assert_eq!(cells.faces(4, 4), None, "a point that is not there");
        assert_eq!(cells.faces(5, 3), None, "more faces than a mesh of theirs has");
        assert_eq!(Cells { polygons: &[0; 400], strips: &[] }.faces(5, 0), Some(Vec::new()));
        for wrong in [&words(&[3, 0, 1])[..], &words(&[u32::MAX])[..], &strips[1..]] {
            assert_eq!(Cells { polygons: wrong, strips: &[] }.faces(9, 9), None);
        }
    }

    #[test]
    fn sizes_that_are_not_there_are_refused() {
        let mut body = words(&[1, 0, 0, 0, 0, 1, 16, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0]);
        assert!(Kind::PolyData.read(&body).is_some());
        for (at, size) in [(0, 2), (0, u32::MAX), (8, 4), (24, 17), (24, u32::MAX), (32, 1)] {
            let right = body.clone();
            body[at..at + 4].copy_from_slice(&size.to_be_bytes());
            assert_eq!(Kind::PolyData.read(&body), None, "{size} at {at}");
            body = right;
        }
        let array = |scalar: u8, sizes: &[u16], bytes: usize| {
            let mut body = vec![scalar, sizes.len() as u8];
            body.extend(sizes.iter().flat_map(|size| size.to_be_bytes()));
            body.resize(body.len() + bytes, 0);
            Kind::Array.read(&body).map(|content| content.positions.len())
        };
        assert_eq!(array(10, &[2, 3], 24), Some(2));
        assert_eq!(array(11, &[1, 2, 3], 48), Some(2));
        assert_eq!(array(10, &[3], 12), Some(1));
        for (scalar, sizes, bytes) in
            [(10, &[2_u16, 3][..], 25), (6, &[2, 3], 24), (10, &[3, 2], 24)]
        {
            assert_eq!(array(scalar, sizes, bytes), None, "{scalar} {sizes:?}");
        }
        assert_eq!(array(10, &[u16::MAX; 255], 24), None);
        assert_eq!(Kind::Point.read(&[0; 137]), None);
    }

    proptest! {
        /// No content makes a reader exceed its bounds, or panic.
        #[test]
        fn any_bytes_are_read_or_refused(
            start in prop::collection::vec(0_u32..40, 10),
            bytes in prop::collection::vec(any::<u8>(), 0..400),
        ) {
            let body = [words(&start), bytes].concat();
            for kind in [Kind::PolyData, Kind::Point, Kind::Array] {
                for body in [&body[..], &body[40..]] {
                    if let Some(Content { positions, cells }) = kind.read(body) {
                        prop_assert!(12 * positions.len() <= body.len());
                        drop(cells.and_then(|cells| cells.faces(positions.len(), 40)));
                    }
                }
            }
        }
    }
}
