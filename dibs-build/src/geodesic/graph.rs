//! The graph whose shortest paths bound the distance along the surface from above.
//!
//! Its arcs are the mesh's edges and, for [`Paths::Surface`], *chords*: straight lines across a strip of triangles that
//! is unfolded into a plane. Both are paths on the surface, so no distance is under-estimated.
//!
//! If triangles have their own stretch limits, lengths are weighted by the ratio of each limit to the largest, so a
//! path grows to at most the largest limit times its weighted length. An edge stretches no more than any of its
//! triangles, so its weighted length is the least in any of them; a chord's is the sum over the triangles that it
//! crosses. Lengths are those of the triangles' [rest shapes](RestShape), which the stretch check measures too. No
//! chord crosses a flat triangle, whose rest shape does not fit those of its neighbours.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Topology;
use crate::Mesh;
use crate::rest::{LimitRatios, Paths, RestShape};
use crate::rounding::round_up;

/// Arcs from each vertex, in compressed rows. Lengths are weighted lengths at rest, rounded up.
#[derive(Debug)]
pub(crate) struct Graph {
    start: Vec<u32>,
    arcs: Vec<Arc>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Arc {
    pub to: u32,
    pub length: f32,
}

impl Graph {
    pub fn new(mesh: &Mesh, topology: &Topology, paths: Paths, ratios: &LimitRatios) -> Self {
        let is_flat =
            |&corners: &[u32; 3]| RestShape::new(mesh.corners(corners), paths.kind()).is_flat;
        let flat: Vec<bool> = mesh.triangles.par_iter().map(is_flat).collect();
        let flat = &flat;
        let rows: Vec<Vec<Arc>> = (0..mesh.positions.len() as u32)
            .into_par_iter()
            .map_init(Vec::new, |found, vertex| {
                found.clear();
                let crossed = Vec::new();
                Unfolding { mesh, topology, paths, ratios, flat, source: vertex, crossed, found }
                    .run();
                found.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
                found.dedup_by_key(|&mut (to, _)| to);
                found
                    .iter()
                    .map(|&(to, length)| Arc { to, length: round_up(length * (1.0 + UNFOLDING)) })
                    .collect()
            })
            .collect();
        let mut start = Vec::with_capacity(rows.len() + 1);
        let mut arcs = Vec::with_capacity(rows.iter().map(Vec::len).sum());
        start.push(0);
        for row in rows {
            arcs.extend(row);
            start.push(arcs.len() as u32);
        }
        Self { start, arcs }
    }

    pub fn vertices(&self) -> usize {
        self.start.len() - 1
    }

    pub fn arcs(&self, vertex: u32) -> &[Arc] {
        let v = vertex as usize;
        &self.arcs[self.start[v] as usize..self.start[v + 1] as usize]
    }
}

/// Allowance for the f64 rounding of a strip's unfolding, relative to the length.
const UNFOLDING: f64 = 1e-12;

/// Sine of the angle between a chord and an edge below which their crossing point is uncertain.
const GRAZING: f64 = 1e-5;

/// Otherwise the allowance for the rounding of the crossing point, relative to the chord: some 10 units of 2^-53, over
/// [`GRAZING`].
const CROSSING: f64 = 1e-9;

/// The search for all vertices that are visible from one vertex across a strip of unfolded triangles.
struct Unfolding<'a> {
    mesh: &'a Mesh,
    topology: &'a Topology,
    paths: Paths,
    ratios: &'a LimitRatios,
    /// Whether each triangle is flat, so that its rest shape does not fit those of its neighbours.
    flat: &'a [bool],
    source: u32,
    /// The edges from the source to the last unfolded triangle, each with the limit ratio of the triangle before it.
    crossed: Vec<([DVec2; 2], f64)>,
    found: &'a mut Vec<(u32, f64)>,
}

/// An unfolded edge and the interval of it that is visible from the source: the directions from `low` to `high`.
struct Window {
    edge: [(u32, DVec2); 2],
    low: DVec2,
    high: DVec2,
    triangle: u32,
    crossings: u32,
}

impl Unfolding<'_> {
    fn run(&mut self) {
        let topology = self.topology;
        for &triangle in topology.triangles_at(self.source) {
            let [a, b] = topology.others(self.mesh, triangle, self.source);
            let ratio = self.ratios.ratio(triangle);
            let corners = self.mesh.corners([self.source, a, b]);
            let shape = RestShape::new(corners, self.paths.kind());
            let [source, at_a, at_b] = shape.corners;
            let (to_a, to_b) = (at_a - source, at_b - source);
            self.found.extend([(a, to_a.length() * ratio), (b, to_b.length() * ratio)]);
            let Paths::Surface { crossings } = self.paths else { continue };
            if shape.is_flat {
                continue;
            }
            let axis = to_a.normalize();
            let across = to_a.cross(to_b).length() / to_a.length();
            let (at_a, at_b) = (DVec2::new(to_a.length(), 0.0), DVec2::new(to_b.dot(axis), across));
            let edge = [(a, at_a), (b, at_b)];
            self.cross(&Window { edge, low: at_a, high: at_b, triangle, crossings });
        }
    }

    /// The weighted length of the chord to `end`, a corner of `last`.
    fn chord(&self, end: DVec2, last: u32) -> f64 {
        let length = end.length();
        if self.ratios.is_uniform() {
            return length;
        }
        let last = self.ratios.ratio(last);
        let mut ratio = last;
        // From the end to the source, as fractions of the chord.
        let (mut weighted, mut from) = (0.0, 1.0);
        for &([a, b], before) in self.crossed.iter().rev() {
            let across = end.perp_dot(b - a);
            if across.abs() <= GRAZING * length * (b - a).length() {
                // The crossing point is uncertain: weight the whole chord with the largest ratio.
                return length * self.crossed.iter().map(|&(_, ratio)| ratio).fold(last, f64::max);
            }
            let at = (a.perp_dot(b - a) / across).clamp(0.0, from);
            weighted += ratio * (from - at);
            (ratio, from) = (before, at);
        }
        length * (weighted + ratio * from + CROSSING)
    }

    fn edge(&self, from: u32, to: u32) -> DVec3 {
        let at = |v: u32| self.mesh.positions[v as usize].as_dvec3();
        at(to) - at(from)
    }

    /// Unfolds the triangles beyond a window's edge into the source's plane.
    fn cross(&mut self, window: &Window) {
        if window.crossings == 0 {
            return;
        }
        let [(a, at_a), (b, at_b)] = window.edge;
        let topology = self.topology;
        self.crossed.push(([at_a, at_b], self.ratios.ratio(window.triangle)));
        let next = topology.across(self.mesh, window.triangle, a, b);
        if let Some(next) = next.filter(|&next| !self.flat[next as usize]) {
            let apex = topology.apex(self.mesh, next, a, b);
            let (along, to_apex) = (self.edge(a, b), self.edge(a, apex));
            let length = along.length();
            let (x, y) = (to_apex.dot(along) / length, to_apex.cross(along).length() / length);
            let axis = (at_b - at_a) / (at_b - at_a).length();
            // Seen from outside, the source lies to the left of a -> b, so the apex lies to the right.
            let at_apex = at_a + axis * x - axis.perp() * y;
            let (after_low, before_high) =
                (window.low.perp_dot(at_apex), at_apex.perp_dot(window.high));
            if after_low >= 0.0 && before_high >= 0.0 {
                self.found.push((apex, self.chord(at_apex, next)));
            }
            let crossings = window.crossings - 1;
            if after_low > 0.0 {
                let high = if before_high > 0.0 { at_apex } else { window.high };
                let edge = [(a, at_a), (apex, at_apex)];
                self.cross(&Window { edge, low: window.low, high, triangle: next, crossings });
            }
            if before_high > 0.0 {
                let low = if after_low > 0.0 { at_apex } else { window.low };
                let edge = [(apex, at_apex), (b, at_b)];
                self.cross(&Window { edge, low, high: window.high, triangle: next, crossings });
            }
        }
        self.crossed.pop();
    }
}
