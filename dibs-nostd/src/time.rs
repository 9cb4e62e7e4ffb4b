//! Time: the receiver's clock, the count of control ticks, and the age of a stamp on a clock that wraps.
//!
//! One rule applies to frames, heartbeats and packets. A stamp is the clock's reading at an event. Its age is the time
//! since then, wrapping, with two exceptions:
//!
//! - A stamp up to [`AHEAD`] in the future has age 0: the core that wrote it may have read its clock a little later. A
//!   stamp up to half the clock's range ahead has an age of at least 2^31, beyond any limit of a
//!   [`ThresholdPair`](crate::failsafe::ThresholdPair). So a flipped bit does not keep an old surface valid.
//! - A stamp never grows younger: when the clock wraps around, its age stays [`Millis::MAX`]. This requires reading its
//!   age at least once in 2^31 ms.

// Requirement: B-05

use core::fmt;
use core::num::NonZeroU32;

/// A reading of the receiver's clock, or a time on it, in milliseconds.
///
/// The clock wraps after 2^32 ms, 49.7 days. The time between two readings is right if it is less than that.
///
/// ```
/// use dibs_nostd::Millis;
/// assert_eq!(Millis(3).since(Millis(u32::MAX)), Millis(4));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(transparent)]
pub struct Millis(pub u32);

impl Millis {
    /// The longest time; also a time that is unknown or has no end.
    pub const MAX: Self = Self(u32::MAX);

    /// The time from an earlier reading to this one, wrapping.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self(self.0.wrapping_sub(earlier.0))
    }

    /// The reading this long after, wrapping.
    #[must_use]
    pub const fn after(self, time: Self) -> Self {
        Self(self.0.wrapping_add(time.0))
    }

    /// The reading this long before, wrapping.
    #[must_use]
    pub const fn before(self, time: Self) -> Self {
        Self(self.0.wrapping_sub(time.0))
    }

    /// The sum of two times, at most [`MAX`](Self::MAX).
    #[must_use]
    pub const fn plus(self, time: Self) -> Self {
        Self(self.0.saturating_add(time.0))
    }
}

impl fmt::Display for Millis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ms", self.0)
    }
}

/// A count of control ticks since the start. 64 bits never wrap.
///
/// A type of its own, so that ticks are not mistaken for milliseconds: [`at_rate`](Self::at_rate) converts them.
///
/// ```
/// use core::num::NonZeroU32;
/// use dibs_nostd::{Millis, Ticks};
///
/// const RATE: NonZeroU32 = NonZeroU32::new(4_000).unwrap(); // a loop of 4 kHz
/// assert_eq!(Ticks(4_003).at_rate(RATE), Millis(1_000));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(transparent)]
pub struct Ticks(pub u64);

impl Ticks {
    /// The ticks from an earlier count to this one, wrapping.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self(self.0.wrapping_sub(earlier.0))
    }

    /// The count this many ticks later, wrapping.
    #[must_use]
    pub const fn after(self, ticks: Self) -> Self {
        Self(self.0.wrapping_add(ticks.0))
    }

    /// The reading of a millisecond clock that started with the first tick, at this many ticks per second: rounded
    /// down, and wrapping like that clock.
    #[must_use]
    pub const fn at_rate(self, ticks_a_second: NonZeroU32) -> Millis {
        let rate = ticks_a_second.get() as u64;
        let (Some(seconds), Some(rest)) = (self.0.checked_div(rate), self.0.checked_rem(rate))
        else {
            return Millis(0); // Not reached: the rate is not 0.
        };
        // The rest is below 2^32.
        let millis = match (rest * 1_000).checked_div(rate) {
            Some(millis) => millis,
            None => 0,
        };
        Millis(seconds.wrapping_mul(1_000).wrapping_add(millis) as u32)
    }
}

/// How far a stamp may be ahead of the clock.
pub(crate) const AHEAD: Millis = Millis(16);

/// Time from `stamp` to `now`; 0 for a stamp at most [`AHEAD`] in the future.
pub(crate) const fn elapsed(now: Millis, stamp: Millis) -> Millis {
    let elapsed = now.since(stamp);
    if elapsed.0 > u32::MAX - AHEAD.0 { Millis(0) } else { elapsed }
}

/// The greatest age found for a stamp.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct StampAge {
    pub stamp: Millis,
    pub oldest: Millis,
}

impl StampAge {
    /// The state after a reading of `stamp` at the time `now`: `oldest` is the stamp's age.
    #[must_use]
    pub const fn at(self, now: Millis, stamp: Millis) -> Self {
        let (is_same, oldest) = (stamp.0 == self.stamp.0, self.oldest.0);
        // A stamp once found old is in the past, even just before the clock wraps around to it.
        let is_past = is_same && oldest > i32::MAX as u32;
        let age = if is_past { now.since(stamp) } else { elapsed(now, stamp) };
        let fall = if is_same { oldest.saturating_sub(age.0) } else { 0 };
        // A large decrease: the clock wrapped around.
        let oldest = if fall > i32::MAX as u32 { Millis::MAX } else { age.plus(Millis(fall)) };
        Self { stamp, oldest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Distances near the values at which the rule changes, and others.
    fn distance() -> impl Strategy<Value = u32> {
        let near = |at: u32| (0_u32..40).prop_map(move |by| at.wrapping_sub(20).wrapping_add(by));
        prop_oneof![near(0), near(1 << 31), near(0_u32.wrapping_sub(AHEAD.0)), any::<u32>()]
    }

    #[test]
    fn ticks_become_the_reading_of_a_clock_that_wraps_once_in_49_days() {
        for rate in [1, 7, 999, 1_000, 1_001, 4_000, 48_000, u32::MAX] {
            let rate = NonZeroU32::new(rate).unwrap();
            for ticks in [0, 1, 3, 1 << 20, 1 << 32, (1 << 34) + 5, u64::MAX / 3, u64::MAX] {
                let exact = u128::from(ticks) * 1_000 / u128::from(rate.get());
                assert_eq!(Ticks(ticks).at_rate(rate), Millis(exact as u32), "{ticks} at {rate}");
            }
        }
    }

    #[test]
    fn ticks_are_counted_across_the_end_of_their_range() {
        let last = Ticks(u64::MAX);
        assert_eq!((last.after(Ticks(4)), Ticks(3).since(last)), (Ticks(3), Ticks(4)));
        assert_eq!(Ticks(701).since(Ticks(700)), Ticks(1));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 10_000, ..ProptestConfig::default() })]

        #[test]
        fn a_stamp_a_little_ahead_is_new_and_farther_ahead_is_old(
            now in any::<u32>(),
            ahead in distance(),
        ) {
            let Millis(age) = elapsed(Millis(now), Millis(now.wrapping_add(ahead)));
            let expected = if ahead <= AHEAD.0 { 0 } else { ahead.wrapping_neg() };
            prop_assert_eq!(age, expected);
            // A stamp ahead by up to half the clock's range is older than any limit of a watch.
            prop_assert!(ahead <= AHEAD.0 || ahead > 1 << 31 || age >= 1 << 31);
        }

        #[test]
        fn one_flipped_bit_makes_no_stamp_younger_than_the_bit_says(
            now in any::<u32>(),
            age in 0_u32..1 << 20,
            bit in 0_u32..32,
        ) {
            let stamp = Millis(now.wrapping_sub(age) ^ (1 << bit));
            let Millis(found) = elapsed(Millis(now), stamp);
            prop_assert!(found >= age.saturating_sub(1 << bit), "{age}, bit {bit}: {found}");
            // A flipped bit above the age's bits puts the stamp into the future or far into the past: both are old.
            prop_assert!(1 << bit <= age + AHEAD.0 || found >= (1 << bit) - AHEAD.0, "bit {bit}: {found}");
        }

        #[test]
        fn no_stamp_grows_younger_whatever_the_clock_does(
            stamp in any::<u32>(),
            steps in prop::collection::vec(distance(), 1..40),
        ) {
            let stamp = Millis(stamp);
            let (mut ageing, mut now, mut oldest) = (StampAge::default().at(stamp, stamp), stamp, Millis(0));
            for step in steps {
                now = now.after(Millis(step));
                ageing = ageing.at(now, stamp);
                prop_assert!(ageing.oldest >= oldest && ageing.oldest >= elapsed(now, stamp));
                oldest = ageing.oldest;
            }
            // Another stamp begins anew.
            let other = Millis(stamp.0 ^ 1);
            prop_assert_eq!(ageing.at(now, other).oldest, elapsed(now, other));
        }

        #[test]
        fn an_age_asked_for_in_time_is_right_until_the_clock_came_around(
            stamp in any::<u32>(),
            steps in prop::collection::vec(1_u32..1 << 31, 1..12),
        ) {
            let stamp = Millis(stamp);
            let (mut ageing, mut now, mut true_age) = (StampAge::default().at(stamp, stamp), stamp, 0_u64);
            for step in steps {
                now = now.after(Millis(step));
                true_age += u64::from(step);
                ageing = ageing.at(now, stamp);
                let (age, most) = (u64::from(ageing.oldest.0), u64::from(u32::MAX));
                prop_assert!(age >= true_age.min(most) && age <= true_age + u64::from(AHEAD.0));
            }
        }
    }
}
