//! A state machine that decides whether the surface may be trusted, from age, silence, lost heartbeats and rejections.
//!
//! The control tick calls [`FailSafe::step`] once. The machine needs no clock of its own and a few words of memory;
//! each step takes a handful of integer comparisons.
//!
//! # States
//!
//! | state | the constraint's input | meaning |
//! |---|---|---|
//! | [`State::Nominal`] | the answer, widened by (age + transit) x tissue speed | every input is within its limits |
//! | [`State::Degraded`] | the same, and the margin grows with the age | an input is beyond its first limit, or was: tell the operator |
//! | [`State::Safe`] | [`Unavailable`]: the constraint's hold | an input is beyond its second limit, or was: the surface is not acted on |
//!
//! The answer is widened in the nominal state too, so that the force does not jump when the state changes: the margin
//! is one continuous function of the age. It also covers the transit of the frame, unless [`Limits::without_transit`]
//! leaves it out.
//!
//! # Transitions
//!
//! Each input has two limits, a [`ThresholdPair`]. A step is *clear* if every input is within its first limit, there
//! is a surface, the query gave an answer and the tree is sound. The *run* counts the frames published since the last
//! step that was not clear; two frames between two steps count as one. The *calm* counts the steps since then, and is
//! *long enough* once more than [`Limits::dwell`]'s steps were clear.
//!
//! | from | to | when |
//! |---|---|---|
//! | (start) | safe | always |
//! | nominal | degraded | an input is beyond its first limit |
//! | nominal, degraded | safe | an input is beyond its second limit, the query failed, the tree's bytes changed, or there is no surface |
//! | degraded | nominal | the run reaches [`Limits::recovery`]'s frames, and the calm is long enough |
//! | safe | nominal | the same, and [`FailSafe::acknowledge`] was accepted since; or alone, with [`Limits::automatic`] |
//!
//! Safe never changes to degraded, and no fault recovers without new frames, so a surface that only looks fresh,
//! because a clock wrapped, does not help. An acknowledgement is accepted only once the run is complete, and becomes
//! void at the first step that is not clear, so nobody can acknowledge in advance; while it is all that is missing, it
//! is the cause, [`Unavailable::Unacknowledged`]. Recovery is manual by default, as in the da Vinci Research Kit. The
//! calm bounds how often the state changes, even if an attacker moves an input across its limit.
//!
//! # Time
//!
//! Times are [`Millis`] on the receiver's clock, which wraps; a count of control [`Ticks`](crate::Ticks) is converted
//! by its rate. If a surface is received at `r` and nothing after it, the first safe step is the first one at
//! `r + safe + 1` or later, where `safe` is the second limit on age, unless another input requires it earlier. Ages of
//! surface, packets and heartbeats follow one rule, that of [`FrameAge`]: a stamp up to 16 ms ahead of the clock is
//! new, one farther ahead is old, and a stamp once found old stays old when the clock wraps.

// Requirement: C-01

mod freshness;
mod limits;
mod link;
#[cfg(feature = "bus")]
mod status;
#[cfg(all(test, feature = "bus"))]
mod tests;

use core::fmt;

use crate::query::Proximity;
use crate::surface::{FrameAge, Millis};
use crate::unavailable::Unavailable;

#[doc(hidden)]
pub use limits::Quantity;
pub use limits::{LimitError, Limits, ThresholdPair};
pub use link::Link;
#[cfg(feature = "bus")]
pub use status::LinkStatus;

/// The input of a step of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Observation {
    /// The published frame and its age: [`LatestSurface::frame`](crate::LatestSurface::frame); `None` before the first.
    pub frame: Option<FrameAge>,
    /// How far the searched surface is behind the present, beyond what its own error covers:
    /// [`SurfaceBlend::lag`](crate::SurfaceBlend::lag). `None` for the frame as published, whose lag is its age.
    pub lag: Option<Millis>,
    /// The bus's health.
    pub link: Link,
    /// Why that frame gave no answer, if so: the query's error, or a tool without a pose.
    pub no_answer: Option<Unavailable>,
    /// Whether the tree's bytes were found changed: [`Scrub`](crate::Scrub). Keep it set until the program restarts,
    /// unless the memory's defect is known and repaired.
    pub is_tree_corrupt: bool,
}

/// The trust in the surface, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum State {
    /// Every input is within its limits.
    Nominal,
    /// The surface is used, with a growing margin.
    Degraded,
    /// The surface is not used.
    Safe,
}

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Verdict {
    /// The state after the step.
    pub state: State,
    /// Why the state is not nominal: the first input that requires it, in the order missing surface, answer, tree, age,
    /// link. If no input requires it any more, the last cause remains, until only an acknowledgement is missing:
    /// [`Unavailable::Unacknowledged`].
    pub cause: Option<Unavailable>,
    /// Most that the tissue may have moved from the surface that was searched, in mm: its lag and transit, times the
    /// speed.
    pub margin: f32,
    /// Whether only an acknowledgement is missing to leave the safe state.
    pub waits_for_acknowledgement: bool,
}

impl Verdict {
    /// The answer for the constraint, widened by the margin, or why there is none.
    ///
    /// # Errors
    /// The cause in the safe state.
    pub fn admit(&self, answer: Proximity) -> Result<Proximity, Unavailable> {
        match (self.state, self.cause) {
            (State::Nominal | State::Degraded, _) => Ok(answer.widened(self.margin)),
            (State::Safe, cause) => Err(cause.unwrap_or(Unavailable::NoSurface)),
        }
    }
}

/// The state machine.
///
/// ```
/// use dibs_nostd::{FrameAge, Millis};
/// use dibs_nostd::failsafe::{FailSafe, Limits, Link, Observation, State, ThresholdPair};
///
/// // Degraded after 50 ms, safe after 200; tissue at up to 0.1 mm a millisecond.
/// let age = ThresholdPair::new(Millis(50), Millis(200))?;
/// let limits = Limits::new(age, 0.1)?.recovery(2)?.dwell(1).automatic();
/// let mut machine = FailSafe::new(limits);
/// let link = Link::CLEAR;
/// let mut state = |now: u32, epoch, received: u32| {
///     let (age, received) = (Millis(now - received), Millis(received));
///     let frame = Some(FrameAge { epoch, received, age }); // from `LatestSurface::frame`
///     let seen = Observation { frame, lag: None, link, no_answer: None, is_tree_corrupt: false };
///     machine.step(&seen).state
/// };
/// assert_eq!(state(1000, 1, 1000), State::Safe); // it starts safe
/// assert_eq!(state(1001, 2, 1001), State::Nominal); // the second frame
/// assert_eq!(state(1052, 2, 1001), State::Degraded);
/// assert_eq!(state(1202, 2, 1001), State::Safe);
/// # Ok::<(), dibs_nostd::failsafe::LimitError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FailSafe {
    limits: Limits,
    state: State,
    /// The last cause that was an input's.
    cause: Option<Unavailable>,
    /// Epoch and clock of the last step's frame.
    frame: Option<(u32, Millis)>,
    /// Frames since the last step that was not clear; stops at the number needed.
    run: u16,
    /// Clear steps in a row; stops above the number needed.
    calm: u32,
    acknowledged: bool,
}

impl FailSafe {
    /// A machine in the safe state.
    #[must_use]
    pub const fn new(limits: Limits) -> Self {
        Self {
            limits,
            state: State::Safe,
            cause: Some(Unavailable::NoSurface),
            frame: None,
            run: 0,
            calm: 0,
            acknowledged: false,
        }
    }

    /// The limits.
    #[must_use]
    pub const fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The state after the last step.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// One control tick. Cost: O(1), two comparisons for each input.
    pub fn step(&mut self, seen: &Observation) -> Verdict {
        let age = seen.frame.map_or(Millis::MAX, |frame| frame.age);
        let (level, cause) = self.worst(seen, age);

        let frame = seen.frame.map(|frame| (frame.epoch, frame.received));
        let is_new = frame.is_some() && frame != self.frame;
        self.frame = frame;
        if level == State::Nominal {
            if is_new && self.run < self.limits.recovery_frames() {
                self.run += 1;
            }
            if self.calm <= self.limits.dwell_steps() {
                self.calm = self.calm.saturating_add(1);
            }
        } else {
            self.run = 0;
            self.calm = 0;
            self.acknowledged = false;
        }

        let has_recovered = self.has_recovered();
        self.state = match (self.state, level) {
            (State::Safe, _)
                if has_recovered && (self.acknowledged || self.limits.is_automatic()) =>
            {
                State::Nominal
            }
            (State::Safe, _) | (_, State::Safe) => State::Safe,
            (State::Degraded, State::Nominal) if has_recovered => State::Nominal,
            (State::Degraded, _) | (_, State::Degraded) => State::Degraded,
            (State::Nominal, State::Nominal) => State::Nominal,
        };
        let before = self.cause;
        self.cause = match self.state {
            State::Nominal => None,
            state if level < state => before,
            _ => cause,
        };
        if self.state == State::Nominal {
            self.acknowledged = false;
        }
        let waits_for_acknowledgement = self.state == State::Safe && has_recovered;
        Verdict {
            state: self.state,
            cause: if waits_for_acknowledgement {
                Some(Unavailable::Unacknowledged)
            } else {
                self.cause
            },
            margin: match seen.frame {
                Some(frame) => self.margin(frame, seen.lag, &seen.link),
                None => 0.0,
            },
            waits_for_acknowledgement,
        }
    }

    /// The margin (mm) of a verdict on a frame with this lag.
    pub(crate) fn margin(&self, frame: FrameAge, lag: Option<Millis>, link: &Link) -> f32 {
        let lag = lag.unwrap_or(frame.age);
        self.limits.margin(lag.plus(self.limits.freshness.transit(link)))
    }

    /// An operator's acknowledgement: the next step leaves the safe state if it is clear.
    ///
    /// # Errors
    /// [`AcknowledgeError`] unless the last step waited for it; it has no effect then.
    pub fn acknowledge(&mut self) -> Result<(), AcknowledgeError> {
        if self.state == State::Safe && self.has_recovered() {
            self.acknowledged = true;
            return Ok(());
        }
        let frames = self.limits.recovery_frames().saturating_sub(self.run);
        let steps = self.limits.dwell_steps().saturating_add(1).saturating_sub(self.calm);
        Err(AcknowledgeError { state: self.state, frames, steps })
    }

    /// Whether run and calm are long enough.
    fn has_recovered(&self) -> bool {
        let is_calm = self.calm > self.limits.dwell_steps() || self.calm == u32::MAX;
        self.run >= self.limits.recovery_frames() && is_calm
    }

    /// The level that the inputs of this step require, and its first cause.
    fn worst(&self, seen: &Observation, age: Millis) -> (State, Option<Unavailable>) {
        let (link, limits) = (seen.link, &self.limits);
        let mut worst = (State::Nominal, None);
        let stale = Unavailable::Stale { age };
        let silent = Unavailable::LinkLost { silence: link.silence };
        let heartbeat = Unavailable::HeartbeatLost { silence: link.heartbeat };
        let rejections = Unavailable::Rejections { streak: link.rejections };
        if let Some(cause) = seen.no_answer {
            worst = (State::Safe, Some(cause));
        }
        if seen.frame.is_none() {
            worst = (State::Safe, Some(Unavailable::NoSurface));
        }
        let inputs = [
            (safe_if(seen.is_tree_corrupt), Unavailable::CorruptTree),
            (limits.age.level(age), stale),
            (limits.silence.level(link.silence), silent),
            (limits.heartbeat.level(link.heartbeat), heartbeat),
            (limits.rejections.level(link.rejections), rejections),
        ];
        for (level, cause) in inputs.into_iter().chain(limits.freshness.levels(&link, limits.age)) {
            if level > worst.0 {
                worst = (level, Some(cause));
            }
        }
        worst
    }
}

fn safe_if(is_safe: bool) -> State {
    if is_safe { State::Safe } else { State::Nominal }
}

/// An acknowledgement that came too early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct AcknowledgeError {
    /// The machine's state.
    pub state: State,
    /// Good frames that are still missing.
    pub frames: u16,
    /// Clear steps that are still missing.
    pub steps: u32,
}

impl fmt::Display for AcknowledgeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.state {
            State::Safe => {
                let Self { frames, steps, .. } = self;
                write!(
                    f,
                    "{frames} good frames and {steps} clear steps are missing before an acknowledgement"
                )
            }
            _ => write!(f, "the state is not safe: there is nothing to acknowledge"),
        }
    }
}

impl core::error::Error for AcknowledgeError {}
