//! The double buffer between the bus and the control tick: complete frames only, never torn.
//!
//! One side writes vertices into the back buffer, the other reads the front buffer, and one atomic
//! word says which is which. The whole module is safe code: positions are stored as the bits of
//! `f32` in relaxed atomics, which compile to plain loads and stores.
//!
//! # Why no read is torn
//!
//! The state word holds three bits: which buffer is in front, whether a read is in progress, and
//! whether anything was published.
//!
//! - A read begins with one `fetch_or` that sets READING and, in the same operation, learns the
//!   front buffer. It ends with one `fetch_and` that clears READING.
//! - A publication is one compare-exchange that flips the front buffer and expects READING to be
//!   clear. So the front buffer never changes while a read is in progress, and the writer writes
//!   to the back buffer only.
//!
//! Ordering: the compare-exchange releases the writer's stores, and the `fetch_or` acquires them, so
//! a read sees the whole frame. The `fetch_and` releases the reader's loads, and the next
//! compare-exchange acquires them, so the writer's next stores, which go to what was the front
//! buffer, come after every load of the last read. Both hold on any number of cores.
//!
//! # Who waits
//!
//! Nobody. The reader takes two atomic operations a read, whatever the writer does. The writer is
//! told [`PublishError::Busy`] when a read is in progress, keeps its frame, and publishes it at a
//! later call. On one core where the control tick preempts the writer and finishes its read before
//! it returns, that never happens. (On ARMv7-M an atomic operation repeats when an exception comes
//! between its load and its store: at most once an exception, and never in the handler of highest
//! priority.)

use core::fmt;

use glam::Vec3;

use crate::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use crate::constraint::Unknown;
use crate::{MeasuredStretch, VertexTable};

/// State word, bit 0: index of the front buffer.
const FRONT: u32 = 1;
/// State word, bit 1: a read is in progress.
const READING: u32 = 2;
/// State word, bit 2: the front buffer holds a frame.
const PUBLISHED: u32 = 4;

/// What is known of a published frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameLabel {
    /// Number of the frame, given by the sender; wraps.
    pub epoch: u32,
    /// When the first packet of the frame arrived, on the receiver's clock (any unit; wraps).
    pub received: u32,
    /// No vertex is farther than this from the position that the sender had, in mm: the
    /// quantisation on the wire. A separation is off by at most as much.
    pub position_error: f32,
    /// Measured stretch of the frame against the rest shape; `None` where nobody measured it.
    pub stretch: Option<MeasuredStretch>,
}

/// One buffer: positions as bits of `f32`, and the label of the frame in it.
struct Buffer<const N: usize> {
    positions: [[AtomicU32; 3]; N],
    epoch: AtomicU32,
    received: AtomicU32,
    position_error: AtomicU32,
    /// Measured stretch; the first word is not a number where there is none.
    stretch: [AtomicU32; MeasuredStretch::WORDS],
}

impl<const N: usize> Buffer<N> {
    #[cfg(not(loom))]
    const fn new() -> Self {
        Self {
            positions: [const { [const { AtomicU32::new(0) }; 3] }; N],
            epoch: AtomicU32::new(0),
            received: AtomicU32::new(0),
            position_error: AtomicU32::new(0),
            stretch: [const { AtomicU32::new(0) }; MeasuredStretch::WORDS],
        }
    }

    #[cfg(loom)]
    fn new() -> Self {
        use core::array::from_fn;
        Self {
            positions: from_fn(|_| from_fn(|_| AtomicU32::new(0))),
            epoch: AtomicU32::new(0),
            received: AtomicU32::new(0),
            position_error: AtomicU32::new(0),
            stretch: from_fn(|_| AtomicU32::new(0)),
        }
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let [x, y, z] = self.positions.get(vertex as usize)?;
        let load = |bits: &AtomicU32| f32::from_bits(bits.load(Ordering::Relaxed));
        Some(Vec3::new(load(x), load(y), load(z)))
    }

    fn set_label(&self, label: FrameLabel) {
        self.epoch.store(label.epoch, Ordering::Relaxed);
        self.received.store(label.received, Ordering::Relaxed);
        self.position_error.store(label.position_error.to_bits(), Ordering::Relaxed);
        let words = match label.stretch {
            Some(measured) => measured.to_words(),
            None => [f32::NAN.to_bits(); MeasuredStretch::WORDS],
        };
        for (at, word) in self.stretch.iter().zip(words) {
            at.store(word, Ordering::Relaxed);
        }
    }

    fn label(&self) -> FrameLabel {
        let words = self.stretch.each_ref().map(|word| word.load(Ordering::Relaxed));
        let epoch = self.epoch.load(Ordering::Relaxed);
        let is_measured = words.first().is_some_and(|&sigma| !f32::from_bits(sigma).is_nan());
        FrameLabel {
            epoch,
            received: self.received.load(Ordering::Relaxed),
            position_error: f32::from_bits(self.position_error.load(Ordering::Relaxed)),
            stretch: is_measured.then(|| MeasuredStretch::from_words(&words, epoch)),
        }
    }
}

/// A double buffer of `N` vertex positions, meant for a `static`.
///
/// RAM: 25 bytes a vertex and 120 more (all zero at start, so it lives in `.bss`): two positions, and
/// one byte that remembers in which frame the vertex was last written.
///
/// ```
/// use dibs_nostd::{FrameLabel, Frames, VertexTable, glam::Vec3};
///
/// static FRAMES: Frames<2> = Frames::new();
/// let (mut writer, mut reader) = FRAMES.split().expect("split once");
/// assert!(reader.read().is_none(), "nothing published yet");
///
/// writer.begin();
/// writer.write(0, Vec3::X).unwrap();
/// writer.write(1, Vec3::Y).unwrap();
/// let label = FrameLabel { epoch: 7, received: 1000, position_error: 0.0, stretch: None };
/// writer.publish(label).unwrap();
///
/// let frame = reader.read().unwrap();
/// assert_eq!(frame.position(1), Some(Vec3::Y));
/// assert_eq!(frame.label().epoch, 7);
/// assert_eq!(frame.age(1008), 8);
/// ```
pub struct Frames<const N: usize> {
    buffers: [Buffer<N>; 2],
    /// In which of the last 255 frames each vertex was last written; 0 for none of them.
    marks: [AtomicU8; N],
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
            marks: [const { AtomicU8::new(0) }; N],
            state: AtomicU32::new(0),
            split: AtomicBool::new(false),
        }
    }

    /// An empty double buffer, of atomics whose order a model checker decides.
    #[cfg(loom)]
    #[must_use]
    pub fn new() -> Self {
        use core::array::from_fn;
        Self {
            buffers: from_fn(|_| Buffer::new()),
            marks: from_fn(|_| AtomicU8::new(0)),
            state: AtomicU32::new(0),
            split: AtomicBool::new(false),
        }
    }

    /// The two ends, once: `None` at every later call, so that there is one writer and one reader.
    pub fn split(&self) -> Option<(FrameWriter<'_, N>, FrameReader<'_, N>)> {
        if self.split.swap(true, Ordering::AcqRel) {
            return None;
        }
        let writer = FrameWriter {
            frames: self,
            back: &self.buffers[1],
            state: 0,
            generation: 0,
            missing: N as u32,
            scrub: 0,
        };
        Some((writer, FrameReader { frames: self }))
    }
}

impl<const N: usize> Default for Frames<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// The end that writes: owned by whoever receives vertices.
///
/// A frame is [`begin`](Self::begin), one [`write`](Self::write) for every vertex in any order, and
/// [`publish`](Self::publish). Between frames the back buffer holds the frame before the last one;
/// a frame that only moves some vertices would start from a copy of [`front`](Self::front), which
/// the writer may read at any time, because nobody else changes it.
pub struct FrameWriter<'f, const N: usize> {
    frames: &'f Frames<N>,
    back: &'f Buffer<N>,
    /// The state word as the last publication left it: only the writer changes these bits.
    state: u32,
    /// Mark of the frame being written: 1 to 255, reused after 255 frames.
    generation: u8,
    missing: u32,
    /// Where the next share of old marks is wiped.
    scrub: usize,
}

impl<const N: usize> FrameWriter<'_, N> {
    /// Starts a frame and forgets an unfinished one. Cost: `N / 128` byte stores.
    pub fn begin(&mut self) {
        self.generation = if self.generation == u8::MAX { 1 } else { self.generation + 1 };
        self.missing = N as u32;
        // A mark of 255 frames ago would pass for one of this frame. Wiping a 128th of the marks at
        // every frame removes it in time, and costs less at once than wiping all of them.
        let share = N.div_ceil(128);
        let end = self.scrub.saturating_add(share);
        for mark in self.frames.marks.iter().skip(self.scrub).take(share) {
            mark.store(0, Ordering::Relaxed);
        }
        self.scrub = if end < N { end } else { 0 };
    }

    /// Stores one position (mm) in the back buffer. Cost: O(1).
    ///
    /// # Errors
    /// [`OutOfTable`] when there is no such vertex; nothing is stored.
    #[inline]
    pub fn write(&mut self, vertex: u32, position: Vec3) -> Result<(), OutOfTable> {
        let index = vertex as usize;
        let (Some([x, y, z]), Some(mark)) =
            (self.back.positions.get(index), self.frames.marks.get(index))
        else {
            return Err(OutOfTable { vertex, vertices: N as u32 });
        };
        x.store(position.x.to_bits(), Ordering::Relaxed);
        y.store(position.y.to_bits(), Ordering::Relaxed);
        z.store(position.z.to_bits(), Ordering::Relaxed);
        // Before the first `begin` nothing counts as written.
        if self.generation != 0 && mark.load(Ordering::Relaxed) != self.generation {
            mark.store(self.generation, Ordering::Relaxed);
            self.missing = self.missing.saturating_sub(1);
        }
        Ok(())
    }

    /// Whether this frame has this vertex already.
    #[must_use]
    #[inline]
    pub fn is_written(&self, vertex: u32) -> bool {
        self.generation != 0
            && self
                .frames
                .marks
                .get(vertex as usize)
                .is_some_and(|mark| mark.load(Ordering::Relaxed) == self.generation)
    }

    /// Vertices that this frame still lacks.
    #[must_use]
    pub const fn missing(&self) -> u32 {
        self.missing
    }

    /// The frame being written, complete or not: for a check before it is published.
    #[must_use]
    pub const fn back(&self) -> FrameView<'_, N> {
        FrameView { buffer: self.back }
    }

    /// The published frame, `None` before the first.
    #[must_use]
    pub fn front(&self) -> Option<FrameView<'_, N>> {
        let [first, second] = &self.frames.buffers;
        let buffer = if self.state & FRONT == 0 { first } else { second };
        (self.state & PUBLISHED != 0).then_some(FrameView { buffer })
    }

    /// Makes the frame the published one, by one compare-exchange. The next frame begins with
    /// [`begin`](Self::begin).
    ///
    /// # Errors
    /// [`PublishError::Incomplete`] while vertices are missing. [`PublishError::Busy`] while a read is
    /// in progress: nothing is lost, call again later.
    pub fn publish(&mut self, label: FrameLabel) -> Result<(), PublishError> {
        if self.missing != 0 || self.generation == 0 {
            return Err(PublishError::Incomplete { missing: self.missing });
        }
        self.back.set_label(label);
        let next = (self.state ^ FRONT) | PUBLISHED;
        self.frames
            .state
            .compare_exchange(self.state, next, Ordering::AcqRel, Ordering::Relaxed)
            .map_err(|_| PublishError::Busy)?;
        let [first, second] = &self.frames.buffers;
        self.back = if next & FRONT == 0 { second } else { first };
        self.state = next;
        // What the back buffer holds now is an old frame: it must be begun before it is published.
        self.missing = N as u32;
        Ok(())
    }
}

/// The end that reads: owned by the control tick.
pub struct FrameReader<'f, const N: usize> {
    frames: &'f Frames<N>,
}

impl<const N: usize> FrameReader<'_, N> {
    /// Holds the published frame for as long as the guard lives; `None` before the first.
    ///
    /// Keep the guard for one query, not longer: no frame is published meanwhile. A guard that is
    /// leaked keeps the surface at its present frame, which its age then tells.
    #[inline]
    pub fn read(&mut self) -> Option<FrameGuard<'_, N>> {
        let state = self.frames.state.fetch_or(READING, Ordering::Acquire);
        let [first, second] = &self.frames.buffers;
        let buffer = if state & FRONT == 0 { first } else { second };
        // Made before the check, so that it clears READING on both ways out.
        let guard = FrameGuard { state: &self.frames.state, view: FrameView { buffer } };
        (state & PUBLISHED != 0).then_some(guard)
    }
}

/// The published frame, held still: a [`VertexTable`].
pub struct FrameGuard<'f, const N: usize> {
    state: &'f AtomicU32,
    view: FrameView<'f, N>,
}

impl<const N: usize> FrameGuard<'_, N> {
    /// What is known of this frame.
    #[must_use]
    pub fn label(&self) -> FrameLabel {
        self.view.buffer.label()
    }

    /// Time since the frame's first packet arrived, in the unit of the receiver's clock. Right over
    /// one wrap of the clock.
    #[must_use]
    pub fn age(&self, now: u32) -> u32 {
        now.wrapping_sub(self.view.buffer.received.load(Ordering::Relaxed))
    }

    /// What a constraint has to be told when the frame is older than `limit`.
    ///
    /// # Errors
    /// [`Unknown::Stale`] with the age.
    pub fn check_age(&self, now: u32, limit: u32) -> Result<(), Unknown> {
        let age = self.age(now);
        if age > limit { Err(Unknown::Stale { age }) } else { Ok(()) }
    }
}

impl<const N: usize> Drop for FrameGuard<'_, N> {
    fn drop(&mut self) {
        self.state.fetch_and(!READING, Ordering::Release);
    }
}

impl<const N: usize> VertexTable for FrameGuard<'_, N> {
    fn len(&self) -> usize {
        N
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.view.buffer.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        Some(self.view.buffer.epoch.load(Ordering::Relaxed))
    }
}

/// The writer's view of one buffer: a [`VertexTable`].
#[derive(Clone, Copy)]
pub struct FrameView<'f, const N: usize> {
    buffer: &'f Buffer<N>,
}

impl<const N: usize> VertexTable for FrameView<'_, N> {
    fn len(&self) -> usize {
        N
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.buffer.position(vertex)
    }
}

/// A vertex outside the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct OutOfTable {
    /// The vertex asked for.
    pub vertex: u32,
    /// How many there are.
    pub vertices: u32,
}

impl fmt::Display for OutOfTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "vertex {} is outside a table of {}", self.vertex, self.vertices)
    }
}

impl core::error::Error for OutOfTable {}

/// Why a frame was not published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PublishError {
    /// Vertices of this frame were never written.
    Incomplete {
        /// How many.
        missing: u32,
    },
    /// A read is in progress.
    Busy,
}

impl fmt::Display for PublishError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Incomplete { missing } => write!(f, "the frame lacks {missing} vertices"),
            Self::Busy => write!(f, "a read of the published frame is in progress"),
        }
    }
}

impl core::error::Error for PublishError {}
