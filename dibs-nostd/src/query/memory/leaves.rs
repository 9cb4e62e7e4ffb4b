//! The leaves around a point of the axis, each with a bound.
//!
//! Until tool and surface have moved too far, the closest triangle to the point is in one of them.

use heapless::Vec;

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
        let leaves = Vec::new();
        Self { leaves, is_over: false, moved: 0.0, beyond: 0.0, parameter: 0.0, step: 0.0 }
    }

    pub fn forget(&mut self) {
        self.leaves.clear();
        (self.is_over, self.moved, self.beyond) = (false, 0.0, 0.0);
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

    /// Whether all leaves within `distance` of a point that has moved by so much are among these.
    pub fn has_all(&self, distance: f32, moved: f32) -> bool {
        distance + moved <= self.beyond
    }

    pub fn is_full(&self) -> bool {
        self.leaves.is_full()
    }

    /// All other leaves are at least as far as this, unless there was no room for one.
    pub fn close(&mut self, beyond: f32) {
        if !self.is_over {
            self.beyond = beyond;
        }
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
