//! Live frames: a thread reads them, and the newest waits to be sent.

// Requirement: B-10

use anyhow::Result;
use dibs_build::glam::Vec3;
use dibs_nostd::RigidPose;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The assumed time from the first frame to the second: that of 30 frames a second.
const FIRST_GAP: Duration = Duration::from_millis(33);

/// A frame of a source that fits the tree.
pub struct ParsedFrame {
    /// In the mesh's order.
    pub positions: Vec<Vec3>,
    /// The rigid pose of the whole surface, if the source has one.
    pub pose: Option<RigidPose>,
    /// When its last byte came.
    pub came: Instant,
    /// Its age then.
    pub age: Duration,
}

/// A frame of a live source.
pub struct Frame {
    pub parsed: ParsedFrame,
    /// Time since the previous frame.
    pub gap: Duration,
}

/// The state of a source.
pub enum Next {
    Frame(Frame),
    /// No frame yet.
    Later,
    /// No more frames.
    End,
}

/// A live source.
pub struct Live(Arc<SharedSlot>);

#[derive(Default)]
struct SharedSlot {
    place: Mutex<Slot>,
    changed: Condvar,
}

/// Room for one frame. A queue would be wrong: frames that wait behind others only age.
#[derive(Default)]
struct Slot {
    frame: Option<Frame>,
    /// How the source ended.
    end: Option<Result<()>>,
    passed_over: u64,
}

impl Live {
    /// Starts to read frames from `next`, which returns `None` at the end. With `keeps_all` a frame waits until the
    /// previous one is taken; otherwise it replaces it.
    pub fn start(
        next: impl FnMut() -> Result<Option<ParsedFrame>> + Send + 'static,
        keeps_all: bool,
    ) -> Self {
        let shared = Arc::new(SharedSlot::default());
        let filled = Arc::clone(&shared);
        // This thread may wait for input for ever, so the program does not wait for it.
        thread::spawn(move || filled.fill(next, keeps_all));
        Self(shared)
    }

    /// The waiting frame, or the first that arrives within `patience`.
    ///
    /// # Errors
    /// The source's error, once every earlier frame is taken.
    pub fn next(&self, patience: Duration) -> Result<Next> {
        let place = self.0.place();
        let is_idle = |place: &mut Slot| place.frame.is_none() && place.end.is_none();
        let waited = self.0.changed.wait_timeout_while(place, patience, is_idle);
        let (mut place, _) = waited.unwrap_or_else(PoisonError::into_inner);
        if let Some(frame) = place.frame.take() {
            self.0.changed.notify_all();
            return Ok(Next::Frame(frame));
        }
        match place.end.take() {
            Some(end) => end.map(|()| Next::End),
            None => Ok(Next::Later),
        }
    }

    /// Number of frames that newer ones replaced.
    pub fn passed_over(&self) -> u64 {
        self.0.place().passed_over
    }
}

impl SharedSlot {
    fn place(&self) -> MutexGuard<'_, Slot> {
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fill(&self, mut next: impl FnMut() -> Result<Option<ParsedFrame>>, keeps_all: bool) {
        let mut last: Option<Instant> = None;
        let end = loop {
            let parsed = match next() {
                Ok(Some(parsed)) => parsed,
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            };
            let gap = last.replace(parsed.came).map_or(FIRST_GAP, |last| parsed.came - last);
            let frame = Frame { parsed, gap };
            let mut place = self.place();
            if keeps_all {
                let is_full = |place: &mut Slot| place.frame.is_some();
                let waited = self.changed.wait_while(place, is_full);
                place = waited.unwrap_or_else(PoisonError::into_inner);
            }
            place.passed_over += u64::from(place.frame.is_some());
            place.frame = Some(frame);
            self.changed.notify_all();
        };
        self.place().end = Some(end);
        self.changed.notify_all();
    }
}
