//! The triangles across each triangle's edges, in the order of the tree's rows.

use std::collections::HashMap;

use dibs_nostd::Index;
use dibs_nostd::format::no_neighbour;

use super::flatten::put;
use crate::Mesh;
use crate::leaf::StoredTriangle;

/// Two angles (radians) closer than this count as equal.
const COINCIDENT: f64 = 1e-9;

/// A triangle at an edge.
#[derive(Clone, Copy)]
struct User {
    row: u32,
    /// Index of the edge in the triangle: 0 to 2.
    edge: usize,
    /// Whether the triangle runs along the edge from the lower vertex number to the higher.
    is_forward: bool,
}

/// The adjacency section; `None` for a surface without sides: two triangles run along their common edge in the same
/// direction.
///
/// At an edge of more than two triangles, as where two solids touch, neighbours are the two triangles around each wedge
/// of the solid at rest. Where they do not form such pairs, the edge is a border.
pub(super) fn adjacency<I: Index>(mesh: &Mesh, triangles: &[StoredTriangle]) -> Option<Vec<u8>> {
    let mut users: HashMap<(u32, u32), Vec<User>> = HashMap::with_capacity(2 * triangles.len());
    for (row, placed) in (0..).zip(triangles) {
        for (edge, (from, to)) in edges(placed.corners).into_iter().enumerate() {
            let of = users.entry((from.min(to), from.max(to))).or_default();
            of.push(User { row, edge, is_forward: from < to });
        }
    }
    let mut across = vec![[no_neighbour::<I>(); 3]; triangles.len()];
    let mut join = |one: User, other: User| {
        across[one.row as usize][one.edge] = other.row;
        across[other.row as usize][other.edge] = one.row;
    };
    for (&edge, of) in &users {
        match of[..] {
            [_] => (),
            [one, other] if one.is_forward == other.is_forward => return None,
            [one, other] => join(one, other),
            _ => {
                for [one, other] in wedges::<I>(mesh, triangles, edge, of) {
                    join(one, other);
                }
            }
        }
    }
    let mut bytes = Vec::with_capacity(3 * I::BYTES * triangles.len());
    across.into_iter().flatten().for_each(|row| put::<I>(&mut bytes, row));
    Some(bytes)
}

/// The pairs of triangles around an edge with the solid between them; none if the triangles do not alternate in
/// direction.
fn wedges<I: Index>(
    mesh: &Mesh,
    triangles: &[StoredTriangle],
    (low, high): (u32, u32),
    users: &[User],
) -> Vec<[User; 2]> {
    let at = |vertex: u32| mesh.positions[vertex as usize].as_dvec3();
    let axis = (at(high) - at(low)).normalize_or_zero();
    let (one, two) = axis.any_orthonormal_pair();
    let angle = |user: &User| {
        let corners = triangles[user.row as usize].corners;
        let third = corners[(user.edge + 2) % 3];
        let towards = at(third) - at(low);
        towards.dot(two).atan2(towards.dot(one))
    };
    let mut around: Vec<(f64, User)> = users.iter().map(|user| (angle(user), *user)).collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Rotating around the edge, the solid ends at a forward triangle: each pair starts with a backward one.
    let first = around.iter().position(|(_, user)| !user.is_forward).unwrap_or_default();
    around.rotate_left(first);
    let pairs: Vec<_> = around.as_chunks::<2>().0.to_vec();
    let is_pair = |&[(from, behind), (to, before)]: &[(f64, User); 2]| {
        let turn = (to - from).rem_euclid(std::f64::consts::TAU);
        let is_wedge = (COINCIDENT..std::f64::consts::TAU - COINCIDENT).contains(&turn);
        is_wedge && !behind.is_forward && before.is_forward && is_unique::<I>(users, behind, before)
    };
    let is_apart = |window: &[(f64, User)]| {
        window[1].0 - window[0].0 > COINCIDENT || window[1].0 < window[0].0
    };
    if users.len().is_multiple_of(2) && pairs.iter().all(is_pair) && around.windows(2).all(is_apart)
    {
        pairs.into_iter().map(|[(_, one), (_, other)]| [one, other]).collect()
    } else {
        Vec::new()
    }
}

/// Whether a reader can tell the rows of both triangles from the others at the edge by their low 16 bits.
fn is_unique<I: Index>(users: &[User], one: User, other: User) -> bool {
    let is_found = |row: u32| {
        let alike = users.iter().filter(|user| user.row % (1 << 16) == row % (1 << 16));
        I::BYTES > 2 || alike.count() == 1
    };
    is_found(one.row) && is_found(other.row)
}

/// The directed edges of a triangle.
fn edges([a, b, c]: [u32; 3]) -> [(u32, u32); 3] {
    [(a, b), (b, c), (c, a)]
}
