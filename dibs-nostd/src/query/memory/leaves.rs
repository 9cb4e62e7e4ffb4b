//! The leaves around a point of the axis, each with a bound.
//!
//! Until tool and surface have moved too far, the closest triangle to the point is in one of them.

use heapless::{Vec, VecView};

use super::waiting::Waiting;

/// Most leaves.
pub(in crate::query) const MOST: usize = 48;

/// The leaves around a point.
#[derive(Clone, Debug)]
pub(in crate::query) struct Leaves {
    leaves: Vec<Leaf, MOST>,
    /// There were more.
    is_over: bool,
    /// Motion (mm) of tool and surface, and of the point along its axis, since they were gathered.
    moved: f32,
    /// All other leaves were at least as far (mm) as this; 0 if that is not known.
    beyond: f32,
    /// The same of those that were passed over while the leaves are gathered.
    passed: f32,
    /// A search for them goes on.
    is_gathering: bool,
    /// Where the point is on its axis: 0 at the start, 1 at the end.
    parameter: f32,
    /// The motion (mm) of the last tick.
    step: f32,
}

/// A leaf.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Leaf {
    pub link: u32,
    /// It was at least as far (mm) as this when the leaves were gathered.
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

    /// Forgets them, and begins to gather them anew.
    pub fn begin(&mut self) {
        self.forget();
        self.is_gathering = true;
    }

    /// Whether a search for them goes on.
    pub const fn is_gathering(&self) -> bool {
        self.is_gathering
    }

    /// Forgets them for the leaves around another point of the axis.
    pub fn forget_for(&mut self, parameter: f32) {
        self.forget();
        self.parameter = parameter;
    }

    /// Forgets them and their point, and the subtrees that wait for them.
    pub fn end(&mut self, waiting: &mut VecView<Waiting>) {
        if self.is_gathering {
            waiting.clear();
        }
        self.forget_for(f32::NAN);
    }

    /// Whether they are those around this point of the axis.
    pub fn are_around(&self, parameter: f32) -> bool {
        self.parameter == parameter
    }

    /// The point that they are around.
    pub const fn parameter(&self) -> f32 {
        self.parameter
    }

    /// Tool and surface have moved.
    pub fn add_motion(&mut self, moved: f32) {
        self.moved = sum(self.moved, moved);
        self.step = moved;
    }

    /// The way from the point to another one of its axis, which is as long as `length`.
    pub fn way_to(&self, parameter: f32, length: f32) -> f32 {
        (parameter - self.parameter).abs() * length * (1.0 + 4.0 * f32::EPSILON)
    }

    /// The point is another one of its axis.
    pub fn move_to(&mut self, parameter: f32, length: f32) {
        self.moved = sum(self.moved, self.way_to(parameter, length));
        self.parameter = parameter;
    }

    /// The motion of the last tick.
    pub const fn step(&self) -> f32 {
        self.step
    }

    /// The motion since the leaves were gathered, to a point farther by `way`.
    pub fn moved(&self, way: f32) -> f32 {
        sum(self.moved, way)
    }

    /// The leaves, and the motion since they were gathered.
    pub fn each(&mut self) -> (&mut [Leaf], f32) {
        (&mut self.leaves, self.moved)
    }

    /// Whether they were gathered, and hold for some motion.
    pub fn are_complete(&self) -> bool {
        self.beyond > 0.0
    }

    /// Whether all leaves within `distance` of a point that has moved by so much are among these.
    pub fn has_all(&self, distance: f32, moved: f32) -> bool {
        distance + moved <= self.beyond
    }

    pub fn is_full(&self) -> bool {
        self.leaves.is_full()
    }

    /// Leaves that are now farther than this are passed over.
    pub fn pass(&mut self, distance: f32) {
        let passed = self.then(distance);
        if passed < self.passed {
            self.passed = passed;
        }
    }

    /// All leaves are gathered that were not passed over, unless there was no room for one. `slack` is the rounding.
    pub fn close(&mut self, slack: f32) {
        self.is_gathering = false;
        if !self.is_over {
            self.beyond = self.passed - slack;
        }
    }

    /// The bound at the start of the gathering that is this one now.
    pub fn then(&self, bound: f32) -> f32 {
        let sum = bound + self.moved;
        sum - sum.abs() * f32::EPSILON
    }

    pub fn push(&mut self, leaf: Leaf) {
        self.is_over |= self.leaves.push(leaf).is_err();
    }

    /// Keeps the leaves that may be within `distance`.
    pub fn keep_within(&mut self, distance: f32) {
        self.leaves.retain(|leaf| !(leaf.bound > distance));
    }
}

/// The sum of two lengths, rounded up.
fn sum(a: f32, b: f32) -> f32 {
    (a + b) * (1.0 + f32::EPSILON)
}
