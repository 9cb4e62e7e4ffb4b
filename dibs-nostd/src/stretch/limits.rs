//! Limits of a surface besides its stretch, chosen by a user who knows the tissue.

/// Limits that a surface must keep to before it is published; the tree knows its stretch limit by itself.
///
/// They refuse surfaces in impossible places or shapes. They do not see a first frame that is turned, mirrored or moved
/// as a whole (only the next one would be too fast), or a part of a region that shrinks while the rest makes up for it.
///
/// A limit of NaN refuses every frame.
///
/// ```
/// use dibs_nostd::SurfaceLimits;
/// // 300 mm around the origin, and 0.2 mm a tick of 1 ms: a beating heart.
/// let limits = SurfaceLimits::reach_mm(300.0).speed(0.2);
/// assert_eq!(limits, SurfaceLimits::reach_mm(300.0).speed(0.2).shrinkage(0.25));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SurfaceLimits {
    pub(crate) reach: f32,
    pub(super) speed: f32,
    pub(super) shrinkage: f32,
}

impl SurfaceLimits {
    /// No coordinate of any vertex beyond `reach` (mm) on each axis; the smaller, the more damage it tells from a
    /// surface, and the better the accuracy that every query has. No limit on speed, and regions that shrink to a
    /// quarter of their size are refused.
    #[must_use]
    pub const fn reach_mm(reach: f32) -> Self {
        Self { reach, speed: f32::INFINITY, shrinkage: 0.25 }
    }

    /// The largest speed of any vertex, in mm per unit of the receiver's clock: from one published frame to the
    /// next no vertex moves farther than that times the time between their captures, and one unit more.
    ///
    /// A refused frame is not the last word: the longer the published one has stood, the farther the next may be
    /// from it. Until then the surface ages, which a [`FailSafe`](crate::failsafe::FailSafe) watches. Frames that
    /// were held up and come in a burst seem faster than they are: choose with that in mind.
    #[must_use]
    pub const fn speed(mut self, speed: f32) -> Self {
        self.speed = speed;
        self
    }

    /// The least size of each of the [`REGIONS`](crate::REGIONS), as a part of its size at rest: a length, the root
    /// mean square of an edge of each of its triangles (of which those with a smaller stretch limit than the largest
    /// count for less). 0 for no limit. Checked from the first frame on, so a
    /// collapsed surface, one of zeros, or one in metres instead of millimetres is refused at once.
    #[must_use]
    pub const fn shrinkage(mut self, part: f32) -> Self {
        self.shrinkage = part;
        self
    }
}
