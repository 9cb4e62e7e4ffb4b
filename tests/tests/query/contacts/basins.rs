//! The exhaustive list of contacts: every basin of the distance over the surface, in f64.

// Requirement: S-04

use std::collections::{HashMap, HashSet};

use dibs_tests::oracle::closest_pair;
use glam::{DVec3, Vec3};

/// How far contacts are looked for (mm).
pub const MARGIN: f32 = 6.0;

/// The library's least prominence of a contact at this distance, without its accuracy.
pub fn least_prominence(distance: f64) -> f64 {
    distance.min(f64::from(MARGIN)) / 128.0
}

/// Distance between two unit directions that certainly count as alike: the library's is 0.125, with its rounding.
pub const LIKE: f32 = 0.11;

/// A basin of the distance over the surface.
#[derive(Clone, Copy, Debug)]
pub struct Basin {
    pub distance: f64,
    /// Height of the lowest ridge to a lower basin, relative to this basin's minimum.
    pub prominence: f64,
    /// Product of the axis' direction with the normal of the lowest triangle.
    pub up: f64,
}

/// Every basin in f64, and the basin of every triangle. Ridges up to [`least_prominence`] do not separate basins.
pub fn basins(rows: &[Vec3], triangles: &[[u32; 3]], tool: [Vec3; 2]) -> (Vec<Basin>, Vec<usize>) {
    let mut across = HashMap::new();
    for (row, &[a, b, c]) in triangles.iter().enumerate() {
        for edge in [(a, b), (b, c), (c, a)] {
            across.insert(edge, row);
        }
    }
    let at = |row: usize| triangles[row].map(|v| rows[v as usize].as_dvec3());
    let [start, end] = tool.map(Vec3::as_dvec3);
    let pairs: Vec<_> = (0..triangles.len()).map(|row| closest_pair(start, end, at(row))).collect();
    let mut order: Vec<usize> = (0..triangles.len()).collect();
    order.sort_by(|&a, &b| pairs[a].distance.total_cmp(&pairs[b].distance));
    // The basin that each triangle belongs to: with all ridges, and without the low ones.
    let (mut all, mut one) = (vec![usize::MAX; order.len()], vec![usize::MAX; order.len()]);
    let bottom = |of: &[usize], mut row: usize| {
        while of[row] != row {
            row = of[row];
        }
        row
    };
    let mut prominences: HashMap<usize, f64> = HashMap::new();
    for &row in &order {
        let [a, b, c] = triangles[row];
        let known = [(b, a), (c, b), (a, c)].into_iter().filter_map(|edge| across.get(&edge));
        let known: Vec<usize> = known.copied().filter(|&other| all[other] != usize::MAX).collect();
        let mut bottoms: Vec<usize> = known.iter().map(|&other| bottom(&all, other)).collect();
        bottoms.sort_by(|&a, &b| pairs[a].distance.total_cmp(&pairs[b].distance));
        bottoms.dedup();
        (all[row], one[row]) = (row, row);
        let Some(&lowest) = bottoms.first() else { continue };
        all[row] = lowest;
        let near = known.iter().find(|&&other| bottom(&all, other) == lowest);
        one[row] = bottom(&one, *near.expect("it is known"));
        for &basin in &bottoms[1..] {
            let prominence = pairs[row].distance - pairs[basin].distance;
            prominences.insert(basin, prominence);
            all[basin] = lowest;
            if prominence <= least_prominence(pairs[basin].distance) {
                let into = bottom(&one, row);
                one[basin] = into;
            }
        }
    }
    let lowest: Vec<usize> = (0..triangles.len()).filter(|&row| one[row] == row).collect();
    let labels = (0..triangles.len())
        .map(|row| lowest.iter().position(|&l| l == bottom(&one, row)).expect("a basin"))
        .collect();
    let found = lowest.iter().map(|&row| {
        let [a, b, c] = at(row);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let towards = (pairs[row].on_axis - pairs[row].on_surface).normalize_or_zero();
        let prominence = prominences.get(&row).copied().unwrap_or(f64::INFINITY);
        Basin { distance: pairs[row].distance, prominence, up: normal.dot(towards) }
    });
    (found.collect(), labels)
}

/// Triangles with their neighbours, their distances, and the directions to the tool, in f64.
pub struct Surroundings {
    neighbours: Vec<[Option<usize>; 3]>,
    distances: Vec<f64>,
    /// Of each triangle's edges.
    edges: Vec<[f64; 3]>,
    directions: Vec<DVec3>,
}

impl Surroundings {
    pub fn of(rows: &[Vec3], triangles: &[[u32; 3]], tool: [Vec3; 2]) -> Self {
        let mut across = HashMap::new();
        for (row, &[a, b, c]) in triangles.iter().enumerate() {
            for edge in [(a, b), (b, c), (c, a)] {
                across.insert(edge, row);
            }
        }
        let neighbours = triangles
            .iter()
            .map(|&[a, b, c]| [(b, a), (c, b), (a, c)].map(|edge| across.get(&edge).copied()))
            .collect();
        let [start, end] = tool.map(Vec3::as_dvec3);
        let at = |&corners: &[u32; 3]| corners.map(|v| rows[v as usize].as_dvec3());
        let pairs = triangles.iter().map(|corners| closest_pair(start, end, at(corners)));
        let edges = triangles.iter().map(at).map(|[a, b, c]| {
            [[a, b, b], [b, c, c], [c, a, a]].map(|ends| closest_pair(start, end, ends).distance)
        });
        let edges = edges.collect();
        let (distances, directions) = pairs
            .map(|pair| (pair.distance, (pair.on_axis - pair.on_surface).normalize_or_zero()))
            .unzip();
        Self { neighbours, distances, edges, directions }
    }

    /// Whether a path connects two triangles without a ridge above the higher one, and without a triangle whose
    /// direction to the tool differs from both.
    pub fn connect(&self, [one, other]: [usize; 2]) -> bool {
        let most = self.distances[one].max(self.distances[other]);
        let top = most + least_prominence(most);
        let is_like = |row: usize| {
            let to = |end: usize| self.directions[row].distance(self.directions[end]);
            to(one) < f64::from(LIKE) && to(other) < f64::from(LIKE)
        };
        let (mut reached, mut next) = (HashSet::from([one]), vec![one]);
        while let Some(row) = next.pop() {
            for (at, over) in self.neighbours[row].into_iter().zip(self.edges[row]) {
                let Some(at) = at.filter(|_| over <= top) else { continue };
                if is_like(at) && reached.insert(at) {
                    next.push(at);
                }
            }
        }
        reached.contains(&other)
    }
}
