//! Isotropic remeshing to an exact number of triangles: split long edges, collapse short ones, flip for the best
//! smallest angle, relax along the surface (Botsch and Kobbelt, "A remeshing approach to multiresolution modeling",
//! 2004). Each split adds two triangles and each collapse removes two, so every even count can be reached.

use glam::DVec3;

use super::half_edge::HalfEdges;

/// The smooth surface that a mesh approximates.
pub(super) trait Surface {
    /// The point of the surface near `point`, and a unit vector for [`Self::alignment`].
    fn project(&self, point: DVec3) -> (DVec3, DVec3);

    /// Whether the vectors of [`Self::project`] are the surface's outward normals. If not, the mesh's normals define
    /// the tangent planes.
    const PROJECTS_TO_NORMALS: bool;

    /// Alignment of a triangle with the surface, given those vectors at its corners: 1 if the triangle is tangent to
    /// it, 0 at right angles, negative if turned over.
    fn alignment(&self, corners: [DVec3; 3], normals: [DVec3; 3]) -> f64;

    /// A step may not worsen a triangle whose alignment would be below this.
    const LEAST_ALIGNMENT: f64;
}

/// Passes of remeshing towards the count, and of polishing after that.
const ROUNDS: usize = 6;
const POLISH: usize = 4;

/// Covers `surface` with exactly `triangles` (even) triangles, starting from any closed mesh of it. The error is the
/// count reached, if the surface does not admit so few.
pub(super) fn remesh(
    points: Vec<DVec3>,
    triangles: &[[u32; 3]],
    surface: &impl Surface,
    count: usize,
) -> Result<(Vec<DVec3>, Vec<[u32; 3]>), usize> {
    let mut mesh = Remesher { mesh: HalfEdges::new(points, triangles), surface };
    mesh.project();
    let mut correction = 1.0;
    for round in 0..ROUNDS {
        let length = correction * mesh.ideal_length(count);
        mesh.split_longer_than(length * 4.0 / 3.0);
        mesh.collapse_shorter_than(length * 4.0 / 5.0, length * 4.0 / 3.0);
        mesh.flip();
        mesh.relax();
        if round > 1 {
            let excess = mesh.mesh.triangle_count() as f64 / count as f64;
            correction *= excess.sqrt().clamp(0.8, 1.25);
        }
    }
    for _ in 0..POLISH {
        mesh.meet(count);
        mesh.flip();
        mesh.relax();
    }
    mesh.flip();
    match mesh.mesh.triangle_count() {
        reached if reached == count => Ok(mesh.mesh.into_parts()),
        reached => Err(reached),
    }
}

struct Remesher<'a, S> {
    mesh: HalfEdges,
    surface: &'a S,
}

impl<S: Surface> Remesher<'_, S> {
    fn project(&mut self) {
        for (point, normal) in self.mesh.points.iter_mut().zip(&mut self.mesh.normals) {
            (*point, *normal) = self.surface.project(*point);
        }
    }

    fn corners(&self, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|vertex| self.mesh.points[vertex as usize])
    }

    /// The edge length at which `count` equilateral triangles have the mesh's area.
    fn ideal_length(&self, count: usize) -> f64 {
        let area: f64 = self.mesh.triangles().map(|t| area_vector(self.corners(t)).length()).sum();
        (area / count as f64 * 4.0 / 3f64.sqrt()).sqrt()
    }

    fn alignment(&self, triangle: [u32; 3]) -> f64 {
        let normals = triangle.map(|vertex| self.mesh.normals[vertex as usize]);
        self.surface.alignment(self.corners(triangle), normals)
    }

    /// Whether the first corner of a fan's triangles may move to `point` with this `normal`: no triangle may become
    /// worse aligned with the surface or, if `shapely`, have an angle below 10 degrees, unless one did before.
    fn fits<I: Iterator<Item = [u32; 3]>>(
        &self,
        fan: impl Fn() -> I,
        (point, normal): (DVec3, DVec3),
        shapely: bool,
    ) -> bool {
        let (mut alignment, mut cosine) = (f64::INFINITY, -1.0f64);
        for [_, c, d] in fan() {
            let [p, q] = [c, d].map(|other| self.mesh.points[other as usize]);
            let [n, m] = [c, d].map(|other| self.mesh.normals[other as usize]);
            alignment = alignment.min(self.surface.alignment([point, p, q], [normal, n, m]));
            if shapely {
                cosine = cosine.max(smallest_angle_cosine([point, p, q]));
            }
        }
        // The previous state is examined only if needed, because this is the inner loop.
        let aligned = alignment >= S::LEAST_ALIGNMENT
            || fan().any(|triangle| self.alignment(triangle) <= alignment);
        aligned
            && (cosine <= 0.985
                || fan().any(|triangle| smallest_angle_cosine(self.corners(triangle)) >= cosine))
    }

    fn split_longer_than(&mut self, limit: f64) {
        // A pass halves the longest edges; a rough start needs several.
        for _ in 0..8 {
            let mut edges = self.edges();
            edges.retain(|&(length, _)| length > limit);
            if edges.is_empty() {
                break;
            }
            for (length, h) in edges.into_iter().rev() {
                // A split may reuse half-edges; an edge whose length changed is split in the next pass.
                if self.mesh.length(h) == length {
                    self.split(h);
                }
            }
            self.flip();
        }
    }

    /// Every edge once with its length, shortest first.
    fn edges(&self) -> Vec<(f64, u32)> {
        let mut edges: Vec<(f64, u32)> = (0..self.mesh.edge_count_bound())
            .filter(|&h| self.mesh.stands_for_edge(h))
            .map(|h| (self.mesh.length(h), h))
            .collect();
        edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        edges
    }

    fn split(&mut self, h: u32) {
        let [a, b] = self.mesh.ends(h).map(|vertex| self.mesh.points[vertex as usize]);
        let (point, normal) = self.surface.project(a.midpoint(b));
        self.mesh.split(h, point, normal);
    }

    fn collapse_shorter_than(&mut self, limit: f64, longest: f64) {
        for h in 0..self.mesh.edge_count_bound() {
            if self.mesh.stands_for_edge(h) && self.mesh.length(h) < limit {
                self.try_collapse(h, longest);
            }
        }
    }

    /// Collapses the edge into its middle unless that spoils a triangle or makes an edge too long.
    fn try_collapse(&mut self, h: u32, longest: f64) -> bool {
        if !self.mesh.can_collapse(h) {
            return false;
        }
        let [a, b] = self.mesh.ends(h);
        let middle = self.mesh.points[a as usize].midpoint(self.mesh.points[b as usize]);
        let (point, normal) = self.surface.project(middle);
        let good = [(a, b), (b, a)].into_iter().all(|(centre, other)| {
            let kept = || self.mesh.fan(centre).filter(move |fan| !fan.contains(&other));
            self.fits(kept, (point, normal), true)
                && kept().all(|[_, c, _]| point.distance(self.mesh.points[c as usize]) < longest)
        });
        if good {
            self.mesh.collapse(h, point, normal);
        }
        good
    }

    /// Splits the longest or collapses the shortest edges until there are `count` triangles.
    fn meet(&mut self, count: usize) {
        for _ in 0..20 {
            let present = self.mesh.triangle_count();
            if present == count {
                return;
            }
            let edges = self.edges();
            if present < count {
                for &(_, h) in edges.iter().rev().take((count - present) / 2) {
                    self.split(h);
                }
            } else {
                let mut excess = (present - count) / 2;
                for (_, h) in edges {
                    if excess == 0 {
                        break;
                    }
                    // An earlier collapse may have removed this edge, or made it longer.
                    if self.mesh.stands_for_edge(h) && self.try_collapse(h, f64::INFINITY) {
                        excess -= 1;
                    }
                }
                self.flip();
                self.relax();
            }
        }
    }

    /// Flips edges while that makes the smallest angle of the two triangles larger.
    fn flip(&mut self) {
        for _ in 0..4 {
            let mut flips = 0;
            for h in 0..self.mesh.edge_count_bound() {
                if self.mesh.stands_for_edge(h) && self.wants_flip(h) {
                    self.mesh.flip(h);
                    flips += 1;
                }
            }
            // Once few edges flip, the rest is left to the next pass.
            if flips * 1000 <= self.mesh.triangle_count() {
                break;
            }
        }
    }

    fn wants_flip(&self, h: u32) -> bool {
        let ([a, b], [c, d]) = (self.mesh.ends(h), self.mesh.facing(h));
        let worst = |triangles: [[u32; 3]; 2]| {
            let [one, other] = triangles.map(|t| smallest_angle_cosine(self.corners(t)));
            one.max(other)
        };
        let turned = [[a, d, c], [d, b, c]];
        let present = [[a, b, c], [b, a, d]];
        let alignment = |triangles: [[u32; 3]; 2]| {
            let [one, other] = triangles.map(|triangle| self.alignment(triangle));
            one.min(other)
        };
        let now = alignment(present);
        let better = if now < S::LEAST_ALIGNMENT {
            alignment(turned) > now + 1e-3
        } else {
            worst(turned) < worst(present) - 1e-3 && alignment(turned) >= S::LEAST_ALIGNMENT
        };
        better && self.mesh.can_flip(h)
    }

    /// Moves each vertex along the surface to the centre of gravity of its triangles.
    fn relax(&mut self) {
        for vertex in 0..self.mesh.points.len() as u32 {
            if !self.mesh.is_alive(vertex) {
                continue;
            }
            let (mut moment, mut weight, mut up) = (DVec3::ZERO, 0.0, DVec3::ZERO);
            for triangle in self.mesh.fan(vertex) {
                let corners = self.corners(triangle);
                let facing = area_vector(corners);
                let area = facing.length();
                up += facing;
                moment += corners.iter().sum::<DVec3>() * (area / 3.0);
                weight += area;
            }
            if weight == 0.0 {
                continue;
            }
            let here = self.mesh.points[vertex as usize];
            let step = moment / weight - here;
            if S::PROJECTS_TO_NORMALS {
                up = self.mesh.normals[vertex as usize];
            }
            let along = step.reject_from_normalized(up.normalize_or_zero());
            let (point, normal) = self.surface.project(here + along);
            let good = self.fits(|| self.mesh.fan(vertex), (point, normal), false);
            if good {
                self.mesh.points[vertex as usize] = point;
                self.mesh.normals[vertex as usize] = normal;
            }
        }
    }
}

/// Normal to the triangle, with its area as length.
pub(super) fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a) * 0.5
}

/// Cosine of the triangle's smallest angle.
fn smallest_angle_cosine([a, b, c]: [DVec3; 3]) -> f64 {
    let [ab, bc, ca] = [b - a, c - b, a - c].map(DVec3::normalize_or_zero);
    (-ab.dot(ca)).max(-bc.dot(ab)).max(-ca.dot(bc))
}
