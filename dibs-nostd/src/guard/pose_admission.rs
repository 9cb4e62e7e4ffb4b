//! The check of a frame with a pose: the rows by their own admission check, and both together by the limit on speed.

// Requirement: F-08

use core::ops::Range;

use glam::Vec3;

use super::poses::Poses;
use crate::math::sqrt::sqrt;
use crate::stretch::{
    Admission, AdmissionCheck, Comparison, FrameExtent, IncomingSurface, StretchError,
};
use crate::surface::{MotionUnit, PoseStep};
use crate::tree::SurfaceFacts;
use crate::{Millis, RigidPose, VertexTable};

const BUFFERS: u32 = 3;

/// The admission check of rows with poses.
#[doc(hidden)]
#[derive(Debug)]
pub struct PoseAdmissionCheck<'s, G> {
    rows: G,
    poses: &'s Poses,
    centre: Vec3,
    /// A vertex is no farther from the centre than the farthest row times this.
    amplification: f32,
    /// The pose of the frame being checked, its farthest row from the centre, and the next row to be examined.
    pose: RigidPose,
    farthest: (u32, f32),
    next_row: u32,
    /// The poses of the last two published frames.
    last: Option<RigidPose>,
    before: Option<RigidPose>,
    /// The buffer of the frame being checked: buffers alternate, and the first frame is in the second.
    buffer: u32,
}

impl<'s, G> PoseAdmissionCheck<'s, G> {
    pub(super) fn new(rows: G, poses: &'s Poses, centre: Vec3, amplification: f32) -> Self {
        Self {
            rows,
            poses,
            centre,
            amplification,
            pose: RigidPose::IDENTITY,
            farthest: (0, 0.0),
            next_row: 0,
            last: None,
            before: None,
            buffer: 1,
        }
    }

    /// Whether poses move any point: if all are the same, the lever arm is not needed.
    fn moves(&self) -> bool {
        let is_other = |pose: &Option<RigidPose>| pose.is_some_and(|pose| pose != self.pose);
        is_other(&self.last) || is_other(&self.before)
    }

    /// Searches the received rows for the one farthest from the centre. Returns the work left.
    fn check<V: VertexTable + ?Sized>(&mut self, surface: &V, ready: u32, work: u32) -> u32 {
        let waiting = ready.saturating_sub(self.next_row);
        let rows = if waiting < work { waiting } else { work };
        let end = self.next_row.saturating_add(rows);
        for row in self.next_row..end {
            let square =
                surface.position(row).map_or(f32::NAN, |at| at.distance_squared(self.centre));
            // Written so that NaN is kept.
            if !(square <= self.farthest.1) && !self.farthest.1.is_nan() {
                self.farthest = (row, square);
            }
        }
        self.next_row = end;
        work.saturating_sub(rows)
    }

    /// Upper bound (mm) on the distance of any vertex of the frame from the centre.
    fn lever(&self) -> f32 {
        let (_, square) = self.farthest;
        sqrt(square) * (self.amplification * (1.0 + 8.0 * f32::EPSILON))
    }

    /// The largest distance (mm) of a vertex from the extrapolation of the two previous poses. It uses the fraction of
    /// a step that the rows' extrapolation added, and grows like it; NaN if the rows were not extrapolated.
    fn residual(&self, compared: &Comparison) -> f32 {
        let (Some(before), Some(last)) = (&self.before, &self.last) else { return f32::NAN };
        PoseStep::between(before, last, self.centre).map_or(f32::NAN, |step| {
            let off = step.beyond(compared.t).step(&self.pose, self.centre, self.lever());
            off * compared.growth()
        })
    }
}

impl<G: AdmissionCheck> PoseAdmissionCheck<'_, G> {
    /// A vertex moves by at most its row's step in the mesh plus the step of the pose, turned and shifted, at its
    /// current position.
    fn check_speed(&self, compared: &Comparison, elapsed: Millis) -> Result<(), StretchError> {
        let Some(last) = &self.last else { return Ok(()) };
        let limit = self.rows.farthest(elapsed) * self.amplification;
        let own = sqrt(compared.largest) * self.amplification;
        let step = own + last.step(&self.pose, self.centre, self.lever());
        // False for NaN.
        if step <= limit {
            return Ok(());
        }
        let (vertex, _) = self.farthest;
        Err(StretchError::TooFast { vertex, step, limit })
    }
}

impl<G: AdmissionCheck> AdmissionCheck for PoseAdmissionCheck<'_, G> {
    fn begin(&mut self, changed: FrameExtent) {
        let kept = match changed {
            FrameExtent::Whole => None,
            FrameExtent::Partial => self.last,
        };
        self.pose = kept.unwrap_or(RigidPose::IDENTITY);
        (self.farthest, self.next_row) = ((0, 0.0), 0);
        self.rows.begin(changed);
    }

    fn takes_poses(&self) -> bool {
        true
    }

    fn place(&mut self, pose: RigidPose) {
        self.pose = pose;
    }

    fn moved(&mut self, rows: Range<u32>) {
        self.rows.moved(rows);
    }

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        arriving: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError> {
        let IncomingSurface { surface, ready, before, compared } = arriving;
        let is_checking = self.moves();
        let work = if is_checking { self.check(surface, ready, work) } else { work };
        let admission = self.rows.advance(arriving, work)?;
        let is_waiting = is_checking && (self.next_row as usize) < surface.len();
        if admission == Admission::Pending || is_waiting {
            return Ok(Admission::Pending);
        }
        // A registration is not compared with an earlier frame.
        let mut residual = f32::NAN;
        if let (Some((_, elapsed)), Some(compared)) = (before, &compared) {
            self.check_speed(compared, elapsed)?;
            residual = self.residual(compared);
        }
        self.poses.set(self.buffer, &self.pose, residual);
        Ok(admission)
    }

    fn published(&mut self) {
        self.before = self.last.replace(self.pose);
        self.buffer = if self.buffer + 1 < BUFFERS { self.buffer + 1 } else { 0 };
        self.rows.published();
    }

    fn motion_unit(&self) -> Option<MotionUnit> {
        self.rows.motion_unit()
    }

    fn ahead(&self) -> Option<f32> {
        self.rows.ahead()
    }

    fn carries(&self, row: u32) -> bool {
        self.rows.carries(row)
    }

    fn surface_facts(&self) -> SurfaceFacts {
        self.rows.surface_facts()
    }

    fn position_error(&self) -> f32 {
        self.rows.position_error()
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::guard::SharedState;

    /// Admits rows without work, up to this distance (mm).
    struct AtOnce(f32);

    impl AdmissionCheck for AtOnce {
        fn begin(&mut self, _: FrameExtent) {}

        fn advance<V: VertexTable + ?Sized>(
            &mut self,
            _: IncomingSurface<'_, V>,
            _: u32,
        ) -> Result<Admission, StretchError> {
            Ok(Admission::Admitted(None))
        }

        fn farthest(&self, _: Millis) -> f32 {
            self.0
        }
    }

    /// The verdict on a frame that turns by a tenth of a radian, row by row, and the number of slices.
    fn turned(rows: &[Vec3], limit: f32) -> (Result<Admission, StretchError>, usize) {
        let poses = Poses::NEW;
        let mut admission_check = PoseAdmissionCheck::new(AtOnce(limit), &poses, Vec3::ZERO, 1.0);
        let count = rows.len() as u32;
        admission_check.begin(FrameExtent::Whole);
        let first = admission_check.advance(IncomingSurface::new(rows, count), 1);
        assert_eq!(first, Ok(Admission::Admitted(None)));
        admission_check.published();
        admission_check.begin(FrameExtent::Whole);
        admission_check
            .place(RigidPose::new(Quat::from_rotation_z(0.1), Vec3::ZERO).expect("a rotation"));
        let compared = Some(Comparison { largest: 0.0, rows: [0, 0], t: f32::NAN });
        let before = Some((rows, Millis(30)));
        let mut verdicts = (1..=rows.len()).map(|slices| {
            let next = IncomingSurface { before, compared, ..IncomingSurface::new(rows, count) };
            (admission_check.advance(next, 1), slices)
        });
        verdicts.find(|(verdict, _)| *verdict != Ok(Admission::Pending)).expect("all is examined")
    }

    /// A turn moves the farthest row most, so a frame waits until all rows are examined.
    #[test]
    fn a_turn_is_judged_by_the_farthest_row() {
        let rows = [Vec3::X, Vec3::X * 2.0, Vec3::X * 50.0, Vec3::Y];
        let (verdict, slices) = turned(&rows, 4.0);
        assert!(matches!(verdict, Err(StretchError::TooFast { vertex: 2, .. })), "{verdict:?}");
        assert_eq!(slices, rows.len());
        assert_eq!(turned(&rows, 6.0), (Ok(Admission::Admitted(None)), rows.len()));
    }

    /// No later row hides one that is not a number.
    #[test]
    fn a_row_that_is_not_a_number_is_too_fast() {
        let (verdict, _) = turned(&[Vec3::X, Vec3::NAN, Vec3::Y * 2.0, Vec3::X], 4.0);
        assert!(matches!(verdict, Err(StretchError::TooFast { vertex: 1, .. })), "{verdict:?}");
    }
}
