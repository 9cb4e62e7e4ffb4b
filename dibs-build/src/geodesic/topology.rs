//! The triangles at each vertex and across each edge. Non-manifold edges are allowed.

use crate::Mesh;

/// Triangles around each vertex, in compressed rows.
#[derive(Debug)]
pub(crate) struct Topology {
    start: Vec<u32>,
    around: Vec<u32>,
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
        Self { start, around }
    }

    /// Triangles that use a vertex.
    pub fn triangles_at(&self, vertex: u32) -> &[u32] {
        let v = vertex as usize;
        &self.around[self.start[v] as usize..self.start[v + 1] as usize]
    }

    /// The two corners of a triangle besides `vertex`, in the triangle's order.
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

    /// The corner of a triangle besides `a` and `b`.
    pub fn apex(&self, mesh: &Mesh, triangle: u32, a: u32, b: u32) -> u32 {
        let corners = mesh.triangles[triangle as usize];
        corners.into_iter().find(|&v| v != a && v != b).unwrap_or(corners[0])
    }

    /// The other triangles that share the edge `a`-`b` with a triangle.
    pub fn across<'a>(
        &'a self,
        mesh: &'a Mesh,
        triangle: u32,
        a: u32,
        b: u32,
    ) -> impl Iterator<Item = u32> + 'a {
        let shares = move |&t: &u32| t != triangle && mesh.triangles[t as usize].contains(&b);
        self.triangles_at(a).iter().copied().filter(shares)
    }
}
