//! Why a frame was not sent.

use dibs_nostd::wire::EncodeError;
use dibs_nostd::{PoseError, SurfaceFacts};
use thiserror::Error;

/// Why a frame was not sent.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SendError {
    /// The frame has too few vertices.
    #[error(
        "the frame has {found} vertices and the tree uses vertex {vertex}: send the positions of \
         the mesh that the tree was built from"
    )]
    Vertices {
        /// A vertex of the tree.
        vertex: u32,
        /// Vertices of the frame.
        found: usize,
    },
    /// The positions are not a frame of the tree's surface.
    #[error("the frame {0}")]
    Positions(#[from] dibs_build::FrameError),
    /// The positions cannot be encoded in packets.
    #[error("the frame cannot be sent: {0}")]
    Frame(EncodeError),
    /// The numbers given with the positions are not a pose.
    #[error("the frame cannot be sent: {0}")]
    Pose(#[from] PoseError),
    /// Packets must carry tags, but the receiver's challenge is not known yet.
    #[error("no genuine status came from the receiver: is it on, and has it the same key?")]
    NoChallenge,
    /// Another sender has taken over the receiver: a surface has one sender.
    #[error(
        "another sender has taken over with session {session}: there can be only one; stop it, and start \
         this one again"
    )]
    Superseded {
        /// The other sender's session.
        session: u32,
    },
    /// The receiver's surface differs from this sender's.
    #[error(
        "the receiver's surface (mesh {:#010x}) has {}; this sender's (mesh {:#010x}) has {}: build both \
         from one file",
        there.0, there.1, here.0, here.1
    )]
    OtherSurface {
        /// The receiver's mesh id and surface facts.
        there: (u32, SurfaceFacts),
        /// This sender's mesh id and surface facts.
        here: (u32, SurfaceFacts),
    },
    /// The connection failed.
    #[error("the connection broke: {0}")]
    Line(std::io::Error),
}
