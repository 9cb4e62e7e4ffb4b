//! The leaves around a point of the axis, each with a bound.
//!
//! Until tool and surface have moved too far, one of them contains the closest triangle to the point.

// Requirements: S-03, T-01

use heapless::{Vec, VecView};

use super::waiting::WaitingNode;

pub(in crate::query) const MOST: usize = 48;

#[derive(Clone, Debug)]
pub(in crate::query) struct Leaves {
    leaves: Vec<Leaf, MOST>,
    /// There were more leaves than fit.
    is_over: bool,
    /// Motion (mm) of tool and surface, and of the point along its axis, since the leaves were collected.
    moved: f32,
    /// All other leaves were at least this far (mm) away; 0 if unknown.
    beyond: f32,
    /// The same for the leaves skipped so far during collection.
    passed: f32,
    is_gathering: bool,
    /// The point's parameter on its axis: 0 at the start, 1 at the end.
    parameter: f32,
    /// The motion (mm) of the last tick.
    step: f32,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Leaf {
    pub link: u32,
    /// Its least distance (mm) when the leaves were collected.
    pub bound: f32,
}

impl Leaves {
    #[inline(always)]
    pub const fn new() -> Self {
        Self {
            leaves: Vec::new(),
            is_over: false,
            moved: 0.0,
            beyond: 0.0,
            passed: f32::INFINITY,
            is_gathering: false,
            parameter: f32::NAN,
            step: 0.0,
        }
    }

    pub fn forget(&mut self) {
        self.leaves.clear();
        (self.is_over, self.moved, self.beyond, self.passed) = (false, 0.0, 0.0, f32::INFINITY);
        self.is_gathering = false;
    }

    /// Clears the leaves, and starts a new collection.
    pub fn begin(&mut self) {
        self.forget();
        self.is_gathering = true;
    }

    /// Whether a collection is in progress.
    pub const fn is_gathering(&self) -> bool {
        self.is_gathering
    }

    /// Clears the leaves for another point of the axis.
    pub fn forget_for(&mut self, parameter: f32) {
        self.forget();
        self.parameter = parameter;
    }

    /// Clears the leaves, their point, and the subtrees that wait for them.
    pub fn end(&mut self, waiting: &mut VecView<WaitingNode>) {
        if self.is_gathering {
            waiting.clear();
        }
        self.forget_for(f32::NAN);
    }

    /// Whether the leaves are around this point of the axis.
    pub fn are_around(&self, parameter: f32) -> bool {
        self.parameter == parameter
    }

    /// The parameter of the leaves' point.
    pub const fn parameter(&self) -> f32 {
        self.parameter
    }

    /// Adds a motion of tool and surface.
    pub fn add_motion(&mut self, moved: f32) {
        self.moved = sum(self.moved, moved);
        self.step = moved;
    }

    /// The distance (mm) from the point to another one of its axis of this `length`.
    pub fn distance_to(&self, parameter: f32, length: f32) -> f32 {
        (parameter - self.parameter).abs() * length * (1.0 + 4.0 * f32::EPSILON)
    }

    /// Moves the point to another one of its axis.
    pub fn move_to(&mut self, parameter: f32, length: f32) {
        self.moved = sum(self.moved, self.distance_to(parameter, length));
        self.parameter = parameter;
    }

    /// The motion of the last tick.
    pub const fn step(&self) -> f32 {
        self.step
    }

    /// The motion since the leaves were collected, for a point `distance` (mm) farther on.
    pub fn moved(&self, distance: f32) -> f32 {
        sum(self.moved, distance)
    }

    /// The leaves, and the motion since they were collected.
    pub fn each(&mut self) -> (&mut [Leaf], f32) {
        (&mut self.leaves, self.moved)
    }

    /// Whether the leaves were collected, and hold for some motion.
    pub fn are_complete(&self) -> bool {
        self.beyond > 0.0
    }

    /// Whether these include all leaves within `distance` of the point after this motion.
    pub fn has_all(&self, distance: f32, moved: f32) -> bool {
        distance + moved <= self.beyond
    }

    pub fn is_full(&self) -> bool {
        self.leaves.is_full()
    }

    /// Notes that leaves farther than this are skipped.
    pub fn pass(&mut self, distance: f32) {
        let passed = self.then(distance);
        if passed < self.passed {
            self.passed = passed;
        }
    }

    /// Ends the collection: all leaves but the skipped ones are included, unless one did not fit. `slack` covers the
    /// rounding.
    pub fn close(&mut self, slack: f32) {
        self.is_gathering = false;
        if !self.is_over {
            self.beyond = self.passed - slack;
        }
    }

    /// Converts a current bound to one at the start of the collection.
    pub fn then(&self, bound: f32) -> f32 {
        let sum = bound + self.moved;
        sum - sum.abs() * f32::EPSILON
    }

    pub fn push(&mut self, leaf: Leaf) {
        self.is_over |= self.leaves.push(leaf).is_err();
    }

    /// Keeps only leaves that may be within `distance`.
    pub fn keep_within(&mut self, distance: f32) {
        self.leaves.retain(|leaf| !(leaf.bound > distance));
    }
}

/// The sum of two lengths, rounded up.
fn sum(a: f32, b: f32) -> f32 {
    (a + b) * (1.0 + f32::EPSILON)
}
