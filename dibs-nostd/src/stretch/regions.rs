//! Regions: equal ranges of triangle rows, each with its own measurement.

use super::kernel::{Worst, root_up};
use crate::math::order::smaller;
use crate::surface::{MeasuredStretch, REGIONS, region_sigma};
use crate::tree::{Index, Tree};

/// Triangle rows of each region (the last may have fewer).
pub(super) const fn region_rows<I: Index>(tree: &Tree<'_, I>) -> u32 {
    tree.triangle_count().div_ceil(REGIONS as u32)
}

/// The measurement of a whole frame, from the worst triangle of each region.
pub(super) fn of_regions<I: Index>(
    tree: &Tree<'_, I>,
    regions: &[Worst; REGIONS],
    epoch: Option<u32>,
) -> MeasuredStretch {
    let mut worst = Worst::none(0);
    for region in regions {
        if region.squared > worst.squared {
            worst = *region;
        }
    }
    // A square that passed at the limit is within it; only the root's rounding may exceed it.
    let within = |squared: f32| {
        let sigma = root_up(squared);
        smaller(sigma, tree.stretch())
    };
    let sigma = within(worst.squared);
    let mut codes = [0; REGIONS];
    for (code, region) in codes.iter_mut().zip(regions) {
        let own = within(region.squared);
        // The least code whose stretch is at least `own`, however the division rounds.
        let mut part = ((own / sigma * 256.0) as u8).saturating_sub(1);
        for _ in 0..2 {
            if region_sigma(sigma, part) < own {
                part = part.saturating_add(1);
            }
        }
        *code = part;
    }
    MeasuredStretch::new(sigma, tree.checksum(), worst.triangle, epoch, codes)
}
