//! Errors of splitting, filling and publishing buffers.

// Requirement: F-01

use core::fmt;

/// The buffers are split already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SplitError;

impl fmt::Display for SplitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the two ends of these buffers were taken before")
    }
}

impl core::error::Error for SplitError {}

/// A vertex outside the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct OutOfTableError {
    /// The vertex.
    pub vertex: u32,
    /// Number of vertices in the table.
    pub vertices: u32,
}

impl fmt::Display for OutOfTableError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "vertex {} is outside a table of {}", self.vertex, self.vertices)
    }
}

impl core::error::Error for OutOfTableError {}

/// Why a frame was not published.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum PublishError {
    /// Vertices of this frame were never written.
    Incomplete {
        /// Number of missing vertices.
        missing: u32,
    },
    /// A read is in progress.
    Busy,
}

impl fmt::Display for PublishError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Incomplete { missing } => write!(f, "the frame lacks {missing} vertices"),
            Self::Busy => write!(f, "a read of the published frame is in progress"),
        }
    }
}

impl core::error::Error for PublishError {}
