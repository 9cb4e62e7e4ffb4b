//! Stretch limits of single triangles, as the tree stores them.

use dibs_nostd::format::MAX_LIMIT_CODE;

/// Each triangle's limit over the largest, rounded up to a 16-bit code. The whole build uses these codes, so that the
/// controller enforces the limits that the radii are computed for.
#[derive(Clone, Debug, Default)]
pub(crate) struct LimitRatios {
    /// One for each triangle; empty if all have the same limit.
    codes: Vec<u16>,
}

impl LimitRatios {
    /// The largest of these limits, which becomes the tree's, and each triangle's ratio to it.
    pub fn of(limits: &[f32]) -> (f32, Self) {
        let largest = limits.iter().copied().fold(1.0, f32::max);
        if limits.iter().all(|&limit| limit == largest) {
            return (largest, Self::default());
        }
        let code = |limit: f32| {
            let exact = f64::from(limit) / f64::from(largest) * f64::from(MAX_LIMIT_CODE);
            exact.ceil() as u16
        };
        (largest, Self { codes: limits.iter().map(|&limit| code(limit)).collect() })
    }

    /// Whether every triangle has the tree's limit.
    pub fn is_uniform(&self) -> bool {
        self.codes.is_empty()
    }

    /// The code of a triangle's limit, as it is stored.
    pub fn code(&self, triangle: u32) -> u16 {
        self.codes.get(triangle as usize).copied().unwrap_or(MAX_LIMIT_CODE as u16)
    }

    /// A triangle's limit over the tree's, at most 1.
    pub fn ratio(&self, triangle: u32) -> f64 {
        f64::from(self.code(triangle)) / f64::from(MAX_LIMIT_CODE)
    }
}
