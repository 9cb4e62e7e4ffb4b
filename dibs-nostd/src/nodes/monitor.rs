//! The check of a frame of nodes before it is published.

use super::Nodes;
use super::measure::Pass;
use crate::stretch::{
    Admission, AdmissionCheck, Comparison, FrameExtent, IncomingSurface, StretchError,
    SurfaceLimits, farthest, largest_step, too_fast,
};
use crate::surface::{Millis, MotionUnit, SurfaceBlend, VertexTable};
use crate::tree::SurfaceFacts;

/// Measures every frame of nodes before it is published, a few elements at a time: the [`AdmissionCheck`] of an
/// [`Assembler`](crate::Assembler) whose buffers have a row for each node.
///
/// It refuses frames with an element stretched beyond the tree's limit, shrunk, or inverted, and nodes that move too
/// far, like [`StretchMonitor`](crate::StretchMonitor) for triangles and vertices, and gives the query the measured
/// stretch. Nodes may move as far as keeps every vertex within the limits: see [`Nodes::amplification`]. An element is
/// measured once its nodes have arrived; in a partial frame all elements are measured.
///
/// Inversion is checked for each element: a body bent until its ends overlap passes.
///
/// With `SURFACES` = 2 ([`continuous`](NodeMonitor::continuous)) it also measures the end of the frame's extrapolation.
/// Between two frames the stretch is bounded by theirs, because the largest singular value is convex; between frames
/// that both turn an element by much, it may be inverted, which does not affect distance bounds.
///
/// Cost: [`advance`](AdmissionCheck::advance) checks at most `work` nodes and elements. RAM: 250 bytes.
#[derive(Clone, Debug)]
pub struct NodeMonitor<'a, const SURFACES: usize = 1> {
    nodes: Nodes<'a>,
    limits: SurfaceLimits,
    changed: FrameExtent,
    /// The measurement of the frame, and that of its extrapolation.
    passes: [Pass; SURFACES],
    is_beyond: bool,
    /// The next row to be compared with the published one.
    next_row: u32,
}

impl<'a> NodeMonitor<'a> {
    /// A monitor for frames of these nodes, with the default limits of [`SurfaceLimits::reach_mm`].
    #[must_use]
    pub const fn new(nodes: &Nodes<'a>) -> Self {
        Self::with_passes(nodes)
    }
}

impl<'a> NodeMonitor<'a, 2> {
    /// The same with the frames' extrapolations. An extrapolation beyond the tree's limit, or with an inverted element,
    /// is no error: then the surface is held instead.
    #[must_use]
    pub const fn continuous(nodes: &Nodes<'a>) -> Self {
        Self::with_passes(nodes)
    }
}

impl<'a, const SURFACES: usize> NodeMonitor<'a, SURFACES> {
    const fn with_passes(nodes: &Nodes<'a>) -> Self {
        Self {
            nodes: *nodes,
            limits: SurfaceLimits::reach_mm(f32::INFINITY),
            changed: FrameExtent::Whole,
            passes: [Pass::new(); SURFACES],
            is_beyond: false,
            next_row: 0,
        }
    }

    /// The same with these limits on speed, recovery and size, for nodes and elements. The assembler checks the reach.
    #[must_use]
    pub const fn limits(mut self, limits: SurfaceLimits) -> Self {
        self.limits = limits;
        self
    }

    /// The nodes whose frames are measured.
    #[must_use]
    pub const fn nodes(&self) -> &Nodes<'a> {
        &self.nodes
    }

    /// Upper bound on the nodes and elements checked for one frame: the sum of its slices' work.
    #[must_use]
    pub const fn whole_work(&self) -> u32 {
        let elements = self.nodes.element_count().saturating_mul(SURFACES as u32);
        self.nodes.count().saturating_add(elements)
    }

    /// Compares arrived rows with the published ones. Returns the work left, and whether all rows are done.
    fn compare<V: VertexTable + ?Sized>(
        &mut self,
        IncomingSurface { surface, ready, before, compared }: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<(u32, bool), StretchError> {
        let Some((before, elapsed)) = before else { return Ok((work, true)) };
        let limit = self.farthest(elapsed);
        if limit == f32::INFINITY {
            return Ok((work, true));
        }
        if let Some(Comparison { largest, rows: [first, end], .. }) = compared {
            if !(largest <= limit * limit) {
                return Err(too_fast(surface, before, self.nodes.carrying(first..end), limit));
            }
            return Ok((work, true));
        }
        let waiting = ready.saturating_sub(self.next_row);
        let rows = if waiting < work { waiting } else { work };
        let range = self.next_row..self.next_row.saturating_add(rows);
        let carrying = || self.nodes.carrying(range.clone());
        if !(largest_step(surface, before, carrying(), 0.0) <= limit * limit) {
            return Err(too_fast(surface, before, carrying(), limit));
        }
        self.next_row = range.end;
        Ok((work.saturating_sub(rows), self.next_row >= self.nodes.count()))
    }
}

impl<const SURFACES: usize> AdmissionCheck for NodeMonitor<'_, SURFACES> {
    fn begin(&mut self, changed: FrameExtent) {
        (self.changed, self.next_row, self.is_beyond) = (changed, 0, false);
        self.passes = [Pass::new(); SURFACES];
    }

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        arriving: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError> {
        let IncomingSurface { surface, ready, before, .. } = arriving;
        let nodes = self.nodes;
        nodes.check_rows(surface)?;
        let is_complete = ready >= nodes.count();
        if self.changed == FrameExtent::Partial && !is_complete {
            return Ok(Admission::Pending);
        }
        let (work, is_compared) = self.compare(arriving, work)?;
        // Half of the work for each, so that both keep up with the frame.
        let for_ahead = if SURFACES > 1 { work / 2 } else { 0 };
        let Some((own, ahead)) = self.passes.split_first_mut() else {
            return Ok(Admission::Pending);
        };
        let left = own.advance(&nodes, surface, ready, self.limits.shrinkage, work - for_ahead)?;
        let mut is_ahead = true;
        if let (Some(pass), Some((before, _)), false) = (ahead.first_mut(), before, self.is_beyond)
        {
            let surface = SurfaceBlend::ahead(before, surface);
            let work = for_ahead.saturating_add(left);
            // Beyond the limit, inverted, or not finite: no extrapolation.
            self.is_beyond = pass.advance(&nodes, &surface, ready, 0.0, work).is_err();
            is_ahead = self.is_beyond || pass.is_done(&nodes);
        }
        if !is_complete || !is_compared || !own.is_done(&nodes) || !is_ahead {
            return Ok(Admission::Pending);
        }
        Ok(Admission::Admitted(Some(own.measured(&nodes, surface.epoch()))))
    }

    fn ahead(&self) -> Option<f32> {
        let pass =
            self.passes.get(1).filter(|pass| pass.is_done(&self.nodes) && !self.is_beyond)?;
        Some(pass.measured(&self.nodes, None).sigma())
    }

    fn motion_unit(&self) -> Option<MotionUnit> {
        Some(self.nodes.motion)
    }

    fn carries(&self, row: u32) -> bool {
        self.nodes.carries(row)
    }

    fn surface_facts(&self) -> SurfaceFacts {
        self.nodes.facts
    }

    fn farthest(&self, elapsed: Millis) -> f32 {
        farthest(self.limits.speed, self.limits.recovery, elapsed) / self.nodes.amplification()
    }
}
