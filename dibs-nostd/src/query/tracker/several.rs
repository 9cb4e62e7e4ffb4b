//! Several trackers: the closest of all pairs. A pair that is certainly farther is not searched.
//!
//! Apart from `chain.rs`, which searches every pair in every call, up to the closest so far: here a pair's own last tick
//! tells whether it is searched at all.

// Requirement: T-01

use super::{LastTick, Purpose, Tracker, TrackerAnswer};
use crate::query::made::Tests;
use crate::query::{Budget, NoSide, Options, Side};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Tool};

/// Most tests made in advance in a tick, less one.
const AHEAD: Budget = Budget::new(120);

/// How much farther than the closest pair the others are proven to be, in units: an eighth to a sixteenth of the root
/// sphere's radius.
const LEAD: u32 = 1 << 21;

/// A bound on a pair that is not searched.
struct Bound {
    /// A lower bound on the separation; negative infinity if nothing is known.
    apart: f32,
    /// Motion since the pair's last complete search.
    stale: f32,
}

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// The closest of several pairs of a surface and a tool, each with its own tracker; `None` for an empty slice. A
    /// chain of tools is one pair for each tool with its surface.
    ///
    /// A pair is skipped while it is certainly farther than the closest one: its distance at its last search, less the
    /// motion since. A tool that was then outside a closed surface is still outside. Pairs that are inside or crossing
    /// are searched at every tick, and so are all pairs at an open surface, whose side may change without contact. In a
    /// tick with few tests, the pair whose certainty runs out first is searched in advance with up to 65 more tests,
    /// only as far as needed. This spreads the work of pairs that were long skipped.
    ///
    /// The interval begins at the least lower end of all pairs, the accuracy is the worst, the test counts are sums
    /// over all pairs. The side is [`NoSide::CutShort`] if the budget left the side of any pair open.
    ///
    /// Cost: at most the budget, for all pairs together.
    ///
    /// # Errors
    /// Same as [`closest`](Self::closest), for any pair.
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::{Capsule, Odometer, Options, Tracker, Tree, glam::Vec3};
    ///
    /// let heart = generate::heart(1_000)?.mesh;
    /// let built = Builder::new().build(&heart)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// let rows = built.to_rows(&heart.positions);
    /// let mut odometer = Odometer::new(&tree);
    /// let surface = odometer.start(rows.as_slice());
    ///
    /// let mut trackers = [Tracker::<_, 64, 128>::new(&tree)?, Tracker::new(&tree)?];
    /// let mut searched = 0;
    /// for tick in 0..10 {
    ///     let joints = [200.0, 140.0, 80.0].map(|x| Vec3::new(x, 0.1 * tick as f32, 20.0));
    ///     let [shaft, jaw] = [0, 1].map(|at| Capsule::new(joints[at], joints[at + 1], 2.5));
    ///     let tools = [shaft?, jaw?];
    ///     let [one, other] = &mut trackers;
    ///     let mut chain = [(one, &surface, &tools[0]), (other, &surface, &tools[1])];
    ///     let closest = Tracker::closest_of(&mut chain, &Options::new())?.expect("two pairs");
    ///     assert_eq!(closest.pair, 1);
    ///     searched += closest.searched;
    /// }
    /// assert_eq!(searched, 11); // the shaft once
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn closest_of<S: MovingSurface + ?Sized, T: Tool>(
        pairs: &mut [(&mut Self, &S, &T)],
        options: &Options,
    ) -> Result<Option<TrackerAnswer>, QueryError> {
        let Some(first) = Self::nearest(pairs, options) else { return Ok(None) };
        let mut found: Option<TrackerAnswer> = None;
        // The pair with the least lead relative to its motion since the last search; none if every lead is at least
        // four times that motion.
        let (mut ahead, mut lead_ahead, mut stale_ahead) = (None, 4.0, 1.0);
        let mut rest = *options;
        let others = (0..pairs.len()).filter(|&at| at != first);
        for at in [first].into_iter().chain(others) {
            let Some((tracker, surface, tool)) = pairs.get_mut(at) else { continue };
            if let Some(best) = &found {
                let Bound { apart, stale } = tracker.bound(*surface, *tool, options);
                let lead = apart - best.closest.separation;
                if lead >= 0.0 {
                    // Written so that a lead of zero is included.
                    if stale * lead_ahead >= lead * stale_ahead {
                        (ahead, lead_ahead, stale_ahead) = (Some(at), lead, stale);
                    }
                    continue;
                }
            }
            let tracked = tracker.closest(*surface, *tool, &rest)?;
            rest = rest.after(tracked.closest.tests());
            let moved = if pairs.len() > 1 { None } else { tracked.moved };
            let own = TrackerAnswer { pair: at, moved, ..tracked };
            found = Some(found.map_or(own, |found| found.and(own)));
        }
        if let (Some(found), Some(at)) = (&mut found, ahead)
            && rest.budget.tests() > 0
            && found.closest.tests().work() < 2 * AHEAD.tests()
            && let Some((tracker, surface, tool)) = pairs.get_mut(at)
        {
            let tests = tracker.search_ahead(*surface, *tool, found.closest.separation, &rest)?;
            found.closest.add_tests(tests);
        }
        Ok(found)
    }

    /// Searches a pair partly in advance, so that the tick that needs it has less to do. Earlier certain bounds stay.
    /// Returns the tests made.
    fn search_ahead<S: MovingSurface + ?Sized, T: Tool>(
        &mut self,
        surface: &S,
        tool: &T,
        closest: f32,
        options: &Options,
    ) -> Result<Tests, QueryError> {
        let moved = self.memory.moved(tool, surface.motion());
        let (Some(before), Ok(moved)) = (self.last, moved) else {
            return Ok(Tests::NONE);
        };
        let clear = before.clear_after(self.memory.clock.length(moved));
        // A tool that has not touched a closed surface since then is on the same side.
        let keeps_side = before.is_signed && clear > 0.0 && self.tree.is_closed();
        let (options, separation) = if options.is_signed && !keeps_side {
            (*options, f32::INFINITY)
        } else {
            (options.unsigned(), closest + self.memory.clock.length(LEAD))
        };
        let options = options.within(options.budget.at_most(AHEAD.tests()));
        let found = self.within(surface, tool, &options, separation, Purpose::Ahead)?.closest;
        if let Some(last) = &mut self.last {
            last.is_signed |= keeps_side;
            if last.clear < clear {
                *last = LastTick { clear, ..before };
            }
        }
        Ok(found.tests())
    }

    /// Index of the pair that may be the closest.
    fn nearest<S: MovingSurface + ?Sized, T: Tool>(
        pairs: &[(&mut Self, &S, &T)],
        options: &Options,
    ) -> Option<usize> {
        let (mut nearest, mut least) = (None, f32::INFINITY);
        for (at, (tracker, surface, tool)) in pairs.iter().enumerate() {
            let Bound { apart, .. } = tracker.bound(*surface, *tool, options);
            if nearest.is_none() || apart < least {
                (nearest, least) = (Some(at), apart);
            }
        }
        nearest
    }

    /// The bound on the separation that holds before a search.
    fn bound<S: MovingSurface + ?Sized, T: Tool>(
        &self,
        surface: &S,
        tool: &T,
        options: &Options,
    ) -> Bound {
        const NONE: Bound = Bound { apart: f32::NEG_INFINITY, stale: 0.0 };
        let last = self.last.filter(|last| last.is_signed || !options.is_signed);
        let Some(last) = last else { return NONE };
        let Ok(moved) = self.memory.moved(tool, surface.motion()) else { return NONE };
        let clock = &self.memory.clock;
        let clear = last.clear_after(clock.length(moved));
        let apart = clear - surface.position_error() - tool.radius();
        let apart = if apart.is_nan() { f32::NEG_INFINITY } else { apart };
        let stale = clock.length(clock.since(last.searched)) + clock.length(moved);
        Bound { apart, stale }
    }
}

impl TrackerAnswer {
    /// The closer of two pairs, with the bounds and counts of both.
    fn and(self, other: Self) -> Self {
        let (one, two) = (self.closest, other.closest);
        let closer = if two.separation < one.separation { other } else { self };
        // A pair whose side was left open by the budget may be inside.
        let cut_short = Side::Undefined(NoSide::CutShort);
        let is_open = one.side == cut_short || two.side == cut_short;
        let mut closest = one.or_nearer(two);
        if is_open {
            closest.side = cut_short;
        }
        Self {
            closest,
            is_kept: self.is_kept || other.is_kept,
            fallback: self.fallback.or(other.fallback),
            searched: self.searched.saturating_add(other.searched),
            ..closer
        }
    }
}
