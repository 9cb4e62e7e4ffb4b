//! The limits of a bus and a guard: numbers that only the user knows.

use dibs_nostd::Millis;
use dibs_nostd::guard::GuardLimits;

use crate::border::{AnyBits, Input};
use crate::code::dibs_code;
use crate::failsafe::dibs_limits;
use crate::query::{DIBS_UNLIMITED, dibs_options};
use crate::receiver::dibs_surface_limits;

/// Limits on the trust in a surface, and options of a tick's query. `dibs_guard_limits_of` makes one from two numbers.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_guard_limits {
    /// Largest speed (mm/s) of any point of the tissue, at least 0.
    pub speed: f32,
    /// Largest age (ms) of a surface: about two periods of the source plus the transit time. From three quarters of it
    /// on the state is degraded, above it safe.
    pub age: u32,
    /// Ticks of the control loop a second, above 0: needed for velocities.
    pub ticks_a_second: u32,
    /// Options of every tick's query; the budget limits the work of a tick.
    pub options: dibs_options,
    /// 0 to leave the safe state only by an acknowledgement; otherwise automatically.
    pub automatic: u32,
    /// Other than 0 for a line that returns no status: a delayed frame is then taken for a new one, and no margin
    /// covers the delay.
    pub without_transit: u32,
    /// The fail-safe machine's limits; or null to derive them from the numbers above.
    pub trust: *const dibs_limits,
    /// The published surfaces' limits; or null to derive them from the speed and the tree's rest shape: a reach of four
    /// times its size.
    pub surfaces: *const dibs_surface_limits,
}

// SAFETY: the fields are numbers and pointers.
unsafe impl AnyBits for dibs_guard_limits {}

impl dibs_guard_limits {
    /// Converts them to the core's limits.
    pub(crate) fn read(self) -> Result<GuardLimits, dibs_code> {
        if self.ticks_a_second == 0 {
            return Err(dibs_code::Argument);
        }
        let mut limits = GuardLimits::new(self.speed, Millis(self.age))
            .ticks_a_second(self.ticks_a_second)
            .options(self.options.try_into()?);
        if self.automatic != 0 {
            limits = limits.automatic();
        }
        if self.without_transit != 0 {
            limits = limits.without_transit();
        }
        if let Some(trust) = self.trust.get_if_any()? {
            limits = limits.trust(trust.try_into()?);
        }
        if let Some(surfaces) = self.surfaces.get_if_any()? {
            limits = limits.surfaces(surfaces.into());
        }
        Ok(limits)
    }
}

/// The limits that follow from two numbers: 1,000 ticks a second, no budget, and an operator who acknowledges.
///
/// @param speed  Largest speed (mm/s) of any point of the tissue.
/// @param age    Largest age (ms) of a surface.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_guard_limits_of(speed: f32, age: u32) -> dibs_guard_limits {
    let budget = DIBS_UNLIMITED;
    dibs_guard_limits {
        speed,
        age,
        ticks_a_second: 1_000,
        options: dibs_options { budget, depth_tolerance: 0.0, flags: 0, label: 0 },
        automatic: 0,
        without_transit: 0,
        trust: core::ptr::null(),
        surfaces: core::ptr::null(),
    }
}
