//! The stretch of each frame, measured in slices of bounded work while its packets arrive.

// Requirement: F-02

use core::ops::Range;

use super::motion::{farthest, largest_step, too_fast};
use super::pass::{ALL, Pass};
use super::regions::region_rows;
use super::volume::Volume;
use super::{
    Admission, AdmissionCheck, Comparison, FrameExtent, IncomingSurface, StretchError,
    SurfaceLimits, check_tables,
};
use crate::surface::{Millis, MotionUnit, REGIONS, SurfaceBlend, VertexTable};
use crate::tree::{Index, SurfaceFacts, Tree, TriangleRow};

/// Largest number of blocks of vertex rows, in which moved rows of a partial frame are marked.
const BLOCKS: usize = 32;

/// Measures every frame before it is published, a few triangles at a time. This [`AdmissionCheck`] refuses surfaces
/// stretched, shrunk or moved beyond their limits, and gives the query the measured stretch.
///
/// A whole frame is measured as it arrives: a triangle is checked once its corners have arrived, and rows are sorted so
/// that corners arrive along with their triangles. Of a partial frame only the [`REGIONS`] with a moved corner are
/// measured, once it is complete; the other regions keep their stretch. A region starts with its worst triangle of the
/// last time, so that few others fail the quick check. The result is that of
/// [`measure_stretch`](super::measure_stretch) on the whole surface, except for a few parts in a million of rounding
/// that depend on the triangle with which a region started. The same frames always give the same bits.
///
/// The rows of a frame are compared with the published ones, and the volume that a closed surface encloses with that of
/// the rest shape; [`SurfaceLimits`] lists the refusals.
///
/// With `SURFACES` = 2 ([`continuous`](StretchMonitor::continuous)) it also measures the end of the frame's
/// extrapolation, `now + 2 (now - before)`, with the published frame as `before`. By convexity the two bound the
/// stretch of all surfaces between.
///
/// Cost: [`advance`](AdmissionCheck::advance) checks at most `work` rows and triangles, plus O([`REGIONS`]). RAM: at
/// most 800 bytes for any surface, and 300 bytes more with the extrapolation. [`new`](Self::new) makes two passes over
/// the triangles.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
/// use dibs_nostd::{Advance, Assembler, Frames, Millis, SurfaceLimits, Tree};
///
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(320)?;
/// let built = Builder::new().stretch(1.5).build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
///
/// static FRAMES: Frames<162> = Frames::new();
/// let (writer, mut reader) = FRAMES.split()?;
/// let limits = SurfaceLimits::reach_mm(300.0).speed(0.2); // mm, mm a millisecond
/// let mut assembler = Assembler::for_tree(writer, &tree, limits)?;
/// let rows = built.to_rows(&motion.frames[9]);
/// let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch: 1 };
/// let mut sender = FrameEncoder::<_, 512>::new(id, Encoding::Float, rows.as_slice())?;
/// let mut buffer = [0; 512];
/// while let Some(packet) = sender.next_packet(&mut buffer) {
///     assembler.accept(packet, Millis(0))?;
///     assembler.advance(60)?; // at most 60 rows and triangles
/// }
/// while assembler.advance(60)? == Advance::Pending {}
///
/// let frame = reader.read().ok_or("nothing published")?;
/// let measured = frame.label().stretch.ok_or("not measured")?;
/// assert!(measured.sigma() < 1.5 && measured.epoch() == Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct StretchMonitor<'t, I, const SURFACES: usize = 1> {
    tree: Tree<'t, I>,
    /// The regions with corners in each block of `1 << block_shift` vertex rows.
    touched: [u32; BLOCKS],
    block_shift: u8,
    changed: FrameExtent,
    /// The measurement of the frame, and that of its extrapolation.
    passes: [Pass; SURFACES],
    /// The stretch of the current frame's extrapolation; NaN unless measured and within the limit.
    ahead: f32,
    is_beyond: bool,
    speed: f32,
    recovery: f32,
    shrinkage: f32,
    /// The square of each region's size at rest.
    rest: [f32; REGIONS],
    volume: Volume,
    /// Blocks of rows still to be compared with the published ones, and the next row of the first block.
    blocks_left: u32,
    next_row: u32,
}

impl<'t, I: Index> StretchMonitor<'t, I> {
    /// A monitor for surfaces of this tree, with the default limits of [`SurfaceLimits::reach_mm`].
    ///
    /// # Errors
    /// [`StretchError::NoMetric`] if the tree was emitted without its metric.
    pub fn new(tree: &Tree<'t, I>) -> Result<Self, StretchError> {
        Self::with_passes(tree)
    }
}

impl<'t, I: Index> StretchMonitor<'t, I, 2> {
    /// The same with the frames' extrapolations. An extrapolation beyond the tree's limit is no error: then the surface
    /// is held instead.
    ///
    /// # Errors
    /// [`StretchError::NoMetric`] if the tree was emitted without its metric.
    pub fn continuous(tree: &Tree<'t, I>) -> Result<Self, StretchError> {
        Self::with_passes(tree)
    }
}

impl<'t, I: Index, const SURFACES: usize> StretchMonitor<'t, I, SURFACES> {
    fn with_passes(tree: &Tree<'t, I>) -> Result<Self, StretchError> {
        let limits = SurfaceLimits::reach_mm(f32::INFINITY);
        if tree.sections().metric.is_empty() {
            return Err(StretchError::NoMetric);
        }
        let last = tree.vertex_count().saturating_sub(1);
        let block_shift = (u32::BITS - last.leading_zeros()).saturating_sub(BLOCKS.ilog2());
        let mut touched = [0; BLOCKS];
        let mut rest = [0.0; REGIONS];
        let rows = region_rows(tree);
        let (mut region, mut end) = (1u32, rows);
        for triangle in 0..tree.triangle_count() {
            if triangle == end {
                (region, end) = (region << 1, end.saturating_add(rows));
            }
            let corners = tree.triangle(triangle).ok_or(StretchError::Corrupt { row: triangle })?;
            if let Some(size) = rest.get_mut(region.trailing_zeros() as usize) {
                *size += squared_edge(tree, triangle);
            }
            for corner in corners {
                let block = touched.get_mut((corner >> block_shift) as usize);
                *block.ok_or(StretchError::Corrupt { row: triangle })? |= region;
            }
        }
        Ok(Self {
            tree: *tree,
            touched,
            block_shift: block_shift as u8,
            changed: FrameExtent::Whole,
            passes: [const { Pass::new() }; SURFACES],
            ahead: f32::NAN,
            is_beyond: false,
            speed: limits.speed,
            recovery: limits.recovery,
            shrinkage: limits.shrinkage,
            rest,
            volume: Volume::of(tree),
            blocks_left: ALL,
            next_row: 0,
        })
    }

    /// The same with these limits on speed, recovery and size. The assembler checks the reach:
    /// [`Assembler::for_tree`](crate::Assembler::for_tree).
    #[must_use]
    pub const fn limits(mut self, limits: SurfaceLimits) -> Self {
        self.speed = limits.speed;
        self.recovery = limits.recovery;
        self.shrinkage = limits.shrinkage;
        self
    }

    /// The tree whose surfaces are measured.
    #[must_use]
    pub const fn tree(&self) -> &Tree<'t, I> {
        &self.tree
    }

    /// Upper bound on the rows and triangles checked for one frame: the sum of its slices' work.
    #[must_use]
    pub const fn whole_work(&self) -> u32 {
        let rows = self.tree.vertex_count().saturating_add(self.tree.triangle_count());
        rows.saturating_add(REGIONS as u32).saturating_mul(SURFACES as u32)
    }

    /// Compares arrived rows with the published ones. Returns the work left, and whether all rows are done.
    fn compare<V: VertexTable + ?Sized>(
        &mut self,
        IncomingSurface { surface, ready, before, compared }: IncomingSurface<'_, V>,
        mut work: u32,
    ) -> Result<(u32, bool), StretchError> {
        let Some((before, elapsed)) = before else {
            self.blocks_left = 0;
            return Ok((work, true));
        };
        let limit = farthest(self.speed, self.recovery, elapsed);
        if limit == f32::INFINITY {
            self.blocks_left = 0;
        } else if let Some(Comparison { largest, rows: [first, end], .. }) = compared {
            self.blocks_left = 0;
            if !(largest <= limit * limit) {
                return Err(too_fast(surface, before, first..end, limit));
            }
        }
        let (count, shift) = (self.tree.vertex_count(), u32::from(self.block_shift));
        while self.blocks_left != 0 {
            let block = self.blocks_left.trailing_zeros();
            let first = block.wrapping_shl(shift);
            let end = first.saturating_add(1_u32.wrapping_shl(shift));
            let end = if end < count { end } else { count };
            let from = if self.next_row > first { self.next_row } else { first };
            let stop = if end < ready { end } else { ready };
            let stop =
                if stop.saturating_sub(from) < work { stop } else { from.saturating_add(work) };
            if from < stop {
                let step = largest_step(surface, before, from..stop, 0.0);
                if !(step <= limit * limit) {
                    return Err(too_fast(surface, before, from..stop, limit));
                }
                work = work.saturating_sub(stop - from);
            }
            if stop < end {
                self.next_row = if stop > from { stop } else { from };
                return Ok((work, false));
            }
            self.next_row = 0;
            self.blocks_left &= self.blocks_left - 1;
        }
        Ok((work, true))
    }

    /// Measures the extrapolation of arrived rows, with at most `work` triangles. Returns whether it is finished.
    fn check_ahead<V: VertexTable + ?Sized>(
        &mut self,
        before: Option<&V>,
        surface: &V,
        ready: u32,
        work: u32,
    ) -> bool {
        let ([_, ahead, ..], Some(before)) = (self.passes.as_mut_slice(), before) else {
            return true;
        };
        if self.is_beyond {
            return true;
        }
        let surface = SurfaceBlend::ahead(before, surface);
        // Beyond the limit, or not finite: no extrapolation.
        let measured = ahead.advance(&self.tree, &surface, ready, (0.0, &self.rest), work, |_| ());
        self.is_beyond = measured.is_err();
        let is_done = measured.is_ok_and(|(_, is_done)| is_done);
        self.ahead = if is_done { ahead.measured(&self.tree, None).sigma() } else { f32::NAN };
        is_done || self.is_beyond
    }
}

impl<I: Index, const SURFACES: usize> AdmissionCheck for StretchMonitor<'_, I, SURFACES> {
    fn begin(&mut self, changed: FrameExtent) {
        self.changed = changed;
        self.next_row = 0;
        self.blocks_left = if changed == FrameExtent::Whole { ALL } else { 0 };
        (self.ahead, self.is_beyond) = (f32::NAN, false);
        self.volume.begin(changed == FrameExtent::Whole);
        for (number, pass) in self.passes.iter_mut().enumerate() {
            // Rows that a partial frame does not change moved before, so their extrapolation changes too.
            pass.begin(changed == FrameExtent::Whole || number > 0);
        }
    }

    fn moved(&mut self, rows: Range<u32>) {
        if self.changed == FrameExtent::Whole || rows.is_empty() {
            return;
        }
        let first = (rows.start >> u32::from(self.block_shift)) as usize;
        let last = (rows.end.saturating_sub(1) >> u32::from(self.block_shift)) as usize;
        for (number, block) in
            self.touched.iter().enumerate().take(last.saturating_add(1)).skip(first)
        {
            if let Some(pass) = self.passes.first_mut() {
                pass.add(*block);
            }
            self.blocks_left |= 1_u32.wrapping_shl(number as u32);
        }
    }

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        arriving: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError> {
        let IncomingSurface { surface, ready, before, .. } = arriving;
        let before = before.map(|(before, _)| before);
        check_tables(&self.tree, surface)?;
        let is_complete = ready >= self.tree.vertex_count();
        if self.changed == FrameExtent::Partial && !is_complete {
            return Ok(Admission::Pending);
        }
        let (work, is_compared) = self.compare(arriving, work)?;
        // Half of the work for each, so that both keep up with the frame.
        let ahead = if SURFACES > 1 { work / 2 } else { 0 };
        let (tree, size) = (&self.tree, (self.shrinkage, &self.rest));
        let Some(own) = self.passes.first_mut() else { return Ok(Admission::Pending) };
        // Moved rows of a partial frame replace the published ones.
        let replaced = if self.changed == FrameExtent::Partial { before } else { None };
        let volume = &mut self.volume;
        let sum = |rows| volume.add(tree, surface, replaced, rows);
        let (left, is_measured) = own.advance(tree, surface, ready, size, work - ahead, sum)?;
        let is_ahead =
            SURFACES == 1 || self.check_ahead(before, surface, ready, ahead.saturating_add(left));
        if !is_complete || !is_compared || !is_measured || !is_ahead {
            return Ok(Admission::Pending);
        }
        self.volume.check()?;
        let Some(own) = self.passes.first() else { return Ok(Admission::Pending) };
        Ok(Admission::Admitted(Some(own.measured(&self.tree, surface.epoch()))))
    }

    fn ahead(&self) -> Option<f32> {
        (self.ahead >= 0.0).then_some(self.ahead)
    }

    fn motion_unit(&self) -> Option<MotionUnit> {
        Some(MotionUnit::of(&self.tree))
    }

    fn surface_facts(&self) -> SurfaceFacts {
        self.tree.surface_facts()
    }

    fn farthest(&self, elapsed: Millis) -> f32 {
        farthest(self.speed, self.recovery, elapsed)
    }

    fn published(&mut self) {
        self.volume.published();
        for pass in &mut self.passes {
            pass.published();
        }
    }
}

/// The squared edge from a triangle's centre to its third corner at rest. The metric stores it times the square of the
/// ratio of the triangle's limit to the tree's.
fn squared_edge<I: Index>(tree: &Tree<'_, I>, row: u32) -> f32 {
    let [.., second] = tree.metric(row).map_or([0.0; 3], |metric| metric.squares);
    let limit = tree.stretch_limit(TriangleRow(row)).unwrap_or(tree.stretch());
    let part = limit / tree.stretch();
    second / (part * part)
}
