//! The double buffer between the bus and the control tick: complete frames only, never torn.
//!
//! One side writes vertices into the back buffer, the other reads the front buffer, and one atomic word states which
//! buffer is in front. The whole module is safe code: positions are stored as the bits of `f32` in relaxed atomics,
//! which compile to plain loads and stores.
//!
//! # Why no read is torn
//!
//! The state word holds three bits: the index of the front buffer, whether a read is in progress, and whether a frame
//! was published.
//!
//! - A read begins with one `fetch_or` that sets READING and returns the index of the front buffer. It ends with one
//!   `fetch_and` that clears READING.
//! - A publication is one compare-exchange that flips the front buffer and expects READING to be
//!   clear. So the front buffer never changes while a read is in progress, and the writer writes
//!   to the back buffer only.
//!
//! Ordering: the compare-exchange releases the writer's stores, and the `fetch_or` acquires them, so a read sees the
//! whole frame. The `fetch_and` releases the reader's loads, and the next compare-exchange acquires them, so the
//! writer's next stores, which go to the former front buffer, come after every load of the last read. Both hold on any
//! number of cores.
//!
//! # Who waits
//!
//! Nobody. The reader takes two atomic operations a read, whatever the writer does. During a read the writer gets
//! [`PublishError::Busy`], keeps its frame, and publishes it at a later call. This never happens on one core where the
//! control tick preempts the writer and finishes its read before it returns. (On ARMv7-M an atomic operation repeats
//! when an exception comes between its load and its store: at most once an exception, and never in the handler of
//! highest priority.)

use core::ops::Range;

use glam::Vec3;

#[cfg(feature = "bus")]
use super::age::elapsed;
use super::atomic::{AtomicBool, AtomicU32, Ordering};
use super::buffer::{Buffer, FrameLabel, Position, Rows};
use super::error::{OutOfTableError, PublishError, SplitError};
use super::motion::{MovingSurface, Travel};
use super::{Ageing, FrameAge, Latest, MeasuredStretch, VertexTable};

/// State word, bit 0: index of the front buffer.
const FRONT: u32 = 1;
/// State word, bit 1: a read is in progress.
const READING: u32 = 2;
/// State word, bit 2: the front buffer holds a frame.
const PUBLISHED: u32 = 4;

/// A double buffer of `N` vertex positions, meant for a `static`.
///
/// RAM: 24 bytes a vertex (two positions), plus some 150. All zero at start, so it lies in `.bss`.
///
/// ```
/// use dibs_nostd::{FrameLabel, Frames, VertexTable, glam::Vec3};
///
/// static FRAMES: Frames<2> = Frames::new();
/// let (mut writer, mut reader) = FRAMES.split().expect("split once");
/// assert!(reader.read().is_none(), "nothing published yet");
///
/// writer.begin();
/// writer.push(Vec3::X).unwrap();
/// writer.push(Vec3::Y).unwrap();
/// let label = FrameLabel { epoch: 7, received: 1000, position_error: 0.0, stretch: None };
/// writer.publish(label).unwrap();
///
/// let frame = reader.read().unwrap();
/// assert_eq!(frame.position(1), Some(Vec3::Y));
/// assert_eq!(frame.label().epoch, 7);
/// # drop(frame);
/// let latest = reader.latest(1008); // the receiver's clock
/// assert_eq!(latest.frame().unwrap().age, 8);
/// assert!(latest.within(50).is_ok());
/// ```
#[derive(Debug)]
pub struct Frames<const N: usize> {
    buffers: [Buffer<[Position; N]>; 2],
    state: AtomicU32,
    split: AtomicBool,
}

impl<const N: usize> Frames<N> {
    /// An empty double buffer: nothing is published.
    #[cfg(not(loom))]
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffers: [const { Buffer::new() }; 2],
            state: AtomicU32::new(0),
            split: AtomicBool::new(false),
        }
    }

    /// An empty double buffer, for a model checker.
    #[cfg(loom)]
    #[must_use]
    pub fn new() -> Self {
        use core::array::from_fn;
        Self {
            buffers: from_fn(|_| Buffer::new()),
            state: AtomicU32::new(0),
            split: AtomicBool::new(false),
        }
    }

    /// The two ends, once, so that there is one writer and one reader.
    ///
    /// # Errors
    /// [`SplitError`] at every later call.
    pub fn split(&self) -> Result<(FrameWriter<'_, N>, FrameReader<'_, N>), SplitError> {
        if self.split.swap(true, Ordering::AcqRel) {
            return Err(SplitError);
        }
        Ok(ends(self))
    }
}

/// Two buffers and their state: [`Frames`], or memory of a size that no type has.
pub trait Buffers {
    /// Positions of a buffer.
    type Rows: Rows + ?Sized;

    fn state(&self) -> &AtomicU32;

    fn buffers(&self) -> [&Buffer<Self::Rows>; 2];
}

impl<const N: usize> Buffers for Frames<N> {
    type Rows = [Position; N];

    #[inline(always)]
    fn state(&self) -> &AtomicU32 {
        &self.state
    }

    #[inline(always)]
    fn buffers(&self) -> [&Buffer<[Position; N]>; 2] {
        let [first, second] = &self.buffers;
        [first, second]
    }
}

/// Buffers in somebody else's memory, of the same size, and their state. All of it must be zero at first.
#[derive(Debug)]
pub struct BorrowedFrames<'m> {
    /// As that of [`Frames`].
    pub state: &'m AtomicU32,
    /// The same.
    pub buffers: [&'m Buffer<[Position]>; 2],
}

impl Buffers for BorrowedFrames<'_> {
    type Rows = [Position];

    fn state(&self) -> &AtomicU32 {
        self.state
    }

    fn buffers(&self) -> [&Buffer<[Position]>; 2] {
        self.buffers
    }
}

impl BorrowedFrames<'_> {
    /// The two ends. Whoever calls it sees to it that each is used once.
    #[must_use]
    pub fn ends(&self) -> (FrameWriter<'_, 0, Self>, FrameReader<'_, 0, Self>) {
        ends(self)
    }
}

/// The two ends of these buffers.
fn ends<const N: usize, F: Buffers>(frames: &F) -> (FrameWriter<'_, N, F>, FrameReader<'_, N, F>) {
    let [_, back] = frames.buffers();
    let writer = FrameWriter { frames, back, state: 0, filled: 0 };
    (writer, FrameReader { frames, ageing: (0, Ageing::default()) })
}

impl<const N: usize> Default for Frames<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// The end that writes: owned by the receiver of vertices.
///
/// A frame is [`begin`](Self::begin), one [`push`](Self::push) for every vertex in the order of the rows, and
/// [`publish`](Self::publish). An [`Assembler`](crate::Assembler) takes rows in any order, and proves that all have
/// come.
#[derive(Debug)]
pub struct FrameWriter<'f, const N: usize, F: Buffers = Frames<N>> {
    frames: &'f F,
    back: &'f Buffer<F::Rows>,
    /// The state word after the last publication; only the writer changes these bits.
    state: u32,
    /// Rows pushed since the last `begin`.
    filled: u32,
}

impl<const N: usize, F: Buffers> FrameWriter<'_, N, F> {
    /// Rows of a frame.
    pub(crate) fn len(&self) -> u32 {
        self.back.rows().len() as u32
    }

    /// Starts a frame and forgets an unfinished one. O(1).
    pub fn begin(&mut self) {
        self.filled = 0;
    }

    /// Stores the position (mm) of the next row in the back buffer. O(1).
    ///
    /// # Errors
    /// [`OutOfTableError`] when the frame is full; nothing is stored.
    #[inline]
    pub fn push(&mut self, position: Vec3) -> Result<(), OutOfTableError> {
        let row = self.filled;
        let Some([place]) = self.rows(row..row.saturating_add(1)).and_then(<[_]>::as_array) else {
            return Err(OutOfTableError { vertex: row, vertices: self.len() });
        };
        place.set(position);
        self.filled = row.saturating_add(1);
        Ok(())
    }

    /// Vertices not yet pushed.
    #[must_use]
    pub fn missing(&self) -> u32 {
        self.len().saturating_sub(self.filled)
    }

    /// Rows of the back buffer; `None` outside it.
    #[inline]
    pub(crate) fn rows(&self, rows: Range<u32>) -> Option<&[Position]> {
        self.back.rows().get(rows.start as usize..rows.end as usize)
    }

    /// Copies rows of the published frame to the back buffer. O(rows).
    #[cfg(feature = "bus")]
    pub(crate) fn copy(&self, rows: Range<u32>) {
        let range = rows.start as usize..rows.end as usize;
        let front = self.front_buffer().rows().get(range.clone()).unwrap_or_default();
        let back = self.back.rows().get(range).unwrap_or_default();
        for (to, from) in back.iter().zip(front) {
            to.copy(from);
        }
    }

    /// The frame being written, complete or not: for a check before it is published.
    #[must_use]
    pub const fn back(&self) -> FrameView<'_, N, F> {
        FrameView { buffer: self.back }
    }

    /// The published frame, `None` before the first.
    #[must_use]
    pub fn front(&self) -> Option<FrameView<'_, N, F>> {
        (self.state & PUBLISHED != 0).then_some(FrameView { buffer: self.front_buffer() })
    }

    fn front_buffer(&self) -> &Buffer<F::Rows> {
        let [first, second] = self.frames.buffers();
        if self.state & FRONT == 0 { first } else { second }
    }

    /// Publishes the frame, by one compare-exchange. The next frame begins with [`begin`](Self::begin).
    ///
    /// # Errors
    /// [`PublishError::Incomplete`] while vertices are missing. [`PublishError::Busy`] while a read is
    /// in progress: nothing is lost, call again later.
    pub fn publish(&mut self, label: FrameLabel) -> Result<(), PublishError> {
        if self.missing() != 0 {
            return Err(PublishError::Incomplete { missing: self.missing() });
        }
        self.set_label(label, None);
        self.publish_complete()
    }

    /// Labels the frame being written, with its odometer's reading if its motion since the published one is measured.
    pub(crate) fn set_label(&mut self, label: FrameLabel, travel: Option<Travel>) {
        self.back.set_label(label, travel);
    }

    /// Publishes a labelled frame that the caller has proven complete.
    pub(crate) fn publish_complete(&mut self) -> Result<(), PublishError> {
        let next = (self.state ^ FRONT) | PUBLISHED;
        self.frames
            .state()
            .compare_exchange(self.state, next, Ordering::AcqRel, Ordering::Relaxed)
            .map_err(|_| PublishError::Busy)?;
        let [first, second] = self.frames.buffers();
        self.back = if next & FRONT == 0 { second } else { first };
        self.state = next;
        // The back buffer now holds an old frame: it must be begun before it is published.
        self.filled = 0;
        Ok(())
    }
}

/// The end that reads: owned by the control tick.
#[derive(Debug)]
pub struct FrameReader<'f, const N: usize, F: Buffers = Frames<N>> {
    frames: &'f F,
    /// Epoch and age of the frame read last.
    ageing: (u32, Ageing),
}

impl<const N: usize, F: Buffers> FrameReader<'_, N, F> {
    /// The published frame and its age at `now`, on the receiver's clock. [`Latest::within`] a limit gives the frame,
    /// held as by [`read`](Self::read).
    #[inline]
    pub fn latest(&mut self, now: u32) -> Latest<FrameGuard<'_, N, F>> {
        let (epoch_before, before) = self.ageing;
        let Some(guard) = read(self.frames) else { return Latest::new(None) };
        let FrameLabel { epoch, received, .. } = guard.label();
        let before = if epoch == epoch_before { before } else { Ageing::default() };
        let ageing = before.at(now, received);
        self.ageing = (epoch, ageing);
        Latest::new(Some((guard, FrameAge { epoch, received, age: ageing.oldest })))
    }

    /// The published frame, held for as long as the guard lives; `None` before the first.
    ///
    /// Keep the guard for one query, not longer: no frame is published meanwhile. A leaked guard keeps the surface at
    /// its present frame, whose age then grows. This does not check the age: use [`latest`](Self::latest).
    #[inline]
    pub fn read(&mut self) -> Option<FrameGuard<'_, N, F>> {
        read(self.frames)
    }
}

#[inline]
fn read<const N: usize, F: Buffers>(frames: &F) -> Option<FrameGuard<'_, N, F>> {
    let state = frames.state().fetch_or(READING, Ordering::Acquire);
    let [first, second] = frames.buffers();
    let buffer = if state & FRONT == 0 { first } else { second };
    // Created before the check, so that it clears READING on both paths.
    let guard = FrameGuard { state: frames.state(), view: FrameView { buffer } };
    (state & PUBLISHED != 0).then_some(guard)
}

/// The published frame, held still: a [`VertexTable`] that carries its measured stretch and its position error.
#[derive(Debug)]
pub struct FrameGuard<'f, const N: usize, F: Buffers = Frames<N>> {
    state: &'f AtomicU32,
    view: FrameView<'f, N, F>,
}

impl<const N: usize, F: Buffers> FrameGuard<'_, N, F> {
    /// The facts about this frame.
    #[must_use]
    pub fn label(&self) -> FrameLabel {
        self.view.buffer.label()
    }
}

impl<const N: usize, F: Buffers> Drop for FrameGuard<'_, N, F> {
    fn drop(&mut self) {
        self.state.fetch_and(!READING, Ordering::Release);
    }
}

impl<const N: usize, F: Buffers> VertexTable for FrameGuard<'_, N, F> {
    fn len(&self) -> usize {
        self.view.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.view.buffer.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        Some(self.view.buffer.epoch.load(Ordering::Relaxed))
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.view.buffer.stretch()
    }

    fn position_error(&self) -> f32 {
        self.view.buffer.position_error()
    }
}

/// Its motion since other frames is known if an [`Assembler`](crate::Assembler) with a tree's gate published them all.
impl<const N: usize, F: Buffers> MovingSurface for FrameGuard<'_, N, F> {
    fn travel(&self) -> Option<Travel> {
        self.view.buffer.travel()
    }
}

/// The writer's view of one buffer: a [`VertexTable`].
#[derive(Debug)]
pub struct FrameView<'f, const N: usize, F: Buffers = Frames<N>> {
    buffer: &'f Buffer<F::Rows>,
}

impl<const N: usize, F: Buffers> Clone for FrameView<'_, N, F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<const N: usize, F: Buffers> Copy for FrameView<'_, N, F> {}

#[cfg(feature = "bus")]
impl<const N: usize, F: Buffers> FrameView<'_, N, F> {
    /// The facts about the frame; arbitrary for a frame not yet labelled.
    pub(crate) fn label(&self) -> FrameLabel {
        self.buffer.label()
    }

    /// Its odometer's reading.
    pub(crate) fn travel(&self) -> Option<Travel> {
        self.buffer.travel()
    }

    /// Time from this frame to one with the stamp `received`.
    pub(crate) fn time_to(&self, received: u32) -> u32 {
        elapsed(received, self.buffer.received.load(Ordering::Relaxed))
    }
}

impl<const N: usize, F: Buffers> VertexTable for FrameView<'_, N, F> {
    fn len(&self) -> usize {
        self.buffer.rows().len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.buffer.position(vertex)
    }
}
