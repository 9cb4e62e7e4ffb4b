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
    /// Arcs looked at by searches and not yet taken: the work done.
    arcs_seen: usize,
}

/// A vertex has many arcs if it has so many times those that could be wanted: a look-up takes about as long as so many.
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

    /// Arcs that the searches with this memory looked at since the last call.
    pub fn take_arcs_seen(&mut self) -> usize {
        std::mem::take(&mut self.arcs_seen)
    }

    /// The vertices whose distances are final, nearest first.
    pub fn settled(&self) -> &[u32] {
        &self.settled
    }

    /// Searches from `source` until `wanted` vertices that satisfy `is_wanted` are settled, or all reachable ones;
    /// `allowed` limits the vertices on paths; `only`, if given, lists the allowed ones in ascending order. The search ends
    /// after `most` arcs.
    ///
    /// Cost: at a vertex of many arcs the vertices of `only` are looked up among them, so the arcs that leave a section take
    /// no time.
    ///
    /// Returns the farthest of the wanted vertices, and its distance.
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
