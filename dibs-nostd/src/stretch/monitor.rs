//! The stretch of each frame, measured in slices of bounded work while its packets arrive.

use core::ops::Range;

use super::kernel::Worst;
use super::regions::{of_regions, region_rows};
use super::{Changed, Gate, StretchError, Verdict, check_tables, rows};
use crate::surface::{REGIONS, VertexTable};
use crate::tree::{Index, Tree};

/// Blocks of vertex rows, at most: what a partial frame moved is remembered by them.
const BLOCKS: usize = 32;

/// All regions, one bit each.
const ALL: u32 = u32::MAX;
const _: () = assert!(REGIONS == u32::BITS as usize);

/// Measures every frame before it is published, a few triangles at a time: the [`Gate`] that keeps what
/// is stretched beyond its limit from the controller, and gives the query the measured stretch.
///
/// A whole frame is measured as it arrives: a triangle can be checked as soon as its corners are there,
/// and rows are numbered so that corners come about when their triangles do. Of a partial frame only
/// the [`REGIONS`] with a moved corner are measured, once it is complete; the others' stretch
/// stays. A region begins with the triangle that was its worst the last time: as a rule few come near it
/// then, and only they take more than a glance. Either way the result is that of
/// [`measure_stretch`](super::measure_stretch) on the whole surface, but for the few parts in a million that are
/// added for rounding, which depend on where a region began; from the same frames always the same bits.
///
/// Cost: [`advance`](Gate::advance) checks at most as many triangles as it is told, and takes
/// O([`REGIONS`]) besides. RAM: half a kilobyte at most, whatever the surface. Making one takes one pass over
/// the triangles.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
/// use dibs_nostd::{Advance, Assembler, Frames, StretchMonitor, Tree};
///
/// let (heart, motion) = generate::heart(320)?;
/// let built = Builder::new().stretch(1.5).build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
///
/// static FRAMES: Frames<162> = Frames::new();
/// let (writer, mut reader) = FRAMES.split().ok_or("taken")?;
/// let mut assembler = Assembler::new(writer, StretchMonitor::new(&tree)?, tree.mesh_id(), 1e3);
/// let rows = built.to_rows(&motion.frames[9]);
/// let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch: 1 };
/// let mut sender = FrameEncoder::<_, 512>::new(id, Encoding::Float, rows.as_slice())?;
/// let mut buffer = [0; 512];
/// while let Some(packet) = sender.next_packet(&mut buffer) {
///     assembler.accept(packet, 0)?;
///     assembler.advance(60)?; // at most 60 triangles
/// }
/// while assembler.advance(60)? == Advance::Pending {}
///
/// let frame = reader.read().ok_or("nothing published")?;
/// let measured = frame.label().stretch.ok_or("not measured")?;
/// assert!(measured.sigma() < 1.5 && measured.epoch() == Some(1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct StretchMonitor<'t, I> {
    tree: &'t Tree<'t, I>,
    /// Which regions have corners in each block of `1 << block_shift` vertex rows.
    touched: [u32; BLOCKS],
    block_shift: u32,
    changed: Changed,
    /// Regions still to be measured.
    left: u32,
    /// Regions whose entry below is not that of the published surface: of a frame that was abandoned, or in
    /// work. The next partial frame measures them, whether it changes them or not.
    unpublished: u32,
    /// The next triangle of the region that is being measured.
    next: Option<u32>,
    regions: [Worst; REGIONS],
}

impl<'t, I: Index> StretchMonitor<'t, I> {
    /// A monitor for surfaces of this tree.
    ///
    /// # Errors
    /// [`StretchError::NoMetric`] where the tree was emitted without what it takes.
    pub fn new(tree: &'t Tree<'t, I>) -> Result<Self, StretchError> {
        if tree.sections().metric.is_empty() {
            return Err(StretchError::NoMetric);
        }
        let last = tree.vertex_count().saturating_sub(1);
        let block_shift = (u32::BITS - last.leading_zeros()).saturating_sub(BLOCKS.ilog2());
        let mut touched = [0; BLOCKS];
        let rows = region_rows(tree);
        let (mut region, mut end) = (1u32, rows);
        for triangle in 0..tree.triangle_count() {
            if triangle == end {
                (region, end) = (region << 1, end.saturating_add(rows));
            }
            let corners = tree.triangle(triangle).ok_or(StretchError::Corrupt { row: triangle })?;
            for corner in corners {
                let block = touched.get_mut((corner >> block_shift) as usize);
                *block.ok_or(StretchError::Corrupt { row: triangle })? |= region;
            }
        }
        Ok(Self {
            tree,
            touched,
            block_shift,
            changed: Changed::Whole,
            left: ALL,
            unpublished: ALL,
            next: None,
            regions: [Worst::none(u32::MAX); REGIONS],
        })
    }

    /// The tree whose surfaces are measured.
    #[must_use]
    pub const fn tree(&self) -> &'t Tree<'t, I> {
        self.tree
    }

    /// Triangles that a frame of which every row moved takes, at most: the sum of its slices' work.
    #[must_use]
    pub const fn whole_work(&self) -> u32 {
        self.tree.triangle_count().saturating_add(REGIONS as u32)
    }

    /// The rows of a region's triangles.
    fn rows(&self, region: u32) -> Range<u32> {
        let rows = region_rows(self.tree);
        let triangles = self.tree.triangle_count();
        let first = rows.saturating_mul(region);
        let end = first.saturating_add(rows);
        if end < triangles { first..end } else { first.min(triangles)..triangles }
    }
}

impl<I: Index> Gate for StretchMonitor<'_, I> {
    fn begin(&mut self, changed: Changed) {
        self.changed = changed;
        self.next = None;
        self.left = match changed {
            Changed::Whole => ALL,
            Changed::Partial => self.unpublished,
        };
    }

    fn moved(&mut self, rows: Range<u32>) {
        if self.changed == Changed::Whole || rows.is_empty() {
            return;
        }
        let first = (rows.start >> self.block_shift) as usize;
        let last = (rows.end.saturating_sub(1) >> self.block_shift) as usize;
        for block in self.touched.iter().take(last.saturating_add(1)).skip(first) {
            self.left |= block;
        }
    }

    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        surface: &V,
        ready: u32,
        mut work: u32,
    ) -> Result<Verdict, StretchError> {
        check_tables(self.tree, surface)?;
        let is_complete = ready >= self.tree.vertex_count();
        if self.changed == Changed::Partial && !is_complete {
            return Ok(Verdict::Pending);
        }
        while self.left != 0 {
            let region = self.left.trailing_zeros();
            let rows = self.rows(region);
            let next = self.next.unwrap_or(rows.start);
            let slot = self.regions.get_mut(region as usize);
            let slot = slot.ok_or(StretchError::Corrupt { row: rows.start })?;
            if self.next.is_none() {
                if work == 0 {
                    return Ok(Verdict::Pending);
                }
                let last = slot.triangle;
                let mut worst = Worst::none(rows.start);
                if rows.contains(&last) {
                    if !rows::look(self.tree, surface, last, ready, &mut worst) {
                        return Ok(Verdict::Pending);
                    }
                    work -= 1;
                }
                *slot = worst;
                self.unpublished |= 1 << region;
            }
            let stop = if rows.end - next < work { rows.end } else { next + work };
            let at = rows::scan(self.tree, surface, next..stop, ready, slot)?;
            work -= at - next;
            if at < rows.end {
                self.next = Some(at);
                return Ok(Verdict::Pending);
            }
            self.next = None;
            self.left &= self.left - 1;
        }
        if !is_complete {
            return Ok(Verdict::Pending);
        }
        let measured = of_regions(self.tree, &self.regions, surface.epoch());
        Ok(Verdict::Admitted(Some(measured)))
    }

    fn published(&mut self) {
        self.unpublished = 0;
    }
}
