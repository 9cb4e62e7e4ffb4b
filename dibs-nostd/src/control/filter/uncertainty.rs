//! How far the tissue may be from the searched surface.

use crate::Millis;
use crate::math::round::sum_up;

/// How far the tissue may be from the searched surface, besides that surface's own [position
/// error](crate::VertexTable::position_error): at the start of a period, and its growth rate.
///
/// ```
/// use dibs_nostd::Millis;
/// use dibs_nostd::filter::Uncertainty;
///
/// // Tissue of at most 100 mm/s; a frame held for 12 ms after a transit of 4 ms; registered to within 0.5 mm.
/// let tissue = Uncertainty::new(100.0).after(Millis(12)).after(Millis(4)).error(0.5);
/// assert!((tissue.stand_off(0.001) - 2.2).abs() < 1e-5); // at a tick of 1 ms
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Uncertainty {
    /// mm.
    pub(super) now: f32,
    /// mm/s.
    pub(super) speed: f32,
}

impl Uncertainty {
    /// A surface at rest with exact positions.
    pub const NONE: Self = Self { now: 0.0, speed: 0.0 };

    /// For a current surface, no point of which will move faster than `speed` (mm/s, at least 0).
    #[must_use]
    pub const fn new(speed: f32) -> Self {
        Self { now: 0.0, speed }
    }

    /// The same for a surface of this age: adds its speed times the age. Age and transit both count; for an
    /// extrapolated surface its [lag](crate::SurfaceBlend::lag) and the transit.
    #[must_use]
    pub fn after(self, time: Millis) -> Self {
        let moved = time.0 as f32 * (self.speed * (1.0 / 1_000.0)) * (1.0 + 4.0 * f32::EPSILON);
        self.error(moved)
    }

    /// The same with a further error (mm, at least 0): of the registration, or the
    /// [margin](crate::failsafe::Verdict::margin) of a fail-safe machine.
    #[must_use]
    pub fn error(self, error: f32) -> Self {
        Self { now: sum_up(self.now, error), ..self }
    }

    /// The distance (mm) between tool and searched surface at which a period of this length (s) starts without a risk
    /// of contact: the uncertainty at its end. A filter keeps its stand-off in addition. For an extrapolated surface
    /// add its position error.
    #[must_use]
    pub fn stand_off(&self, period: f32) -> f32 {
        sum_up(self.now, self.grown(period))
    }

    /// Growth (mm) in a period.
    pub(super) fn grown(&self, period: f32) -> f32 {
        self.speed * period * (1.0 + 2.0 * f32::EPSILON)
    }
}
