//! The motion from the published frame to the current one, measured in slices while its rows arrive.
//!
//! The assembler measures it itself, because it alone knows that both frames are unchanged until the later one is
//! published: so no admission check and no user can understate the motion. The limit on speed is the admission
//! check's, because with nodes, weights or a pose a vertex moves by another length than its row.

// Requirement: T-04

use crate::math::sqrt::sqrt;
use crate::stretch::{AdmissionCheck, Comparison, largest_change, largest_step};
use crate::surface::{MotionReading, MotionUnit, PredictionCheck, VertexTable};

/// Most units of an extrapolated step: more than 32 times the root sphere's radius.
const MOST: u64 = 1 << 30;

/// The rows compared so far, and the squares of the largest step and of the largest distance from the extrapolation.
#[derive(Debug)]
pub(super) struct StepMeter {
    rows: u32,
    /// Start and end of the slice with the largest step.
    fastest: [u32; 2],
    largest: f32,
    off: f32,
    /// Odometer units between the two previous frames, and the fraction of that step that the extrapolation adds.
    units: u64,
    t: f32,
}

/// The frame before the published one, from which the current frame is extrapolated.
pub(super) struct Earlier<'f, V: ?Sized> {
    pub frame: &'f V,
    /// Units from it to the published frame, and the fraction of that step to add.
    pub units: u64,
    pub t: f32,
}

impl StepMeter {
    pub const fn new() -> Self {
        Self { rows: 0, fastest: [0; 2], largest: 0.0, off: 0.0, units: 0, t: f32::NAN }
    }

    /// Compares at most `work` of the rows below `ready` with the published ones, and with their extrapolation from an
    /// earlier frame, if there is one; of these rows only those whose motion the admission check counts. Returns the
    /// work left.
    pub fn compare<V: VertexTable + ?Sized, G: AdmissionCheck>(
        &mut self,
        admission_check: &G,
        (now, before): (&V, &V),
        earlier: Option<&Earlier<'_, V>>,
        ready: u32,
        work: u32,
    ) -> u32 {
        let waiting = ready.saturating_sub(self.rows);
        let rows = if waiting < work { waiting } else { work };
        let end = self.rows.saturating_add(rows);
        let counted = (self.rows..end).filter(|&row| admission_check.carries(row));
        let largest = self.largest;
        (self.largest, self.off) = match earlier {
            Some(&Earlier { frame, units, t }) => {
                (self.units, self.t) = (units, t);
                largest_change((now, before, frame), t, counted, (self.largest, self.off))
            }
            None => (largest_step(now, before, counted, self.largest), f32::NAN),
        };
        if !(self.largest <= largest) {
            self.fastest = [self.rows, end];
        }
        self.rows = end;
        work.saturating_sub(rows)
    }

    /// Rows compared so far.
    pub const fn rows(&self) -> u32 {
        self.rows
    }

    pub const fn compared(&self) -> Comparison {
        Comparison { largest: self.largest, rows: self.fastest, t: self.t }
    }

    /// The distance of the frame from its extrapolation, if any; its stretch is not known here.
    pub fn ahead(&self, unit: Option<&MotionUnit>) -> PredictionCheck {
        let units = |squared| unit?.units_of_step(squared);
        let known = match (units(self.largest), units(self.off)) {
            (Some(step), Some(off)) if self.units < MOST && step < MOST && off < MOST => {
                // The distance is the difference of two steps, each rounded by a few times 2^-24 of itself.
                let rounding = (2 * self.units + step) / (1 << 18) + 2;
                Some(((self.t * self.units as f32) as u32, (off + rounding) as u32))
            }
            _ => None,
        };
        let (passed, off) = known.unwrap_or((0, PredictionCheck::UNKNOWN.off));
        let residual = sqrt(self.off) * self.compared().growth();
        PredictionCheck { residual, passed, off, ..PredictionCheck::UNKNOWN }
    }

    /// The odometer's reading after the step from a frame with the reading `before`; a new start if that is unknown or
    /// the step is not finite.
    pub fn motion(&self, unit: &MotionUnit, before: Option<MotionReading>) -> MotionReading {
        let after = before.and_then(|before| before.after_step(unit, self.largest));
        after.unwrap_or_else(|| MotionReading::start(unit.tree))
    }
}

#[cfg(test)]
mod tests {
    use dibs_build::{Builder, generate};

    use super::*;
    use crate::tree::Tree;

    /// Of the last step, the new one and the distance from the extrapolation, each may be too long to count: then nothing
    /// is stated.
    #[test]
    fn a_length_that_is_too_long_to_count_is_unknown() {
        let mesh = generate::heart(320).expect("a valid size").mesh;
        let built = Builder::new().build(&mesh).expect("a valid mesh");
        let tree = Tree::<u16>::from_bytes(built.blob()).expect("valid");
        let unit = MotionUnit::of(&tree);
        let (_, radius, _) = tree.node(0).expect("a root");
        let units = |length: f32| unit.units_of_step(length * length).expect("finite");
        let far = 100.0 * radius;
        assert!((MOST..u64::from(u32::MAX)).contains(&units(far)), "{}", units(far));
        let ahead = |units, step: f32, off: f32| {
            let (largest, off) = (step * step, off * off);
            let meter = StepMeter { largest, off, units, t: 1.0, ..StepMeter::new() };
            let PredictionCheck { passed, off, .. } = meter.ahead(Some(&unit));
            (passed, off)
        };
        let near = units(1.0);
        for last in [near, MOST - 1] {
            let (passed, off) = ahead(last, 1.0, 0.5);
            assert!(u64::from(passed).abs_diff(last) <= 1 + last / 1_000_000, "{passed} {last}");
            let rounding = u64::from(off) - units(0.5);
            assert!(rounding <= (2 * last + near) / 100_000 + 2, "{rounding} {last}");
        }
        for (last, step, off) in [(MOST, 1.0, 0.5), (near, far, 0.5), (near, 1.0, far)] {
            assert_eq!(ahead(last, step, off), (0, u32::MAX), "{last} {step} {off}");
        }
    }
}
