//! The stretch limits that a recorded motion needs, for all triangles or for each.

mod file;

use dibs_nostd::format::PathKind;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{Index, Tree, TriangleRow};
use glam::{DMat2, DVec2, DVec3, Vec3};
use rayon::prelude::*;

pub use file::{LimitsError, LimitsErrorKind, read_limits, write_limits};

use crate::motion::MotionMismatchError;
use crate::nodes::{Volume, edges, largest_stretch as largest_stretch_of, least_limit};
use crate::rest::{RestShape, SHARED, least_limits};
use crate::rounding::round_up;
use crate::{FrameError, Mesh, Motion, Paths};

/// The stretch of each triangle of a mesh in a recorded motion.
///
/// The tree's paths decide the measure: a triangle's largest singular value (a triangle whose height is less than 1/64
/// of its longest edge counts as that high), or for [`Paths::Edges`] the largest ratio of an edge to its rest length.
/// Both are convex, so for positions interpolated linearly between two frames neither exceeds the larger of its values
/// at these frames.
///
/// ```
/// use dibs_build::{Builder, MotionStretch, Paths, generate};
/// let generate::MovingMesh { mesh, motion } = generate::heart(1_000)?;
/// let needed = MotionStretch::new(&mesh, &motion, Paths::default(), &|_| ())?;
/// let tree = Builder::new().limits(needed.limits(0.1)).build(&mesh)?;
/// assert!(f64::from(tree.summary().stretch) >= needed.worst().stretch * 1.09);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct MotionStretch {
    triangles: Vec<PeakStretch>,
    /// The factor by which the controller may overestimate each triangle's stretch.
    rounding: Vec<f64>,
}

/// The largest stretch of a triangle in a motion.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PeakStretch {
    /// The triangle of the mesh.
    pub triangle: usize,
    /// Its largest stretch.
    pub stretch: f64,
    /// The first frame with that stretch.
    pub frame: usize,
}

/// A triangle that a motion stretches beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct LimitExcess {
    /// The triangle and its stretch.
    pub needed: PeakStretch,
    /// Its limit.
    pub limit: f32,
}

impl LimitExcess {
    /// The stretch over the limit.
    fn share(&self) -> f64 {
        self.needed.stretch / f64::from(self.limit)
    }
}

impl MotionStretch {
    /// Measures a motion, in f64. `progress` is called with the number of triangles done, from any thread.
    ///
    /// # Errors
    /// [`MotionMismatchError`] where a frame does not fit the mesh, or turns a closed surface inside out, which no limit
    /// admits.
    ///
    /// # Panics
    /// If the mesh names vertices that it does not have.
    pub fn new(
        mesh: &Mesh,
        motion: &Motion,
        paths: Paths,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Self, MotionMismatchError> {
        motion.check_fits(mesh)?;
        let stretch = |triangle: usize, positions: &[Vec3]| {
            let corners = mesh.triangles[triangle];
            let rest = RestShape::new(mesh.corners(corners), paths.kind()).corners;
            stretch(rest, corners.map(|v| positions[v as usize].as_dvec3()), paths)
        };
        let rounding = least_limits(mesh, paths.kind()).collect();
        Ok(Self::of_elements(mesh.triangles.len(), rounding, motion, progress, stretch))
    }

    /// The same for the tetrahedra of a volume whose nodes move: [`PeakStretch::triangle`] is then a tetrahedron.
    ///
    /// # Errors
    /// [`MotionMismatchError`] where a frame does not fit the nodes, or turns a tetrahedron inside out, which no limit
    /// admits.
    pub fn of_nodes(
        volume: &Volume,
        motion: &Motion,
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<Self, MotionMismatchError> {
        let rest = volume.skeleton(motion.origin);
        motion.check_fits_nodes(&rest)?;
        let shape = |tetrahedron: usize, positions: &[Vec3]| {
            volume.tetrahedra()[tetrahedron].map(|node| positions[node as usize].as_dvec3())
        };
        let stretch = |tetrahedron: usize, positions: &[Vec3]| {
            let rest = edges(shape(tetrahedron, &rest.positions));
            largest_stretch_of(rest, edges(shape(tetrahedron, positions)))
        };
        let count = volume.tetrahedra().len();
        for (frame, positions) in motion.frames.iter().enumerate() {
            // Written so that a determinant that is not a number passes: positions that are not finite have their own error.
            let is_inverted = |&at: &usize| edges(shape(at, positions)).determinant() <= 0.0;
            if let Some(tetrahedron) = (0..count).find(is_inverted) {
                let nodes = volume.tetrahedra()[tetrahedron];
                let error = FrameError::Inverted { tetrahedron, nodes };
                return Err(MotionMismatchError::Frame { frame, error });
            }
        }
        let least = |tetrahedron| least_limit(shape(tetrahedron, &rest.positions));
        // The builder refuses a flat tetrahedron, so its factor does not matter.
        let rounding = (0..count).map(|at| least(at).unwrap_or(1.0)).collect();
        Ok(Self::of_elements(count, rounding, motion, progress, stretch))
    }

    fn of_elements(
        count: usize,
        rounding: Vec<f64>,
        motion: &Motion,
        progress: &(dyn Fn(usize) + Sync),
        stretch: impl Fn(usize, &[Vec3]) -> f64 + Sync,
    ) -> Self {
        let done = std::sync::atomic::AtomicUsize::new(0);
        let needed = |triangle: usize| {
            let mut worst = PeakStretch { triangle, stretch: 0.0, frame: 0 };
            for (frame, positions) in motion.frames.iter().enumerate() {
                let stretch = stretch(triangle, positions);
                // Written so that the NaN of a triangle without area is kept.
                if !(stretch <= worst.stretch) {
                    worst = PeakStretch { stretch, frame, ..worst };
                }
            }
            let count = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
            if count.is_multiple_of(1024) {
                progress(count);
            }
            worst
        };
        Self { triangles: (0..count).into_par_iter().map(needed).collect(), rounding }
    }

    /// The largest stretch of each triangle of the mesh.
    #[must_use]
    pub fn triangles(&self) -> &[PeakStretch] {
        &self.triangles
    }

    /// The triangles, most stretched first.
    #[must_use]
    pub fn ranked(&self) -> Vec<PeakStretch> {
        let mut ranked = self.triangles.clone();
        ranked.sort_by(|a, b| b.stretch.total_cmp(&a.stretch));
        ranked
    }

    /// The triangle that is stretched most.
    ///
    /// # Panics
    /// If the mesh has no triangle.
    #[must_use]
    pub fn worst(&self) -> PeakStretch {
        self.ranked()[0]
    }

    /// Limits for the builder: each triangle's largest stretch, at least 1, plus `margin` (0.1: a tenth), plus the
    /// rounding of the controller's measurement: 0.0006, and up to 0.016 for a triangle with a sharp corner or a flat
    /// tetrahedron. A tree with these limits admits every frame of the motion, even with a margin of 0.
    #[must_use]
    pub fn limits(&self, margin: f32) -> Vec<f32> {
        // No frame is known that `SHARED` alone refuses: 400,000 pairs of flat triangles reached 0.00056. The proven
        // bound on the two roundings of such a pair is 0.00085, so both factors are applied.
        let limit = |(needed, rounding): (&PeakStretch, &f64)| {
            round_up(needed.stretch.max(1.0) * (1.0 + f64::from(margin)) * SHARED * rounding)
        };
        self.triangles.iter().zip(&self.rounding).map(limit).collect()
    }

    /// The triangle that exceeds its limit by the largest factor; `None` if none does.
    ///
    /// # Panics
    /// If the number of limits differs from the number of triangles.
    #[must_use]
    pub fn beyond(&self, limits: &[f32]) -> Option<LimitExcess> {
        assert_eq!(limits.len(), self.triangles.len(), "a limit for each triangle");
        // The builder raises limits to the least that the controller can tell from the rest shape.
        let limits =
            limits.iter().zip(&self.rounding).map(|(&limit, &least)| limit.max(round_up(least)));
        let all = self.triangles.iter().zip(limits);
        let all = all.map(|(&needed, limit)| LimitExcess { needed, limit });
        let worst = all.max_by(|a, b| a.share().total_cmp(&b.share()))?;
        // NaN counts as beyond.
        if worst.share() <= 1.0 { None } else { Some(worst) }
    }
}

/// The largest stretch of any triangle of a surface whose vertices are in the order of the tree's rows, or of any element
/// for the nodes of a tree with [nodes](dibs_nostd::nodes), in f64; `None` if the tree has no rest shape, or positions are
/// missing. [`MeasuredStretch`](dibs_nostd::MeasuredStretch) is the factor for the tree's radii instead: if triangles or
/// elements have their own limits, it multiplies one's stretch by the tree's limit over its own.
#[must_use]
pub fn largest_stretch<I: Index>(tree: &Tree<'_, I>, rows: &[Vec3]) -> Option<f64> {
    let kind = tree.paths();
    if kind == PathKind::Volume {
        let nodes = Nodes::of(tree).ok().filter(|nodes| rows.len() == nodes.count() as usize)?;
        let stretch = |element| {
            let corners = nodes.element(element)?;
            let [a, b, c, d] = corners.map(|node| nodes.rest_position(node).map(Vec3::as_dvec3));
            let rest = edges([a?, b?, c?, d?]);
            Some(largest_stretch_of(
                rest,
                edges(corners.map(|node| rows[node as usize].as_dvec3())),
            ))
        };
        return (0..nodes.element_count())
            .map(stretch)
            .try_fold(0.0, |most, now| Some(f64::max(most, now?)));
    }
    let paths = if kind == PathKind::EdgePath { Paths::Edges } else { Paths::default() };
    let mut largest = 0.0;
    for row in 0..tree.triangle_count() {
        let [a, b, c] = tree.corners(TriangleRow(row))?;
        let rest = [tree.rest_position(a)?, tree.rest_position(b)?, tree.rest_position(c)?];
        let now = [a, b, c].map(|vertex| rows.get(vertex as usize).map(|at| at.as_dvec3()));
        let [Some(a), Some(b), Some(c)] = now else { return None };
        largest = f64::max(largest, stretch(RestShape::new(rest, kind).corners, [a, b, c], paths));
    }
    Some(largest)
}

/// The stretch of a triangle against its rest shape.
fn stretch(rest: [DVec3; 3], now: [DVec3; 3], paths: Paths) -> f64 {
    match paths {
        Paths::Edges => {
            let ratio = |i: usize| {
                let other = (i + 1) % 3;
                now[i].distance(now[other]) / rest[i].distance(rest[other])
            };
            (0..3).map(ratio).fold(0.0, f64::max)
        }
        Paths::Surface { .. } => {
            // The deformation gradient in the plane, and the root of the larger eigenvalue of `F^T F`.
            let gradient = in_plane(now) * in_plane(rest).inverse();
            let metric = gradient.transpose() * gradient;
            let (pp, pq, qq) = (metric.x_axis.x, metric.x_axis.y, metric.y_axis.y);
            ((pp + qq) / 2.0 + ((pp - qq) / 2.0).hypot(pq)).sqrt()
        }
    }
}

/// Two edges of a triangle, in an orthonormal basis of its plane.
fn in_plane([a, b, c]: [DVec3; 3]) -> DMat2 {
    let (along, other) = (b - a, c - a);
    let x = along.normalize_or(DVec3::X);
    let height = (other - x * other.dot(x)).length();
    DMat2::from_cols(DVec2::new(along.length(), 0.0), DVec2::new(other.dot(x), height))
}
