//! A tracker's memory from tick to tick: bounds that motion uses up.
//!
//! | part | bounds on |
//! |---|---|
//! | [`front`] | the subtrees and triangles that the closest pair's search passed over |
//! | [`range`] | the children of opened nodes that are farther than a range search went |
//! | [`leaves`] | the leaves around the deepest point of an axis, and around one that may be deeper |
//! | [`waiting`] | the subtrees still to be searched for these leaves |
//! | [`depth`] | the depth of an axis' parts |
//! | [`separation`] | the signed separation |
//!
//! One clock counts the motion for all of them.

// Requirement: T-01

mod axis;
pub mod clock;
pub mod depth;
pub mod front;
pub mod leaves;
pub mod range;
pub mod separation;
pub mod waiting;

use crate::surface::motion::{FAR, Unit};
use crate::{MotionReading, Tool};
use axis::Axis;
use clock::{MotionClock, Reading};
use depth::KnownDepth;
use front::Front;
use range::RangeFront;
use separation::KnownSeparation;

/// Most units between two tests of a bound. Together with [`FAR`], the longest bound, it is less than half a deadline's
/// range.
const LONGEST_WAIT: u32 = 1 << 29;
const _: () = assert!(LONGEST_WAIT < (1 << 31) - FAR as u32 - 1);

#[derive(Clone, Debug)]
pub(super) struct Memory<const STACK: usize, const OPENED: usize, const RANGE: usize> {
    pub clock: MotionClock,
    /// Tool and surface at the last tick; none if the surface's motion was not measured, or the tick ended in an error.
    last: Option<(Axis, MotionReading)>,
    /// When all due bounds of the front were last tested.
    complete: Reading,
    pub front: Front<OPENED>,
    pub range: RangeFront<RANGE>,
    pub depth: KnownDepth<STACK>,
    pub separation: KnownSeparation,
}

/// Why a motion cannot be applied to the bounds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Loss {
    /// There was no last tick.
    Start,
    /// The surface's motion was not measured over the whole time.
    Surface,
    /// The motion is too large.
    Jump,
}

impl<const STACK: usize, const OPENED: usize, const RANGE: usize> Memory<STACK, OPENED, RANGE> {
    #[inline(always)]
    pub const fn new(unit: Unit) -> Self {
        Self {
            clock: MotionClock::new(unit),
            last: None,
            complete: Reading::START,
            front: Front::EMPTY,
            range: RangeFront::EMPTY,
            depth: KnownDepth::new(),
            separation: KnownSeparation::NONE,
        }
    }

    /// The motion of tool and surface since the last tick, in units.
    #[inline(always)]
    pub fn moved(&self, tool: &impl Tool, motion: Option<MotionReading>) -> Result<u32, Loss> {
        let (axis, before) = self.last.ok_or(Loss::Start)?;
        let surface = motion.and_then(|motion| motion.since(&before)).ok_or(Loss::Surface)?;
        let moved = surface.saturating_add(u64::from(axis.step(tool, self.clock.unit())));
        if moved > u64::from(LONGEST_WAIT.saturating_sub(self.clock.since(self.complete))) {
            return Err(Loss::Jump);
        }
        Ok(moved as u32)
    }

    /// Begins a tick after a motion. Unless the tick is [kept](Self::keep), the next one has no last tick.
    #[inline(always)]
    pub fn begin(&mut self, moved: Result<u32, Loss>) {
        self.last = None;
        match moved {
            Ok(units) => self.clock.advance(units),
            Err(_) => {
                self.front.borrow().clear();
                self.range.forget();
                self.depth.forget();
                self.separation.forget();
                self.complete = self.clock.now();
            }
        }
    }

    /// Ends a tick. `is_complete` if all due bounds of the front were tested.
    pub fn keep(&mut self, tool: &impl Tool, motion: Option<MotionReading>, is_complete: bool) {
        self.last = motion.map(|motion| (Axis::of(tool), motion));
        if is_complete {
            self.complete = self.clock.now();
        }
    }

    /// Forgets the last tick.
    pub fn forget_tick(&mut self) {
        self.last = None;
    }
}
