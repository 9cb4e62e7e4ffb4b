//! Shortest paths from one vertex: Dijkstra's algorithm, stopped once a section is reached.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::Graph;

/// Distances of one search, kept until the next one with the same memory.
#[derive(Debug)]
pub(crate) struct Distances {
    /// For each vertex its distance, and the run that it is from.
    rows: Vec<(f64, u32)>,
    run: u32,
    /// Distance and vertex in one number, so that one comparison orders them.
    heap: BinaryHeap<Reverse<u128>>,
    /// Vertices in the order in which they were settled.
    settled: Vec<u32>,
}

impl Distances {
    pub fn new(vertices: usize) -> Self {
        Self {
            rows: vec![(f64::INFINITY, 0); vertices],
            run: 0,
            heap: BinaryHeap::new(),
            settled: Vec::new(),
        }
    }

    /// Distance of a vertex from the source, infinite if the search did not reach it.
    pub fn get(&self, vertex: u32) -> f64 {
        match self.rows[vertex as usize] {
            (distance, run) if run == self.run => distance,
            _ => f64::INFINITY,
        }
    }

    /// The vertices whose distances are final, nearest first.
    pub fn settled(&self) -> &[u32] {
        &self.settled
    }

    /// Searches from `source` until `wanted` vertices that satisfy `is_wanted` are settled, or all reachable ones;
    /// `allowed` limits the vertices on paths.
    ///
    /// Returns the farthest of the wanted vertices, and its distance.
    pub fn search(
        &mut self,
        graph: &Graph,
        source: u32,
        wanted: usize,
        is_wanted: impl Fn(u32) -> bool,
        allowed: impl Fn(u32) -> bool,
    ) -> Farthest {
        self.run = self.run.wrapping_add(1);
        if self.run == 0 {
            self.rows.fill((f64::INFINITY, 0));
            self.run = 1;
        }
        self.heap.clear();
        self.settled.clear();
        let mut farthest = Farthest { vertex: source, distance: 0.0, reached: 0 };
        self.rows[source as usize] = (0.0, self.run);
        self.heap.push(key(0.0, source));
        while let Some(Reverse(key)) = self.heap.pop() {
            let (distance, vertex) = (f64::from_bits((key >> 32) as u64), key as u32);
            if distance > self.rows[vertex as usize].0 {
                continue;
            }
            self.settled.push(vertex);
            if is_wanted(vertex) {
                farthest = Farthest { vertex, distance, reached: farthest.reached + 1 };
                if farthest.reached == wanted {
                    break;
                }
            }
            for arc in graph.arcs(vertex) {
                let through = distance + f64::from(arc.length);
                let row = &mut self.rows[arc.to as usize];
                if (row.1 != self.run || through < row.0) && allowed(arc.to) {
                    *row = (through, self.run);
                    self.heap.push(self::key(through, arc.to));
                }
            }
        }
        farthest
    }
}

/// Orders by distance, then by vertex: distances are not negative, so their bits sort as they do.
fn key(distance: f64, vertex: u32) -> Reverse<u128> {
    Reverse(u128::from(distance.to_bits()) << 32 | u128::from(vertex))
}

/// The last vertex of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Farthest {
    pub vertex: u32,
    pub distance: f64,
    /// Wanted vertices that were reached.
    pub reached: usize,
}
