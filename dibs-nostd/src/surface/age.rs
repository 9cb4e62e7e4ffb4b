//! Age on a clock that wraps: one rule for frames, heartbeats and packets.
//!
//! A stamp is the clock's value at an arrival. Its age is `now - stamp`, wrapping, with two exceptions:
//!
//! - A stamp up to [`AHEAD`] in the future has age 0: the core that wrote it may have read its clock a little later. A
//!   stamp up to half the clock's range ahead has an age of at least 2^31, beyond any limit that a
//!   [`Watch`](crate::failsafe::Watch) may have. So a flipped bit does not keep an old surface alive.
//! - A stamp never grows younger: when the clock comes around, its age stays `u32::MAX`. This requires a reading of its
//!   age at least once in 2^31 units.

/// Most that a stamp may lie ahead of the clock, in the clock's unit.
pub(crate) const AHEAD: u32 = 16;

/// Time from `stamp` to `now`; 0 for a stamp at most [`AHEAD`] in the future.
pub(crate) const fn elapsed(now: u32, stamp: u32) -> u32 {
    let elapsed = now.wrapping_sub(stamp);
    if elapsed > u32::MAX - AHEAD { 0 } else { elapsed }
}

/// The greatest age that a stamp was found to have.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Ageing {
    pub stamp: u32,
    pub oldest: u32,
}

impl Ageing {
    /// The state after a reading of `stamp` at the time `now`: `oldest` is the stamp's age.
    #[must_use]
    pub const fn at(self, now: u32, stamp: u32) -> Self {
        // A stamp that was found old lies in the past, even just before the clock comes around to it.
        let is_past = stamp == self.stamp && self.oldest > i32::MAX as u32;
        let age = if is_past { now.wrapping_sub(stamp) } else { elapsed(now, stamp) };
        let fall = if stamp == self.stamp { self.oldest.saturating_sub(age) } else { 0 };
        let oldest = if fall > i32::MAX as u32 {
            u32::MAX // The clock came around.
        } else {
            age.saturating_add(fall)
        };
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
        prop_oneof![near(0), near(1 << 31), near(0_u32.wrapping_sub(AHEAD)), any::<u32>()]
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 10_000, ..ProptestConfig::default() })]

        #[test]
        fn a_stamp_a_little_ahead_is_new_and_farther_ahead_is_old(
            now in any::<u32>(),
            ahead in distance(),
        ) {
            let age = elapsed(now, now.wrapping_add(ahead));
            let expected = if ahead <= AHEAD { 0 } else { ahead.wrapping_neg() };
            prop_assert_eq!(age, expected);
            // A stamp ahead by up to half the clock's range is older than any limit of a watch.
            prop_assert!(ahead <= AHEAD || ahead > 1 << 31 || age >= 1 << 31);
        }

        #[test]
        fn one_flipped_bit_makes_no_stamp_younger_than_the_bit_says(
            now in any::<u32>(),
            age in 0_u32..1 << 20,
            bit in 0_u32..32,
        ) {
            let found = elapsed(now, now.wrapping_sub(age) ^ (1 << bit));
            prop_assert!(found >= age.saturating_sub(1 << bit), "{age}, bit {bit}: {found}");
            // A flipped bit above the age's bits puts the stamp into the future or far into the past: both are old.
            prop_assert!(1 << bit <= age + AHEAD || found >= (1 << bit) - AHEAD, "bit {bit}: {found}");
        }

        #[test]
        fn no_stamp_grows_younger_whatever_the_clock_does(
            stamp in any::<u32>(),
            steps in prop::collection::vec(distance(), 1..40),
        ) {
            let (mut ageing, mut now, mut oldest) = (Ageing::default().at(stamp, stamp), stamp, 0);
            for step in steps {
                now = now.wrapping_add(step);
                ageing = ageing.at(now, stamp);
                prop_assert!(ageing.oldest >= oldest && ageing.oldest >= elapsed(now, stamp));
                oldest = ageing.oldest;
            }
            // Another stamp begins anew.
            prop_assert_eq!(ageing.at(now, stamp ^ 1).oldest, elapsed(now, stamp ^ 1));
        }

        #[test]
        fn an_age_asked_for_in_time_is_right_until_the_clock_came_around(
            stamp in any::<u32>(),
            steps in prop::collection::vec(1_u32..1 << 31, 1..12),
        ) {
            let (mut ageing, mut now, mut true_age) = (Ageing::default().at(stamp, stamp), stamp, 0_u64);
            for step in steps {
                now = now.wrapping_add(step);
                true_age += u64::from(step);
                ageing = ageing.at(now, stamp);
                let (age, most) = (u64::from(ageing.oldest), u64::from(u32::MAX));
                prop_assert!(age >= true_age.min(most) && age <= true_age + u64::from(AHEAD));
            }
        }
    }
}
