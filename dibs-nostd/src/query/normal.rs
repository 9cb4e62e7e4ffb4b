//! Normals of the surface as it is now, at a face, an edge or a vertex.
//!
//! The sign of `(p - c) . n` is the side of a point `p` whose closest point is `c`, if `n` is the angle-weighted
//! pseudonormal there (Bærentzen & Aanæs, "Signed distance computation using the angle weighted pseudonormal", IEEE
//! TVCG 11(3), 2005).

use core::f32::consts::{FRAC_PI_2, PI};

use glam::Vec3;

use crate::math::sqrt::sqrt;
use crate::{Index, Tree, VertexTable};

/// Most triangles around a vertex.
const MAX_RING: u32 = 256;

/// Square of the sine below which two edges span no plane in f32.
const FLAT: f32 = 1.0 / 1_048_576.0;

/// The same in f64.
const FLAT_DOUBLE: f64 = 1e-18;

/// Squares of lengths below this lose their digits.
const TINY: f32 = 1e-30;

/// The feature of a triangle that a point is on. Edge `e` leads from corner `e` to the next one.
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
    /// Of a vertex: the point is above a triangle that may be as close as the vertex.
    pub is_above: bool,
    /// Of a vertex: the point is below such a triangle.
    pub is_below: bool,
}

/// A point, and the error of its distance from the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Off {
    pub point: Vec3,
    pub error: f32,
}

impl Pseudonormal {
    fn new(vector: Vec3, weight: f32) -> Self {
        Self { vector, weight, is_above: false, is_below: false }
    }

    /// Adds a triangle around a vertex, the first of its corners, with its unit normal.
    fn add(&mut self, [centre, from, to]: [Vec3; 3], unit: Vec3, area: f32, off: Off) {
        let weight = angle(area, (from - centre).dot(to - centre));
        self.vector += weight * unit;
        self.weight += weight;
        let towards = off.point - centre;
        // If the point is over the triangle, it leans over one of its edges at least.
        let leans = |end: Vec3| {
            let edge = end - centre;
            let over = towards.dot(edge);
            !(over < 0.0 && over * over > off.error * off.error * edge.length_squared())
        };
        if leans(from) || leans(to) {
            let height = towards.dot(unit);
            self.is_above |= height > 0.0;
            self.is_below |= height < 0.0;
        }
    }
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
    /// The feature within `tolerance` of a point of a triangle: a corner rather than an edge, an edge rather than
    /// the face.
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
            let across = (point - from).cross(along).length_squared();
            if across <= nearest * squared && squared > TINY {
                nearest = across / squared;
                feature = Self::Edge(edge);
            }
        }
        feature
    }

    /// Whether a point is above all triangles that meet in a feature, or below all, by the sine `least` against its
    /// direction `towards` from the closest point. Then it is so for any pseudonormal of the feature, which costs twice
    /// as much. `None` where that is not clear.
    pub fn clear_side<I: Index, V: VertexTable + ?Sized>(
        self,
        tree: &Tree<'_, I>,
        vertices: &V,
        triangle: u32,
        corners: &[Vec3; 3],
        towards: Vec3,
        least: f32,
    ) -> Option<bool> {
        let square = least * least * towards.length_squared();
        let is_above = |[centre, from, to]: [Vec3; 3]| {
            let (one, other) = (from - centre, to - centre);
            let across = one.cross(other);
            let squared = across.length_squared();
            let is_flat = !(squared > FLAT * one.length_squared() * other.length_squared());
            let height = towards.dot(across);
            let is_clear = squared > TINY && !is_flat && height * height > square * squared;
            is_clear.then_some(height > 0.0)
        };
        let first = self.corner();
        let [centre, mut from, mut to] = turned(*corners, first);
        let (mut row, mut corner, mut side) = (triangle, first, None);
        for rest in (0..=self.most()).rev() {
            let this = is_above([centre, from, to])?;
            if *side.get_or_insert(this) != this {
                return None;
            }
            if rest == 0 {
                break;
            }
            // The next triangle has this one's edge from `centre` to `from`.
            let (next, back) = tree.across(row, corner)?;
            if next == triangle {
                return side;
            }
            (row, corner, to) = (next, after(back), from);
            let [a, b, c] = tree.triangle(row)?;
            from = vertices.position(match corner {
                0 => b,
                1 => c,
                _ => a,
            })?;
        }
        if matches!(self, Self::Vertex(_)) { None } else { side }
    }

    /// The corner around which the feature's triangles lie, and which its edge leaves.
    const fn corner(self) -> u32 {
        match self {
            Self::Face => 0,
            Self::Edge(edge) => edge,
            Self::Vertex(corner) => corner,
        }
    }

    /// The most triangles that meet in it besides the first.
    const fn most(self) -> u32 {
        match self {
            Self::Face => 0,
            Self::Edge(_) => 1,
            Self::Vertex(_) => MAX_RING,
        }
    }

    /// The pseudonormal of a feature of a triangle, for a point to whose distance the feature's comes near.
    ///
    /// Cost: one normal of a face, two of an edge, at most [`MAX_RING`] of a vertex.
    pub fn pseudonormal<I: Index, V: VertexTable + ?Sized>(
        self,
        tree: &Tree<'_, I>,
        vertices: &V,
        triangle: u32,
        off: Off,
    ) -> Result<Pseudonormal, NoNormal> {
        let at = |row| corners(tree, vertices, row);
        match self {
            Self::Face => Ok(Pseudonormal::new(normal(&at(triangle)?)?.0, 1.0)),
            Self::Edge(edge) => {
                let (other, _) = tree.across(triangle, edge).ok_or(NoNormal::Open)?;
                let vector = normal(&at(triangle)?)?.0 + normal(&at(other)?)?.0;
                Ok(Pseudonormal::new(vector, 2.0))
            }
            Self::Vertex(corner) => {
                let mut sum = Pseudonormal::new(Vec3::ZERO, 0.0);
                let (mut row, mut corner) = (triangle, corner);
                for _ in 0..MAX_RING {
                    let fan = turned(at(row)?, corner);
                    let (unit, area) = normal(&fan)?;
                    sum.add(fan, unit, area, off);
                    let (next, back) = tree.across(row, corner).ok_or(NoNormal::Open)?;
                    if next == triangle {
                        return Ok(sum);
                    }
                    (row, corner) = (next, after(back));
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

/// The corner after one.
const fn after(corner: u32) -> u32 {
    if corner == 2 { 0 } else { corner + 1 }
}

/// The corners in their order, from one of them on.
fn turned([a, b, c]: [Vec3; 3], first: u32) -> [Vec3; 3] {
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
    if squared > FLAT * ab.length_squared() * ac.length_squared() && squared > TINY {
        let area = sqrt(squared);
        return Ok((across / area, area));
    }
    flat_normal(corners)
}

/// [`normal`] in f64, for a triangle too flat or small for f32.
#[cold]
#[inline(never)]
fn flat_normal(corners: &[Vec3; 3]) -> Result<(Vec3, f32), NoNormal> {
    let [a, b, c] = corners.map(|corner| corner.to_array().map(f64::from));
    let (ab, ac) = (minus(b, a), minus(c, a));
    let [x, y, z] = cross(ab, ac);
    let mut largest = 0.0;
    for size in [x.abs(), y.abs(), z.abs()] {
        if size > largest {
            largest = size;
        }
    }
    // Written so that NaN has no normal.
    let is_clear = squared([x, y, z]) > FLAT_DOUBLE * squared(ab) * squared(ac);
    let scaled = Vec3::new((x / largest) as f32, (y / largest) as f32, (z / largest) as f32);
    let length = sqrt(scaled.length_squared());
    let area = largest as f32 * length;
    if is_clear && area > 0.0 && area.is_finite() {
        Ok((scaled / length, area))
    } else {
        Err(NoNormal::Unclear)
    }
}

fn minus([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [a - x, b - y, c - z]
}

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn squared([x, y, z]: [f64; 3]) -> f64 {
    x * x + y * y + z * z
}

/// The angle, 0 to pi, of a sine above 0 and a cosine, both times the same length. Within 1e-6.
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

    /// A clear side is the pseudonormal's side. The surface is crumpled, and some triangles have no area.
    #[test]
    fn a_clear_side_is_that_of_the_pseudonormal() {
        const WEIGHTS: f32 = 1e-5;
        let mesh = dibs_build::generate::heart(320).unwrap().mesh;
        let built = dibs_build::Builder::new().build(&mesh).unwrap();
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        let mut rng = fastrand::Rng::with_seed(1);
        let unit = |rng: &mut fastrand::Rng| {
            let mut axis = || rng.f32() - 0.5;
            Vec3::new(axis(), axis(), axis()).normalize_or(Vec3::X)
        };
        let mut clear = [0; 2];
        for round in 0..40 {
            let mut rows = built.to_rows(&mesh.positions);
            for row in &mut rows {
                *row += unit(&mut rng) * (rng.f32() * 0.3 * round as f32);
            }
            for _ in 0..round {
                let [a, b, _] = tree.triangle(rng.u32(..320)).unwrap();
                rows[b as usize] = rows[a as usize];
            }
            let rows = rows.as_slice();
            for _ in 0..2_000 {
                let triangle = rng.u32(..320);
                let at @ [a, b, c] = corners(&tree, rows, triangle).unwrap();
                let (feature, from) = match rng.u32(..3) {
                    0 => (Feature::Face, (a + b + c) / 3.0),
                    1 => (Feature::Edge(1), b.midpoint(c)),
                    _ => (Feature::Vertex(2), c),
                };
                let towards = unit(&mut rng) * 10.0_f32.powf(rng.f32() * 5.0 - 4.0);
                let (point, error, distance) = (from + towards, 1e-5, towards.length());
                let least = (4.0 * error / distance).sqrt() + WEIGHTS;
                let found = feature.clear_side(&tree, rows, triangle, &at, towards, least);
                let Some(is_above) = found else { continue };
                clear[usize::from(is_above)] += 1;
                let normal =
                    feature.pseudonormal(&tree, rows, triangle, Off { point, error }).unwrap();
                let height = towards.dot(normal.vector) * if is_above { 1.0 } else { -1.0 };
                let doubt = (2.0 * error * distance).sqrt() * normal.vector.length()
                    + WEIGHTS * distance * normal.weight;
                assert!(height > doubt, "{feature:?} {height} {doubt}");
                assert!(!(if is_above { normal.is_below } else { normal.is_above }));
            }
        }
        assert!(clear[0] > 1_000 && clear[1] > 1_000, "{clear:?}");
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
        assert!(normal(&[Vec3::ZERO, Vec3::X, Vec3::X * 3.0]).is_err());
        assert!(normal(&[Vec3::ZERO, Vec3::X, Vec3::NAN]).is_err());
    }
}
