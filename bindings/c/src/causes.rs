//! The code of each of the core's errors.

use dibs_nostd::constraint::GainError;
use dibs_nostd::failsafe::{AcknowledgeError, LimitError};
use dibs_nostd::filter::FilterError;
use dibs_nostd::modes::ModesError;
use dibs_nostd::wire::{Event, PacketError, StreamError};
use dibs_nostd::{
    CorruptTreeError, Error, FormatError, PoseError, QueryError, ReceiveError, StretchError,
    ToolError, Unavailable,
};

use crate::code::dibs_code;

impl From<FormatError> for dibs_code {
    fn from(error: FormatError) -> Self {
        match error {
            FormatError::Length { .. } => Self::TreeLength,
            FormatError::Magic { .. } => Self::TreeMagic,
            FormatError::Version { .. } => Self::TreeVersion,
            FormatError::Width { .. } => Self::TreeWidth,
            FormatError::Checksum { .. } => Self::TreeChecksum,
            _ => Self::TreeForm,
        }
    }
}

impl From<CorruptTreeError> for dibs_code {
    fn from(_: CorruptTreeError) -> Self {
        Self::TreeCorrupt
    }
}

impl From<ModesError> for dibs_code {
    fn from(error: ModesError) -> Self {
        match error {
            ModesError::Absent | ModesError::NoRestShape => Self::TreeNoModes,
            _ => Self::TreeForm,
        }
    }
}

impl From<ToolError> for dibs_code {
    fn from(error: ToolError) -> Self {
        match error {
            ToolError::Radius { .. } => Self::ToolRadius,
            _ => Self::ToolCoordinate,
        }
    }
}

impl From<QueryError> for dibs_code {
    fn from(error: QueryError) -> Self {
        match error {
            QueryError::VertexCount { .. } => Self::VertexCount,
            QueryError::Position { .. } => Self::Position,
            QueryError::OtherTree { .. } => Self::StretchOfOtherTree,
            QueryError::OtherFrame { .. } => Self::StretchOfOtherFrame,
            QueryError::Uncovered { .. } => Self::Uncovered,
            QueryError::NoAdjacency => Self::TreeNoAdjacency,
            QueryError::Margin { .. } => Self::Margin,
            QueryError::Corrupt { .. } => Self::TreeCorrupt,
            _ => Self::QueryFailed,
        }
    }
}

impl From<Unavailable> for dibs_code {
    fn from(cause: Unavailable) -> Self {
        match cause {
            Unavailable::NoSurface => Self::NoSurface,
            Unavailable::Unacknowledged => Self::Unacknowledged,
            Unavailable::Stale { .. } => Self::Stale,
            Unavailable::Query(error) => error.into(),
            Unavailable::CorruptTree => Self::TreeCorrupt,
            Unavailable::LinkLost { .. } => Self::LinkLost,
            Unavailable::HeartbeatLost { .. } => Self::HeartbeatLost,
            Unavailable::Rejections { .. } => Self::Rejections,
            Unavailable::Delayed { .. } => Self::Delayed,
            Unavailable::SourceStale { .. } => Self::SourceStale,
            Unavailable::Forgeries { .. } => Self::Forgeries,
            Unavailable::NoPose => Self::NoPose,
            Unavailable::NoDirection => Self::NoDirection,
            Unavailable::NoSide => Self::NoSide,
            Unavailable::CutShort => Self::CutShort,
            Unavailable::NotFinite => Self::NotFinite,
            _ => Self::Unavailable,
        }
    }
}

impl From<StretchError> for dibs_code {
    fn from(error: StretchError) -> Self {
        match error {
            StretchError::NoMetric => Self::TreeNoMetric,
            StretchError::VertexCount { .. } => Self::VertexCount,
            StretchError::Shrunk { .. } | StretchError::ElementsShrunk { .. } => Self::Shrunk,
            StretchError::TooFast { .. } => Self::TooFast,
            StretchError::InsideOut { .. } | StretchError::Inverted { .. } => Self::InsideOut,
            StretchError::Corrupt { .. } => Self::TreeCorrupt,
            _ => Self::StretchExceeded,
        }
    }
}

impl From<ReceiveError> for dibs_code {
    fn from(error: ReceiveError) -> Self {
        match error {
            ReceiveError::Packet(PacketError::TooShort { .. } | PacketError::Checksum { .. }) => {
                Self::PacketDamaged
            }
            ReceiveError::Packet(PacketError::Version { .. }) => Self::PacketVersion,
            ReceiveError::Packet(_) => Self::PacketForm,
            ReceiveError::WrongMesh { .. } | ReceiveError::OtherSurface { .. } => Self::PacketMesh,
            ReceiveError::Forged { .. } => Self::PacketForged,
            ReceiveError::Stale { .. } => Self::PacketStale,
            ReceiveError::Earlier { .. } => Self::PacketEarlier,
            ReceiveError::TooOld => Self::PacketTooOld,
            ReceiveError::Throttled { .. } => Self::PacketThrottled,
            ReceiveError::Refused { cause, .. }
            | ReceiveError::Unverifiable { cause: Some(cause), .. } => cause.into(),
            ReceiveError::Unexpected { .. } | ReceiveError::Unverifiable { .. } => {
                Self::PacketUnexpected
            }
            ReceiveError::Busy { .. } => Self::PacketBusy,
            ReceiveError::Base { .. } => Self::PacketBase,
            ReceiveError::NotReady { .. } => Self::PacketNotReady,
            ReceiveError::RowCount { .. } | ReceiveError::OutOfRange { .. } => Self::PacketRows,
            ReceiveError::Encoding => Self::PacketEncoding,
            ReceiveError::Order { .. } | ReceiveError::Gaps { .. } => Self::PacketOrder,
            ReceiveError::NotFinite { .. } | ReceiveError::Pose(PoseError::NotFinite) => {
                Self::PacketNotFinite
            }
            ReceiveError::TooFar { .. } | ReceiveError::Pose(PoseError::TooFar { .. }) => {
                Self::PacketTooFar
            }
            ReceiveError::Pose(PoseError::NoRotation { .. }) => Self::PacketForm,
            ReceiveError::Digest { .. } => Self::PacketDigest,
            ReceiveError::Stretch(error) => error.into(),
            _ => Self::PacketRefused,
        }
    }
}

/// The cause that packets of an already refused frame report.
impl From<Event> for dibs_code {
    fn from(cause: Event) -> Self {
        match cause {
            Event::WrongMesh => Self::PacketMesh,
            Event::Forged => Self::PacketForged,
            Event::Stale => Self::PacketStale,
            Event::Busy => Self::PacketBusy,
            Event::Base => Self::PacketBase,
            Event::RowCount => Self::PacketRows,
            Event::Encoding => Self::PacketEncoding,
            Event::Digest => Self::PacketDigest,
            Event::Stretch => Self::StretchExceeded,
            Event::Shrunk => Self::Shrunk,
            Event::TooFast => Self::TooFast,
            _ => Self::PacketUnexpected,
        }
    }
}

impl From<StreamError> for dibs_code {
    fn from(_: StreamError) -> Self {
        Self::Framing
    }
}

impl From<GainError> for dibs_code {
    fn from(_: GainError) -> Self {
        Self::Gain
    }
}

impl From<LimitError> for dibs_code {
    fn from(error: LimitError) -> Self {
        match error {
            LimitError::Order { .. } => Self::LimitOrder,
            LimitError::Speed { .. } => Self::LimitSpeed,
            LimitError::Recovery { .. } => Self::LimitRecovery,
            LimitError::Untrippable { .. } => Self::LimitUntrippable,
            LimitError::NoReach => Self::TreeNoRestShape,
            LimitError::Rate => Self::Argument,
            _ => Self::LimitTooLong,
        }
    }
}

impl From<FilterError> for dibs_code {
    fn from(error: FilterError) -> Self {
        match error {
            FilterError::Parameter { .. } | FilterError::Unlabelled { .. } => Self::Filter,
            FilterError::Command | FilterError::Row { .. } => Self::NotFinite,
            FilterError::Query(error) => error.into(),
            FilterError::Untrusted(cause) => cause.into(),
            _ => Self::Argument,
        }
    }
}

/// Errors of a guard's start.
impl From<Error> for dibs_code {
    fn from(error: Error) -> Self {
        match error {
            Error::Format(error) => error.into(),
            Error::CorruptTree(error) => error.into(),
            Error::Split(_) => Self::Taken,
            Error::Stretch(error) => error.into(),
            Error::Query(error) => error.into(),
            Error::Limit(error) => error.into(),
            _ => Self::Argument,
        }
    }
}

impl From<AcknowledgeError> for dibs_code {
    fn from(_: AcknowledgeError) -> Self {
        Self::Acknowledge
    }
}
