//! The control tick's end: tool pose in, answer out.

// Requirements: C-01, C-07

use glam::Vec3;

use super::posed::TickPose;
use super::rows::Blend;
use super::surface::{Common, Notes};
use super::{Answer, GuardLimits, Rows, SearchedSurface, Vertices};
use crate::failsafe::{AcknowledgeError, FailSafe, Observation, State, Verdict};
use crate::filter::{AdmittedMotion, Filter, FilterError, RigidMotion, Uncertainty};
use crate::math::round::sum_up;
use crate::{
    Contacts, Error, FrameAge, FrameReader, Index, Millis, Options, QueryError, Tool, Tracker,
    TrackerAnswer, Tree, TreeBytes, Unavailable, VertexTable,
};

/// The control tick's end of a [`Surface`](super::Surface): the closest pair of one tool on the current surface, and
/// the trust in it.
///
/// Keep it in a `static` or in a task's memory. RAM: that of a [`Tracker`] with `OPENED` slots and `RANGE` slots for
/// [contacts](Self::contacts), plus less than 500 bytes.
#[derive(Debug)]
pub struct Guard<
    's,
    't,
    I,
    const STACK: usize,
    const OPENED: usize,
    R: Rows = Vertices,
    const RANGE: usize = 0,
> {
    notes: &'s Notes<R::Poses>,
    reader: FrameReader<'s>,
    tree: TreeBytes<'t, I>,
    tracker: Tracker<'t, I, STACK, OPENED, RANGE>,
    failsafe: FailSafe,
    options: Options,
    /// Ticks per second.
    rate: f32,
    /// The tissue's largest speed (mm/ms).
    speed: f32,
    before: Option<Pose>,
    rows: R::Of<'t>,
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

    /// Velocity (mm/s) of the axis' point at a parameter since an earlier pose. If the clock shows that ticks were
    /// skipped, the longer time is used.
    fn velocity(&self, before: &Self, rate: f32, parameter: f32) -> Vec3 {
        let (start, end) = (self.start - before.start, self.end - before.end);
        // Two readings of a clock in milliseconds may be up to 1 ms closer than their difference.
        let elapsed = self.at.since(before.at).0.saturating_sub(1) as f32;
        let rate = if elapsed * rate > 1_000.0 { 1_000.0 / elapsed } else { rate };
        (start + (end - start) * parameter) * rate
    }
}

impl<'s, 't, I: Index, const STACK: usize, const OPENED: usize, R: Rows, const RANGE: usize>
    Guard<'s, 't, I, STACK, OPENED, R, RANGE>
{
    /// The control tick's end of three buffers in the caller's memory.
    ///
    /// # Errors
    /// [`Error`]: the stack is too small for the tree, or a limit is out of range.
    #[doc(hidden)]
    #[inline(always)]
    pub fn new(
        notes: &'s Notes<R::Poses>,
        reader: FrameReader<'s>,
        (tree, bytes, rows): (&Tree<'t, I>, TreeBytes<'t, I>, R::Of<'t>),
        limits: &GuardLimits,
    ) -> Result<Self, Error> {
        Ok(Self {
            notes,
            reader,
            tree: bytes,
            tracker: Tracker::with_range(tree)?,
            failsafe: FailSafe::new(limits.failsafe()?),
            options: limits.of_tick(tree),
            rate: limits.rate,
            speed: limits.speed,
            before: None,
            rows,
        })
    }

    /// The answer of this tick. `now` is the receiver's clock.
    ///
    /// The surface is the last published one, extrapolated to `now`
    /// ([`FrameGuard::extrapolated`](crate::FrameGuard::extrapolated)). Query errors are in the answer, and lead to the
    /// safe state.
    ///
    /// Cost: the budget at most, plus about a thousand instructions.
    pub fn closest<T: Tool>(&mut self, tool: &T, now: Millis) -> Answer {
        self.on_latest(
            tool,
            now,
            |tracker, surface, tool, _, options| tracker.closest(surface, tool, options),
            |_, _, _, _| (),
        )
        .0
    }

    /// The answer of this tick, and all contacts within `margin` (mm), as [`Tracker::contacts`] finds them, in one
    /// budget, with the surface's velocity at each. [`Answer::contacts`] selects those on which a constraint may act.
    ///
    /// The search margin includes the surface's error and the motion during its age, so that a constraint with this
    /// margin has each contact as soon as it must act.
    ///
    /// A guard from [`start_with_contacts`](super::Surface::start_with_contacts) remembers the nodes that a search for
    /// contacts opened; other guards search from the root at each tick. The list is empty if there is no surface, or
    /// the query failed. Its [accuracy](Contacts::accuracy) covers the same errors as the pair's.
    ///
    /// Cost: the budget at most, plus about a thousand instructions, and some hundred for each contact.
    pub fn contacts<T: Tool, const N: usize, const NEAR: usize>(
        &mut self,
        tool: &T,
        margin: f32,
        now: Millis,
        contacts: &mut Contacts<N, NEAR>,
    ) -> Answer {
        contacts.clear();
        let (mut error, mut placing) = (0.0, 0.0);
        let (answer, _) = self.on_latest(
            tool,
            now,
            |tracker, surface, own, flow, options| {
                placing = flow.placed.map_or(0.0, |placed| placed.error(tool));
                error = sum_up(surface.position_error(), placing);
                let margin = sum_up(margin, sum_up(error, flow.margin()));
                let tracked = tracker.contacts(surface, own, margin, options, contacts)?;
                contacts.set_velocities(|corners, weights| {
                    let own = flow.at(corners, weights);
                    Ok(match flow.placed {
                        Some(placed) => own + placed.flow(surface, corners, weights),
                        None => own,
                    })
                })?;
                if let Some(placed) = flow.placed {
                    placed.lead_back(contacts);
                }
                Ok(tracked)
            },
            |_, _, _, _| (),
        );
        let moved = answer.trust.margin;
        contacts.widen(sum_up(moved, placing), sum_up(error, moved));
        answer
    }

    /// The answer of this tick, and the motion nearest to `command` that keeps the tool out of the tissue until the
    /// next tick. After an error nothing is admitted: the tool stays at rest.
    ///
    /// The filter has the stand-off and the robot's speed; the guard adds the period, the tissue's speed, and the
    /// uncertainty by lag and transit. The surface is extrapolated, and its residual is an estimate: see
    /// [filter](crate::filter) for the consequences. Nothing is admitted in the safe state.
    ///
    /// Cost: that of [`closest`](Self::closest) plus that of [`Filter::admit`].
    pub fn admit<T: Tool, const LABELS: usize>(
        &mut self,
        filter: &Filter<LABELS>,
        tool: &T,
        command: &RigidMotion,
        now: Millis,
    ) -> (Answer, Result<AdmittedMotion, FilterError>) {
        let (period, speed) = (1.0 / self.rate, self.speed * 1_000.0);
        let (answer, admitted) = self.on_latest(
            tool,
            now,
            |tracker, surface, tool, _, options| tracker.closest(surface, tool, options),
            |tracker, surface, placed, trust| {
                if trust.state == State::Safe {
                    let cause = trust.cause.unwrap_or(Unavailable::NoSurface);
                    return Err(FilterError::Untrusted(cause));
                }
                let tissue = Uncertainty::new(speed).error(trust.margin);
                let Some(placed) = placed else {
                    return filter.admit(
                        &mut [(tracker, surface, tool)],
                        command,
                        period,
                        &tissue,
                        &[],
                    );
                };
                // The tissue's speed limit is in the world and includes the pose's motion, so the pose is fixed for the
                // period.
                let (own, motion) = (placed.tool(tool), placed.motion(command));
                let moved = placed.error_of_motion(&own, &motion, (filter, period));
                let tissue = tissue.error(placed.error(tool) + moved);
                let pairs = &mut [(tracker, surface, &own)];
                let admitted = filter.admit(pairs, &motion, period, &tissue, &[])?;
                Ok(placed.admitted(admitted, command))
            },
        );
        let none = Err(FilterError::Untrusted(Unavailable::NoSurface));
        (answer, admitted.unwrap_or(none))
    }

    /// The answer of this tick by `search`, and the result of `then` for the searched surface and the trust in it.
    #[inline(always)]
    fn on_latest<T: Tool, A>(
        &mut self,
        tool: &T,
        now: Millis,
        search: impl FnOnce(
            &mut Tracker<'t, I, STACK, OPENED, RANGE>,
            &R::Surface<'_>,
            &T,
            &SurfaceFlow<'_, '_, 't, R>,
            &Options,
        ) -> Result<TrackerAnswer, QueryError>,
        then: impl FnOnce(
            &mut Tracker<'t, I, STACK, OPENED, RANGE>,
            &R::Surface<'_>,
            Option<&TickPose>,
            &Verdict,
        ) -> A,
    ) -> (Answer, Option<A>) {
        let Self { notes, reader, tree, tracker, failsafe, options, rate, before, rows, .. } = self;
        let latest = reader.latest(now);
        let frame = latest.frame();
        let published = latest.of_any_age();
        let blend = published.as_ref().map(|published| R::now(rows, &notes.poses, published));
        let placed = match (&published, &blend) {
            (Ok(published), Ok(blend)) => R::placed(rows, &notes.poses, published, blend),
            _ => None,
        };
        let placed = placed.as_ref();
        let room = &mut R::Room::default();
        let surface = blend.as_ref().map(|blend| (blend, R::surface(rows, blend, room)));
        let moved;
        let own = match placed {
            Some(placed) => {
                moved = placed.tool(tool);
                &moved
            }
            None => tool,
        };
        // The fail-safe machine decides the age limit of a surface.
        let (searched, tracked) = match (frame, surface) {
            (Some(frame), Ok((blend, surface))) => {
                let notes = &notes.of_all;
                let flow = SurfaceFlow { rows, blend, placed, frame, failsafe, notes, now };
                let tracked = search(tracker, surface, own, &flow, options);
                let searched = SearchedSurface {
                    frame,
                    before: blend.before().epoch().unwrap_or(frame.epoch),
                    t: blend.t(),
                    position_error: surface.position_error(),
                    residual: blend.residual(),
                    lag: blend.lag(),
                    velocity: tracked.map_or(Vec3::ZERO, |tracked| {
                        let closest = tracked.closest;
                        flow.at(closest.corners, closest.barycentric)
                    }),
                };
                match placed {
                    Some(placed) => placed.in_world(tool, tracked, searched),
                    None => (Some(searched), tracked.map_err(Unavailable::Query)),
                }
            }
            (_, Err(unavailable)) => (None, Err(**unavailable)),
            (None, Ok(_)) => (None, Err(Unavailable::NoSurface)),
        };
        let pose = Pose::of(tool, now);
        let along = tracked.map_or(0.5, |tracked| tracked.closest.axis_parameter);
        let flow = searched.map_or(Vec3::ZERO, |searched| searched.velocity);
        let velocity = match before.replace(pose) {
            Some(before) => pose.velocity(&before, *rate, along) - flow,
            None => Vec3::ZERO,
        };
        let is_corrupt =
            notes.of_all.is_tree_corrupt() || tracker.tree().check(tree.bytes()).is_err();
        let answer =
            judge(&notes.of_all, failsafe, is_corrupt, (frame, searched, tracked), velocity, now);
        let after = match surface {
            Ok((_, surface)) if searched.is_some() => {
                Some(then(tracker, surface, placed, &answer.trust))
            }
            _ => None,
        };
        (answer, after)
    }

    /// The answer of a tick without a tool pose: the state is safe, with the cause [`Unavailable::NoPose`] while there
    /// is a surface. The constraint's output is the hold, with zero force as no velocity is known to damp. The next
    /// tick's velocity restarts.
    pub fn without_pose(&mut self, now: Millis) -> Answer {
        self.before = None;
        let Self { notes, reader, tree, tracker, failsafe, .. } = self;
        let frame = reader.latest(now).frame();
        let is_corrupt =
            notes.of_all.is_tree_corrupt() || tracker.tree().check(tree.bytes()).is_err();
        let found = (frame, None, Err(Unavailable::NoPose));
        judge(&notes.of_all, failsafe, is_corrupt, found, Vec3::NAN, now)
    }

    /// An operator's acknowledgement, which ends the safe state once every input is within its limits again.
    ///
    /// # Errors
    /// [`AcknowledgeError`] unless the last tick waited for it.
    pub fn acknowledge(&mut self) -> Result<(), AcknowledgeError> {
        self.failsafe.acknowledge()
    }

    /// The tracker.
    #[must_use]
    pub const fn tracker(&self) -> &Tracker<'t, I, STACK, OPENED, RANGE> {
        &self.tracker
    }
}

/// The velocity and lag of the searched surface.
struct SurfaceFlow<'a, 'f, 't, R: Rows> {
    rows: &'f R::Of<'t>,
    blend: &'f Blend<'f>,
    placed: Option<&'a TickPose>,
    frame: FrameAge,
    failsafe: &'a FailSafe,
    notes: &'a Common,
    now: Millis,
}

impl<R: Rows> SurfaceFlow<'_, '_, '_, R> {
    /// The margin (mm) of this tick's trust.
    fn margin(&self) -> f32 {
        self.failsafe.margin(self.frame, self.blend.lag(), &self.notes.link.read(self.now))
    }

    /// The velocity of a point of a triangle (mm/s).
    fn at(&self, corners: [u32; 3], weights: [f32; 3]) -> Vec3 {
        R::velocity(self.rows, self.blend, corners, weights)
    }
}

/// The frame, the searched surface, and the pair on it.
type TickResult = (Option<FrameAge>, Option<SearchedSurface>, Result<TrackerAnswer, Unavailable>);

/// The tick's answer, by the trust in the searched surface.
fn judge(
    notes: &Common,
    failsafe: &mut FailSafe,
    is_tree_corrupt: bool,
    (frame, searched, tracked): TickResult,
    velocity: Vec3,
    now: Millis,
) -> Answer {
    let link = notes.link.read(now);
    let trust = failsafe.step(&Observation {
        frame,
        lag: searched.and_then(|searched| searched.lag),
        link,
        no_answer: tracked.err(),
        is_tree_corrupt,
    });
    notes.set_state(trust.state);
    let closest = tracked.and_then(|tracked| trust.admit(tracked.closest));
    Answer { closest, velocity, trust, link, searched, tracked }
}
