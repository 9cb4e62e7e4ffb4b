//! The parts of a buffer: positions and the label of their frame, in relaxed atomics.

// Requirement: F-01

use glam::Vec3;

use super::atomic::{AtomicU32, Ordering};
use super::motion::MotionReading;
use super::{MeasuredStretch, Millis};

/// The facts about a published frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameLabel {
    /// Number of the frame, set by the sender; wraps.
    pub epoch: u32,
    /// Arrival of the frame's first packet on the receiver's clock, less the surface's age at sending; wraps.
    pub received: Millis,
    /// Largest distance of a vertex from the sender's position, in mm, by quantisation on the wire. It bounds the
    /// resulting error of a separation.
    pub position_error: f32,
    /// Measured stretch of the frame against the rest shape; `None` if not measured.
    pub stretch: Option<MeasuredStretch>,
}

/// The stretch of a frame's extrapolation, and the frame's distance from the previous extrapolation.
#[derive(Clone, Copy, Debug)]
pub struct PredictionCheck {
    /// The largest stretch at the end of its extrapolation; NaN unless measured, and within the tree's limit.
    pub sigma: f32,
    /// Largest distance (mm) of a vertex of this frame from its extrapolation by the two previous frames; NaN if
    /// unknown.
    pub residual: f32,
    /// Odometer units from the previous frame to that extrapolation, along the step of the two previous frames.
    pub passed: u32,
    /// Upper bound on the units from there to this frame; the largest number if unknown.
    pub off: u32,
}

impl PredictionCheck {
    pub(crate) const UNKNOWN: Self =
        Self { sigma: f32::NAN, residual: f32::NAN, passed: 0, off: u32::MAX };
}

/// One position, as bits of `f32`.
#[derive(Debug)]
#[repr(transparent)]
pub struct Position([AtomicU32; 3]);

#[cfg_attr(not(loom), expect(clippy::new_without_default, reason = "as its buffers"))]
impl Position {
    /// Zeros.
    #[cfg(not(loom))]
    #[must_use]
    pub const fn new() -> Self {
        Self([const { AtomicU32::new(0) }; 3])
    }

    #[cfg(loom)]
    pub(super) fn new() -> Self {
        Self(core::array::from_fn(|_| AtomicU32::new(0)))
    }

    #[inline(always)]
    pub(crate) fn get(&self) -> Vec3 {
        let [x, y, z] = &self.0;
        let load = |bits: &AtomicU32| f32::from_bits(bits.load(Ordering::Relaxed));
        Vec3::new(load(x), load(y), load(z))
    }

    #[inline(always)]
    pub(crate) fn set(&self, position: Vec3) {
        let [x, y, z] = &self.0;
        x.store(position.x.to_bits(), Ordering::Relaxed);
        y.store(position.y.to_bits(), Ordering::Relaxed);
        z.store(position.z.to_bits(), Ordering::Relaxed);
    }

    #[cfg(feature = "bus")]
    #[inline(always)]
    pub(crate) fn copy(&self, from: &Self) {
        for (to, from) in self.0.iter().zip(&from.0) {
            to.store(from.load(Ordering::Relaxed), Ordering::Relaxed);
        }
    }
}

/// The facts about the frame in a buffer. All zero at start, so that zeroed memory is valid.
#[derive(Debug)]
#[repr(C)]
pub struct Head {
    epoch: AtomicU32,
    received: AtomicU32,
    position_error: AtomicU32,
    /// Measured stretch; the first word is a NaN if there is none.
    stretch: [AtomicU32; MeasuredStretch::WORDS],
    /// The odometer's reading, all zero if there is none.
    motion: [AtomicU32; MotionReading::WORDS],
    ahead: [AtomicU32; 4],
}

#[cfg_attr(not(loom), expect(clippy::new_without_default, reason = "as its buffers"))]
impl Head {
    /// Before the first frame.
    #[cfg(not(loom))]
    #[must_use]
    pub const fn new() -> Self {
        Self {
            epoch: AtomicU32::new(0),
            received: AtomicU32::new(0),
            position_error: AtomicU32::new(0),
            stretch: [const { AtomicU32::new(0) }; MeasuredStretch::WORDS],
            motion: [const { AtomicU32::new(0) }; MotionReading::WORDS],
            ahead: [const { AtomicU32::new(0) }; 4],
        }
    }

    #[cfg(loom)]
    pub(super) fn new() -> Self {
        use core::array::from_fn;
        Self {
            epoch: AtomicU32::new(0),
            received: AtomicU32::new(0),
            position_error: AtomicU32::new(0),
            stretch: from_fn(|_| AtomicU32::new(0)),
            motion: from_fn(|_| AtomicU32::new(0)),
            ahead: from_fn(|_| AtomicU32::new(0)),
        }
    }

    pub(super) fn set_label(
        &self,
        label: FrameLabel,
        motion: Option<MotionReading>,
        ahead: PredictionCheck,
    ) {
        self.epoch.store(label.epoch, Ordering::Relaxed);
        self.received.store(label.received.0, Ordering::Relaxed);
        self.position_error.store(label.position_error.to_bits(), Ordering::Relaxed);
        let words = match label.stretch {
            Some(measured) => measured.to_words(),
            None => [f32::NAN.to_bits(); MeasuredStretch::WORDS],
        };
        for (at, word) in self.stretch.iter().zip(words) {
            at.store(word, Ordering::Relaxed);
        }
        let words = motion.map_or([0; MotionReading::WORDS], MotionReading::to_words);
        for (at, word) in self.motion.iter().zip(words) {
            at.store(word, Ordering::Relaxed);
        }
        let PredictionCheck { sigma, residual, passed, off } = ahead;
        for (at, word) in self.ahead.iter().zip([sigma.to_bits(), residual.to_bits(), passed, off])
        {
            at.store(word, Ordering::Relaxed);
        }
    }

    /// The prediction check of a labelled frame.
    pub(super) fn ahead(&self) -> PredictionCheck {
        let [sigma, residual, passed, off] =
            self.ahead.each_ref().map(|word| word.load(Ordering::Relaxed));
        PredictionCheck {
            sigma: f32::from_bits(sigma),
            residual: f32::from_bits(residual),
            passed,
            off,
        }
    }

    pub(super) fn epoch(&self) -> u32 {
        self.epoch.load(Ordering::Relaxed)
    }

    pub(super) fn received(&self) -> Millis {
        Millis(self.received.load(Ordering::Relaxed))
    }

    pub(super) fn label(&self) -> FrameLabel {
        FrameLabel {
            epoch: self.epoch(),
            received: self.received(),
            position_error: self.position_error(),
            stretch: self.stretch(),
        }
    }

    pub(super) fn motion(&self) -> Option<MotionReading> {
        MotionReading::from_words(self.motion.each_ref().map(|word| word.load(Ordering::Relaxed)))
    }

    pub(super) fn position_error(&self) -> f32 {
        f32::from_bits(self.position_error.load(Ordering::Relaxed))
    }

    pub(super) fn stretch(&self) -> Option<MeasuredStretch> {
        let words = self.stretch.each_ref().map(|word| word.load(Ordering::Relaxed));
        let epoch = self.epoch();
        let is_measured = words.first().is_some_and(|&sigma| !f32::from_bits(sigma).is_nan());
        is_measured.then(|| MeasuredStretch::from_words(words, epoch))
    }
}

/// One buffer, in memory of any kind.
#[derive(Clone, Copy, Debug)]
pub struct Buffer<'m> {
    /// The facts about its frame.
    pub head: &'m Head,
    /// Its positions.
    pub rows: &'m [Position],
}
