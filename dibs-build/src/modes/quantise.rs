//! Modes in 16 bits, and the fixed-point scale of their sums.

use dibs_nostd::modes::FRACTION_BITS;
use glam::DVec3;

/// A mode as the tree stores it: `displacement = step * row`, at weight 1.
#[derive(Clone, Debug)]
pub struct QuantisedMode {
    pub rows: Vec<[i16; 3]>,
    /// Size of one step, in mm, exact in f32.
    pub step: f64,
}

impl QuantisedMode {
    /// The rounded mode's displacements at weight 1.
    pub fn displacements(&self) -> Vec<DVec3> {
        self.rows.iter().map(|row| DVec3::from(row.map(f64::from)) * self.step).collect()
    }
}

/// Rounds a mode to 16 bits; `None` if only zeros are left, or f32 cannot hold its scale.
pub fn quantise(mode: &[DVec3]) -> Option<QuantisedMode> {
    let largest = mode.iter().map(|d| d.abs().max_element()).fold(0.0, f64::max);
    let step = f64::from((largest / f64::from(i16::MAX)) as f32);
    if !(step > f64::from(f32::MIN_POSITIVE) && step < 1e12) {
        return None;
    }
    let code = |x: f64| (x / step).round().clamp(-32_767.0, 32_767.0) as i16;
    Some(QuantisedMode { rows: mode.iter().map(|d| d.to_array().map(code)).collect(), step })
}

/// Unit of a displacement sum (mm), a power of two: the largest sum takes 26 or 27 bits.
pub fn unit(modes: &[QuantisedMode], largest_weights: impl Iterator<Item = f64>) -> f64 {
    let steps = modes.iter().map(|mode| mode.step * 32_768.0);
    let reach: f64 = steps.zip(largest_weights).map(|(step, weight)| step * weight).sum();
    (reach / 2.0_f64.powi(27)).log2().ceil().exp2()
}

/// Gain of a mode in fixed point, exact: its step over the unit, which is a power of two.
pub fn gain(mode: &QuantisedMode, unit: f64) -> f32 {
    (mode.step / unit * f64::from(1_u32 << FRACTION_BITS)) as f32
}
