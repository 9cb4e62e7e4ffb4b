//! The control tick's end: pose in, answer out.

use glam::Vec3;

use super::surface::Notes;
use super::{Answer, GuardLimits, Searched};
use crate::failsafe::{AcknowledgeError, FailSafe, Observation};
use crate::{
    Error, FrameAge, FrameReader, Index, Millis, Options, Tool, Tracker, TrackerAnswer, Tree,
    TreeBytes, Unavailable, VertexTable,
};

/// The control tick's end of a [`Surface`](super::Surface): the closest pair of one tool on the surface as it is now,
/// and the trust in it.
///
/// Keep it in a `static` or in a task's memory. RAM: that of a [`Tracker`] with `OPENED` slots, and less than 500 bytes.
#[derive(Debug)]
pub struct Guard<'s, 't, I, const STACK: usize, const OPENED: usize> {
    notes: &'s Notes,
    reader: FrameReader<'s>,
    tree: TreeBytes<'t, I>,
    tracker: Tracker<'t, I, STACK, OPENED>,
    failsafe: FailSafe,
    options: Options,
    /// Ticks a second.
    rate: f32,
    before: Option<Pose>,
}

/// The tool's axis at a tick.
#[derive(Clone, Copy, Debug)]
struct Pose {
    start: Vec3,
    end: Vec3,
    at: Millis,
}

impl Pose {
    fn of(tool: &impl Tool, at: Millis) -> Self {
        Self { start: tool.axis_start(), end: tool.axis_point(1.0), at }
    }

    /// Velocity (mm/s) of the axis' point at a parameter since an earlier pose. Where the clock shows that ticks were
    /// left out, as slow as they make it.
    fn velocity(&self, before: &Self, rate: f32, parameter: f32) -> Vec3 {
        let (start, end) = (self.start - before.start, self.end - before.end);
        // Two readings of a clock in milliseconds are up to one less apart than they seem.
        let elapsed = self.at.since(before.at).0.saturating_sub(1) as f32;
        let rate = if elapsed * rate > 1_000.0 { 1_000.0 / elapsed } else { rate };
        (start + (end - start) * parameter) * rate
    }
}

impl<'s, 't, I: Index, const STACK: usize, const OPENED: usize> Guard<'s, 't, I, STACK, OPENED> {
    /// The control tick's end of buffers in anybody's memory, of which there are three.
    ///
    /// # Errors
    /// [`Error`]: the stack is too small for the tree, or a limit is out of range.
    #[doc(hidden)]
    #[inline(always)]
    pub fn new(
        notes: &'s Notes,
        reader: FrameReader<'s>,
        (tree, bytes): (&Tree<'t, I>, TreeBytes<'t, I>),
        limits: &GuardLimits,
    ) -> Result<Self, Error> {
        Ok(Self {
            notes,
            reader,
            tree: bytes,
            tracker: Tracker::new(tree)?,
            failsafe: FailSafe::new(limits.failsafe()?),
            options: limits.options,
            rate: limits.rate,
            before: None,
        })
    }

    /// The answer of this tick. `now` is the receiver's clock.
    ///
    /// The surface is the one published last, moved on to now
    /// ([`FrameGuard::extrapolated`](crate::FrameGuard::extrapolated)). Errors of the query are in the answer, and lead
    /// to the safe state.
    ///
    /// Cost: the budget at most, and about a thousand instructions.
    pub fn closest<T: Tool>(&mut self, tool: &T, now: Millis) -> Answer {
        let latest = self.reader.latest(now);
        let frame = latest.frame();
        // The fail-safe machine decides how old a surface may be.
        let (searched, tracked) = match (frame, latest.of_any_age()) {
            (Some(frame), Ok(published)) => {
                let surface = published.extrapolated();
                let tracked = self.tracker.closest(&surface, tool, &self.options);
                let searched = Searched {
                    frame,
                    before: surface.before().epoch().unwrap_or(frame.epoch),
                    t: surface.t(),
                    position_error: surface.position_error(),
                    residual: surface.residual(),
                    lag: surface.lag(),
                    velocity: tracked.map_or(Vec3::ZERO, |tracked| {
                        surface.velocity(tracked.closest.corners, tracked.closest.barycentric)
                    }),
                };
                (Some(searched), tracked.map_err(Unavailable::Query))
            }
            (_, Err(unavailable)) => (None, Err(unavailable)),
            (None, Ok(_)) => (None, Err(Unavailable::NoSurface)),
        };
        let pose = Pose::of(tool, now);
        let along = tracked.map_or(0.5, |tracked| tracked.closest.axis_parameter);
        let surface = searched.map_or(Vec3::ZERO, |searched| searched.velocity);
        let velocity = match self.before.replace(pose) {
            Some(before) => pose.velocity(&before, self.rate, along) - surface,
            None => Vec3::ZERO,
        };
        self.judge(frame, searched, tracked, velocity, now)
    }

    /// The answer of a tick whose tool has no pose: the state is safe, with [`Unavailable::NoPose`] as its cause while
    /// there is a surface, and the constraint's output is the hold, without a force where nothing is known to damp. The
    /// next tick's velocity starts anew.
    pub fn without_pose(&mut self, now: Millis) -> Answer {
        self.before = None;
        let frame = self.reader.latest(now).frame();
        self.judge(frame, None, Err(Unavailable::NoPose), Vec3::NAN, now)
    }

    fn judge(
        &mut self,
        frame: Option<FrameAge>,
        searched: Option<Searched>,
        tracked: Result<TrackerAnswer, Unavailable>,
        velocity: Vec3,
        now: Millis,
    ) -> Answer {
        let link = self.notes.link.read(now);
        let trust = self.failsafe.step(&Observation {
            frame,
            lag: searched.and_then(|searched| searched.lag),
            link,
            no_answer: tracked.err(),
            is_tree_corrupt: self.notes.is_tree_corrupt()
                || self.tracker.tree().check(self.tree.bytes()).is_err(),
        });
        self.notes.set_state(trust.state);
        let closest = tracked.and_then(|tracked| trust.admit(tracked.closest));
        Answer { closest, velocity, trust, link, searched, tracked }
    }

    /// An operator's acknowledgement, which ends the safe state once every input is good again.
    ///
    /// # Errors
    /// [`AcknowledgeError`] unless the last tick waited for it.
    pub fn acknowledge(&mut self) -> Result<(), AcknowledgeError> {
        self.failsafe.acknowledge()
    }

    /// The tracker.
    #[must_use]
    pub const fn tracker(&self) -> &Tracker<'t, I, STACK, OPENED> {
        &self.tracker
    }
}
