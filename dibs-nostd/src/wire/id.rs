//! A frame's name: mesh, session and epoch, and their order.

// Requirement: B-01

/// The name of a frame: its mesh, the run of its sender, and its number within that run.
///
/// Frames are ordered by (session, epoch): a sender that restarts takes a later session, and may number its frames from
/// any epoch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FrameId {
    /// Identity of the mesh: `Tree::mesh_id`.
    pub mesh_id: u32,
    /// Number of the sender's run; wraps.
    pub session: u32,
    /// Number of the frame within the session; wraps.
    pub epoch: u32,
}

impl FrameId {
    /// Whether this frame comes after another of the same mesh.
    ///
    /// ```
    /// use dibs_nostd::wire::FrameId;
    /// let before = FrameId { mesh_id: 7, session: 1, epoch: u32::MAX };
    /// assert!(FrameId { epoch: 0, ..before }.is_after(&before));
    /// assert!(FrameId { session: 2, ..before }.is_after(&before));
    /// assert!(!before.is_after(&before));
    /// ```
    #[must_use]
    pub const fn is_after(&self, other: &Self) -> bool {
        if self.session == other.session {
            is_newer(self.epoch, other.epoch)
        } else {
            is_newer(self.session, other.session)
        }
    }
}

/// Serial number order (RFC 1982): whether `a` comes after `b`, up to 2^31 - 1 ahead.
#[must_use]
pub const fn is_newer(a: u32, b: u32) -> bool {
    a.wrapping_sub(b) as i32 > 0
}
