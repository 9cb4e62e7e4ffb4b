//! Motion instead of time: a bound on a distance runs out once tool and surface have moved that far.
//!
//! The clock counts their motion, rounded up, in units of a tree's odometer. A bound found at reading `now` has the
//! deadline `now + bound`. Until then the deadline minus the reading is a bound.

// Requirement: T-04

use crate::surface::motion::{FAR, Unit};

/// Counts the motion of tool and surface, in units.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct MotionClock {
    unit: Unit,
    now: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::query) struct Reading(u64);

impl Reading {
    /// A new clock's reading.
    pub const START: Self = Self(0);
}

/// The low half of the reading at which a bound is used up: deadlines differ by less than half its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::query) struct Deadline(u32);

impl MotionClock {
    #[inline(always)]
    pub const fn new(unit: Unit) -> Self {
        Self { unit, now: 0 }
    }

    #[inline(always)]
    pub const fn now(&self) -> Reading {
        Reading(self.now)
    }

    pub const fn unit(&self) -> Unit {
        self.unit
    }

    /// Adds a motion of tool and surface.
    #[inline(always)]
    pub fn advance(&mut self, units: u32) {
        self.now = self.now.wrapping_add(units.into());
    }

    /// The units since an earlier reading of this clock, at most half a deadline's range.
    #[inline(always)]
    pub const fn since(&self, before: Reading) -> u32 {
        const MOST: u32 = i32::MAX as u32;
        let units = self.now.wrapping_sub(before.0);
        if units < MOST as u64 { units as u32 } else { MOST }
    }

    /// The deadline of a bound (mm), rounded down; for a bound below zero or NaN it is now.
    #[inline(always)]
    pub fn deadline(&self, bound: f32) -> Deadline {
        Deadline((self.now as u32).wrapping_add(self.unit.down(bound)))
    }

    /// The deadline of a distance (mm), rounded up: no bound up to the distance has a later deadline.
    #[inline(always)]
    pub fn within(&self, distance: f32) -> Deadline {
        Deadline((self.now as u32).wrapping_add(self.unit.up(distance)))
    }

    /// The length (mm) of this many units, rounded up; they are less than half a deadline's range.
    #[inline(always)]
    pub fn length(&self, units: u32) -> f32 {
        self.unit.length(units as i32) * (1.0 + 4.0 * f32::EPSILON)
    }

    /// The motion (mm) since an earlier reading of this clock, rounded up; `None` from half a deadline's range on.
    pub fn moved_since(&self, before: Reading) -> Option<f32> {
        let units = self.since(before);
        (units < i32::MAX as u32).then(|| self.length(units))
    }

    /// A deadline later than that of every bound.
    #[inline(always)]
    pub const fn never(&self) -> Deadline {
        Deadline((self.now as u32).wrapping_add(FAR as u32))
    }

    /// The remaining part of a bound (mm), rounded to nearest.
    pub fn left(&self, deadline: Deadline) -> f32 {
        self.unit.length(self.units_left(deadline))
    }

    /// The same in units.
    #[inline(always)]
    pub const fn units_left(&self, deadline: Deadline) -> i32 {
        deadline.0.wrapping_sub(self.now as u32) as i32
    }

    /// A clock whose low half wraps after this many units.
    #[cfg(test)]
    pub fn wrapping_after(unit: Unit, units: u32) -> Self {
        Self { unit, now: (u32::MAX - units).into() }
    }

    #[cfg(test)]
    pub fn has_wrapped(&self) -> bool {
        self.now > u32::MAX.into()
    }
}

impl Deadline {
    /// The deadline of an unused entry.
    pub const UNUSED: Self = Self(0);

    #[inline(always)]
    pub const fn is_before(self, other: Self) -> bool {
        self.units_after(other) < 0
    }

    /// The units from another deadline to this one.
    #[inline(always)]
    pub const fn units_after(self, other: Self) -> i32 {
        self.0.wrapping_sub(other.0) as i32
    }

    /// The later of two deadlines.
    #[inline(always)]
    pub fn or_later(self, other: Self) -> Self {
        if self.is_before(other) { other } else { self }
    }
}
