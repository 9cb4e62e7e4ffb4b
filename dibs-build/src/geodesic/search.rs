//! Shortest paths from one vertex: Dijkstra's algorithm, stopped once all vertices of a section are reached.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::Graph;

/// Distances of one search, kept until the next one with the same memory.
#[derive(Debug)]
pub(crate) struct Distances {
    /// For each vertex its distance, and the number of the search that found it.
    rows: Vec<(f64, u32)>,
    run: u32,
    /// Distance and vertex packed in one number, so that one comparison orders both.
    heap: BinaryHeap<Reverse<u128>>,
    /// Vertices in the order in which their distances became final.
    settled: Vec<u32>,
    /// Arcs looked at since the last call of `take_arcs_seen`: the work done.
    arcs_seen: usize,
}

/// A vertex with this many times more arcs than allowed vertices is a hub: looking up each vertex among its arcs is
/// then faster than trying every arc.
const HUB: usize = 8;

impl Distances {
    pub fn new(vertices: usize) -> Self {
        Self {
            rows: vec![(f64::INFINITY, 0); vertices],
            run: 0,
            heap: BinaryHeap::new(),
            settled: Vec::new(),
            arcs_seen: 0,
        }
    }

    /// Distance of a vertex from the source, infinite if the search did not reach it.
    pub fn get(&self, vertex: u32) -> f64 {
        match self.rows[vertex as usize] {
            (distance, run) if run == self.run => distance,
            _ => f64::INFINITY,
        }
    }

    /// Arcs that searches with this memory looked at since the last call.
    pub fn take_arcs_seen(&mut self) -> usize {
        std::mem::take(&mut self.arcs_seen)
    }

    /// The vertices whose distances are final, nearest first.
    pub fn settled(&self) -> &[u32] {
        &self.settled
    }

    /// Searches from `source` until `wanted` vertices that satisfy `is_wanted` are final, or all reachable ones. Paths
    /// use only vertices that are `allowed`; `only`, if given, lists these in ascending order. The search ends after
    /// `most` arcs.
    ///
    /// Cost: at a hub the vertices of `only` are looked up among its arcs, so arcs that leave a section take no time.
    ///
    /// Returns the wanted vertex with the largest distance.
    #[allow(clippy::too_many_arguments)]
    pub fn search(
        &mut self,
        graph: &Graph,
        source: u32,
        wanted: usize,
        is_wanted: impl Fn(u32) -> bool,
        allowed: impl Fn(u32) -> bool,
        only: Option<&[u32]>,
        mut most: usize,
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
            let arcs = graph.arcs(vertex);
            let only = only.filter(|only| arcs.len() > HUB * only.len());
            let work = only.map_or(arcs.len(), |only| HUB * only.len());
            let Some(left) = most.checked_sub(work) else { break };
            most = left;
            self.arcs_seen += work;
            let inside = only.into_iter().flatten().filter_map(|&to| {
                let at = arcs.binary_search_by_key(&to, |arc| arc.to).ok()?;
                arcs.get(at)
            });
            let all = if only.is_some() { [].iter() } else { arcs.iter() };
            for arc in all.chain(inside) {
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

/// Key that orders by distance, then by vertex: the bits of numbers that are not negative are ordered as the numbers.
fn key(distance: f64, vertex: u32) -> Reverse<u128> {
    Reverse(u128::from(distance.to_bits()) << 32 | u128::from(vertex))
}

/// The last wanted vertex of a search.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Farthest {
    pub vertex: u32,
    pub distance: f64,
    /// Wanted vertices that were reached.
    pub reached: usize,
}
