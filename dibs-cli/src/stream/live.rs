//! Frames as they come: a thread reads them, and the newest waits to be sent.

// Requirement: B-10

use anyhow::Result;
use dibs_build::glam::Vec3;
use dibs_nostd::RigidPose;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The time to the next frame that is assumed at the first one: of 30 frames a second.
const FIRST_GAP: Duration = Duration::from_millis(33);

/// A frame that fits the tree, as a source has it.
pub struct Parsed {
    /// In the mesh's order.
    pub positions: Vec<Vec3>,
    /// At which they are as a whole, where the source has one.
    pub pose: Option<RigidPose>,
    /// When its last byte came.
    pub came: Instant,
    pub age: Age,
}

/// What a source knows of a frame's age.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Age {
    /// It states the time since the capture, also of frames that are equal.
    Stated(Duration),
    /// At least so long on the way. A frame that equals the one before it is as old as that one.
    Delay(Duration),
}

/// A frame of a live source.
pub struct Frame {
    /// In the mesh's order.
    pub positions: Vec<Vec3>,
    pub pose: Option<RigidPose>,
    /// When it came.
    pub came: Instant,
    /// When the one that it repeats came, or it did: a source that states no age and stands still grows old.
    pub first: Instant,
    /// The age at that time.
    pub age: Duration,
    /// Time from the frame before it.
    pub gap: Duration,
}

/// What a source has.
pub enum Next {
    Frame(Frame),
    /// Nothing yet.
    Later,
    /// No more.
    End,
}

/// A live source.
pub struct Live(Arc<Shared>);

#[derive(Default)]
struct Shared {
    place: Mutex<Place>,
    changed: Condvar,
}

/// Room for one frame. Not a channel: a frame that waits behind others only grows old.
#[derive(Default)]
struct Place {
    frame: Option<Frame>,
    /// How the source ended.
    end: Option<Result<()>>,
    passed_over: u64,
}

impl Live {
    /// Starts to read what `next` gives, `None` at the end. With `keeps_all` a frame waits until the one before it is
    /// taken; otherwise it replaces that one.
    pub fn start(
        next: impl FnMut() -> Result<Option<Parsed>> + Send + 'static,
        keeps_all: bool,
    ) -> Self {
        let shared = Arc::new(Shared::default());
        let filled = Arc::clone(&shared);
        // It may wait for input for ever: the program ends without it.
        thread::spawn(move || filled.fill(next, keeps_all));
        Self(shared)
    }

    /// The frame that waits, or the first that comes within `patience`.
    ///
    /// # Errors
    /// The source's, once every frame before it is taken.
    pub fn next(&self, patience: Duration) -> Result<Next> {
        let place = self.0.place();
        let is_idle = |place: &mut Place| place.frame.is_none() && place.end.is_none();
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

    /// Frames that newer ones replaced.
    pub fn passed_over(&self) -> u64 {
        self.0.place().passed_over
    }
}

impl Shared {
    fn place(&self) -> MutexGuard<'_, Place> {
        self.place.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn fill(&self, mut next: impl FnMut() -> Result<Option<Parsed>>, keeps_all: bool) {
        // The last positions, when they came, when their like first did, and its age then.
        let mut last: Option<(Vec<Vec3>, Instant, Instant, Duration)> = None;
        let end = loop {
            let Parsed { positions, pose, came, age } = match next() {
                Ok(Some(parsed)) => parsed,
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            };
            let (first, age) = match (age, &last) {
                (Age::Delay(_), Some((before, _, first, age))) if *before == positions => {
                    (*first, *age)
                }
                (Age::Delay(age) | Age::Stated(age), _) => (came, age),
            };
            let gap = last.as_ref().map_or(FIRST_GAP, |(_, last, ..)| came - *last);
            last = Some((positions.clone(), came, first, age));
            let frame = Frame { positions, pose, came, first, age, gap };
            let mut place = self.place();
            if keeps_all {
                let is_full = |place: &mut Place| place.frame.is_some();
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
