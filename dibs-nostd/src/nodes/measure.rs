//! The measurement of all elements, in slices of bounded work.

use super::Nodes;
use super::kernel::Now;
use super::layout::{self, ELEMENT_BYTES};
use crate::stretch::{LEAST, StretchError, root_up, squared_limit};
use crate::surface::{MeasuredStretch, REGIONS, VertexTable};

/// How far a measurement has come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pass {
    /// The next element.
    next: u32,
    /// The largest squared stretch so far, and its element.
    squared: f32,
    worst: u32,
    /// The squares of the edges of this run of elements, now and at rest.
    sizes: [f32; 2],
}

impl Pass {
    pub const fn new() -> Self {
        Self { next: 0, squared: LEAST, worst: 0, sizes: [0.0; 2] }
    }

    /// Measures at most `work` elements whose nodes are below row `ready`, and returns the work left. Runs of elements
    /// must not shrink below `shrinkage` of their size at rest.
    pub fn advance<V: VertexTable + ?Sized>(
        &mut self,
        nodes: &Nodes<'_>,
        table: &V,
        ready: u32,
        shrinkage: f32,
        mut work: u32,
    ) -> Result<u32, StretchError> {
        let limit = squared_limit(nodes.limit);
        let run = nodes.run();
        let elements = nodes.parts.elements;
        let rows = elements.get(self.next as usize..).unwrap_or_default();
        for record in rows {
            if work == 0 || !self.measure(nodes, record, table, ready, limit)? {
                break;
            }
            work -= 1;
            self.next += 1;
            let is_end = self.next.is_multiple_of(run) || self.next as usize == elements.len();
            if is_end {
                let [now, rest] = self.sizes;
                self.sizes = [0.0; 2];
                if !(now >= shrinkage * shrinkage * rest) {
                    let element = self.next.saturating_sub(run);
                    return Err(StretchError::ElementsShrunk { element, limit: shrinkage });
                }
            }
        }
        Ok(work)
    }

    /// Measures the next element; false where a node of it is not ready.
    #[inline(always)]
    fn measure<V: VertexTable + ?Sized>(
        &mut self,
        nodes: &Nodes<'_>,
        record: &[u8; ELEMENT_BYTES],
        table: &V,
        ready: u32,
        limit: f32,
    ) -> Result<bool, StretchError> {
        let element = layout::element(record);
        let [a, b, c, d] = element.corners;
        if (a >= ready) | (b >= ready) | (c >= ready) | (d >= ready) {
            return Ok(false);
        }
        let at = |node| table.position(node).ok_or(StretchError::Corrupt { row: node });
        let now = Now::of([at(a)?, at(b)?, at(c)?, at(d)?]);
        if !now.is_within(&element, self.squared) {
            let row = self.next;
            if !now.is_within(&element, limit) {
                let stretch = now.stretch_beyond(&element, limit);
                let limit = nodes.limit;
                return Err(StretchError::ElementExceeded { element: row, stretch, limit });
            }
            self.squared = now.squared_stretch(&element, self.squared, limit);
            self.worst = row;
        }
        if !now.is_upright(&element) {
            return Err(StretchError::Inverted { element: self.next });
        }
        let [size, rest] = now.sizes(&element);
        let [sizes, at_rest] = self.sizes;
        self.sizes = [sizes + size, at_rest + rest];
        Ok(true)
    }

    /// Whether all elements are measured.
    pub fn is_done(&self, nodes: &Nodes<'_>) -> bool {
        self.next as usize >= nodes.parts.elements.len()
    }

    /// The stretch, once all elements are measured.
    pub fn measured(&self, nodes: &Nodes<'_>, epoch: Option<u32>) -> MeasuredStretch {
        let sigma = root_up(self.squared);
        let regions = [u8::MAX; REGIONS];
        MeasuredStretch::new(sigma, nodes.motion.tree, self.worst, epoch, regions)
    }
}
