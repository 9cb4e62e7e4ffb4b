//! Errors of a session.

use dibs_nostd::nodes::NodesError;
use dibs_nostd::{FormatError, QueryError, StretchError, ToolError};
use thiserror::Error;

/// Why a session cannot start, or gives no answer.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum SessionError {
    /// The tree's bytes.
    #[error("the page's tree is damaged: {0}; write the page again with `dibs view`")]
    Tree(#[from] FormatError),
    /// The tree's nodes.
    #[error("the page's tree is damaged: {0}; write the page again with `dibs view`")]
    Nodes(#[from] NodesError),
    /// The motion's bytes.
    #[error(
        "the page's motion has {found} bytes, which is no number of frames of {frame} bytes; write the page again"
    )]
    Motion {
        /// Its bytes.
        found: usize,
        /// Bytes of a frame.
        frame: usize,
    },
    /// A tree without rest positions, for a page without a motion.
    #[error("the tree has no rest shape; give a motion")]
    NoRest,
    /// A frame stretched beyond the tree's limit, or with an inverted element.
    #[error("frame {frame}: {error}{}", remedy(error))]
    Stretch {
        /// Its number, from 0.
        frame: usize,
        /// The measurement's error.
        error: StretchError,
    },
    /// The instrument.
    #[error("the instrument is no tool: {0}")]
    Tool(#[from] ToolError),
    /// The wrong count of numbers for an instrument.
    #[error("{0} numbers are no instrument: 4 are a sphere, 7 a capsule")]
    Numbers(usize),
    /// The query.
    #[error("{0}")]
    Query(#[from] QueryError),
}

/// What to do about a frame that is refused. No limit admits an inverted element.
const fn remedy(error: &StretchError) -> &'static str {
    match error {
        StretchError::Exceeded { .. } | StretchError::ElementExceeded { .. } => {
            "; build the tree with a larger --stretch, or with --limits that allow it"
        }
        StretchError::Inverted { .. } => ": no stretch limit admits that, mend the frame",
        _ => "",
    }
}
