//! One error type for all errors of this crate, for `?`.

// Requirement: A-07

use core::fmt;

/// Defines [`Error`] with a variant for each error type, and for each variant its `From` and its message, which is the
/// inner error's.
macro_rules! errors {
    ($($(#[doc = $text:literal])+ $(#[cfg($when:meta)])? $name:ident($error:ty),)+) => {
        /// Any error of this crate. A program that only reports an error, or skips a tick, needs no other type.
        ///
        /// ```
        /// use dibs_nostd::{Error, Options, Query, Sphere, Tree, glam::Vec3};
        ///
        /// fn answer(bytes: &[u8], vertices: &[Vec3]) -> Result<f32, Error> {
        ///     let tree = Tree::<u16>::from_bytes(bytes)?;
        ///     let mut query = Query::<_, 32>::new(&tree)?;
        ///     let tool = Sphere::new(Vec3::ZERO, 2.5)?;
        ///     Ok(query.closest(vertices, &tool, &Options::new())?.separation)
        /// }
        /// assert!(matches!(answer(b"no tree", &[]), Err(Error::Format(_))));
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[non_exhaustive]
        pub enum Error {
            $($(#[doc = $text])+ $(#[cfg($when)])? $name($error),)+
        }

        impl fmt::Display for Error {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self {
                    $($(#[cfg($when)])? Self::$name(error) => error.fmt(f),)+
                }
            }
        }

        impl core::error::Error for Error {}

        $($(#[cfg($when)])? impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::$name(error)
            }
        })+
    };
}

errors! {
    /// The bytes are not a tree of this version.
    Format(crate::FormatError),
    /// The tree's bytes changed.
    CorruptTree(crate::CorruptTreeError),
    /// Buffers were split twice.
    Split(crate::SplitError),
    /// A frame has more vertices than its buffers.
    OutOfTable(crate::OutOfTableError),
    /// A frame was not published.
    Publish(crate::PublishError),
    /// A stretch is beyond its limit, or was not measured.
    Stretch(crate::StretchError),
    /// A tool's coordinate or radius is out of range.
    Tool(crate::ToolError),
    /// A query gave no answer.
    Query(crate::QueryError),
    /// There is no proximity for a constraint.
    Unavailable(crate::Unavailable),
    /// A packet, or the frame that it would have finished, was rejected.
    #[cfg(feature = "bus")]
    Receive(crate::ReceiveError),
    /// The bytes are not a packet.
    #[cfg(feature = "bus")]
    Packet(crate::wire::PacketError),
    /// A frame cannot be encoded.
    #[cfg(feature = "bus")]
    Encode(crate::wire::EncodeError),
    /// A byte stream lost a packet.
    #[cfg(feature = "bus")]
    Stream(crate::wire::StreamError),
    /// A quantisation box's corner or step is out of range.
    #[cfg(feature = "bus")]
    Box(crate::wire::BoxError),
    /// A constraint's gain is out of range.
    #[cfg(feature = "control")]
    Gain(crate::constraint::GainError),
    /// A filter admits no motion.
    #[cfg(feature = "control")]
    Filter(crate::filter::FilterError),
    /// A fail-safe limit is out of range.
    #[cfg(feature = "control")]
    Limit(crate::failsafe::LimitError),
    /// An acknowledgement came too early.
    #[cfg(feature = "control")]
    Acknowledge(crate::failsafe::AcknowledgeError),
    /// The tree carries no modes, or damaged ones.
    #[cfg(feature = "modes")]
    Modes(crate::modes::ModesError),
    /// The weights are not a surface's.
    #[cfg(feature = "modes")]
    Weights(crate::modes::WeightsError),
    /// The tree carries no nodes, or damaged ones.
    #[cfg(feature = "nodes")]
    Nodes(crate::nodes::NodesError),
}
