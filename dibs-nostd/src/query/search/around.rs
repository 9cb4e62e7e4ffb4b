//! The leaves around a point of the axis.
//!
//! A search that goes farther than the closest triangle leaves them. Until tool and surface have moved so far, the closest
//! triangle is in one of them, and the next ticks look at no others.
//!
//! Rounding. The distance beyond is stored less the slack of its own search, and compared with the cutoff, which has the
//! slack of this one.

use super::{Search, Waiting};
use crate::tree::format::Link;
use crate::{Index, Proximity, Tool, VertexTable};

/// Most of them.
const MOST: usize = 32;

/// A search goes as much farther as tool and surface move in so many ticks, but not more than twice as far.
const TICKS: f32 = 8.0;

/// The leaves around a point.
#[derive(Clone, Debug)]
pub(in crate::query) struct Around {
    /// Their links.
    leaves: [u32; MOST],
    count: usize,
    /// All other leaves are at least as far as this from the point; 0 if that is not known.
    pub beyond: f32,
    /// Where the point is on its axis: 0 at the start, 1 at the end.
    parameter: f32,
    /// The motion of the last tick.
    moved: f32,
}

impl Around {
    pub const fn new() -> Self {
        Self { leaves: [0; MOST], count: 0, beyond: 0.0, parameter: 0.0, moved: 0.0 }
    }

    pub fn forget(&mut self) {
        self.beyond = 0.0;
    }

    /// Tool and surface have moved.
    pub fn add_motion(&mut self, moved: f32) {
        self.beyond = (self.beyond - moved) * (1.0 - f32::EPSILON);
        self.moved = moved;
    }

    /// The point is another one of its axis, which is as long as this.
    pub fn move_to(&mut self, parameter: f32, length: f32) {
        let moved = (parameter - self.parameter).abs() * length;
        self.beyond -= moved * (1.0 + 4.0 * f32::EPSILON);
        self.parameter = parameter;
    }

    /// Whether there was room.
    #[inline(always)]
    pub(super) fn push(&mut self, leaf: Link) -> bool {
        let place = self.leaves.get_mut(self.count);
        let has_room = place.is_some();
        if let Some(place) = place {
            *place = leaf.encode();
        }
        self.count = self.count.saturating_add(1);
        has_room
    }

    /// The search for the closest pair `found` has ended. It left all leaves that are less than `wider` farther.
    pub fn keep(&mut self, found: &Proximity, wider: f32) {
        let is_known = !found.is_cut_short() && self.count <= MOST;
        self.beyond = if is_known { found.axis_distance + wider } else { 0.0 };
    }
}

impl<'s, I: Index, V: VertexTable + ?Sized, T: Tool> Search<'s, '_, I, V, T> {
    /// Begins with the leaves in `around` alone, if all others are beyond the cutoff. If not, the search will leave them
    /// there: all that are less than the width returned farther than the closest one.
    pub fn begin_around(&mut self, around: &'s mut Around) -> Option<f32> {
        if self.cutoff + self.coordinate_slack <= around.beyond
            && let Some(leaves) = around.leaves.get(..around.count)
            && let Some(places) = self.stack.get_mut(..leaves.len())
        {
            for (place, &link) in places.iter_mut().zip(leaves.iter().rev()) {
                *place = Waiting { lower: 0.0, link };
            }
            self.waiting = leaves.len();
            return None;
        }
        around.count = 0;
        around.forget();
        let width = TICKS * around.moved;
        self.wider = if width < self.cutoff { width } else { self.cutoff };
        self.around = Some(around);
        Some(self.wider - self.slack - self.coordinate_slack)
    }
}
