//! The motion from the published frame to the one in work, measured in slices while its rows arrive.
//!
//! The assembler measures it itself, because it alone knows that both frames stay as they are until the later one is
//! published: so no gate, and no user, can understate it.

use crate::math::sqrt::sqrt;
use crate::stretch::largest_step;
use crate::surface::{Travel, TravelUnit, VertexTable};

/// The rows compared so far, and the squares of the largest step and of the largest distance from the extrapolation.
#[derive(Debug)]
pub(super) struct Step {
    rows: u32,
    largest: f32,
    off: f32,
}

impl Step {
    pub const fn new() -> Self {
        Self { rows: 0, largest: 0.0, off: 0.0 }
    }

    /// Compares at most `work` of the rows below `ready` with those before, and with those `expected` by the two frames
    /// before, if there are two. Returns the work left.
    pub fn compare<V: VertexTable + ?Sized, W: VertexTable + ?Sized>(
        &mut self,
        now: &V,
        before: &V,
        expected: Option<&W>,
        ready: u32,
        work: u32,
    ) -> u32 {
        let waiting = ready.saturating_sub(self.rows);
        let rows = if waiting < work { waiting } else { work };
        let end = self.rows.saturating_add(rows);
        self.largest = largest_step(now, before, self.rows..end, self.largest);
        self.off = match expected {
            Some(expected) => largest_step(now, expected, self.rows..end, self.off),
            None => f32::NAN,
        };
        self.rows = end;
        work.saturating_sub(rows)
    }

    pub const fn compared(&self) -> u32 {
        self.rows
    }

    /// The largest distance of a row from the expected one; NaN where nothing was expected.
    pub fn shown_error(&self) -> f32 {
        sqrt(self.off)
    }

    /// The odometer's reading after the step from a frame with the reading `before`; a start where that is unknown, or
    /// the step is not finite.
    pub fn travel(&self, unit: &TravelUnit, before: Option<Travel>) -> Travel {
        let after = before.and_then(|before| before.after_step(unit, self.largest));
        after.unwrap_or_else(|| Travel::start(unit.tree))
    }
}
