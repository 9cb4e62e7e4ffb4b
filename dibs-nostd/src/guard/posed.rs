//! Frames with a rigid pose each: the tool is moved by the inverse pose, so that the layers below need no poses.

// Requirement: F-08

use core::marker::PhantomData;

use glam::Vec3;

use super::pose_admission::PoseAdmissionCheck;
use super::poses::Poses;
use super::rows::{Blend, Rows, sealed};
use super::{SearchedSurface, Vertices};
use crate::filter::{AdmittedMotion, Filter, Reason, RigidMotion};
use crate::math::sqrt::sqrt;
use crate::surface::{PoseStep, grown};
use crate::tree::VertexOrder;
use crate::{
    Contacts, Error, FrameGuard, Index, Proximity, QueryError, RigidPose, SurfaceLimits, Tool,
    TrackerAnswer, Tree, Unavailable, VertexTable,
};

/// Frames of rows `R`, each with a rigid pose: the position of the mesh as a whole, for example from a tracker of the
/// patient, besides its deformation. [`Bus::frame_at`](super::Bus::frame_at) takes them; tools, answers and commands
/// are in world coordinates.
///
/// A frame without a pose is in the mesh's own coordinates; a partial frame keeps the pose of the frame that it
/// changes. The limits on [speed](crate::SurfaceLimits::speed) and [recovery](crate::SurfaceLimits::recovery_mm) apply
/// to the sum of the rows' step and the pose's, even if one cancels the other: a mesh that moved far without frames is
/// registered anew. The [reach](crate::SurfaceLimits::reach_mm) limits the rows alone.
/// [`FrameEncoder::with_pose`](crate::wire::FrameEncoder::with_pose) makes packets of a frame with its pose.
///
/// Between frames the mesh continues its last step: its centre in a straight line, with a constant turn rate. After a
/// step of more than half a radian the surface is held.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{Advance, Millis, Sphere, TreeBytes, glam::{Quat, Vec3}};
/// use dibs_nostd::guard::{GuardLimits, PosedRows, Surface};
///
/// # let heart = generate::heart(320)?.mesh;
/// # let built = Builder::new().stretch(1.5).build(&heart)?;
/// # let tree = TreeBytes::<u16>::new(built.blob());
/// static HEART: Surface<162, PosedRows> = Surface::new();
/// let (mut bus, mut guard) = HEART.start::<_, 32, 64>(tree, GuardLimits::new(300.0, Millis(80)))?;
///
/// // The patient lies 500 mm away.
/// bus.frame_at(&heart.positions, (Quat::IDENTITY, Vec3::X * 500.0), Millis(5), Millis(8))?;
/// while bus.work(100)? == Advance::Pending {}
/// let tool = Sphere::new(Vec3::new(580.0, 0.0, 20.0), 2.5)?;
/// let found = guard.closest(&tool, Millis(10)).tracked?.closest;
/// assert!(found.point_on_surface.x > 500.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PosedRows<R = Vertices>(PhantomData<R>);

impl<R: Rows<Poses = ()>> sealed::Sealed for PosedRows<R> {}

/// The facts of a tree about rows with poses.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct PosedFacts<T> {
    of: T,
    /// The centre of the rest shape, about which the mesh turns between frames.
    centre: Vec3,
}

impl<R: Rows<Poses = ()>> Rows for PosedRows<R> {
    type Of<'t> = PosedFacts<R::Of<'t>>;
    type AdmissionCheck<'s, 't, I: Index> = PoseAdmissionCheck<'s, R::AdmissionCheck<'s, 't, I>>;
    type Surface<'f> = R::Surface<'f>;
    type Room<'f> = R::Room<'f>;
    type Poses = Poses;

    fn of<'t, I: Index>(tree: &Tree<'t, I>) -> Result<Self::Of<'t>, Error> {
        let of = R::of(tree)?;
        let rest = (0..R::count(tree, &of)).map_while(|row| R::rest(tree, &of, row));
        let corners =
            rest.map(|at| (at, at)).reduce(|(low, high), (at, _)| (low.min(at), high.max(at)));
        // Any centre is valid: the farther it is from the mesh, the looser the bound on the motion of a turn.
        let centre = corners.map_or(Vec3::ZERO, |(low, high)| (low + high) * 0.5);
        Ok(PosedFacts { of, centre })
    }

    fn count<I: Index>(tree: &Tree<'_, I>, of: &Self::Of<'_>) -> u32 {
        R::count(tree, &of.of)
    }

    fn rest<I: Index>(tree: &Tree<'_, I>, of: &Self::Of<'_>, row: u32) -> Option<Vec3> {
        R::rest(tree, &of.of, row)
    }

    fn amplification(of: &Self::Of<'_>) -> f32 {
        R::amplification(&of.of)
    }

    fn order<'t, I: Index>(tree: &Tree<'t, I>, of: &Self::Of<'t>) -> VertexOrder<'t, I> {
        R::order(tree, &of.of)
    }

    fn admission_check<'s, 't, I: Index>(
        tree: &Tree<'t, I>,
        of: &Self::Of<'t>,
        limits: SurfaceLimits,
        poses: &'s Poses,
    ) -> Result<Self::AdmissionCheck<'s, 't, I>, Error> {
        let admission_check = R::admission_check(tree, &of.of, limits, &())?;
        Ok(PoseAdmissionCheck::new(admission_check, poses, of.centre, R::amplification(&of.of)))
    }

    fn surface<'s, 'f: 's, 't: 'f>(
        of: &'f Self::Of<'t>,
        rows: &'f Blend<'f>,
        room: &'s mut Self::Room<'f>,
    ) -> &'s Self::Surface<'f> {
        R::surface(&of.of, rows, room)
    }

    fn velocity(of: &Self::Of<'_>, rows: &Blend<'_>, corners: [u32; 3], weights: [f32; 3]) -> Vec3 {
        R::velocity(&of.of, rows, corners, weights)
    }

    /// If no pose is known for later times, the rows are held as well.
    fn now<'f>(of: &Self::Of<'_>, poses: &Poses, published: &'f FrameGuard<'f>) -> Blend<'f> {
        if poses.are_none(published) || poses.step(published, of.centre).is_some() {
            published.extrapolated()
        } else {
            published.held()
        }
    }

    fn placed(
        of: &Self::Of<'_>,
        poses: &Poses,
        published: &FrameGuard<'_>,
        rows: &Blend<'_>,
    ) -> Option<TickPose> {
        // Frames that never had a pose are treated exactly as rows alone, to the bit.
        if poses.are_none(published) {
            return None;
        }
        Some(match poses.step(published, of.centre) {
            Some((step, residual)) => TickPose::moving(step, residual, rows),
            None => TickPose::at(poses.last(published)),
        })
    }
}

/// The pose of the surface at a tick.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct TickPose {
    pose: RigidPose,
    /// The step that continues, the fraction of it beyond the last frame, and steps per second.
    step: Option<(PoseStep, f32, f32)>,
    /// The error of the extrapolation (mm), and the residual from which it grows.
    error: f32,
    residual: f32,
}

impl TickPose {
    const fn at(pose: RigidPose) -> Self {
        Self { pose, step: None, error: 0.0, residual: 0.0 }
    }

    fn moving(step: PoseStep, residual: f32, rows: &Blend<'_>) -> Self {
        let part = rows.t() - 1.0;
        Self {
            pose: step.beyond(part),
            step: Some((step, part, rows.rate())),
            error: grown(residual, part),
            residual,
        }
    }

    /// The tool in the mesh's coordinates.
    pub(super) fn tool<T: Tool>(&self, tool: &T) -> T {
        tool.with_axis(self.ends(tool))
    }

    /// The end is the start plus the turned span: so rounding does not grow with the distance to the world's origin.
    fn ends(&self, tool: &impl Tool) -> [Vec3; 2] {
        let start = self.pose.apply_inverse(tool.axis_start());
        [start, start + self.pose.rotate_inverse(tool.axis_span())]
    }

    /// Upper bound (mm) on the error of a point of the tool's axis, besides the rows' own errors.
    ///
    /// The end has the start's error plus that of the turned span. In halves of a unit: 1 for its coordinates, a sum,
    /// and 6 for the span as the tool stores it (a difference, a division, and a product at each read). Points between
    /// have at most the larger error of the ends.
    pub(super) fn error(&self, tool: &impl Tool) -> f32 {
        let [start, end] = self.ends(tool);
        let span = end - start;
        let kept = (end.abs() + span.abs() * 6.0).element_sum() * (0.5 * f32::EPSILON);
        self.rounding(start) + self.rounding_of_vector(span) + kept + self.error
    }

    /// Upper bound (mm) on the rounding of a point that was transformed to the mesh.
    fn rounding(&self, local: Vec3) -> f32 {
        match &self.step {
            Some((step, part, _)) => step.rounding(local, &self.pose, *part),
            None => RigidPose::rounding(local),
        }
    }

    /// The same for a vector.
    fn rounding_of_vector(&self, local: Vec3) -> f32 {
        match &self.step {
            Some((step, part, _)) => step.rounding_of_vector(local, *part),
            None => RigidPose::rounding(local),
        }
    }

    /// Upper bound (mm) on the additional error of a tool's point in mesh coordinates during a motion that a filter
    /// admits for a period: the robot executes it in the world.
    ///
    /// A translation has the rounding of its turned vector. A rotation moves a point by the error of its vector times
    /// the arm; an error of the reference point adds that error times the angle.
    pub(super) fn error_of_motion<T: Tool, const LABELS: usize>(
        &self,
        tool: &T,
        motion: &RigidMotion,
        (filter, period): (&Filter<LABELS>, f32),
    ) -> f32 {
        let (shift, turn) = filter.most(tool, motion, period);
        let mut arm = 0.0;
        for end in [tool.axis_start(), tool.axis_point(1.0)] {
            let far = sqrt(end.distance_squared(motion.about));
            if far > arm {
                arm = far;
            }
        }
        // The sum of a vector's coordinates is at most its length times the square root of three.
        let turned = self.rounding_of_vector(Vec3::X * (1.75 * (shift + turn * arm)));
        turned + turn * self.rounding(motion.about)
    }

    /// The searched surface and the answer for the moved tool, in world coordinates.
    pub(super) fn in_world(
        &self,
        tool: &impl Tool,
        tracked: Result<TrackerAnswer, QueryError>,
        mut searched: SearchedSurface,
    ) -> (Option<SearchedSurface>, Result<TrackerAnswer, Unavailable>) {
        let error = self.error(tool);
        searched.position_error += error;
        searched.residual = searched.residual.map(|residual| residual + self.residual);
        searched.velocity = self.pose.rotate(searched.velocity);
        let tracked = tracked.map(|answer| {
            let closest = answer.closest;
            let on_surface = self.pose.apply(closest.point_on_surface);
            if let Some((step, part, rate)) = self.step {
                searched.velocity += step.velocity(part, on_surface) * rate;
            }
            let closest = Proximity {
                point_on_surface: on_surface,
                point_on_tool: self.pose.apply(closest.point_on_tool),
                direction: self.pose.rotate(closest.direction),
                ..closest.widened(error)
            };
            TrackerAnswer { closest, ..answer }
        });
        (Some(searched), tracked.map_err(Unavailable::Query))
    }

    /// The velocity (mm/s) of a point of a triangle due to the pose, in mesh coordinates.
    pub(super) fn flow(
        &self,
        surface: &impl VertexTable,
        corners: [u32; 3],
        weights: [f32; 3],
    ) -> Vec3 {
        let Some((step, part, rate)) = self.step else { return Vec3::ZERO };
        let mut point = Vec3::ZERO;
        for (corner, weight) in corners.into_iter().zip(weights) {
            point += surface.position(corner).unwrap_or_default() * weight;
        }
        self.pose.rotate_inverse(step.velocity(part, self.pose.apply(point)) * rate)
    }

    /// The contacts of the moved tool, in world coordinates.
    pub(super) fn lead_back<const N: usize, const NEAR: usize>(
        &self,
        contacts: &mut Contacts<N, NEAR>,
    ) {
        contacts.transform(|point| self.pose.apply(point), |vector| self.pose.rotate(vector));
    }

    /// The motion in mesh coordinates.
    pub(super) fn motion(&self, motion: &RigidMotion) -> RigidMotion {
        RigidMotion {
            about: self.pose.apply_inverse(motion.about),
            translation: self.pose.rotate_inverse(motion.translation),
            rotation: self.pose.rotate_inverse(motion.rotation),
        }
    }

    /// The admitted motion in world coordinates; the command itself if that was admitted.
    pub(super) fn admitted(
        &self,
        admitted: AdmittedMotion,
        command: &RigidMotion,
    ) -> AdmittedMotion {
        let motion = match admitted.reason {
            Reason::Commanded => *command,
            _ => RigidMotion {
                about: command.about,
                translation: self.pose.rotate(admitted.motion.translation),
                rotation: self.pose.rotate(admitted.motion.rotation),
            },
        };
        AdmittedMotion { motion, ..admitted }
    }
}

#[cfg(test)]
mod tests;
