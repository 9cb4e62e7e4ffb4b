//! Normals of the current surface, at a face, an edge or a vertex.
//!
//! The sign of `(p - c) . n` is the side of a point `p` whose closest point is `c`, if `n` is the angle-weighted
//! pseudonormal there (Bærentzen & Aanæs, "Signed distance computation using the angle weighted pseudonormal", IEEE
//! TVCG 11(3), 2005).

// Requirement: S-01

use core::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use super::precision::Precision;
use crate::math::sqrt::sqrt;
use crate::tree::MAX_RING;
use crate::{Index, Tree, VertexTable};

/// Square of the sine below which two edges span no plane in f32.
const FLAT: f32 = 1.0 / 1_048_576.0;

/// The same in f64.
const FLAT_DOUBLE: f64 = 1e-18;

/// Squares of lengths below this lose precision.
const TINY: f32 = 1e-30;

/// Rounding of a pseudonormal, relative to the sum of its weights.
pub(super) const NORMAL: f32 = 1e-5;

/// The feature of a triangle that contains a point. Edge `e` leads from corner `e` to the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Feature {
    Face,
    Edge(u32),
    Vertex(u32),
}

/// A pseudonormal, not of unit length.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pseudonormal {
    pub vector: Vec3,
    /// Sum of the weights of the unit normals; rounding is relative to it.
    pub weight: f32,
}

/// Why there is no pseudonormal.
#[derive(Clone, Copy, Debug)]
pub(super) enum NoNormal {
    /// The feature is on an open boundary.
    Open,
    /// A triangle there has no area, or more than [`MAX_RING`] meet.
    Unclear,
    /// A row outside its table.
    Corrupt(u32),
}

impl Feature {
    /// The feature within `tolerance` of a point of a triangle: a corner is preferred to an edge, an edge to the face.
    pub fn of(corners: &[Vec3; 3], point: Vec3, tolerance: f32) -> Self {
        let [a, b, c] = *corners;
        let near = tolerance * tolerance;
        for (corner, position) in (0..).zip([a, b, c]) {
            if point.distance_squared(position) <= near {
                return Self::Vertex(corner);
            }
        }
        let (mut nearest, mut feature) = (near, Self::Face);
        for (edge, from, to) in [(0, a, b), (1, b, c), (2, c, a)] {
            let along = to - from;
            let squared = along.length_squared();
            let across = (point - from).cross(along);
            let apart = across.dot(across / squared);
            if apart <= nearest && squared > TINY {
                nearest = apart;
                feature = Self::Edge(edge);
            }
        }
        feature
    }

    /// Visits the other triangles that meet in a feature of a triangle, up to [`MAX_RING`] or an open boundary.
    pub fn each_other<I: Index>(
        self,
        tree: &Tree<'_, I>,
        triangle: u32,
        mut visit: impl FnMut(u32),
    ) {
        let (mut corner, most) = match self {
            Self::Face => return,
            Self::Edge(edge) => (edge, 1),
            Self::Vertex(corner) => (corner, MAX_RING),
        };
        let mut row = triangle;
        for _ in 0..most {
            match tree.next_around(row, corner) {
                Some(next) if next.0 != triangle => (row, corner) = next,
                _ => return,
            }
            visit(row);
        }
    }

    /// The pseudonormal of a feature of a triangle.
    ///
    /// Cost: one normal of a face, two of an edge, at most [`MAX_RING`] of a vertex.
    #[cold]
    #[inline(never)]
    pub fn pseudonormal<I: Index, V: VertexTable + ?Sized>(
        self,
        tree: &Tree<'_, I>,
        vertices: &V,
        triangle: u32,
    ) -> Result<Pseudonormal, NoNormal> {
        let at = |row| corners(tree, vertices, row);
        match self {
            Self::Face => Ok(Pseudonormal { vector: normal(&at(triangle)?)?.0, weight: 1.0 }),
            Self::Edge(edge) => {
                let (other, _) = tree.across(triangle, edge).ok_or(NoNormal::Open)?;
                let vector = normal(&at(triangle)?)?.0 + normal(&at(other)?)?.0;
                Ok(Pseudonormal { vector, weight: 2.0 })
            }
            Self::Vertex(corner) => {
                let mut sum = Pseudonormal { vector: Vec3::ZERO, weight: 0.0 };
                let (mut row, mut corner) = (triangle, corner);
                for _ in 0..MAX_RING {
                    let [centre, from, to] = turned(at(row)?, corner);
                    let (unit, area) = normal(&[centre, from, to])?;
                    let weight = angle(area, (from - centre).dot(to - centre));
                    sum.vector += weight * unit;
                    sum.weight += weight;
                    let next = tree.next_around(row, corner).ok_or(NoNormal::Open)?;
                    if next.0 == triangle {
                        return Ok(sum);
                    }
                    (row, corner) = next;
                }
                Err(NoNormal::Unclear)
            }
        }
    }
}

/// The current positions of a triangle's corners.
pub(super) fn corners<I: Index, V: VertexTable + ?Sized>(
    tree: &Tree<'_, I>,
    vertices: &V,
    row: u32,
) -> Result<[Vec3; 3], NoNormal> {
    let [a, b, c] = tree.triangle(row).ok_or(NoNormal::Corrupt(row))?;
    let position = |vertex| vertices.position(vertex).ok_or(NoNormal::Corrupt(vertex));
    Ok([position(a)?, position(b)?, position(c)?])
}

/// The corners rotated so that `first` comes first.
pub(super) fn turned<T>([a, b, c]: [T; 3], first: u32) -> [T; 3] {
    match first {
        0 => [a, b, c],
        1 => [b, c, a],
        _ => [c, a, b],
    }
}

/// The unit normal of a triangle, and twice its area.
fn normal(corners: &[Vec3; 3]) -> Result<(Vec3, f32), NoNormal> {
    let [a, b, c] = *corners;
    let (ab, ac) = (b - a, c - a);
    let across = ab.cross(ac);
    let squared = across.length_squared();
    let is_clear = squared > FLAT * ab.length_squared() * ac.length_squared() && squared > TINY;
    if is_clear && squared <= f32::MAX {
        let area = sqrt(squared);
        return Ok((across / area, area));
    }
    flat_normal(corners)
}

/// [`normal`] in f64, for a triangle too flat, small or large for f32.
#[cold]
#[inline(never)]
fn flat_normal(corners: &[Vec3; 3]) -> Result<(Vec3, f32), NoNormal> {
    let [a, b, c] = corners.map(f64::vector);
    let (ab, ac) = (b - a, c - a);
    let across = ab.cross(ac);
    let size = f64::size(across);
    // Written so that NaN gives no normal.
    let is_clear = f64::dot(across, across) > FLAT_DOUBLE * f64::dot(ab, ab) * f64::dot(ac, ac);
    let scaled = (across / size).as_vec3();
    let length = sqrt(scaled.length_squared());
    let area = size as f32 * length;
    if is_clear && area > 0.0 && area.is_finite() {
        Ok((scaled / length, area))
    } else {
        Err(NoNormal::Unclear)
    }
}

/// The angle, 0 to pi, from a sine above 0 and a cosine, both scaled by the same length. Within 1e-6.
fn angle(sine: f32, cosine: f32) -> f32 {
    let flank = cosine.abs();
    let acute =
        if sine < flank { arctangent(sine / flank) } else { FRAC_PI_2 - arctangent(flank / sine) };
    if cosine < 0.0 { PI - acute } else { acute }
}

/// Arctangent on 0 to 1: Abramowitz & Stegun 4.4.49, within 2e-8 before rounding.
fn arctangent(x: f32) -> f32 {
    const TERMS: [f32; 8] = [
        0.002_866_225_7,
        -0.016_165_737,
        0.042_909_614,
        -0.075_289_64,
        0.106_562_64,
        -0.142_089,
        0.199_935_51,
        -0.333_331_45,
    ];
    let squared = x * x;
    let series = TERMS.iter().fold(0.0, |sum, term| (sum + term) * squared);
    x + x * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_those_of_f64() {
        for step in 1..10_000 {
            let truth = f64::from(step) * core::f64::consts::PI / 10_000.0;
            let found = angle((3.0 * truth.sin()) as f32, (3.0 * truth.cos()) as f32);
            assert!((f64::from(found) - truth).abs() < 1e-6, "{found} for {truth}");
        }
    }

    #[test]
    fn a_sliver_has_the_normal_that_f64_says() {
        for height in [1e-3, 1e-5, 1e-6] {
            let corners =
                [Vec3::new(1.0, 2.0, 0.0), Vec3::new(9.0, 2.0, 0.0), Vec3::new(5.0, 2.0, height)];
            let (unit, area) = normal(&corners).expect("it has an area");
            assert!((unit - Vec3::NEG_Y).length() < 1e-6, "{unit}");
            assert!((area / (8.0 * height) - 1.0).abs() < 1e-6, "{area}");
        }
        let large = [Vec3::ZERO, Vec3::X * 8e9, Vec3::Y * 8e9];
        let (unit, area) = normal(&large).expect("it has an area");
        assert!(unit == Vec3::Z && (area / 6.4e19 - 1.0).abs() < 1e-6, "{unit} {area}");
        // No f32 holds their areas.
        for size in [1e-23, 1e20] {
            assert!(normal(&[Vec3::ZERO, Vec3::X * size, Vec3::Y * size]).is_err(), "{size:e}");
        }
        assert!(normal(&[Vec3::ZERO, Vec3::X, Vec3::X * 3.0]).is_err());
        assert!(normal(&[Vec3::ZERO, Vec3::X, Vec3::NAN]).is_err());
    }

    /// The line through its ends passes the point, but the square of its length has lost its digits.
    #[test]
    fn an_edge_that_is_hardly_longer_than_zero_is_no_feature() {
        let third = Vec3::new(10.0, 10.0, 0.0);
        let feature = |end: Vec3| Feature::of(&[Vec3::ZERO, end, third], Vec3::X * 5.0, 1e-3);
        assert_eq!(feature(Vec3::X * 1e-16), Feature::Face);
        assert_eq!(feature(Vec3::X * 10.0), Feature::Edge(0));
    }
}
