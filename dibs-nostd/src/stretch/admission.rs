//! The last check of a frame before it is published, as a trait, so that users can write their own.

use core::ops::Range;

use super::{StretchError, measure_stretch};
use crate::math::order::larger;
#[cfg(feature = "bus")]
use crate::surface::RigidPose;
use crate::surface::{MeasuredStretch, Millis, MotionUnit, VertexTable};
use crate::tree::{Index, SurfaceFacts, Tree};

/// The part of the published surface that a frame changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameExtent {
    /// Every row.
    Whole,
    /// Some rows; the others stay as published.
    Partial,
}

/// The state of a check.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Admission {
    /// Not finished: more work or rows are needed.
    Pending,
    /// The whole surface may be published; with its stretch, if measured.
    Admitted(Option<MeasuredStretch>),
}

/// A surface that is being received.
#[derive(Clone, Copy, Debug)]
pub struct IncomingSurface<'a, V: ?Sized> {
    /// Its rows: those below `ready` have their final values, the others are arbitrary.
    pub surface: &'a V,
    /// Number of final rows. It only grows within a frame, and is the number of all rows once the frame is complete.
    pub ready: u32,
    /// The published surface, and the time from its capture to this one's; `None` before the first, and for a
    /// [registration](crate::Assembler::register).
    pub before: Option<(&'a V, Millis)>,
    /// The motion of the rows since `before`, if already measured.
    #[doc(hidden)]
    pub compared: Option<Comparison>,
}

/// The comparison of a surface's rows with the published ones.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    /// The largest squared distance (mm²) of any row compared so far.
    pub largest: f32,
    /// Start and end of a range of rows that contains it.
    pub rows: [u32; 2],
    /// The fraction of the previous step that was added to the published rows for this comparison; NaN if none was.
    pub t: f32,
}

impl Comparison {
    /// The factor from the observed residual to that of the next extrapolation. With a constant acceleration the error,
    /// a time `b` beyond a step that took `a`, grows as `b (a + b)`. For the observed residual `b` was the last step's
    /// time; for the next one both times are assumed to be the last step's. With `t = b / a` of the observed one the
    /// factor is `2 t / (1 + t)`.
    #[cfg(feature = "bus")]
    pub(crate) fn growth(&self) -> f32 {
        let growth = 2.0 * self.t / (1.0 + self.t);
        larger(1.0, growth)
    }
}

impl<'a, V: ?Sized> IncomingSurface<'a, V> {
    /// A first surface, with the rows below `ready`.
    #[must_use]
    pub const fn new(surface: &'a V, ready: u32) -> Self {
        Self { surface, ready, before: None, compared: None }
    }
}

/// Checks the surface that is being received, in slices of bounded work.
///
/// For each frame: [`begin`](Self::begin) once, then [`moved`](Self::moved) for each packet and
/// [`advance`](Self::advance) as often as there is time, until it admits or refuses the frame. A frame may be abandoned
/// at any time, and another begun. [`published`](Self::published) follows once an admitted frame is published.
///
/// A user's admission check wraps the library's: in this example whole frames wait until somebody has confirmed them. A
/// wrapper that, like this one, does not forward the other methods has frames without measured motion.
///
/// ```
/// use core::ops::Range;
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{
///     Admission, FrameExtent, AdmissionCheck, IncomingSurface, StretchError, StretchMonitor, Tree, VertexTable,
/// };
///
/// struct Confirmed<G> {
///     measured: G,
///     is_confirmed: bool,
/// }
///
/// impl<G: AdmissionCheck> AdmissionCheck for Confirmed<G> {
///     fn begin(&mut self, changed: FrameExtent) {
///         self.is_confirmed |= changed == FrameExtent::Partial;
///         self.measured.begin(changed);
///     }
///     fn moved(&mut self, rows: Range<u32>) {
///         self.measured.moved(rows);
///     }
///     fn advance<V: VertexTable + ?Sized>(
///         &mut self,
///         arriving: IncomingSurface<'_, V>,
///         work: u32,
///     ) -> Result<Admission, StretchError> {
///         let admission = self.measured.advance(arriving, work)?;
///         Ok(if self.is_confirmed { admission } else { Admission::Pending })
///     }
///     fn published(&mut self) {
///         self.is_confirmed = false;
///         self.measured.published();
///     }
/// }
///
/// let heart = generate::heart(320)?.mesh;
/// let built = Builder::new().build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let rows = built.to_rows(&heart.positions);
/// let mut admission_check = Confirmed { measured: StretchMonitor::new(&tree)?, is_confirmed: false };
///
/// admission_check.begin(FrameExtent::Whole);
/// admission_check.moved(0..tree.vertex_count());
/// let arriving = || IncomingSurface::new(rows.as_slice(), tree.vertex_count());
/// assert_eq!(admission_check.advance(arriving(), u32::MAX)?, Admission::Pending);
/// admission_check.is_confirmed = true;
/// assert!(matches!(admission_check.advance(arriving(), u32::MAX)?, Admission::Admitted(Some(_))));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait AdmissionCheck {
    /// A frame begins; the previous one is discarded unless it was published. O(1).
    fn begin(&mut self, changed: FrameExtent);

    /// These rows of the frame have arrived: each row at most once, packets in any order. O(1).
    fn moved(&mut self, rows: Range<u32>) {
        let _ = rows;
    }

    /// Whether frames may come with a pose.
    #[doc(hidden)]
    fn takes_poses(&self) -> bool {
        false
    }

    /// The current frame has this pose.
    #[doc(hidden)]
    #[cfg(feature = "bus")]
    fn place(&mut self, pose: RigidPose) {
        let _ = pose;
    }

    /// Checks at most `work` rows and triangles that have arrived. Admission before the frame is complete has no
    /// effect.
    ///
    /// # Errors
    /// [`StretchError`] if the surface must not be published; it names the triangle or vertex.
    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        arriving: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError>;

    /// The admitted frame is now the published one.
    fn published(&mut self) {}

    /// Smallest and largest admitted weight of a mode. With `None`, as for most admission checks, the receiver takes
    /// frames of vertices; with a range it takes only modal frames. The rows of a modal frame are
    /// [`Vec3`](crate::glam::Vec3)s with one weight each, as `x`.
    fn weight_range(&self, mode: u32) -> Option<[f32; 2]> {
        let _ = mode;
        None
    }

    /// Upper bound (mm) on the distance of any vertex from its position in a surface captured this much earlier: see
    /// [`SurfaceLimits::speed`](crate::SurfaceLimits::speed) and [`recovery_mm`](crate::SurfaceLimits::recovery_mm).
    /// Infinite for an admission check that compares no frames.
    fn farthest(&self, elapsed: Millis) -> f32 {
        let _ = elapsed;
        f32::INFINITY
    }

    /// The unit in which the motion from one published frame to the next is counted; `None` if it is not measured.
    #[doc(hidden)]
    fn motion_unit(&self) -> Option<MotionUnit> {
        None
    }

    /// Whether this row carries a part of the surface: if not, its motion does not count.
    #[doc(hidden)]
    fn carries(&self, row: u32) -> bool {
        let _ = row;
        true
    }

    /// The stretch at the end of the frame's extrapolation, once the frame is admitted. `None` if the admission check
    /// does not measure it, or it is beyond the limit.
    #[doc(hidden)]
    fn ahead(&self) -> Option<f32> {
        None
    }

    /// The facts of the admission check's surface; the default has none.
    #[doc(hidden)]
    fn surface_facts(&self) -> SurfaceFacts {
        SurfaceFacts::default()
    }

    /// The error (mm) of computing the surface from the frame's rows: added to the frame's position error.
    fn position_error(&self) -> f32 {
        0.0
    }
}

/// Admits every surface, unmeasured. Answers then rely on the paper's assumption that the tissue stays within the
/// tree's stretch limit.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAdmissionCheck;

impl AdmissionCheck for NoAdmissionCheck {
    fn begin(&mut self, _: FrameExtent) {}

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        _: IncomingSurface<'_, V>,
        _: u32,
    ) -> Result<Admission, StretchError> {
        Ok(Admission::Admitted(None))
    }
}

/// A tree admits surfaces within its stretch limit, by one [`measure_stretch`] once the frame is complete. Not sliced:
/// that call's cost is linear in the triangles, whatever `work` is.
impl<I: Index> AdmissionCheck for &Tree<'_, I> {
    fn begin(&mut self, _: FrameExtent) {}

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        IncomingSurface { surface, ready, .. }: IncomingSurface<'_, V>,
        _: u32,
    ) -> Result<Admission, StretchError> {
        if (ready as usize) < surface.len() {
            return Ok(Admission::Pending);
        }
        measure_stretch(self, surface).map(|stretch| Admission::Admitted(Some(stretch)))
    }

    fn motion_unit(&self) -> Option<MotionUnit> {
        Some(MotionUnit::of(self))
    }

    fn surface_facts(&self) -> SurfaceFacts {
        (**self).surface_facts()
    }
}
