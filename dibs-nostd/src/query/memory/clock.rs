//! Motion instead of time: a bound on a distance runs out once tool and surface have moved by as much.
//!
//! The clock counts how far they have moved, rounded up, in units of a tree's odometer. A bound found at reading `now` has
//! the deadline `now + bound`. Until then the difference of the two readings is a bound.

use crate::surface::motion::{FAR, Unit};

/// The units that tool and surface have moved.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct MotionClock {
    unit: Unit,
    now: u64,
}

/// A reading of a clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::query) struct Reading(u64);

impl Reading {
    /// That of a clock that has counted nothing.
    pub const START: Self = Self(0);
}

/// The reading at which a bound is used up, its low half: deadlines are less than half a turn of it apart.
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

    /// Tool and surface have moved.
    #[inline(always)]
    pub fn advance(&mut self, units: u32) {
        self.now = self.now.wrapping_add(units.into());
    }

    /// The units since an earlier reading of this clock, or half a turn if they are more.
    #[inline(always)]
    pub const fn since(&self, before: Reading) -> u32 {
        const MOST: u32 = i32::MAX as u32;
        let units = self.now.wrapping_sub(before.0);
        if units < MOST as u64 { units as u32 } else { MOST }
    }

    /// The deadline of a bound (mm), rounded down. That of a bound below zero, or not a number, is now.
    #[inline(always)]
    pub fn deadline(&self, bound: f32) -> Deadline {
        Deadline((self.now as u32).wrapping_add(self.unit.down(bound)))
    }

    /// The deadline of a distance (mm), rounded up: every bound up to the distance has a deadline not after it.
    #[inline(always)]
    pub fn within(&self, distance: f32) -> Deadline {
        Deadline((self.now as u32).wrapping_add(self.unit.up(distance)))
    }

    /// The length (mm) of so many units, rounded up; they are less than half a turn.
    #[inline(always)]
    pub fn length(&self, units: u32) -> f32 {
        self.unit.length(units as i32) * (1.0 + 4.0 * f32::EPSILON)
    }

    /// The motion (mm) since an earlier reading of this clock, rounded up; `None` from half a turn on.
    pub fn moved_since(&self, before: Reading) -> Option<f32> {
        let units = self.since(before);
        (units < i32::MAX as u32).then(|| self.length(units))
    }

    /// A deadline after that of every bound.
    #[inline(always)]
    pub const fn never(&self) -> Deadline {
        Deadline((self.now as u32).wrapping_add(FAR as u32))
    }

    /// The rest of a bound (mm), to the nearest number.
    pub fn left(&self, deadline: Deadline) -> f32 {
        self.unit.length(self.units_left(deadline))
    }

    /// The same in units.
    #[inline(always)]
    pub const fn units_left(&self, deadline: Deadline) -> i32 {
        deadline.0.wrapping_sub(self.now as u32) as i32
    }

    /// A clock whose low half wraps after so many units.
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
    /// That of a bound that is never read.
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

    /// The later of two.
    #[inline(always)]
    pub fn or_later(self, other: Self) -> Self {
        if self.is_before(other) { other } else { self }
    }
}
