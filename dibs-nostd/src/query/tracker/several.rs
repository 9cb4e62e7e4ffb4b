//! Several trackers: the closest of all pairs. A pair that is certain to be farther is not looked at.

use super::{Tracked, Tracker};
use crate::query::{NoSide, Options, Proximity, Side};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Tool};

impl<I: Index, const STACK: usize, const OPENED: usize> Tracker<'_, I, STACK, OPENED> {
    /// The closest of several pairs of a surface and a tool, each with a tracker of its own; `None` for an empty slice. A
    /// chain of tools is a pair for each of them and its surface.
    ///
    /// A pair is passed over while it is certain to be farther than the closest one: its distance when it was last
    /// searched, less the motion since. A tool that was outside a closed surface then is outside still. Pairs inside or
    /// crossing are searched at every tick.
    ///
    /// The interval begins at the least lower end of all pairs, the accuracy is the worst, the tests are those of all. The
    /// side is not known ([`NoSide::CutShort`]) if the budget left that of any pair open.
    ///
    /// Cost: the budget at most, for all pairs together.
    ///
    /// # Errors
    /// Those of [`closest`](Self::closest), of any pair.
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
    ) -> Result<Option<Tracked>, QueryError> {
        let Some(first) = Self::nearest(pairs, options) else { return Ok(None) };
        let mut found: Option<Tracked> = None;
        let mut rest = *options;
        let others = (0..pairs.len()).filter(|&at| at != first);
        for at in [first].into_iter().chain(others) {
            let Some((tracker, surface, tool)) = pairs.get_mut(at) else { continue };
            if let Some(best) = &found
                && tracker.apart(*surface, *tool, options) >= best.closest.separation
            {
                continue;
            }
            let tracked = tracker.closest(*surface, *tool, &rest)?;
            let own = &tracked.closest;
            rest = rest.budget(rest.budget.less(own.node_tests, own.triangle_tests));
            let own = Tracked { pair: at, ..tracked };
            found = Some(found.map_or(own, |found| found.and(own)));
        }
        Ok(found)
    }

    /// Index of the pair that may be closest.
    fn nearest<S: MovingSurface + ?Sized, T: Tool>(
        pairs: &[(&mut Self, &S, &T)],
        options: &Options,
    ) -> Option<usize> {
        let (mut nearest, mut least) = (None, f32::INFINITY);
        for (at, (tracker, surface, tool)) in pairs.iter().enumerate() {
            let apart = tracker.apart(*surface, *tool, options);
            if nearest.is_none() || apart < least {
                (nearest, least) = (Some(at), apart);
            }
        }
        nearest
    }

    /// A lower bound on the separation, without a search; negative infinity if nothing is known.
    fn apart<S: MovingSurface + ?Sized, T: Tool>(
        &self,
        surface: &S,
        tool: &T,
        options: &Options,
    ) -> f32 {
        let last = self.last.filter(|last| last.is_signed || !options.is_signed);
        let Some(last) = last else { return f32::NEG_INFINITY };
        let Ok(moved) = self.moved(tool, surface.travel()) else { return f32::NEG_INFINITY };
        let moved = self.unit.length(moved as i32) * (1.0 + 4.0 * f32::EPSILON);
        let apart = last.clear - moved - surface.position_error() - tool.radius();
        if apart.is_nan() { f32::NEG_INFINITY } else { apart }
    }
}

impl Tracked {
    /// The closer of two pairs, with what was found out of both.
    fn and(self, other: Self) -> Self {
        let (one, two) = (self.closest, other.closest);
        let closer = if two.separation < one.separation { other } else { self };
        // A pair whose side the budget left open may be inside.
        let cut_short = Side::Undefined(NoSide::CutShort);
        let is_open = one.side == cut_short || two.side == cut_short;
        let closest = Proximity {
            lower: if two.lower < one.lower { two.lower } else { one.lower },
            accuracy: if two.accuracy > one.accuracy { two.accuracy } else { one.accuracy },
            node_tests: one.node_tests.saturating_add(two.node_tests),
            triangle_tests: one.triangle_tests.saturating_add(two.triangle_tests),
            side: if is_open { cut_short } else { closer.closest.side },
            ..closer.closest
        };
        Self {
            closest,
            fallback: self.fallback.or(other.fallback),
            searched: self.searched.saturating_add(other.searched),
            ..closer
        }
    }
}
