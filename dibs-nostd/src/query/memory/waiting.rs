//! A subtree that is still to be searched: on a search's stack, or from tick to tick.

/// A subtree that is still to be searched.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct WaitingNode {
    /// Lower bound on its distance from the tool's axis.
    pub lower: f32,
    /// Link of its node.
    pub link: u32,
}
