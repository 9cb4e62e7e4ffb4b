//! Winding: checks that a surface has an outer side, and flips triangles until it has one.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;
use petgraph::unionfind::UnionFind;

use crate::Mesh;

fn more_pairs(others: usize) -> String {
    match others {
        0 => String::new(),
        1 => ", as one more pair is".to_owned(),
        others => format!(", as {others} more pairs are"),
    }
}

/// Why a surface has no outer side, or the wrong one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WindingError {
    /// Two triangles run along their common edge in the same direction.
    #[error(
        "triangles {triangle} and {other} are wound against each other{}, so the surface has no outer side and distances to \
         it no sign: turn them with --orient", more_pairs(*others)
    )]
    Inconsistent {
        /// One triangle.
        triangle: usize,
        /// The other one.
        other: usize,
        /// Number of other such pairs.
        others: usize,
    },
    /// More than two triangles share an edge, and they do not face each other in pairs.
    #[error(
        "{triangles} triangles share the edge from vertex {from} to vertex {to} and do not face each other in pairs, so \
         distances to that edge have no sign: remove walls inside the solid, or cut it open there, in a mesh editor"
    )]
    NonManifold {
        /// Number of triangles at the edge.
        triangles: usize,
        /// One end of the edge.
        from: u32,
        /// The other end.
        to: u32,
    },
    /// Two triangles disagree whichever way they are wound.
    #[error(
        "the surface has only one side, like a Moebius strip: triangles {triangle} and {other} disagree however they \
         are turned, so distances to it have no sign"
    )]
    OneSided {
        /// One triangle.
        triangle: usize,
        /// The other one.
        other: usize,
    },
    /// Too many closed parts to test which of them contain others.
    #[error(
        "the surface has {parts} closed parts, and which of them contain others is tested for at most {most}: build \
         several trees, each of some of them"
    )]
    Parts {
        /// Closed parts.
        parts: usize,
        /// Most that are tested.
        most: usize,
    },
    /// A closed part of the surface, which no other closed part contains, has normals that point inwards.
    #[error(
        "the closed surface with triangle {triangle} faces inwards, so what it encloses counts as outside: turn it with \
         --orient, unless the tool works inside"
    )]
    Inward {
        /// A triangle of that part.
        triangle: usize,
    },
}

/// Checks that a surface has an outer side, and that its closed parts face outwards. A part inside another may face
/// either way: it may be a cavity, or an organ inside an organ.
///
/// Cost: linear in the triangles, times the closed parts that face inwards.
///
/// # Errors
/// [`WindingError`] names the first conflicting triangles.
pub fn check_winding(mesh: &Mesh) -> Result<(), WindingError> {
    let edges = Edges::of(mesh);
    let against = edges.pairs.iter().filter(|pair| !pair.agrees);
    if let Some(first) = against.clone().next() {
        let others = against.count() - 1;
        return Err(WindingError::Inconsistent {
            triangle: first.triangle,
            other: first.other,
            others,
        });
    }
    let closed = edges.closed_parts();
    check_parts(closed.len())?;
    let is_inside = |row: usize| {
        let vertex = mesh.triangles[closed[row][0]][0];
        let point = mesh.positions[vertex as usize].as_dvec3();
        (0..closed.len()).any(|other| other != row && winds(mesh, &closed[other], point))
    };
    let faces_inwards = |row: usize| volume(mesh, closed[row].iter().copied()) < 0.0;
    match (0..closed.len()).find(|&row| faces_inwards(row) && !is_inside(row)) {
        Some(row) => Err(WindingError::Inward { triangle: closed[row][0] }),
        None => edges.crowded.map_or(Ok(()), Err),
    }
}

/// Flips triangles until the surface has an outer side. Parts end at edges of more than two triangles. In open parts as
/// few triangles as possible are flipped; closed parts face outwards, or inwards for a cavity in another part. Returns
/// the number of flipped triangles.
///
/// Cost: linear in the triangles, times the closed parts of the surface.
///
/// # Errors
/// [`WindingError`] if no flipping helps; the mesh is then unchanged.
pub fn orient(mesh: &mut Mesh) -> Result<usize, WindingError> {
    let edges = Edges::of(mesh);
    let count = mesh.triangles.len();
    let mut around = vec![Vec::new(); count];
    for pair in &edges.pairs {
        around[pair.triangle].push((pair.other, pair.agrees));
        around[pair.other].push((pair.triangle, pair.agrees));
    }
    // Whether to flip each triangle, if the first of its part stays as it is.
    let mut turned: Vec<Option<bool>> = vec![None; count];
    let mut parts: Vec<Vec<usize>> = Vec::new();
    for first in 0..count {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(false);
        let mut part = vec![first];
        let mut at = 0;
        while let Some(&triangle) = part.get(at) {
            at += 1;
            let is_turned = turned[triangle] == Some(true);
            for &(other, agrees) in &around[triangle] {
                let wanted = is_turned == agrees;
                match turned[other] {
                    None => {
                        turned[other] = Some(wanted);
                        part.push(other);
                    }
                    Some(is) if is != wanted => {
                        return Err(WindingError::OneSided { triangle, other });
                    }
                    Some(_) => (),
                }
            }
        }
        parts.push(part);
    }
    let mut oriented = mesh.clone();
    for (triangle, corners) in oriented.triangles.iter_mut().enumerate() {
        if turned[triangle] == Some(true) {
            corners.swap(1, 2);
        }
    }
    let is_closed = |part: &[usize]| part.iter().all(|&triangle| edges.neighbours[triangle] == 3);
    let closed: Vec<bool> = parts.iter().map(|part| is_closed(part)).collect();
    check_parts(closed.iter().filter(|&&is_closed| is_closed).count())?;
    let against: Vec<bool> = (0..parts.len())
        .map(|row| {
            let part = &parts[row];
            if !closed[row] {
                let moved = part.iter().filter(|&&triangle| turned[triangle] == Some(true));
                return 2 * moved.count() > part.len();
            }
            let inside = oriented.triangles[part[0]][0];
            let inside = oriented.positions[inside as usize].as_dvec3();
            let around = (0..parts.len()).filter(|&other| {
                other != row && closed[other] && winds(&oriented, &parts[other], inside)
            });
            let is_hole = around.count() % 2 == 1;
            (volume(&oriented, part.iter().copied()) < 0.0) != is_hole
        })
        .collect();
    for (part, against) in parts.iter().zip(against) {
        for &triangle in part.iter().filter(|_| against) {
            oriented.triangles[triangle].swap(1, 2);
        }
    }
    let changed = mesh.triangles.iter().zip(&oriented.triangles).filter(|(a, b)| a != b).count();
    *mesh = oriented;
    Ok(changed)
}

/// Most closed parts that are tested, each against all triangles. A tree has 64 roots; parts that share vertices or
/// edges belong to one root.
const MOST_PARTS: usize = 256;

fn check_parts(parts: usize) -> Result<(), WindingError> {
    if parts > MOST_PARTS { Err(WindingError::Parts { parts, most: MOST_PARTS }) } else { Ok(()) }
}

/// Two triangles with a common edge.
struct Pair {
    triangle: usize,
    other: usize,
    /// Whether they run along their common edge in opposite directions.
    agrees: bool,
}

struct Edges {
    pairs: Vec<Pair>,
    /// For each triangle the number of its edges that are no border.
    neighbours: Vec<u8>,
    /// The first edge of more than two triangles that does not have equally many in either direction.
    crowded: Option<WindingError>,
}

impl Edges {
    fn of(mesh: &Mesh) -> Self {
        // The triangles of each edge, and whether they run along it from the lower vertex number to the higher.
        let mut users: HashMap<(u32, u32), Vec<(usize, bool)>> = HashMap::new();
        for (triangle, &[a, b, c]) in mesh.triangles.iter().enumerate() {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let edge = (from.min(to), from.max(to));
                users.entry(edge).or_default().push((triangle, from < to));
            }
        }
        let mut edges =
            Self { pairs: Vec::new(), neighbours: vec![0; mesh.triangles.len()], crowded: None };
        let mut crowded: Option<((u32, u32), usize)> = None;
        for (&edge, of) in &users {
            match of[..] {
                [_] => (),
                [(triangle, forward), (other, other_forward)] => {
                    edges.neighbours[triangle] += 1;
                    edges.neighbours[other] += 1;
                    edges.pairs.push(Pair { triangle, other, agrees: forward != other_forward });
                }
                _ => {
                    if of.len().is_multiple_of(2) {
                        of.iter().for_each(|&(triangle, _)| edges.neighbours[triangle] += 1);
                    }
                    let forward = of.iter().filter(|(_, is_forward)| *is_forward).count();
                    if 2 * forward != of.len() && crowded.is_none_or(|(least, _)| edge < least) {
                        crowded = Some((edge, of.len()));
                    }
                }
            }
        }
        edges.crowded = crowded.map(|((from, to), triangles)| WindingError::NonManifold {
            triangles,
            from,
            to,
        });
        // A hash map's order is not deterministic.
        edges.pairs.sort_unstable_by_key(|pair| (pair.triangle, pair.other));
        edges
    }

    /// The sets of triangles that edges connect and that have no border, in order of their first triangle.
    fn closed_parts(&self) -> Vec<Vec<usize>> {
        let mut sets = UnionFind::<usize>::new(self.neighbours.len());
        for pair in &self.pairs {
            sets.union(pair.triangle, pair.other);
        }
        let mut parts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        let mut row_of = HashMap::new();
        for (triangle, set) in sets.into_labeling().into_iter().enumerate() {
            parts.entry(*row_of.entry(set).or_insert(triangle)).or_default().push(triangle);
        }
        let is_closed = |part: &Vec<usize>| part.iter().all(|&row| self.neighbours[row] == 3);
        parts.into_values().filter(is_closed).collect()
    }
}

/// The volume that triangles enclose, negative if they face inwards. Computed relative to the mesh's first vertex.
pub(crate) fn volume(mesh: &Mesh, triangles: impl IntoIterator<Item = usize>) -> f64 {
    let origin = mesh.positions.first().copied().unwrap_or_default().as_dvec3();
    let of = |triangle: usize| {
        let [a, b, c] =
            mesh.triangles[triangle].map(|v| mesh.positions[v as usize].as_dvec3() - origin);
        a.dot(b.cross(c)) / 6.0
    };
    triangles.into_iter().map(of).sum()
}

/// Whether a closed part of a surface encloses a point: by the solid angle of its triangles.
pub(crate) fn winds(mesh: &Mesh, part: &[usize], point: DVec3) -> bool {
    let solid_angle = |&triangle: &usize| {
        let [a, b, c] =
            mesh.triangles[triangle].map(|v| mesh.positions[v as usize].as_dvec3() - point);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let volume = a.dot(b.cross(c));
        2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
    };
    // Half of the full solid angle of 4 pi.
    part.iter().map(solid_angle).sum::<f64>().abs() > 2.0 * std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn ball() -> Mesh {
        crate::generate::heart(320).expect("a valid size").mesh
    }

    #[test]
    fn what_was_turned_is_turned_back() {
        let good = ball();
        assert_eq!(check_winding(&good), Ok(()));
        let mut mesh = good.clone();
        for triangle in [3, 4, 77] {
            mesh.triangles[triangle].swap(1, 2);
        }
        assert!(matches!(check_winding(&mesh), Err(WindingError::Inconsistent { .. })));
        assert_eq!(orient(&mut mesh), Ok(3));
        assert_eq!(mesh, good);
        mesh.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        assert_eq!(check_winding(&mesh), Err(WindingError::Inward { triangle: 0 }));
        assert_eq!(orient(&mut mesh), Ok(good.triangles.len()));
        assert_eq!(check_winding(&mesh), Ok(()));
    }

    #[test]
    fn a_hole_faces_into_itself() {
        let mut mesh = ball();
        let (vertices, triangles) = (mesh.positions.len() as u32, mesh.triangles.clone());
        let middle = mesh.positions.iter().sum::<Vec3>() / vertices as f32;
        let small = Mesh {
            positions: vec![middle, middle + Vec3::X, middle + Vec3::Y, middle + Vec3::Z],
            ..Mesh::default()
        };
        mesh.positions.extend(&small.positions);
        for corners in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
            mesh.triangles.push(corners.map(|corner| corner + vertices));
        }
        let outer = winds(&mesh, &(0..triangles.len()).collect::<Vec<_>>(), middle.as_dvec3());
        assert_eq!(orient(&mut mesh), Ok(if outer { 4 } else { 0 }));
    }

    #[test]
    fn a_moebius_strip_and_a_fin_are_refused() {
        let ring = |i: u32| (2 * (i % 5), 2 * (i % 5) + 1);
        let mut strip =
            Mesh { positions: vec![Vec3::ZERO; 10], triangles: Vec::new(), ..Mesh::default() };
        for i in 0..5 {
            let ((a, b), (c, d)) = (ring(i), ring(i + 1));
            let (c, d) = if i == 4 { (d, c) } else { (c, d) };
            strip.triangles.extend([[a, b, c], [b, d, c]]);
        }
        let before = strip.clone();
        assert!(matches!(orient(&mut strip), Err(WindingError::OneSided { .. })));
        assert_eq!(strip, before);
        let mut fin = ball();
        let [a, b, _] = fin.triangles[0];
        let tip = fin.positions.len() as u32;
        fin.positions.push(Vec3::splat(500.0));
        fin.triangles.push([a, b, tip]);
        let error = check_winding(&fin).expect_err("three triangles at an edge");
        assert!(matches!(error, WindingError::NonManifold { triangles: 3, .. }), "{error}");
    }
}
