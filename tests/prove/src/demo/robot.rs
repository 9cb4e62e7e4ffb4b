//! What moves the instrument in a run.

/// What moves the instrument.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Robot {
    /// A simulated hand, which the wall or a filter stops.
    Hand,
    /// A script that nothing stops.
    Script,
}

impl Robot {
    /// The controller's argument for it.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Hand => "hand",
            Self::Script => "path",
        }
    }
}
