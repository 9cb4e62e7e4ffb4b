//! Finds which vertex of the mesh each point of a POLYDATA is: by the triangles alone, once for each numbering.

use super::content::Cells;
use super::matching::{MatchResult, matched};
use dibs_stream::SurfaceOrder;
use std::collections::VecDeque;
use std::hash::{BuildHasher, RandomState};

/// Number of refused topologies that are remembered.
const REFUSED: usize = 8;

/// Faces that any source may send in addition to those of the tree's mesh.
pub const FEW: usize = 1000;

/// The numbering of the last topology, and the refused topologies.
pub struct Topology {
    order: SurfaceOrder,
    hasher: RandomState,
    known: Option<(Key, Numbering)>,
    /// By hash: another topology with the same hash is refused as well.
    refused: VecDeque<(u64, String)>,
}

/// How a source numbers the mesh's vertices.
#[derive(Debug, PartialEq)]
pub enum Numbering {
    /// As the mesh's file does.
    Own,
    /// The point of each vertex; `None` is possible for a vertex that no triangle uses.
    Other(Vec<Option<u32>>),
}

/// Identifies a topology exactly, which a hash does not.
#[derive(PartialEq)]
struct Key {
    points: usize,
    polygons: Vec<u8>,
    strips: Vec<u8>,
}

impl Key {
    fn is_of(&self, points: usize, cells: Cells<'_>) -> bool {
        (self.points, &*self.polygons, &*self.strips) == (points, cells.polygons, cells.strips)
    }
}

impl Topology {
    pub fn new(order: SurfaceOrder) -> Self {
        Self { order, hasher: RandomState::new(), known: None, refused: VecDeque::new() }
    }

    /// Forgets the last source's numbering.
    pub fn forget(&mut self) {
        self.known = None;
    }

    /// Whether the source's numbering differs from that of the mesh's file.
    pub fn is_other(&self) -> bool {
        self.known.as_ref().is_some_and(|(_, numbering)| *numbering != Numbering::Own)
    }

    /// The numbering of this many points that these cells connect.
    ///
    /// # Errors
    /// A sentence, if they are not the tree's mesh, or match it in several ways.
    pub fn numbering(&mut self, points: usize, cells: Cells<'_>) -> Result<&Numbering, String> {
        let is_known = self.known.as_ref().is_some_and(|(key, _)| key.is_of(points, cells));
        if !is_known {
            let hash = self.hasher.hash_one((points, cells.polygons, cells.strips));
            if let Some((_, why)) = self.refused.iter().find(|(refused, _)| *refused == hash) {
                return Err(why.clone());
            }
            match self.compare(points, cells) {
                Ok(numbering) => {
                    let (polygons, strips) = (cells.polygons.to_vec(), cells.strips.to_vec());
                    self.known = Some((Key { points, polygons, strips }, numbering));
                }
                Err(why) => {
                    self.refused.truncate(REFUSED - 1);
                    self.refused.push_front((hash, why.clone()));
                    return Err(why);
                }
            }
        }
        self.known.as_ref().map(|(_, numbering)| numbering).ok_or_else(String::new)
    }

    fn compare(&self, points: usize, cells: Cells<'_>) -> Result<Numbering, String> {
        let ours = self.order.triangles();
        if ours.is_empty() {
            return Err("the tree's frames are nodes, which no polygons join: send them as POINT or NDARRAY".to_owned());
        }
        // A source may send parts that the tree left out.
        let Some(faces) = cells.faces(points, 2 * ours.len() + FEW) else {
            return Err(
                "a polygon ends early, or has a point that is not there, or there are far more than the tree's mesh has"
                    .to_owned(),
            );
        };
        if faces.is_empty() {
            return Err("no polygon says which surface it is: send points alone as POINT or NDARRAY, in the order of the mesh's file"
                .to_owned());
        }
        let own = self.order.check_faces(&faces);
        if points == self.order.positions() && own.is_ok() {
            return Ok(Numbering::Own);
        }
        let theirs: Vec<[u32; 3]> = faces.iter().flat_map(|face| fan(face)).collect();
        match matched(ours, &theirs) {
            MatchResult::One(pairs) => {
                let mut point_of = vec![None; self.order.positions()];
                for [vertex, point] in pairs {
                    if let Some(of) = point_of.get_mut(vertex as usize) {
                        *of = Some(point);
                    }
                }
                Ok(Numbering::Other(point_of))
            }
            MatchResult::None => Err(format!(
                "its {} triangles of {points} points are not the {} that the tree has: it is of another mesh",
                theirs.len(),
                ours.len()
            )),
            MatchResult::Several => Err(
                "it is the tree's mesh with its points in another order, which the triangles do not tell, as they are \
                 symmetric: send the points in the order of the mesh's file"
                    .to_owned(),
            ),
        }
    }
}

impl Numbering {
    /// Positions in the mesh's order.
    pub fn apply(&self, positions: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        match self {
            Self::Own => positions,
            Self::Other(point_of) => {
                let at = |point: &Option<u32>| positions.get((*point)? as usize).copied();
                // A vertex without a point is in no triangle, and is not sent.
                point_of.iter().map(|point| at(point).unwrap_or_default()).collect()
            }
        }
    }
}

/// A polygon's triangles, without those with a repeated point.
fn fan(face: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let (first, rest) = face.split_first().map_or((0, face), |(&first, rest)| (first, rest));
    let triangles =
        rest.windows(2).filter_map(move |pair| Some([first, *pair.first()?, *pair.get(1)?]));
    triangles.filter(|&[a, b, c]| a != b && b != c && c != a)
}
