//! The triangles across each triangle's edges, in the order of the tree's rows.

use std::collections::HashMap;

use dibs_nostd::Index;
use dibs_nostd::format::no_neighbour;

use super::flatten::put;
use crate::Mesh;
use crate::leaf::StoredTriangle;

/// Angles closer than this, in radians, have no order.
const COINCIDENT: f64 = 1e-9;

/// A triangle at an edge.
#[derive(Clone, Copy)]
struct User {
    row: u32,
    /// Number of the edge in it.
    edge: usize,
    /// It runs along the edge from the lower vertex to the higher.
    is_forward: bool,
}

/// The adjacency section; `None` for a surface without sides: two triangles run along their common edge in the same
/// direction.
///
/// More than two triangles at an edge are pairs, each around a wedge of the solid at rest, as where two solids touch.
/// Where they are not, the surface is cut there.
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

/// The pairs of triangles around an edge between which the solid lies; none if they do not face each other in turn.
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
    // The solid is before a forward triangle, in the sense of rotation around the edge.
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

/// Whether a reader finds each of two triangles across the edge of the other, by the lower bits of their rows.
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
