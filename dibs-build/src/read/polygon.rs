//! Cuts polygons into triangles by ear clipping in the polygon's plane, keeping every corner.

use earcut::Earcut;

/// Cuts polygons into triangles of the same orientation.
pub(crate) struct Triangulator {
    earcut: Earcut<f64>,
    flat: Vec<[f64; 2]>,
    ears: Vec<u32>,
}

impl Triangulator {
    pub fn new() -> Self {
        Self { earcut: Earcut::new(), flat: Vec::new(), ears: Vec::new() }
    }

    /// Appends the triangles of a polygon of at least three corners to `out`. A polygon that is not simple (it touches
    /// or crosses itself in its plane, or has no area) is cut into a fan, and the result is `false`.
    pub fn cut(
        &mut self,
        corners: &[u32],
        positions: &[[f64; 3]],
        out: &mut Vec<[u32; 3]>,
    ) -> bool {
        if let &[a, b, c] = corners {
            out.push([a, b, c]);
            return true;
        }
        let area = self.flatten(corners, positions);
        if area > 0.0 && self.clip_ears(corners, area) {
            let corner = |&i: &u32| corners[i as usize];
            let (ears, _) = self.ears.as_chunks::<3>();
            out.extend(ears.iter().map(|[a, b, c]| [corner(a), corner(b), corner(c)]));
            return true;
        }
        for pair in corners[1..].windows(2) {
            out.push([corners[0], pair[0], pair[1]]);
        }
        false
    }

    /// Projects the polygon along the largest component of its Newell normal, counter-clockwise,
    /// and returns its area there.
    fn flatten(&mut self, corners: &[u32], positions: &[[f64; 3]]) -> f64 {
        let origin = positions[corners[0] as usize];
        let point = |corner: u32| {
            let p = positions[corner as usize];
            [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
        };
        let mut normal = [0.0; 3];
        let mut before = point(corners[corners.len() - 1]);
        for &corner in corners {
            let here = point(corner);
            normal[0] += (before[1] - here[1]) * (before[2] + here[2]);
            normal[1] += (before[2] - here[2]) * (before[0] + here[0]);
            normal[2] += (before[0] - here[0]) * (before[1] + here[1]);
            before = here;
        }
        let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap_or(2);
        let (u, v) = match (axis, normal[axis] < 0.0) {
            (0, false) => (1, 2),
            (0, true) => (2, 1),
            (1, false) => (2, 0),
            (1, true) => (0, 2),
            (_, false) => (0, 1),
            (_, true) => (1, 0),
        };
        self.flat.clear();
        self.flat.extend(corners.iter().map(|&corner| {
            let p = point(corner);
            [p[u], p[v]]
        }));
        normal[axis].abs() / 2.0
    }

    /// Fills `ears`; false unless they cover the polygon exactly once.
    fn clip_ears(&mut self, corners: &[u32], area: f64) -> bool {
        const NO_HOLES: &[u32] = &[];
        self.earcut.earcut(self.flat.iter().copied(), NO_HOLES, &mut self.ears);
        let flat = &self.flat;
        let doubled = |[a, b, c]: [u32; 3]| {
            let [a, b, c] = [a, b, c].map(|i| flat[i as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let (ears, _) = self.ears.as_chunks_mut::<3>();
        for ear in ears {
            if doubled(*ear) < 0.0 {
                ear.swap(1, 2);
            }
        }
        // The area is compared last: a restored corner may be the tip of a spike, outside the polygon.
        let restored = restore_straight_corners(corners.len() as u32, &mut self.ears);
        let (ears, _) = self.ears.as_chunks::<3>();
        let covered: f64 = ears.iter().map(|&ear| doubled(ear).abs() / 2.0).sum();
        restored && (covered - area).abs() <= 1e-6 * area
    }
}

/// Ear clipping may leave out corners between collinear edges. A neighbouring face uses them, and a deformed surface
/// bends there. So each is restored in the triangle whose edge it lies on. False if there is no such triangle.
fn restore_straight_corners(count: u32, ears: &mut Vec<u32>) -> bool {
    let mut used = vec![false; count as usize];
    for &ear in &*ears {
        used[ear as usize] = true;
    }
    if used.iter().all(|&u| u) {
        return true;
    }
    let is_used = |i: u32| used[(i % count) as usize];
    for start in (0..count).filter(|&i| is_used(i)) {
        let Some(length) = (1..=count).find(|step| is_used(start + step)) else { continue };
        let end = (start + length) % count;
        if length == 1 {
            continue;
        }
        let (triangles, _) = ears.as_chunks_mut::<3>();
        let found = triangles.iter_mut().find_map(|ear| {
            let side = (0..3).find(|&s| ear[s] == start && ear[(s + 1) % 3] == end)?;
            Some((ear[(side + 2) % 3], ear))
        });
        let Some((apex, ear)) = found else { return false };
        *ear = [start, start + 1, apex].map(|i| i % count);
        for step in 1..length {
            ears.extend([start + step, start + step + 1, apex].map(|i| i % count));
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangles of a polygon in the plane z = 0, whether it is simple, and their signed areas.
    fn cut(points: &[[f64; 2]]) -> (Vec<[u32; 3]>, bool, Vec<f64>) {
        let positions: Vec<[f64; 3]> = points.iter().map(|p| [p[0], p[1], 7.0]).collect();
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let mut triangles = Vec::new();
        let simple = Triangulator::new().cut(&corners, &positions, &mut triangles);
        let areas = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| points[i as usize]);
                ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0
            })
            .collect();
        (triangles, simple, areas)
    }

    #[test]
    fn concave_polygon_is_covered_once_in_its_own_orientation() {
        let arrow = [[0.0, 0.0], [4.0, 4.0], [0.0, 2.0], [-4.0, 4.0]];
        let (triangles, simple, areas) = cut(&arrow);
        assert!(simple);
        assert_eq!(triangles.len(), 2);
        assert!(areas.iter().all(|&a| a > 0.0), "{areas:?}");
        assert_eq!(areas.iter().sum::<f64>(), 8.0);

        let reversed: Vec<_> = arrow.into_iter().rev().collect();
        let (_, simple, areas) = cut(&reversed);
        assert!(simple);
        assert!(areas.iter().all(|&a| a < 0.0), "{areas:?}");
        assert_eq!(areas.iter().sum::<f64>(), -8.0);
    }

    #[test]
    fn corners_on_straight_sides_are_kept() {
        for per_side in 1..6 {
            let step = 1.0 / f64::from(per_side);
            let side = |i: i32| f64::from(i) * step;
            let mut square = Vec::new();
            square.extend((0..per_side).map(|i| [side(i), 0.0]));
            square.extend((0..per_side).map(|i| [1.0, side(i)]));
            square.extend((0..per_side).map(|i| [1.0 - side(i), 1.0]));
            square.extend((0..per_side).map(|i| [0.0, 1.0 - side(i)]));
            let (triangles, simple, areas) = cut(&square);
            assert!(simple);
            assert_eq!(triangles.len(), square.len() - 2);
            assert!(areas.iter().all(|&a| a >= 0.0), "{areas:?}");
            assert!((areas.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            for corner in 0..square.len() as u32 {
                assert!(triangles.iter().any(|t| t.contains(&corner)), "{per_side}: {corner}");
            }
        }
    }

    #[test]
    fn corners_that_ear_clipping_left_out_are_restored() {
        // A square without the three corners on its first side.
        let mut ears = vec![0, 4, 5, 0, 5, 6];
        assert!(restore_straight_corners(7, &mut ears));
        let (ears, _) = ears.as_chunks::<3>();
        assert_eq!(ears, [[0, 1, 5], [0, 5, 6], [1, 2, 5], [2, 3, 5], [3, 4, 5]]);
    }

    #[test]
    fn polygons_that_are_not_simple_become_fans() {
        let (triangles, simple, _) = cut(&[[0.0, 0.0], [2.0, 1.0], [2.0, 0.0], [0.0, 1.0]]);
        assert!(!simple);
        assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
        let (triangles, simple, _) = cut(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]);
        assert!(!simple);
        assert_eq!(triangles.len(), 2);
    }

    /// The triangles of any polygon have its area and orientation. Those of a simple polygon do not overlap and use
    /// every corner.
    #[test]
    fn random_polygons_keep_their_area() {
        let mut state = 1_u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) % below
        };
        let mut simple_ones = 0;
        for _ in 0..20_000 {
            let count = 4 + random(9);
            let points: Vec<[f64; 2]> =
                (0..count).map(|_| [f64::from(random(12)), f64::from(random(12))]).collect();
            let doubled_area: f64 = (0..points.len())
                .map(|i| {
                    let (a, b) = (points[i], points[(i + 1) % points.len()]);
                    a[0] * b[1] - a[1] * b[0]
                })
                .sum();
            let (triangles, simple, areas) = cut(&points);
            assert_eq!(2.0 * areas.iter().sum::<f64>(), doubled_area, "{points:?} {triangles:?}");
            if simple {
                simple_ones += 1;
                assert!(areas.iter().all(|a| a * doubled_area >= 0.0), "{points:?} {triangles:?}");
                for corner in 0..count {
                    assert!(triangles.iter().any(|t| t.contains(&corner)), "{points:?} {corner}");
                }
            }
        }
        assert!(simple_ones > 1000, "only {simple_ones} were simple");
    }
}
