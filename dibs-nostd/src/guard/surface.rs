//! The memory that both ends share.

// Requirement: C-07

use core::marker::PhantomData;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use super::rows::SharedState;
use super::{Bus, Guard, GuardLimits, Rows, Vertices};
use crate::failsafe::{LinkStatus, State};
use crate::wire::{Mac, NoMac};
use crate::{Error, Frames, Index, QueryError, TreeBytes};

/// The current `N` vertices of a surface, and the data that its two ends exchange. Meant for a `static`; the module
/// that [`include_tree!`](crate::include_tree) includes has its type as `Surface`.
///
/// With [`Nodes`](crate::nodes::Nodes)`<'static>` as `R` the rows are the nodes that move the surface.
///
/// Neither end waits for the other. RAM: 36 bytes for each row, plus less than 400.
#[derive(Debug)]
pub struct Surface<const N: usize, R: Rows = Vertices> {
    frames: Frames<N, 3>,
    notes: Notes<R::Poses>,
    rows: PhantomData<R>,
}

impl<const N: usize, R: Rows> Surface<N, R> {
    /// Before the first frame.
    #[cfg(not(loom))]
    #[must_use]
    #[expect(clippy::new_without_default, reason = "it is too large for a stack")]
    pub const fn new() -> Self {
        Self { frames: Frames::new(), notes: Notes::new(), rows: PhantomData }
    }

    /// Validates the tree and makes the two ends, once. `STACK` must be at least the tree's [`TreeBytes::stack`]; the
    /// guard has slots for `OPENED` opened nodes: see [`Tracker`](crate::Tracker).
    ///
    /// Cost: linear in the tree, for start-up.
    ///
    /// # Errors
    /// [`Error`]: the tree is damaged, it does not have `N` rows, a limit is out of range, or the ends were taken
    /// before.
    #[inline(always)]
    pub fn start<'t, I: Index, const STACK: usize, const OPENED: usize>(
        &self,
        tree: TreeBytes<'t, I>,
        limits: GuardLimits,
    ) -> Result<Ends<'_, 't, I, NoMac, R, STACK, OPENED>, Error> {
        self.start_with_mac(tree, limits, NoMac)
    }

    /// The same, for packets with tags.
    ///
    /// # Errors
    /// Same as [`start`](Self::start).
    #[inline(always)]
    pub fn start_with_mac<'t, I: Index, M: Mac, const STACK: usize, const OPENED: usize>(
        &self,
        tree: TreeBytes<'t, I>,
        limits: GuardLimits,
        mac: M,
    ) -> Result<Ends<'_, 't, I, M, R, STACK, OPENED>, Error> {
        self.start_with_contacts(tree, limits, mac)
    }

    /// The same, for [`Guard::contacts`]: the guard also has slots for `RANGE` opened nodes, usually some hundred.
    ///
    /// # Errors
    /// Same as [`start`](Self::start).
    #[inline(always)]
    pub fn start_with_contacts<
        't,
        I: Index,
        M: Mac,
        const STACK: usize,
        const OPENED: usize,
        const RANGE: usize,
    >(
        &self,
        bytes: TreeBytes<'t, I>,
        limits: GuardLimits,
        mac: M,
    ) -> Result<Ends<'_, 't, I, M, R, STACK, OPENED, RANGE>, Error> {
        let tree = bytes.validate()?;
        let rows = R::of(&tree)?;
        let (expected, found) = (R::count(&tree, &rows), N as u32);
        if expected != found {
            return Err(QueryError::VertexCount { expected, found }.into());
        }
        // If a limit is out of range, no end is taken.
        limits.failsafe()?;
        let (writer, reader) = self.frames.split()?;
        let bus = Bus::new(&self.notes, writer, (&tree, bytes, &rows), &limits, mac)?;
        let guard = Guard::new(&self.notes, reader, (&tree, bytes, rows), &limits)?;
        Ok((bus, guard))
    }
}

/// The two ends of a surface.
type Ends<'s, 't, I, M, R, const STACK: usize, const OPENED: usize, const RANGE: usize = 0> =
    (Bus<'s, 't, I, M, R>, Guard<'s, 't, I, STACK, OPENED, R, RANGE>);

/// The data that the two ends exchange. Public for surfaces of a size that no type has: see
/// [`Buffers`](crate::Buffers).
#[doc(hidden)]
#[derive(Debug)]
pub struct Notes<P = ()> {
    pub(super) of_all: Common,
    /// Data of frames besides their rows.
    pub(super) poses: P,
}

impl<P: SharedState> Notes<P> {
    /// Before the first frame.
    #[cfg(not(loom))]
    #[expect(clippy::new_without_default, reason = "as its surface")]
    #[must_use]
    pub const fn new() -> Self {
        let of_all = Common {
            link: LinkStatus::new(),
            safety: AtomicU32::new(0),
            is_tree_corrupt: AtomicBool::new(false),
        };
        Self { of_all, poses: P::NEW }
    }

    /// The health of the bus.
    #[must_use]
    pub const fn link(&self) -> &LinkStatus {
        &self.of_all.link
    }
}

/// The data for frames of any kind.
#[derive(Debug)]
pub(super) struct Common {
    /// The health of the bus.
    pub link: LinkStatus,
    /// As [`Status::safety`](crate::wire::Status::safety).
    safety: AtomicU32,
    /// Never cleared: flash that was once read wrong is not trusted.
    is_tree_corrupt: AtomicBool,
}

impl Common {
    pub fn safety(&self) -> u8 {
        self.safety.load(Ordering::Relaxed) as u8
    }

    pub fn set_state(&self, state: State) {
        self.safety.store(state as u32 + 1, Ordering::Relaxed);
    }

    pub fn is_tree_corrupt(&self) -> bool {
        self.is_tree_corrupt.load(Ordering::Relaxed)
    }

    pub fn set_tree_corrupt(&self) {
        self.is_tree_corrupt.store(true, Ordering::Relaxed);
    }
}
