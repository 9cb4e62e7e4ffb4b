//! The constants of the run-time stretch bound: each mode's largest growth of a triangle's stretch, in f64, rounded up.

use dibs_nostd::format::PathKind;
use dibs_nostd::{Index, Tree, TriangleRow};
use glam::DVec3;

use crate::rest::RestShape;

/// The triangles of a tree, ready to measure displacements.
pub struct Triangles {
    corners: Vec<[u32; 3]>,
    shapes: Vec<Shape>,
}

/// One triangle at rest.
struct Shape {
    /// The tree's stretch limit over the triangle's: its stretch is multiplied by this.
    strictness: f64,
    measure: Measure,
}

enum Measure {
    /// Length of the first edge, and the components of the second edge along and across the first.
    Surface { x1: f64, x2: f64, y2: f64 },
    /// Lengths of the edges.
    Edges([f64; 3]),
}

impl Triangles {
    /// The triangles of a tree with a rest shape; `None` if a row is missing.
    pub fn new<I: Index>(tree: &Tree<'_, I>) -> Option<Self> {
        let rows = 0..tree.triangle_count();
        let corners: Vec<[u32; 3]> =
            rows.clone().map(|row| tree.corners(TriangleRow(row))).collect::<Option<_>>()?;
        let shape = |row: u32| {
            let [a, b, c] = corners[row as usize];
            let at = |vertex| tree.rest_position(vertex);
            let [a, b, c] = RestShape::new([at(a)?, at(b)?, at(c)?], tree.paths()).corners;
            let (e1, e2) = (b - a, c - a);
            let x1 = e1.length();
            let measure = match tree.paths() {
                PathKind::EdgePath => Measure::Edges([x1, e2.length(), e1.distance(e2)]),
                _ => Measure::Surface { x1, x2: e1.dot(e2) / x1, y2: e1.cross(e2).length() / x1 },
            };
            let limit = f64::from(tree.stretch_limit(TriangleRow(row))?);
            Some(Shape { strictness: f64::from(tree.stretch()) / limit, measure })
        };
        let shapes = rows.map(shape).collect::<Option<_>>()?;
        Some(Self { corners, shapes })
    }

    /// Upper bound on what a displacement adds to the stretch of any triangle: the largest norm of its gradient.
    pub fn growth(&self, displacement: &[DVec3]) -> f64 {
        let growths = self.corners.iter().zip(&self.shapes).map(|(corners, shape)| {
            let [a, b, c] = corners.map(|row| displacement[row as usize]);
            shape.strictness * shape.measure.norm(b - a, c - a)
        });
        growths.fold(0.0, f64::max)
    }

    /// Upper bound on what moving every vertex by at most `error` adds to the stretch of any triangle.
    pub fn growth_of_error(&self, error: f64) -> f64 {
        let growths =
            self.shapes.iter().map(|shape| shape.strictness * shape.measure.of_error(error));
        growths.fold(0.0, f64::max)
    }
}

impl Measure {
    /// Norm of the gradient that maps the rest edges to these; for edge paths the largest relative change of an edge.
    fn norm(&self, f1: DVec3, f2: DVec3) -> f64 {
        match *self {
            Self::Surface { x1, x2, y2 } => {
                let p = f1 / x1;
                let q = (f2 - p * x2) / y2;
                let (pp, pq, qq) = (p.length_squared(), p.dot(q), q.length_squared());
                let (mean, half) = (0.5 * (pp + qq), 0.5 * (pp - qq));
                (mean + (half * half + pq * pq).sqrt()).sqrt()
            }
            Self::Edges(rest) => {
                let now = [f1.length(), f2.length(), f1.distance(f2)];
                rest.iter().zip(now).map(|(rest, now)| now / rest).fold(0.0, f64::max)
            }
        }
    }

    /// Upper bound of that norm if both ends of every edge move by at most `error`: `|p| <= 2 e / x1`, `|q| <= (2 e +
    /// |p| |x2|) / y2`, and the norm is at most `hypot(|p|, |q|)`.
    fn of_error(&self, error: f64) -> f64 {
        match *self {
            Self::Surface { x1, x2, y2 } => {
                let p = 2.0 * error / x1;
                let q = (2.0 * error + p * x2.abs()) / y2;
                p.hypot(q)
            }
            Self::Edges(rest) => rest.iter().map(|rest| 2.0 * error / rest).fold(0.0, f64::max),
        }
    }
}
