//! The background's work besides the bus: the check of the tree in flash.

use dibs_nostd::Scrub;

use crate::BusStatus;
use crate::surface;

/// Bytes checked in one slice.
const SLICE: usize = 256;

/// The background check of the tree. A changed tree makes the control tick safe from then on.
pub struct Upkeep {
    scrub: Scrub<'static>,
    status: &'static BusStatus,
}

impl Upkeep {
    /// A check that begins at the tree's first byte.
    #[must_use]
    pub fn new(status: &'static BusStatus) -> Self {
        Self { scrub: surface::TREE.scrub(), status }
    }

    /// One slice: some thousand instructions.
    pub fn step(&mut self) {
        if self.scrub.step(SLICE).is_err() {
            self.status.set_tree_corrupt();
        }
    }

    /// Rounds finished; wraps.
    #[must_use]
    pub const fn rounds(&self) -> u32 {
        self.scrub.rounds()
    }
}
