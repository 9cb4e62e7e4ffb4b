//! The tools of a scene that were skipped because others are closer, and the proof that they are outside.
//!
//! No surface is within a tool's clearance, so every point within the clearance of the axis of a tool outside is
//! outside, too. An axis with such a point that touches no surface is outside of a closed surface.

// Requirements: A-09, S-01

use crate::Tool;

/// Most tools that may be skipped: one for each bit of a set.
pub(super) const MOST: usize = 64;

/// The tools on one surface.
pub(super) struct SkippedTools {
    /// The distance from each tool's axis within which there is no surface; 0 if unknown.
    clear: [f32; MOST],
    /// Tools that were skipped, and tools that are certainly outside.
    passed: u64,
    outside: u64,
}

impl SkippedTools {
    pub const fn new() -> Self {
        Self { clear: [0.0; MOST], passed: 0, outside: 0 }
    }

    /// Adds a tool that is outside or was skipped, with no surface within `clear` (mm) of its axis.
    pub fn add(&mut self, number: usize, clear: f32, is_outside: bool) {
        if let Some(slot) = self.clear.get_mut(number) {
            *slot = clear;
            *(if is_outside { &mut self.outside } else { &mut self.passed }) |= 1 << number;
        }
    }

    /// The skipped tools that may be inside.
    pub fn unsure<T: Tool>(&mut self, tools: &[T]) -> impl Iterator<Item = usize> + use<T> {
        // Each round but the last finds at least one more tool outside.
        for _ in 0..MOST {
            let before = self.outside;
            for (number, tool) in tools.iter().enumerate().take(MOST) {
                if self.passed & !self.outside & (1 << number) != 0 && self.joins(tool, tools) {
                    self.outside |= 1 << number;
                }
            }
            if self.outside == before {
                break;
            }
        }
        let unsure = self.passed & !self.outside;
        (0..MOST).filter(move |number| unsure & (1 << number) != 0)
    }

    /// Whether an end of a tool's axis is within the clearance of a tool outside.
    fn joins<T: Tool>(&self, tool: &T, tools: &[T]) -> bool {
        let ends = [tool.axis_start(), tool.axis_point(1.0)];
        tools.iter().zip(self.clear).enumerate().any(|(number, (other, clear))| {
            let is_near = |end| other.axis_distance_squared(end) < clear * clear;
            self.outside & (1 << number) != 0 && clear > 0.0 && ends.into_iter().any(is_near)
        })
    }
}
