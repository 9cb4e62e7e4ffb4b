//! The double buffer between the bus and the control tick: complete frames only, never torn.
//!
//! One side writes vertices into the back buffer, the other reads the front buffer, and one atomic word states which
//! buffer is in front. With three buffers the third keeps the previous frame, so that the surface between the two is
//! known. The whole module is safe code: positions are stored as the bits of `f32` in relaxed atomics, which compile to
//! plain loads and stores.
//!
//! # Why no read is torn
//!
//! The state word holds the number of the front buffer, whether a read is in progress, and whether a frame was
//! published.
//!
//! - A read begins with one `fetch_or` that sets READING and returns the number of the front buffer. It ends with one
//!   `fetch_and` that clears READING.
//! - A publication is one compare-exchange that makes the next buffer the front and expects READING to be clear. So the
//!   front buffer never changes while a read is in progress, and the writer writes only to the back buffer, the next
//!   after the front. Of three buffers, the one after that holds the previous frame.
//!
//! Ordering: the compare-exchange releases the writer's stores, and the `fetch_or` acquires them, so a read sees the
//! whole frame. The `fetch_and` releases the reader's loads, and the next compare-exchange acquires them, so the
//! writer's next stores, which go to a buffer that was readable before, follow every load of the last read. Both hold
//! on any number of cores.
//!
//! # Who waits
//!
//! Nobody. The reader takes two atomic operations per read, whatever the writer does. During a read the writer gets
//! [`PublishError::Busy`], keeps its frame, and publishes it at a later call. This never happens on one core where the
//! control tick preempts the writer and finishes its read before it returns. (On ARMv7-M an atomic operation repeats if
//! an exception occurs between its load and its store: at most once per exception, and never in the handler of highest
//! priority.)

// Requirement: F-01

use core::ops::Range;

use glam::Vec3;

use super::atomic::{AtomicBool, AtomicU32, Ordering};
use super::buffer::{Buffer, FrameLabel, Head, Position, PredictionCheck};
use super::error::{OutOfTableError, PublishError, SplitError};
use super::motion::MotionReading;
use super::reader::{FrameReader, FrameView};

/// State word, bits 0 and 1: number of the front buffer.
pub(super) const FRONT: u32 = 3;
/// State word, bit 2: a read is in progress.
pub(super) const READING: u32 = 4;
/// State word, bit 3: the front buffer holds a frame.
const PUBLISHED: u32 = 8;

/// A double buffer of `N` vertex positions, meant for a `static`. With 3 `BUFFERS` it also keeps the frame before the
/// published one, so that a read frame has [`interpolated`](crate::FrameGuard::interpolated) and
/// [`extrapolated`](crate::FrameGuard::extrapolated) surfaces.
///
/// RAM: 12 bytes for each vertex and buffer, plus some 50 for each buffer. All zero at start, so it lies in `.bss`.
///
/// ```
/// use dibs_nostd::{
///     FrameLabel, Frames, Millis, OutOfTableError, SplitError, VertexTable, glam::Vec3,
/// };
///
/// static FRAMES: Frames<2> = Frames::new();
/// let (mut writer, mut reader) = FRAMES.split().expect("split once");
/// assert!(matches!(FRAMES.split(), Err(SplitError)));
/// assert!(reader.read().is_none(), "nothing published yet");
///
/// writer.begin();
/// writer.push(Vec3::X).unwrap();
/// writer.push(Vec3::Y).unwrap();
/// assert!(matches!(writer.push(Vec3::Z), Err(OutOfTableError { vertex: 2, .. })));
/// let label = FrameLabel { epoch: 7, received: Millis(1000), position_error: 0.0, stretch: None };
/// writer.publish(label).unwrap();
///
/// let frame = reader.read().unwrap();
/// assert_eq!(frame.position(1), Some(Vec3::Y));
/// assert_eq!(frame.label().epoch, 7);
/// # drop(frame);
/// let latest = reader.latest(Millis(1008)); // the receiver's clock
/// assert_eq!(latest.frame().unwrap().age, Millis(8));
/// assert!(latest.within(Millis(80)).is_ok());
/// ```
#[derive(Debug)]
pub struct Frames<const N: usize, const BUFFERS: usize = 2> {
    heads: [Head; BUFFERS],
    rows: [[Position; N]; BUFFERS],
    state: AtomicU32,
    split: AtomicBool,
}

impl<const N: usize, const BUFFERS: usize> Frames<N, BUFFERS> {
    /// Empty buffers, two or three: nothing is published.
    #[cfg(not(loom))]
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(BUFFERS == 2 || BUFFERS == 3, "two or three buffers") }
        Self {
            heads: [const { Head::new() }; BUFFERS],
            rows: [const { [const { Position::new() }; N] }; BUFFERS],
            state: AtomicU32::new(0),
            split: AtomicBool::new(false),
        }
    }

    /// Empty buffers, for a model checker.
    #[cfg(loom)]
    #[must_use]
    pub fn new() -> Self {
        use core::array::from_fn;
        Self {
            heads: from_fn(|_| Head::new()),
            rows: from_fn(|_| from_fn(|_| Position::new())),
            state: AtomicU32::new(0),
            split: AtomicBool::new(false),
        }
    }

    /// The two ends, once, so that there is one writer and one reader.
    ///
    /// # Errors
    /// [`SplitError`] at every later call.
    pub fn split(&self) -> Result<(FrameWriter<'_>, FrameReader<'_>), SplitError> {
        if self.split.swap(true, Ordering::AcqRel) {
            return Err(SplitError);
        }
        let mut all = self.heads.iter().zip(&self.rows);
        let mut next = || all.next().map(|(head, rows)| Buffer { head, rows });
        let (Some(first), Some(second)) = (next(), next()) else { return Err(SplitError) };
        Ok(Buffers::new(&self.state, [first, second], next()).ends())
    }
}

/// The buffers of a surface in the caller's memory, and their state: those of [`Frames`], or of the C interface. All
/// memory must be zero at first, and the buffers of equal size.
#[derive(Clone, Copy, Debug)]
pub struct Buffers<'m> {
    state: &'m AtomicU32,
    /// Of two buffers, the first is repeated as the third.
    all: [Buffer<'m>; 3],
    count: u32,
}

impl<'m> Buffers<'m> {
    /// With two or three buffers.
    #[must_use]
    pub const fn new(
        state: &'m AtomicU32,
        [first, second]: [Buffer<'m>; 2],
        third: Option<Buffer<'m>>,
    ) -> Self {
        match third {
            Some(third) => Self { state, all: [first, second, third], count: 3 },
            None => Self { state, all: [first, second, first], count: 2 },
        }
    }

    /// The two ends. The caller must use each of them only once.
    #[must_use]
    pub fn ends(self) -> (FrameWriter<'m>, FrameReader<'m>) {
        let back = self.buffer(self.roles(0).back);
        (FrameWriter { buffers: self, back, state: 0, filled: 0 }, FrameReader::new(self))
    }

    #[cfg(feature = "modes")]
    pub(super) const fn rows(&self) -> u32 {
        let [first, ..] = &self.all;
        first.rows.len() as u32
    }

    pub(super) const fn state(&self) -> &'m AtomicU32 {
        self.state
    }

    #[inline(always)]
    fn buffer(&self, number: u32) -> Buffer<'m> {
        let [first, second, third] = self.all;
        match number {
            0 => first,
            1 => second,
            _ => third,
        }
    }

    #[inline(always)]
    const fn roles(&self, state: u32) -> Roles {
        let front = state & FRONT;
        let back = if front + 1 < self.count { front + 1 } else { 0 };
        let before = if back + 1 < self.count { back + 1 } else { 0 };
        Roles { front, back, before }
    }

    /// The published buffer and the previous one; of two buffers, the published one twice. `None` before the first
    /// frame.
    #[inline(always)]
    pub(super) fn published(&self, state: u32) -> Option<[Buffer<'m>; 2]> {
        let Roles { front, before, .. } = self.roles(state);
        (state & PUBLISHED != 0).then_some([self.buffer(front), self.buffer(before)])
    }
}

/// Numbers of the front buffer, of the next to be written, and of the previous front.
#[derive(Clone, Copy, Debug)]
struct Roles {
    front: u32,
    back: u32,
    before: u32,
}

impl<const N: usize, const BUFFERS: usize> Default for Frames<N, BUFFERS> {
    fn default() -> Self {
        Self::new()
    }
}

/// The end that writes: owned by the receiver of vertices.
///
/// A frame is one [`begin`](Self::begin), one [`push`](Self::push) for every vertex in row order, and
/// [`publish`](Self::publish). An [`Assembler`](crate::Assembler) takes rows in any order, and proves that all have
/// arrived.
#[derive(Debug)]
pub struct FrameWriter<'f> {
    buffers: Buffers<'f>,
    back: Buffer<'f>,
    /// The state word after the last publication; only the writer changes these bits.
    state: u32,
    /// Rows pushed since the last `begin`.
    filled: u32,
}

impl<'f> FrameWriter<'f> {
    /// Number of rows in a frame.
    pub(crate) fn len(&self) -> u32 {
        self.back.rows.len() as u32
    }

    /// Starts a frame and discards an unfinished one. O(1).
    pub fn begin(&mut self) {
        self.filled = 0;
    }

    /// Stores the position (mm) of the next row in the back buffer. O(1).
    ///
    /// # Errors
    /// [`OutOfTableError`] if the frame is full; nothing is stored.
    #[inline]
    pub fn push(&mut self, position: Vec3) -> Result<(), OutOfTableError> {
        let row = self.filled;
        let Some([slot]) = self.rows(row..row.saturating_add(1)).and_then(<[_]>::as_array) else {
            return Err(OutOfTableError { vertex: row, vertices: self.len() });
        };
        slot.set(position);
        self.filled = row.saturating_add(1);
        Ok(())
    }

    /// Number of vertices not yet pushed.
    #[must_use]
    pub fn missing(&self) -> u32 {
        self.len().saturating_sub(self.filled)
    }

    /// Rows of the back buffer; `None` outside it.
    #[inline]
    pub(crate) fn rows(&self, rows: Range<u32>) -> Option<&'f [Position]> {
        self.back.rows.get(rows.start as usize..rows.end as usize)
    }

    /// Copies rows of the published frame to the back buffer. O(rows).
    #[cfg(feature = "bus")]
    pub(crate) fn copy(&self, rows: Range<u32>) {
        let range = rows.start as usize..rows.end as usize;
        let front = self.front_buffer().rows.get(range.clone()).unwrap_or_default();
        let back = self.back.rows.get(range).unwrap_or_default();
        for (to, from) in back.iter().zip(front) {
            to.copy(from);
        }
    }

    /// The frame being written, complete or not: for a check before it is published.
    #[must_use]
    pub const fn back(&self) -> FrameView<'f> {
        FrameView { buffer: self.back, is_published: false }
    }

    /// The published frame, `None` before the first.
    #[must_use]
    pub fn front(&self) -> Option<FrameView<'f>> {
        let [front, _] = self.buffers.published(self.state)?;
        Some(FrameView::published(front))
    }

    /// The published frame and the previous one, in the order of time, if there are three buffers.
    #[cfg(feature = "bus")]
    pub(crate) fn last_two(&self) -> Option<[FrameView<'f>; 2]> {
        let [front, before] = self.buffers.published(self.state)?;
        (self.buffers.count > 2).then_some([before, front].map(FrameView::published))
    }

    #[cfg(feature = "bus")]
    fn front_buffer(&self) -> Buffer<'f> {
        self.buffers.buffer(self.buffers.roles(self.state).front)
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
        self.set_label(label, None, PredictionCheck::UNKNOWN);
        self.publish_complete()
    }

    /// Labels the frame being written, with its odometer's reading if its motion since the published one is measured.
    pub(crate) fn set_label(
        &mut self,
        label: FrameLabel,
        motion: Option<MotionReading>,
        ahead: PredictionCheck,
    ) {
        self.back.head.set_label(label, motion, ahead);
    }

    /// Publishes a labelled frame that the caller has proven complete.
    pub(crate) fn publish_complete(&mut self) -> Result<(), PublishError> {
        let next = self.buffers.roles(self.state).back | PUBLISHED;
        self.buffers
            .state
            .compare_exchange(self.state, next, Ordering::AcqRel, Ordering::Relaxed)
            .map_err(|_| PublishError::Busy)?;
        self.back = self.buffers.buffer(self.buffers.roles(next).back);
        self.state = next;
        // The back buffer now holds an old frame: `begin` must precede the next publication.
        self.filled = 0;
        Ok(())
    }
}
