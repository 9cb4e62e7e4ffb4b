//! A query's answer: the closest pair and how certain it is.

// Requirements

use glam::Vec3;

use super::{NoSide, Side};
use crate::math::order::{larger, smaller};
use crate::math::round::{sum_down, sum_up};
use crate::{Coverage, TriangleRow, VertexTable};

/// The closest pair between a tool and a surface, with a certified interval for its separation.
///
/// Lengths are in millimetres. [`interval`](Self::interval) holds the true separation; its
/// ends are twice the accuracy apart if the budget did not end the query early. It relies on the surface's stretch: see
/// [`coverage`](Self::coverage).
///
/// If [`side`](Self::side) is undefined, `separation` and `lower` are computed as for a tool outside, as unsigned
/// distance less radius: too high for a tool that is inside.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Proximity {
    /// The upper end of the certified interval: the least signed distance of any point of the tool's axis, less the
    /// radius `r`. Outside it is `d - r`, with the distance `d` from axis to surface; where the axis crosses or is
    /// inside it is `-D - r`, with the largest distance `D` of any of its points inside. It changes by no more than
    /// tool and surface move. Of several solids it is the least, whether they are one tree or a scene. Where the
    /// surface intersects itself, the inside is that of the closest sheet, and `D` is not certain: it jumps along the
    /// axis.
    pub separation: f32,
    /// Lower end of the certified interval. Equals `separation` unless the budget ran out, or the axis crosses the
    /// surface or is inside: then it is lower by at most [`Options::depth_tolerance`](crate::Options::depth_tolerance), or by more
    /// if the budget or 28 points of the axis were not enough. Without a side see [`interval`](Self::interval).
    pub lower: f32,
    /// The error bound of every separation above: f32 rounding at coordinates of this size.
    pub accuracy: f32,
    /// The side of the surface on which the axis is.
    pub side: Side,
    /// Whether the stretch on which the answer relies was checked.
    pub coverage: Coverage,
    /// Distance from the tool's axis (a sphere's centre, a capsule's segment) to the surface: 0 where it crosses.
    pub axis_distance: f32,
    /// The pair's point on the surface; where the axis crosses or is inside, the surface point closest to its deepest
    /// point.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_surface: Vec3,
    /// The pair's point on the tool's surface.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_tool: Vec3,
    /// Unit vector that leads out: from `point_on_surface` to the tool's axis if outside, from the axis to
    /// `point_on_surface` if inside or crossing. Near contact it is the surface's pseudonormal; zero where there is
    /// none. It can jump where two parts of the surface are equally near (the medial axis): a
    /// [`Tracker`](crate::Tracker) keeps the last tick's triangle while the two tie. If the budget ended the search,
    /// the direction can be that of the last tick's pair.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub direction: Vec3,
    /// Parameter of the pair along the tool's axis: 0 at its start, 1 at its end; 0 for a sphere.
    pub axis_parameter: f32,
    /// The triangle of `point_on_surface`. `None` if the budget ran out while a pin was still the best known point;
    /// `corners` then repeats the pin.
    pub triangle: Option<TriangleRow>,
    /// That triangle's corners, as rows of the vertex table.
    pub corners: [u32; 3],
    /// Weights of the three corners at `point_on_surface`: not negative, sum 1.
    pub barycentric: [f32; 3],
    /// Tests of spheres, and of leaves' and triangles' planes.
    pub node_tests: u32,
    /// Exact tool-triangle tests evaluated.
    pub triangle_tests: u32,
}

impl Proximity {
    /// No pair: the C interface fills it in from the caller's copy.
    #[doc(hidden)]
    pub const NOWHERE: Self = Self {
        separation: f32::NAN,
        lower: f32::NAN,
        accuracy: f32::NAN,
        side: Side::Undefined(NoSide::NotAsked),
        coverage: Coverage::Assumed,
        axis_distance: f32::NAN,
        point_on_surface: Vec3::NAN,
        point_on_tool: Vec3::NAN,
        direction: Vec3::ZERO,
        axis_parameter: 0.0,
        triangle: None,
        corners: [0; 3],
        barycentric: [0.0; 3],
        node_tests: 0,
        triangle_tests: 0,
    };

    /// The certified interval of the separation: both ends include the accuracy, rounded outwards. Act on its lower end.
    ///
    /// Where the side is undefined, the tool may be inside at any depth, and the lower end is negative infinity. If no
    /// side was asked for, or the tree has none, it is that of a tool outside.
    ///
    /// Cost: some ten f32 operations.
    #[must_use]
    pub fn interval(&self) -> Interval {
        let lower = match self.side {
            Side::Undefined(NoSide::NotAsked | NoSide::NoAdjacency) => self.lower,
            Side::Undefined(_) => f32::NEG_INFINITY,
            _ => self.lower,
        };
        Interval {
            lower: sum_down(lower, -self.accuracy),
            upper: sum_up(self.separation, self.accuracy),
        }
    }

    /// Whether the axis is at the surface within the accuracy: then both sides have the same separation within it, and
    /// the direction is the surface's normal.
    pub(crate) fn is_at_surface(&self) -> bool {
        /// Rounding of a coordinate, relative to its size.
        const COORDINATES: f32 = 4.0 / 16_777_216.0;
        let error = self.accuracy + COORDINATES * self.point_on_surface.abs().max_element();
        self.side == Side::Undefined(NoSide::BelowAccuracy) && self.axis_distance <= 2.0 * error
    }

    /// The nearer pair of two searches, with what holds for both: the least lower end, the worst accuracy and coverage,
    /// and the sum of all tests.
    pub(super) fn or_nearer(self, other: Self) -> Self {
        let nearer = if other.separation < self.separation { other } else { self };
        Self {
            lower: smaller(self.lower, other.lower),
            accuracy: larger(self.accuracy, other.accuracy),
            coverage: self.coverage.or_weaker(other.coverage),
            node_tests: self.node_tests.saturating_add(other.node_tests),
            triangle_tests: self.triangle_tests.saturating_add(other.triangle_tests),
            ..nearer
        }
    }

    /// Widens the answer by the table's position error.
    pub(super) fn add_position_error<V: VertexTable + ?Sized>(&mut self, vertices: &V) {
        self.accuracy = sum_up(self.accuracy, vertices.position_error());
    }

    /// Whether the budget ran out before the closest point was certain.
    pub(super) fn is_cut_short(&self) -> bool {
        self.triangle.is_none() || self.lower < self.separation
    }

    /// The same pair, its accuracy widened by `error` (mm, not negative): a vertex error besides the table's position
    /// error, such as the surface's age times the tissue's greatest speed. A distance changes by at most the motion of
    /// its points.
    #[must_use]
    pub fn widened(mut self, error: f32) -> Self {
        self.accuracy = sum_up(self.accuracy, error);
        self
    }
}

/// An interval of separations (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Interval {
    /// No true separation is less.
    pub lower: f32,
    /// No true separation is more.
    pub upper: f32,
}
