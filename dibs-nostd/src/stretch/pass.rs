//! The measurement of one surface, region by region, in slices of bounded work.

use core::ops::Range;

use super::kernel::Worst;
use super::regions::{of_regions, region_rows};
use super::{StretchError, rows};
use crate::surface::{MeasuredStretch, REGIONS, VertexTable};
use crate::tree::{Index, Tree, TriangleRow};

const NONE: u32 = u32::MAX;

/// All regions, one bit each.
pub(super) const ALL: u32 = u32::MAX;
const _: () = assert!(REGIONS == u32::BITS as usize);

/// The worst triangle of each region, and the progress of the measurement.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    /// Regions still to be measured.
    left: u32,
    /// Regions whose entry below is from an abandoned or the current frame. The next partial frame measures them,
    /// changed or not.
    unpublished: u32,
    /// The next triangle of the current region.
    next: u32,
    /// The sum of the squares of one edge of each triangle of the current region.
    size: f32,
    regions: [Worst; REGIONS],
}

impl Pass {
    pub const fn new() -> Self {
        Self {
            left: ALL,
            unpublished: ALL,
            next: NONE,
            size: 0.0,
            regions: [Worst::none(u32::MAX); REGIONS],
        }
    }

    /// Begins with all regions, or with those whose entry is not from a published frame.
    pub const fn begin(&mut self, is_whole: bool) {
        self.next = NONE;
        self.left = if is_whole { ALL } else { self.unpublished };
    }

    /// Adds regions.
    pub const fn add(&mut self, regions: u32) {
        self.left |= regions;
    }

    /// Marks the entries as those of the published frame.
    pub const fn published(&mut self) {
        self.unpublished = 0;
    }

    /// Measures at most `work` triangles whose corners are below row `ready`. Returns the work left, and whether all
    /// regions are done. A region must not shrink below `shrinkage` of its size, whose square at rest is in `rest`.
    /// `measured` is called with the rows, each once.
    pub fn advance<I: Index, V: VertexTable + ?Sized>(
        &mut self,
        tree: &Tree<'_, I>,
        surface: &V,
        ready: u32,
        (shrinkage, rest): (f32, &[f32; REGIONS]),
        mut work: u32,
        mut measured: impl FnMut(Range<u32>),
    ) -> Result<(u32, bool), StretchError> {
        while self.left != 0 {
            let region = self.left.trailing_zeros();
            let rows = rows_of(tree, region);
            let next = if self.next == NONE { rows.start } else { self.next };
            let slot = self.regions.get_mut(region as usize);
            let slot = slot.ok_or(StretchError::Corrupt { row: rows.start })?;
            if self.next == NONE {
                if work == 0 {
                    return Ok((work, false));
                }
                let last = slot.triangle;
                let mut worst = Worst::none(rows.start);
                if rows.contains(&last) {
                    if !rows::check(tree, surface, last, ready, &mut worst) {
                        return Ok((work, false));
                    }
                    work -= 1;
                }
                *slot = worst;
                self.size = 0.0;
                self.unpublished |= 1 << region;
            }
            let stop = if rows.end - next < work { rows.end } else { next + work };
            let mut size = self.size;
            let at = rows::scan(tree, surface, next..stop, ready, slot, &mut size)?;
            measured(next..at);
            self.size = size;
            work -= at - next;
            if at < rows.end {
                self.next = at;
                return Ok((work, false));
            }
            let least = rest.get(region as usize).map(|rest| shrinkage * shrinkage * rest);
            if !least.is_some_and(|least| self.size >= least) {
                let triangle = TriangleRow(rows.start);
                return Err(StretchError::Shrunk { triangle, limit: shrinkage });
            }
            self.next = NONE;
            self.left &= self.left - 1;
        }
        Ok((work, true))
    }

    /// The measurement, once all regions are done.
    pub fn measured<I: Index>(&self, tree: &Tree<'_, I>, epoch: Option<u32>) -> MeasuredStretch {
        of_regions(tree, &self.regions, epoch)
    }
}

fn rows_of<I: Index>(tree: &Tree<'_, I>, region: u32) -> Range<u32> {
    let rows = region_rows(tree);
    let triangles = tree.triangle_count();
    let first = rows.saturating_mul(region);
    let end = first.saturating_add(rows);
    if end < triangles { first..end } else { first.min(triangles)..triangles }
}
