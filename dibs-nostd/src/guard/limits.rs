//! The limits of a controller: values that only its user knows.

// Requirement: C-07

use super::Rows;
use crate::failsafe::{LimitError, Limits, ThresholdPair};
use crate::{Budget, Cost, Index, Millis, Options, SurfaceLimits, Tree};

/// The limits on the surface, and the options of a tick's query.
///
/// The limits of [`Bus`](super::Bus) and [`Guard`](super::Guard) follow from two numbers, the tissue's largest speed
/// and the largest age; each limit can also be set on its own.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct GuardLimits {
    /// mm a millisecond.
    #[cfg_attr(feature = "serde", serde(rename = "speed_mm_per_ms"))]
    pub(super) speed: f32,
    age: Millis,
    trust: Option<Limits>,
    surface: Option<SurfaceLimits>,
    is_automatic: bool,
    has_transit: bool,
    pub(super) rate: f32,
    options: Options,
    /// The instructions of a tick, instead of the options' budget.
    instructions: Option<u32>,
}

/// The default reach, in units of half the largest extent of the rest shape.
const ROOM: f32 = 4.0;

impl GuardLimits {
    /// Limits for tissue of at most this speed (mm/s), and surfaces of at most this age: about two periods of the
    /// source plus the transit time. From three quarters of the age on the state is degraded, beyond it safe.
    ///
    /// By default the control loop runs at 1 kHz, an operator acknowledges the end of a safe state, the transit time is
    /// measured by the status that each frame echoes ([`Bus::status`](super::Bus::status)), rows stay within four sizes
    /// of the rest shape, and a tick's budget is not limited.
    #[must_use]
    pub const fn new(speed_mm_per_s: f32, age: Millis) -> Self {
        Self {
            speed: speed_mm_per_s / 1_000.0,
            age,
            trust: None,
            surface: None,
            is_automatic: false,
            has_transit: true,
            rate: 1_000.0,
            options: Options::new(),
            instructions: None,
        }
    }

    /// Control ticks per second, above 0: velocities are computed from it.
    #[must_use]
    pub const fn ticks_a_second(mut self, rate: u32) -> Self {
        self.rate = rate as f32;
        self
    }

    /// The work limit of a tick, in instructions of a Cortex-M7: [`Budget::for_instructions`] by the tree's
    /// [`Cost::of_tick`].
    #[must_use]
    pub const fn instructions(mut self, instructions: u32) -> Self {
        self.instructions = Some(instructions);
        self
    }

    /// The work limit of a tick in tests, for a processor whose [`Cost`] you measured.
    #[must_use]
    pub const fn budget(mut self, budget: Budget) -> Self {
        self.options = self.options.budget(budget);
        self.instructions = None;
        self
    }

    /// Options of every tick's query.
    #[must_use]
    pub const fn options(mut self, options: Options) -> Self {
        self.options = options;
        self
    }

    /// Leaves the safe state without an acknowledgement.
    #[must_use]
    pub const fn automatic(mut self) -> Self {
        self.is_automatic = true;
        self
    }

    /// Leaves out the transit time, for a line without statuses to the sender: a delayed frame then counts as new, and
    /// no margin covers the delay.
    #[must_use]
    pub const fn without_transit(mut self) -> Self {
        self.has_transit = false;
        self
    }

    /// Sets the fail-safe machine's limits, instead of those that follow from speed and age.
    /// [`automatic`](Self::automatic) and [`without_transit`](Self::without_transit) change these, too.
    #[must_use]
    pub const fn trust(mut self, limits: Limits) -> Self {
        self.trust = Some(limits);
        self
    }

    /// Sets the published surfaces' limits, instead of those that follow from the speed and the tree's rest shape.
    #[must_use]
    pub const fn surfaces(mut self, limits: SurfaceLimits) -> Self {
        self.surface = Some(limits);
        self
    }

    /// The options of a tick.
    pub(super) fn of_tick<I: Index>(&self, tree: &Tree<'_, I>) -> Options {
        match self.instructions {
            Some(most) => self.options.budget(Budget::for_instructions(most, &Cost::of_tick(tree))),
            None => self.options,
        }
    }

    /// The fail-safe machine's limits.
    pub(super) fn failsafe(&self) -> Result<Limits, LimitError> {
        if self.rate == 0.0 {
            return Err(LimitError::Rate);
        }
        let limits = match self.trust {
            Some(limits) => limits,
            None => {
                Limits::new(ThresholdPair::new(Millis(self.age.0 / 4 * 3), self.age)?, self.speed)?
            }
        };
        let limits = if self.has_transit { limits } else { limits.without_transit() };
        Ok(if self.is_automatic { limits.automatic() } else { limits })
    }

    /// The published surfaces' limits.
    pub(super) fn surface<I: Index, R: Rows>(
        &self,
        tree: &Tree<'_, I>,
        rows: &R::Of<'_>,
    ) -> Result<SurfaceLimits, LimitError> {
        match self.surface {
            Some(limits) => Ok(limits),
            None => Ok(SurfaceLimits::reach_mm(reach::<I, R>(tree, rows)?).speed(self.speed)),
        }
    }
}

/// The largest coordinate of rows that move by the size of their rest shape.
fn reach<I: Index, R: Rows>(tree: &Tree<'_, I>, rows: &R::Of<'_>) -> Result<f32, LimitError> {
    let mut corners = None;
    for row in 0..R::count(tree, rows) {
        let at = R::rest(tree, rows, row).ok_or(LimitError::NoReach)?;
        let (low, high) = corners.unwrap_or((at, at));
        corners = Some((at.min(low), at.max(high)));
    }
    let (low, high) = corners.ok_or(LimitError::NoReach)?;
    let size = (high - low).max_element() * 0.5;
    Ok(((low + high) * 0.5).abs().max_element() + ROOM * size)
}
