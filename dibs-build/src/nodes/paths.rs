//! Lengths of paths through a volume: no vertex is farther from a pin than the largest stretch times the length at
//! rest.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use glam::DVec3;

use super::binding::{Cell, Embedding};

/// The distances between vertices: straight where the line stays in the volume, otherwise along its edges.
///
/// Both are upper bounds on the shortest path: each part of a path lies in one tetrahedron. Where tetrahedra have their
/// own limits, a length is weighted by the ratio of the tetrahedron's limit to the tree's.
pub(crate) struct VolumePaths<'e> {
    embedding: &'e Embedding,
    /// The vertices at rest.
    positions: Vec<DVec3>,
    cells: Vec<Cell>,
    /// For each corner the tetrahedron across the opposite face.
    across: Vec<[Option<u32>; 4]>,
    /// The nodes at the other ends of each node's edges, and the edges' lengths.
    neighbours: Vec<Vec<(u32, f64)>>,
}

/// Much more than the rounding of a length in f64.
const ROUNDED_UP: f64 = 1.0 + 1e-9;

/// More than the rounding of a point's position on a line, and far less than a significant length.
const ASTRAY: f64 = 1e-12;

/// Most tetrahedra that a straight line may cross: rounding may make a line along a face turn back.
const MOST_CROSSED: usize = 256;

impl<'e> VolumePaths<'e> {
    pub fn new(embedding: &'e Embedding) -> Self {
        let (nodes, tetrahedra) = (&embedding.nodes, &embedding.tetrahedra);
        let positions = embedding.positions().collect();
        if embedding.is_box && embedding.is_uniform() {
            let (cells, across, neighbours) = Default::default();
            return Self { embedding, positions, cells, across, neighbours };
        }
        let mut neighbours = vec![Vec::new(); nodes.len()];
        for (tetrahedron, corners) in (0..).zip(tetrahedra) {
            for &node in corners {
                let others = corners.iter().filter(|&&other| other != node);
                neighbours[node as usize].extend(others.map(|&other| {
                    let [a, b] = [node, other].map(|node| nodes[node as usize].as_dvec3());
                    (other, a.distance(b) * embedding.ratio(tetrahedron))
                }));
            }
        }
        // Of an edge in several tetrahedra the shortest weighted length counts.
        for neighbours in &mut neighbours {
            neighbours.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
            neighbours.dedup_by_key(|(node, _)| *node);
        }
        let cells = tetrahedra.iter().map(|&corners| Cell::new(nodes, corners)).collect();
        Self { embedding, positions, cells, across: across(tetrahedra), neighbours }
    }

    /// Whether every straight line is a path through the volume.
    pub const fn is_straight_everywhere(&self) -> bool {
        self.embedding.is_box
    }

    /// Position of a vertex at rest.
    pub fn position(&self, vertex: u32) -> DVec3 {
        self.positions[vertex as usize]
    }

    /// The distance of each of these vertices from another vertex.
    pub fn distances(&self, from: u32, to: &[u32]) -> Vec<f64> {
        let start = self.position(from);
        let straight = |&vertex: &u32| {
            let length = self.position(vertex).distance(start) * ROUNDED_UP;
            match self.embedding.is_box {
                true if self.embedding.is_uniform() => length,
                // A ratio of 1 is safe: no limit is larger than the tree's.
                true => length * self.straight(from, vertex).unwrap_or(1.0),
                false => self.straight(from, vertex).map_or(f64::NAN, |part| length * part),
            }
        };
        let mut distances: Vec<f64> = to.iter().map(straight).collect();
        let around = to.iter().zip(&distances).filter(|(_, distance)| distance.is_nan());
        let mut wanted: Vec<u32> = around.flat_map(|(&vertex, _)| self.corners(vertex)).collect();
        wanted.sort_unstable();
        wanted.dedup();
        if wanted.is_empty() {
            return distances;
        }
        let own = self.ratio(from);
        let starts = self.corners(from).map(|node| (node, self.node(node).distance(start) * own));
        let along = self.along_edges(&starts, &wanted);
        for (&vertex, distance) in to.iter().zip(&mut distances) {
            if distance.is_nan() {
                let (end, own) = (self.position(vertex), self.ratio(vertex));
                let to_end = |node| self.node(node).distance(end) * own;
                let ways = self.corners(vertex).map(|node| along[&node] + to_end(node));
                *distance = ways.into_iter().fold(f64::INFINITY, f64::min) * ROUNDED_UP;
            }
        }
        distances
    }

    /// The length of the longest shortest path from a node of a tetrahedron to another node.
    pub fn extent(&self, from: u32) -> f64 {
        let nodes = &self.embedding.nodes;
        let first = self.node(from);
        if self.embedding.is_box {
            return nodes.iter().map(|node| node.as_dvec3().distance(first)).fold(0.0, f64::max)
                * ROUNDED_UP;
        }
        // Only nodes of tetrahedra; others move nothing.
        let used = (0..).zip(&self.neighbours).filter(|(_, at)| !at.is_empty());
        let used: Vec<u32> = used.map(|(node, _)| node).collect();
        let along = self.along_edges(&[(from, 0.0)], &used);
        along.values().copied().fold(0.0, f64::max) * ROUNDED_UP
    }

    fn corners(&self, vertex: u32) -> [u32; 4] {
        let bound = &self.embedding.vertices[vertex as usize];
        self.embedding.tetrahedra[bound.tetrahedron as usize]
    }

    /// The ratio of the limit at a vertex to the tree's.
    fn ratio(&self, vertex: u32) -> f64 {
        self.embedding.ratio(self.embedding.vertices[vertex as usize].tetrahedron)
    }

    fn node(&self, node: u32) -> DVec3 {
        self.embedding.nodes[node as usize].as_dvec3()
    }

    /// The mean limit ratio along the straight line between two vertices; `None` unless the line is known to stay in
    /// the volume. From a vertex outside, the line first leads to the vertex's tetrahedron and counts as part of it.
    fn straight(&self, from: u32, to: u32) -> Option<f64> {
        let [a, b] = [from, to].map(|vertex| self.position(vertex));
        let [from, to] = [from, to].map(|vertex| &self.embedding.vertices[vertex as usize]);
        let [start, end] = [from, to].map(|bound| bound.tetrahedron);
        let (mut at, mut before, mut sum, mut counted) = (start, None, 0.0, 0.0);
        // The position on the line (0 to 1) where it enters the tetrahedron.
        let mut passed = if from.is_outside() { self.entry(start, a, b) } else { 0.0 };
        for _ in 0..MOST_CROSSED {
            let ratio = self.embedding.ratio(at);
            if at == end {
                return Some(sum + ratio * (1.0 - counted));
            }
            let cell = &self.cells[at as usize];
            let (here, there) = (cell.weights(a), cell.weights(b));
            // The first face through which the line leaves.
            let leaves = (0..4).filter(|&corner| {
                there[corner] < 0.0 && self.across[at as usize][corner] != before.or(Some(u32::MAX))
            });
            let part = |corner: usize| here[corner] / (here[corner] - there[corner]);
            let Some(out) = leaves.min_by(|&i, &j| part(i).total_cmp(&part(j))) else {
                // The end is in this tetrahedron as well.
                let is_in = !to.is_outside() && there.iter().all(|&weight| weight >= 0.0);
                return is_in.then_some(sum + ratio * (1.0 - counted));
            };
            // Rounding may let a line through an edge or a corner leave its tetrahedra.
            let is_ahead = part(out) >= passed - ASTRAY && here[out] >= -ASTRAY;
            let next = self.across[at as usize][out].filter(|_| is_ahead)?;
            sum += ratio * (part(out) - counted);
            (at, before, passed, counted) = (next, Some(at), part(out), part(out));
        }
        None
    }

    /// The position on a line from outside where it has crossed the planes of all faces that it starts beyond.
    fn entry(&self, tetrahedron: u32, from: DVec3, to: DVec3) -> f64 {
        let cell = &self.cells[tetrahedron as usize];
        let ends = cell.weights(from).into_iter().zip(cell.weights(to));
        let outer = ends.filter(|(here, _)| *here < 0.0);
        outer
            .map(|(here, there)| if there > 0.0 { here / (here - there) } else { f64::INFINITY })
            .fold(0.0, f64::max)
    }

    /// Dijkstra's distances of nodes along the volume's edges, until all `wanted` ones are known.
    fn along_edges(&self, starts: &[(u32, f64)], wanted: &[u32]) -> HashMap<u32, f64> {
        let mut found: HashMap<u32, f64> =
            wanted.iter().map(|&node| (node, f64::INFINITY)).collect();
        let mut left = wanted.len();
        let mut known: HashMap<u32, f64> = HashMap::new();
        // The bits of lengths, which are not negative, are ordered as the lengths.
        let mut heap: BinaryHeap<Reverse<(u64, u32)>> =
            starts.iter().map(|&(node, length)| Reverse((length.to_bits(), node))).collect();
        while let Some(Reverse((bits, node))) = heap.pop() {
            if known.contains_key(&node) {
                continue;
            }
            let length = f64::from_bits(bits);
            known.insert(node, length);
            if let Some(found) = found.get_mut(&node) {
                *found = length;
                left -= 1;
                if left == 0 {
                    break;
                }
            }
            for &(next, edge) in &self.neighbours[node as usize] {
                if !known.contains_key(&next) {
                    let length = length + edge;
                    heap.push(Reverse((length.to_bits(), next)));
                }
            }
        }
        found
    }
}

/// For each tetrahedron and corner, the tetrahedron across the opposite face.
fn across(tetrahedra: &[[u32; 4]]) -> Vec<[Option<u32>; 4]> {
    let mut sides: HashMap<[u32; 3], (u32, usize)> = HashMap::new();
    let mut across = vec![[None; 4]; tetrahedra.len()];
    for (number, corners) in (0..).zip(tetrahedra) {
        for lacking in 0..4 {
            let mut face = [0, 1, 2].map(|at| corners[(lacking + 1 + at) % 4]);
            face.sort_unstable();
            if let Some((other, corner)) = sides.insert(face, (number, lacking)) {
                across[number as usize][lacking] = Some(other);
                across[other as usize][corner] = Some(number);
            }
        }
    }
    across
}
