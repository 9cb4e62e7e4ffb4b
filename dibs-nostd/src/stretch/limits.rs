//! Limits of a surface besides its stretch, which depend on the tissue.

// Requirement: F-03

/// Limits for a surface to be published, besides the tree's stretch limit.
///
/// They refuse surfaces of impossible position or shape. A closed surface must enclose a volume with the sign of its
/// rest shape's: a mirrored surface is refused, and one turned inside out, however slowly. They do not detect a first
/// frame that is rotated or shifted as a whole (the next correct frame would be too far away), a part of a closed
/// surface that is inside out while the rest encloses more, or a part of a region that shrinks while the rest grows.
///
/// A limit of NaN refuses every frame. With the feature `serde`, an infinite speed or recovery is `null`: no limit.
///
/// ```
/// use dibs_nostd::SurfaceLimits;
/// // 300 mm around the origin, and 0.2 mm a millisecond: a beating heart.
/// let limits = SurfaceLimits::reach_mm(300.0).speed(0.2);
/// assert_eq!(limits, SurfaceLimits::reach_mm(300.0).speed(0.2).shrinkage(0.25));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct SurfaceLimits {
    pub(crate) reach: f32,
    #[cfg_attr(feature = "serde", serde(with = "crate::math::no_limit"))]
    pub(crate) speed: f32,
    #[cfg_attr(feature = "serde", serde(with = "crate::math::no_limit"))]
    pub(crate) recovery: f32,
    pub(crate) shrinkage: f32,
}

impl SurfaceLimits {
    /// Limits each coordinate of a vertex to `reach` (mm). A smaller reach detects more damage, and improves the
    /// accuracy of every query. The speed is not limited; frames farther than a tenth of the reach from the published
    /// one are refused, and so are regions that shrink below a quarter of their size.
    #[must_use]
    pub const fn reach_mm(reach: f32) -> Self {
        Self { reach, speed: f32::INFINITY, recovery: reach * 0.1, shrinkage: 0.25 }
    }

    /// The largest speed of any vertex, in mm per millisecond (m/s): from one published frame to the next a
    /// vertex may move by the speed times the time between their captures plus one millisecond.
    ///
    /// After a refused frame the published one ages, which a [`FailSafe`](crate::failsafe::FailSafe) watches, and later
    /// frames may be farther from it, up to the limit on [recovery](Self::recovery_mm). For a frame captured before a
    /// published one the time is 0. Delayed frames that arrive in a burst seem faster than they are: allow for that.
    #[must_use]
    pub const fn speed(mut self, speed: f32) -> Self {
        self.speed = speed;
        self
    }

    /// The farthest (mm) that a vertex may be from its position in the published frame, however old that is: after a
    /// silence, a surface that is mirrored, rotated or shifted as a whole is refused. A tenth of the reach by default;
    /// infinite for no limit.
    ///
    /// A surface that was really moved farther, for example with the patient, is refused until it is registered anew:
    /// [`Assembler::register`](crate::Assembler::register).
    #[must_use]
    pub const fn recovery_mm(mut self, distance: f32) -> Self {
        self.recovery = distance;
        self
    }

    /// The least size of each of the [`REGIONS`](crate::REGIONS), as a fraction of its size at rest; 0 for no limit.
    /// The size is the root mean square of one edge of each triangle, independent of the triangles' stretch limits. An
    /// element with its own limit counts at rest as smaller by the ratio to the tree's limit. The size is checked from
    /// the first frame on, so a collapsed surface, one of zeros, or one in metres instead of millimetres is refused at
    /// once.
    #[must_use]
    pub const fn shrinkage(mut self, part: f32) -> Self {
        self.shrinkage = part;
        self
    }
}
