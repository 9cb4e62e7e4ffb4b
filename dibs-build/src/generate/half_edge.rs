//! A closed triangle mesh that can be edited: half-edges, three in a row for each triangle.

use glam::DVec3;

const DEAD: u32 = u32::MAX;

/// Half-edge `h` belongs to triangle `h / 3` and runs from `origin[h]` to the origin of the next one.
pub(super) struct HalfEdges {
    pub points: Vec<DVec3>,
    /// Unit outward normals of the surface at the points.
    pub normals: Vec<DVec3>,
    origin: Vec<u32>,
    twin: Vec<u32>,
    /// For each vertex one half-edge that leaves it; `DEAD` for a removed vertex.
    leaving: Vec<u32>,
    alive: usize,
}

fn next(h: u32) -> u32 {
    if h % 3 == 2 { h - 2 } else { h + 1 }
}

fn previous(h: u32) -> u32 {
    if h.is_multiple_of(3) { h + 2 } else { h - 1 }
}

impl HalfEdges {
    /// Links up a closed, manifold and consistently oriented mesh.
    pub fn new(points: Vec<DVec3>, triangles: &[[u32; 3]]) -> Self {
        let origin = triangles.as_flattened().to_vec();
        let mut leaving = vec![DEAD; points.len()];
        let mut edges = Vec::with_capacity(origin.len());
        for (h, &from) in (0u32..).zip(&origin) {
            let to = origin[next(h) as usize];
            leaving[from as usize] = h;
            edges.push((from.min(to), from.max(to), h));
        }
        edges.sort_unstable();
        let mut twin = vec![DEAD; origin.len()];
        for pair in edges.chunks_exact(2) {
            twin[pair[0].2 as usize] = pair[1].2;
            twin[pair[1].2 as usize] = pair[0].2;
        }
        let normals = vec![DVec3::ZERO; points.len()];
        Self { points, normals, origin, twin, leaving, alive: triangles.len() }
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.alive
    }

    /// One more than the largest half-edge's number, removed ones included.
    pub fn edge_count_bound(&self) -> u32 {
        self.origin.len() as u32
    }

    /// Whether `h` represents its edge: of two twins only one does.
    pub fn stands_for_edge(&self, h: u32) -> bool {
        self.origin[h as usize] != DEAD && h < self.twin[h as usize]
    }

    /// The vertices of all triangles that are not removed.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.origin.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).filter(|t| t[0] != DEAD)
    }

    /// The two ends of `h`.
    pub fn ends(&self, h: u32) -> [u32; 2] {
        [self.origin[h as usize], self.origin[next(h) as usize]]
    }

    /// The vertices that face the edge of `h`: in its own triangle and in its twin's.
    pub fn facing(&self, h: u32) -> [u32; 2] {
        [h, self.twin[h as usize]].map(|side| self.origin[previous(side) as usize])
    }

    /// Length of the edge.
    pub fn length(&self, h: u32) -> f64 {
        let [a, b] = self.ends(h);
        self.points[a as usize].distance(self.points[b as usize])
    }

    /// Whether the vertex is not removed.
    pub fn is_alive(&self, vertex: u32) -> bool {
        self.leaving[vertex as usize] != DEAD
    }

    /// The half-edges that leave `vertex`, in order around it.
    pub fn around(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        let first = self.leaving[vertex as usize];
        let mut current = Some(first).filter(|&h| h != DEAD);
        std::iter::from_fn(move || {
            let h = current?;
            let onward = self.twin[previous(h) as usize];
            current = (onward != first).then_some(onward);
            Some(h)
        })
    }

    /// The triangles around `vertex`, each starting with it.
    pub fn fan(&self, vertex: u32) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.around(vertex)
            .map(|h| [h, next(h), previous(h)].map(|corner| self.origin[corner as usize]))
    }

    fn neighbours(&self, vertex: u32) -> impl Iterator<Item = u32> + '_ {
        self.around(vertex).map(|h| self.ends(h)[1])
    }

    fn degree(&self, vertex: u32) -> usize {
        self.around(vertex).count()
    }

    fn pair(&mut self, a: u32, b: u32) {
        self.twin[a as usize] = b;
        self.twin[b as usize] = a;
    }

    /// Whether turning the edge leaves a manifold mesh.
    pub fn can_flip(&self, h: u32) -> bool {
        let ([a, b], [c, d]) = (self.ends(h), self.facing(h));
        c != d
            && self.degree(a) > 3
            && self.degree(b) > 3
            && self.neighbours(c).all(|vertex| vertex != d)
    }

    /// Turns the edge from `a-b` to `d-c`, where `c` and `d` face it.
    pub fn flip(&mut self, h: u32) {
        let t = self.twin[h as usize];
        let ([a, b], [c, d]) = (self.ends(h), self.facing(h));
        let (n, p, tn, tp) = (next(h), previous(h), next(t), previous(t));
        let [bc, ca, ad, db] = [n, p, tn, tp].map(|side| self.twin[side as usize]);
        for (side, from) in [(h, d), (n, c), (p, a), (t, c), (tn, d), (tp, b)] {
            self.origin[side as usize] = from;
            self.leaving[from as usize] = side;
        }
        self.pair(n, ca);
        self.pair(p, ad);
        self.pair(tn, db);
        self.pair(tp, bc);
    }

    /// Cuts the edge and its two triangles in two, at a new vertex.
    pub fn split(&mut self, h: u32, point: DVec3, normal: DVec3) {
        let t = self.twin[h as usize];
        let ([_, b], [c, d]) = (self.ends(h), self.facing(h));
        let (n, tp) = (next(h), previous(t));
        let [bc, db] = [n, tp].map(|side| self.twin[side as usize]);
        let middle = self.points.len() as u32;
        self.points.push(point);
        self.normals.push(normal);
        let x = self.origin.len() as u32;
        let y = x + 3;
        self.origin.extend([middle, b, c, b, middle, d]);
        self.twin.extend([DEAD; 6]);
        self.origin[n as usize] = middle;
        self.origin[t as usize] = middle;
        self.leaving.push(n);
        self.leaving[b as usize] = x + 1;
        self.pair(x, y);
        self.pair(n, x + 2);
        self.pair(x + 1, bc);
        self.pair(tp, y + 1);
        self.pair(y + 2, db);
        self.alive += 2;
    }

    /// Whether merging the edge's ends leaves a manifold mesh.
    pub fn can_collapse(&self, h: u32) -> bool {
        let ([a, b], [c, d]) = (self.ends(h), self.facing(h));
        let shared = self.neighbours(a).filter(|&v| self.neighbours(b).any(|w| w == v)).count();
        shared == 2 && self.degree(c) > 3 && self.degree(d) > 3
    }

    /// Merges the start of `h` into its end, moved to `point`; two triangles are removed.
    pub fn collapse(&mut self, h: u32, point: DVec3, normal: DVec3) {
        let t = self.twin[h as usize];
        let ([a, b], [c, d]) = (self.ends(h), self.facing(h));
        let leaving: Vec<u32> = self.around(a).collect();
        for side in leaving {
            self.origin[side as usize] = b;
        }
        let [cb, ac, da, bd] =
            [next(h), previous(h), next(t), previous(t)].map(|side| self.twin[side as usize]);
        self.pair(cb, ac);
        self.pair(da, bd);
        self.leaving[a as usize] = DEAD;
        self.leaving[b as usize] = ac;
        self.leaving[c as usize] = cb;
        self.leaving[d as usize] = da;
        for side in [h, next(h), previous(h), t, next(t), previous(t)] {
            self.origin[side as usize] = DEAD;
        }
        self.points[b as usize] = point;
        self.normals[b as usize] = normal;
        self.alive -= 2;
    }

    /// Points and triangles, renumbered without the removed ones.
    pub fn into_parts(self) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let mut renumbered = vec![DEAD; self.points.len()];
        let mut points = Vec::new();
        for (vertex, &point) in self.points.iter().enumerate() {
            if self.leaving[vertex] != DEAD {
                renumbered[vertex] = points.len() as u32;
                points.push(point);
            }
        }
        let triangles = self.triangles().map(|t| t.map(|v| renumbered[v as usize])).collect();
        (points, triangles)
    }
}
