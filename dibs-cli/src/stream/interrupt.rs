//! Ends a stream on Ctrl-C without losing its totals.

use anyhow::{Context, Result};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// Whether the user or the system has requested the end of the program.
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Handles SIGINT, SIGTERM and SIGHUP; on Windows, Ctrl-C and the closing of the console. A second signal ends the
    /// program at once.
    pub fn new() -> Result<Self> {
        let flag = Arc::new(AtomicBool::new(false));
        let raised = Arc::clone(&flag);
        ctrlc::set_handler(move || {
            if raised.swap(true, Ordering::Relaxed) {
                std::process::exit(130);
            }
        })
        .context("Ctrl-C cannot be handled here")?;
        Ok(Self(flag))
    }

    pub fn is_raised(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// The flag, for a line that must not block once it is set.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }

    /// The result of work that may block; `None` if an interrupt came first.
    pub fn unless_raised<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Option<T> {
        let (done, result) = channel();
        // After an interrupt the result is dropped.
        thread::spawn(move || drop(done.send(work())));
        loop {
            match result.recv_timeout(Duration::from_millis(20)) {
                Ok(result) => return Some(result),
                Err(RecvTimeoutError::Timeout) if !self.is_raised() => (),
                Err(_) => return None,
            }
        }
    }
}
