//! The triangles at each vertex and across each edge. Non-manifold edges are allowed.

use crate::Mesh;

/// Triangles around each vertex, in compressed rows.
#[derive(Debug)]
pub(crate) struct Topology {
    start: Vec<u32>,
    around: Vec<u32>,
    /// For each corner of each triangle, the triangle across the opposite edge.
    opposite: Vec<[u32; 3]>,
}

impl Topology {
    pub fn new(mesh: &Mesh) -> Self {
        let mut start = vec![0u32; mesh.positions.len() + 1];
        for &corner in mesh.triangles.iter().flatten() {
            start[corner as usize + 1] += 1;
        }
        for v in 0..mesh.positions.len() {
            start[v + 1] += start[v];
        }
        let mut next = start.clone();
        let mut around = vec![0; mesh.triangles.len() * 3];
        for (triangle, corners) in mesh.triangles.iter().enumerate() {
            for &corner in corners {
                around[next[corner as usize] as usize] = triangle as u32;
                next[corner as usize] += 1;
            }
        }
        Self { start, around, opposite: opposite(mesh) }
    }

    /// Triangles that use a vertex.
    pub fn triangles_at(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.around[self.start[v] as usize..self.start[v + 1] as usize]
    }

    /// The two corners of a triangle other than `vertex`, in the triangle's order.
    pub fn others(&self, mesh: &Mesh, triangle: u32, vertex: u32) -> [u32; 2] {
        let [a, b, c] = mesh.triangles[triangle as usize];
        if a == vertex {
            [b, c]
        } else if b == vertex {
            [c, a]
        } else {
            [a, b]
        }
    }

    /// The corner of a triangle other than `a` and `b`.
    pub fn apex(&self, mesh: &Mesh, triangle: u32, a: u32, b: u32) -> u32 {
        let corners = mesh.triangles[triangle as usize];
        corners.into_iter().find(|&v| v != a && v != b).unwrap_or(corners[0])
    }

    /// The triangle across an edge of exactly two triangles; `None` at a border, and at an edge of more triangles. No
    /// chord crosses such an edge, since `n` triangles there would have `n^2` chords.
    pub fn across(&self, mesh: &Mesh, triangle: u32, a: u32, b: u32) -> Option<u32> {
        let corners = mesh.triangles[triangle as usize];
        let edge = corners.into_iter().position(|v| v != a && v != b)?;
        let other = self.opposite[triangle as usize][edge];
        (other != NONE).then_some(other)
    }
}

/// Stands for no triangle.
const NONE: u32 = u32::MAX;

/// For each corner of each triangle, the other triangle at the opposite edge if there is exactly one.
fn opposite(mesh: &Mesh) -> Vec<[u32; 3]> {
    let ends = |[a, b, c]: [u32; 3]| [(b, c), (c, a), (a, b)];
    let mut edges: Vec<((u32, u32), u32, u8)> = Vec::with_capacity(3 * mesh.triangles.len());
    for (triangle, &corners) in (0..).zip(&mesh.triangles) {
        for (corner, (from, to)) in (0..).zip(ends(corners)) {
            edges.push(((from.min(to), from.max(to)), triangle, corner));
        }
    }
    edges.sort_unstable();
    let mut opposite = vec![[NONE; 3]; mesh.triangles.len()];
    for users in edges.chunk_by(|one, other| one.0 == other.0) {
        if let &[(_, one, at), (_, other, there)] = users {
            opposite[one as usize][usize::from(at)] = other;
            opposite[other as usize][usize::from(there)] = one;
        }
    }
    opposite
}
