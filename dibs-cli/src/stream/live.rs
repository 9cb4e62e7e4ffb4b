//! Frames as they come: a thread reads them, and the newest waits to be sent.

use super::parse::{Parsed, Parser};
use anyhow::Result;
use dibs_build::glam::Vec3;
use std::io::Read;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The time to the next frame that is assumed at the first one: of 30 frames a second.
const FIRST_GAP: Duration = Duration::from_millis(33);

/// A frame of a live source.
pub struct Frame {
    /// In the mesh's order.
    pub positions: Vec<Vec3>,
    /// When it came.
    pub came: Instant,
    /// When it came or, if it states no age, when the first of the equal ones before it did: a source that stands still
    /// grows old.
    pub captured: Instant,
    /// Its age when it came.
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
    /// Starts to read. With `keeps_all` a frame waits until the one before it is taken; otherwise it replaces that one.
    pub fn start<R: Read + Send + 'static>(parser: Parser<R>, keeps_all: bool) -> Self {
        let shared = Arc::new(Shared::default());
        let filled = Arc::clone(&shared);
        // It may wait for input for ever: the program ends without it.
        thread::spawn(move || filled.fill(parser, keeps_all));
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

    fn fill<R: Read>(&self, mut parser: Parser<R>, keeps_all: bool) {
        let mut last: Option<(Vec<Vec3>, Instant, Instant)> = None;
        let end = loop {
            let Parsed { positions, age } = match parser.next() {
                Ok(Some(parsed)) => parsed,
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            };
            let came = Instant::now();
            let captured = match &last {
                Some((before, _, captured)) if age.is_none() && *before == positions => *captured,
                _ => came,
            };
            let gap = last.as_ref().map_or(FIRST_GAP, |(_, last, _)| came - *last);
            last = Some((positions.clone(), came, captured));
            let age = age.unwrap_or_default();
            let frame = Frame { positions, came, captured, age, gap };
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
