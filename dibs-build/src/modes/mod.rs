//! Displacement modes of a recorded motion, for surfaces driven by a few weights.
//!
//! [`ModalFit`] decomposes a motion, [`BuiltTree::with_modes`](crate::BuiltTree::with_modes) adds the
//! first of its modes to a tree, and a sender turns positions into weights with a [`Projector`].

// Requirement: F-06

mod encode;
mod fit;
mod growth;
mod project;
mod quantise;

pub(crate) use encode::encode;
pub use fit::ModalFit;
pub use project::Projector;

use crate::{BuildError, MotionMismatchError};
use dibs_nostd::modes::MAX_MODES;

/// Most frames of a motion that modes are fitted to: the decomposition's cost is cubic in their number.
pub const MAX_FRAMES: usize = 1_000;

/// The error of a number of modes for the motion that they were fitted to.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[non_exhaustive]
pub struct ModalError {
    /// Number of modes.
    pub modes: usize,
    /// Largest distance of any vertex in any frame from its recorded position (mm).
    pub max: f64,
    /// Root mean square of that distance over all vertices and frames (mm).
    pub rms: f64,
}

/// A recorded motion as weights of a tree's modes.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ModalMotion {
    /// For each recorded frame one weight a mode, ready to be sent.
    pub weights: Vec<Vec<f32>>,
    /// Frames that stretch the surface beyond the tree's limit: a receiver rejects them.
    pub beyond_limit: Vec<usize>,
}

/// Fraction of the recorded range by which a mode's weight may exceed it, at either end.
pub const MARGIN: f32 = 0.25;

/// Why modes cannot be fitted to a motion or added to a tree.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The motion does not fit the mesh.
    #[error(transparent)]
    Mismatch(#[from] MotionMismatchError),
    /// No frame, or too many.
    #[error("modes are fitted to 1 to {MAX_FRAMES} frames, the motion has {frames}: thin it out")]
    Frames {
        /// Frames of the motion.
        frames: usize,
    },
    /// A coordinate that is not finite.
    #[error("frame {frame} of the motion has a coordinate that is not finite, at vertex {vertex}")]
    Coordinate {
        /// The frame, counted from 0.
        frame: usize,
        /// The vertex.
        vertex: usize,
    },
    /// Every frame is the rest shape.
    #[error("no vertex of the motion leaves the rest shape: there is no mode to fit")]
    Still,
    /// No mode, or more modes than the motion has.
    #[error(
        "{asked} modes cannot be had: the motion has {available}, and a tree holds 1 to {MAX_MODES}"
    )]
    Count {
        /// Modes asked for.
        asked: usize,
        /// Modes that the motion has.
        available: usize,
    },
    /// The tree is of another mesh than the motion, or has modes already.
    #[error("the tree is not one of the mesh that the modes were fitted on")]
    OtherMesh,
    /// The tree was built without its rest shape.
    #[error("the tree has no rest shape for modes to displace: build it with one")]
    NoRestShape,
    /// The stretch of the rest shape or of a frame cannot be measured.
    #[error("the stretch of the modal surface cannot be measured: {0}")]
    Stretch(dibs_nostd::StretchError),
    /// A mode is so large or so small that 16 bits do not represent it, or is a combination of others.
    #[error("the modes of this motion cannot be told apart: ask for fewer")]
    Degenerate,
    /// The modes fail their validation: a defect of the builder.
    #[error("the builder made modes that its own checker rejects ({0}); please report this motion")]
    Invalid(#[from] dibs_nostd::modes::ModesError),
    /// The tree with its modes cannot be written.
    #[error(transparent)]
    Build(#[from] BuildError),
}
