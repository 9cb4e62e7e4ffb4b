//! The closest pair from tick to tick: a tick's cost is proportional to the change.

// Requirement: T-01

mod answer;
mod contacts;
mod direction;
mod kept;
#[cfg(feature = "control")]
mod part;
mod several;
#[cfg(test)]
mod tests;

use super::made::Tests;
use super::memory::Memory;
use super::memory::clock::Reading;
use super::memory::separation::CertainInterval;
use super::prices::QUERY;
use super::search::{Outcome, Search, Tick, Ties, WHOLE, WaitingNode};
use super::{Budget, NoSide, Options, Proximity, Side, signed};
use crate::surface::motion::Unit;
#[cfg(feature = "control")]
use crate::tree::LabelSet;
use crate::tree::{RootSet, ValidTree};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Tool, Tree, TriangleRow};

pub use answer::{Fallback, TrackerAnswer};

/// A query that reuses the proof of its last answer.
///
/// A search leaves a *front*: the subtrees rejected by a lower bound and the triangles tested. When the tool moves by
/// at most `a` (the larger of its ends' steps) and the surface by at most `b`, each of these bounds still holds, less
/// `a + b`. So a tracker keeps the front from tick to tick, and tests only the bounds that have run out: usually some
/// ten of a thousand. The answers are those of [`Query::closest`](crate::Query::closest), within their accuracy.
/// (Fronts of bounding volume trees: Klosowski et al. 1998, Tang et al. 2010. Bounds that expire: kinetic data
/// structures; Barbič & James 2010.)
///
/// The surface carries its motion, as [`MovingSurface::motion`]; where it was not measured, the tick is a whole query.
/// An [`Assembler`](crate::Assembler) with a tree's admission check measures it for the frames that it publishes, an
/// [`Odometer`](crate::Odometer) for other tables. Another tool counts as a step to its position. The stretch in the
/// options may change from tick to tick: remembered bounds hold for any stretch.
///
/// `STACK` must be at least [`Tree::stack`]. `OPENED` nodes of the tree are remembered with their children, usually
/// some hundred; the repository's `docs/evidence/guarantees.md` has the most that a beating heart took. If `OPENED` is
/// too small, ticks are whole queries. Keep the tracker in a `static`: it can be larger than a controller's stack.
///
/// Where the axis crosses the surface, the tracker remembers which parts of the axis cannot be deepest, and searches
/// only points that may have become deepest. A budget is divided: the closest pair gets at most three eighths if the
/// axis is inside or crossing, half if it may be, and the depth the rest. A point's search that the budget ends
/// continues in the next tick.
///
/// Where a pose's last digits decide which of several triangles is the closest, a force along its direction would
/// oscillate. So at a closed surface an answer keeps the last tick's triangle while it is farther than the closest one
/// by no more than the rounding of both distances, without the position error: from the axis if outside, from the
/// deepest point if the axis crosses or is inside. Separation, interval and side are the search's. Where the direction
/// would turn by 8 degrees or more, this takes one triangle test.
///
/// RAM: 16 bytes for each stack entry, 44 for each of `OPENED`, 12 for each of `RANGE`, plus 1,944.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{Odometer, Options, Sphere, Tracker, Tree, glam::Vec3};
///
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
/// let built = Builder::new().stretch(1.5).build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let mut tracker = Tracker::<_, 64, 128>::new(&tree)?;
/// let mut odometer = Odometer::new(&tree);
///
/// let (first, second) = (built.to_rows(&motion.frames[0]), built.to_rows(&motion.frames[1]));
/// let surface = odometer.start(first.as_slice());
/// let tool = Sphere::new(Vec3::new(70.0, 0.0, 20.0), 2.5)?;
/// let cold = tracker.closest(&surface, &tool, &Options::new())?;
///
/// let surface = odometer.step(first.as_slice(), second.as_slice()).after();
/// let tool = Sphere::new(Vec3::new(70.1, 0.0, 20.0), 2.5)?;
/// let warm = tracker.closest(&surface, &tool, &Options::new())?;
/// assert!(warm.fallback.is_none() && warm.closest.node_tests < cold.closest.node_tests / 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Tracker<'t, I, const STACK: usize, const OPENED: usize, const RANGE: usize = 0> {
    tree: Tree<'t, I>,
    #[cfg(feature = "control")]
    labels: LabelSet,
    stack: [WaitingNode; STACK],
    memory: Memory<STACK, OPENED, RANGE>,
    last: Option<LastTick>,
    ties: Ties,
    triangle: Option<TriangleRow>,
}

/// The last tick, for queries with several trackers.
#[derive(Clone, Copy, Debug)]
struct LastTick {
    /// A lower bound on the distance from the axis to the surface; negative infinity if the tool may be inside.
    clear: f32,
    /// Whether the side was asked for.
    is_signed: bool,
    /// When a search of several pairs was last completed.
    searched: Reading,
}

/// The purpose of a tick's closest pair.
#[derive(Clone, Copy, PartialEq)]
enum Purpose {
    /// It is the tick's answer.
    Answer,
    /// A search for contacts follows: unless the budget ended, the last tick's interval is merged after it, and the
    /// position error added.
    Contacts,
    /// It reduces the work of a later tick. The pair gets the whole budget.
    Ahead,
}

impl<'t, I: Index, const STACK: usize, const OPENED: usize> Tracker<'t, I, STACK, OPENED> {
    /// A new tracker on `tree`, a [`Tree`], which remembers nothing between searches for contacts.
    ///
    /// # Errors
    /// [`QueryError::Stack`] if `STACK` is less than the tree needs.
    #[inline(always)]
    pub fn new(tree: &impl ValidTree<'t, I>) -> Result<Self, QueryError> {
        Self::with_range(tree)
    }
}

impl<'t, I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'t, I, STACK, OPENED, RANGE>
{
    /// As [`new`](Tracker::new), but remembers `RANGE` opened nodes between searches for [contacts](Self::contacts),
    /// usually some hundred.
    ///
    /// # Errors
    /// [`QueryError::Stack`] if `STACK` is less than the tree needs.
    #[inline(always)]
    pub fn with_range(tree: &impl ValidTree<'t, I>) -> Result<Self, QueryError> {
        let tree = tree.valid();
        if tree.stack() as usize > STACK {
            return Err(QueryError::Stack { needed: tree.stack(), available: STACK as u32 });
        }
        Ok(Self {
            tree: *tree,
            #[cfg(feature = "control")]
            labels: tree.labels(),
            stack: [WaitingNode { lower: 0.0, link: 0 }; STACK],
            memory: Memory::new(Unit::of(tree)),
            last: None,
            ties: Ties::new(),
            triangle: None,
        })
    }

    /// Whether a triangle of the tree has this label.
    #[cfg(feature = "control")]
    pub(crate) const fn has_label(&self, label: u8) -> bool {
        self.labels.contains(label)
    }

    /// Number of the front's nodes.
    #[cfg(feature = "control")]
    pub(crate) fn opened(&self) -> u32 {
        self.memory.front.opened() as u32
    }

    /// Number of the front's nodes that a search within a distance (mm) of the axis would test, if the tool moved there.
    #[cfg(feature = "control")]
    pub(crate) fn due_within(&self, distance: f32) -> u32 {
        self.memory.front.count_due(self.memory.clock.within(distance)) as u32
    }

    /// The tree that is searched.
    #[must_use]
    pub const fn tree(&self) -> &Tree<'t, I> {
        &self.tree
    }

    /// The front, for visualisation and tests: rows of the nodes ([`Tree::node`]) that have a bound or, for leaves,
    /// whose triangles have bounds. Every triangle is below exactly one of them. Empty until the first tick.
    pub fn front(&self) -> impl Iterator<Item = u32> {
        self.memory.front.rows()
    }

    /// Number of nodes that the last search for [contacts](Self::contacts) left open, of `RANGE` slots. Once all are
    /// used, the next search restarts; nodes without a slot are searched as in a query.
    #[must_use]
    pub const fn opened_in_range(&self) -> u32 {
        self.memory.range.opened()
    }

    /// Forgets the last tick: the next one is a whole query.
    pub fn forget(&mut self) {
        self.memory.forget_tick();
        self.last = None;
    }

    /// The closest pair between `tool` and the current surface.
    ///
    /// As [`Query::closest`](crate::Query::closest), warm start included. A budget widens the interval as there, but
    /// not beyond that of the last tick plus the motion since ([`TrackerAnswer::is_kept`]), and the next tick continues
    /// where this one ended.
    ///
    /// Cost: the budget at most, and one comparison for each opened node.
    ///
    /// # Errors
    /// Same as [`Query::closest`](crate::Query::closest).
    pub fn closest<S: MovingSurface + ?Sized, T: Tool>(
        &mut self,
        surface: &S,
        tool: &T,
        options: &Options,
    ) -> Result<TrackerAnswer, QueryError> {
        self.within(surface, tool, options, f32::INFINITY, Purpose::Answer)
    }

    /// The closest pair; for pairs farther than `separation` (mm), only that they are farther.
    fn within<S: MovingSurface + ?Sized, T: Tool>(
        &mut self,
        surface: &S,
        tool: &T,
        options: &Options,
        separation: f32,
        purpose: Purpose,
    ) -> Result<TrackerAnswer, QueryError> {
        let motion = surface.motion();
        let memory = &mut self.memory;
        let moved = memory.moved(tool, motion);
        memory.begin(moved);
        self.last = None;
        let moved_by = moved.ok().map(|units| memory.clock.length(units));
        let mut fallback = match moved {
            Ok(_) => memory.front.borrow().is_empty().then_some(Fallback::Start),
            Err(cause) => Some(cause.into()),
        };
        let moved = moved.unwrap_or(0);
        let has_depth = options.is_signed && tool.axis_length() > 0.0 && self.tree.is_closed();
        let past = if has_depth { memory.separation.now(memory.clock) } else { None };
        let budget = match past {
            Some(past) if purpose != Purpose::Ahead => {
                budget_of_pair(options.budget, &past, memory.depth.is_known())
            }
            _ => options.budget,
        };
        let first = self.triangle.or(options.first(None));
        let (stack, ties) = (&mut self.stack, Some(&mut self.ties));
        let all = RootSet::ALL;
        let search = Search::start(all, &self.tree, stack, surface, tool, options, first, ties)?;
        let front = memory.front.borrow();
        let mut tick =
            Tick::new(search, front, memory.clock, (budget, options.is_priced), separation);
        let outcome = tick.run(moved)?;
        let best = tick.triangle();
        self.triangle = best.or(self.triangle);
        let ended = match outcome {
            Outcome::Ended { lower, is_complete, restarted } => {
                if restarted {
                    fallback = Some(Fallback::Jump);
                }
                Ok((lower, is_complete))
            }
            Outcome::Full { tests } => {
                fallback = Some(Fallback::Full);
                // A whole query that cannot test the closest triangle again would answer less than is known.
                let left = for_whole(budget, options.is_priced, tests);
                if left < Budget::TRIANGLE { Ok((0.0, false)) } else { Err(tests) }
            }
        };
        let (mut closest, is_complete) = match ended {
            Ok((lower, is_complete)) => (tick.finish(lower)?, is_complete),
            Err(tests) => (self.whole(surface, tool, &options.within(budget), best, tests)?, true),
        };
        let memory = &mut self.memory;
        let nearest = closest.lower;
        let known = (&mut self.ties, Some(memory.depth.at(memory.clock, past)));
        signed(&self.tree, &mut self.stack, surface, tool, options, &mut closest, known)?;
        self.keep_direction(surface, tool, options, &mut closest)?;
        let is_cut = closest.side == Side::Undefined(NoSide::CutShort);
        let is_kept = separation == f32::INFINITY
            && (purpose != Purpose::Contacts || is_cut)
            && self.keep_certain(surface, tool, options, &mut closest, nearest)?;
        if purpose != Purpose::Contacts {
            closest.add_position_error(surface);
        }
        let memory = &mut self.memory;
        memory.keep(tool, motion, is_complete);
        let (is_closed, now) = (self.tree.is_closed(), memory.clock.now());
        self.last = motion.map(|_| LastTick::new(tool, &closest, is_closed, now));
        let opened = memory.front.borrow().used() as u32;
        let moved = moved_by;
        let (pair, searched) = (0, 1);
        Ok(TrackerAnswer { closest, is_kept, fallback, moved, opened, pair, searched })
    }

    /// A whole query, with the budget left after `tests`.
    #[cold]
    fn whole<S: MovingSurface + ?Sized, T: Tool>(
        &mut self,
        surface: &S,
        tool: &T,
        options: &Options,
        first: Option<TriangleRow>,
        tests: Tests,
    ) -> Result<Proximity, QueryError> {
        let left = for_whole(options.budget, options.is_priced, tests);
        let options = options.within(Budget::new(left));
        let (stack, ties) = (&mut self.stack, Some(&mut self.ties));
        let all = RootSet::ALL;
        let search = Search::start(all, &self.tree, stack, surface, tool, &options, first, ties)?;
        let mut closest = search.run::<WHOLE>(f32::INFINITY)?;
        if options.is_priced {
            // But for the root and the closest triangle.
            let node_tests = closest.work().saturating_sub(1 + Budget::TRIANGLE) / QUERY;
            closest.add_tests(Tests { node_tests, ..Tests::NONE });
        }
        closest.add_tests(tests);
        Ok(closest)
    }
}

/// The tests of a whole query in the budget that is left after `made`.
const fn for_whole(budget: Budget, is_priced: bool, made: Tests) -> u32 {
    let left = budget.less(made.work()).tests();
    if is_priced { left / (QUERY + 1) * QUERY } else { left }
}

/// The closest pair's part of a tick's budget: the rest is for the depth of an axis that may be inside. Where no depth is
/// known and the last tick did not find the axis inside, the closest pair comes first, because a depth begins from it.
fn budget_of_pair(budget: Budget, past: &CertainInterval, is_depth_known: bool) -> Budget {
    let was_inside = matches!(past.side, Side::Inside | Side::Crossing);
    if past.upper < 0.0 {
        Budget::new(budget.tests() / 8 * 3)
    } else if past.lower < 0.0 && (was_inside || is_depth_known) {
        Budget::new(budget.tests() / 2)
    } else {
        budget
    }
}

impl LastTick {
    fn new(tool: &impl Tool, closest: &Proximity, is_closed: bool, searched: Reading) -> Self {
        let clear = closest.lower + tool.radius() - closest.accuracy;
        let (clear, is_signed) = match closest.side {
            Side::Undefined(NoSide::NotAsked) => (clear, false),
            Side::Undefined(NoSide::NoAdjacency) => (clear, true),
            // Only a closed surface must be touched on the way in: the side of an open surface is that of the closest
            // sheet.
            Side::Outside if is_closed => (clear, true),
            _ => (f32::NEG_INFINITY, true),
        };
        Self { clear, is_signed, searched }
    }

    /// The distance within which there is certainly no surface, after a motion.
    fn clear_after(&self, moved: f32) -> f32 {
        let clear = self.clear - moved;
        clear - clear.abs() * f32::EPSILON
    }
}
