//! The header's numbers for the results of the Rust library.

// Requirement: P-06

use dibs_nostd::wire::Event;
use dibs_nostd::{
    Advance, NoSide, Progress, QueryError, ReceiveError, Side, StretchError, Unavailable,
};

pub fn number(progress: Progress) -> u32 {
    match progress {
        Progress::Begun { .. } => 1,
        Progress::Stored => 2,
        Progress::Complete { .. } => 4,
        other => panic!("{other:?}"),
    }
}

pub fn outcome(advance: Advance) -> u32 {
    match advance {
        Advance::Idle => 0,
        Advance::Pending => 1,
        Advance::Held { .. } => 2,
        Advance::Published { .. } => 3,
        other => panic!("{other:?}"),
    }
}

pub fn refusal(error: &ReceiveError) -> u32 {
    match error {
        ReceiveError::Packet(_) => 400,
        ReceiveError::Unexpected { .. } => 406,
        ReceiveError::RowCount { .. } => 410,
        ReceiveError::Stretch(StretchError::Exceeded { .. })
        | ReceiveError::Refused { cause: Event::Stretch, .. } => 311,
        ReceiveError::Stretch(StretchError::TooFast { .. })
        | ReceiveError::Refused { cause: Event::TooFast, .. } => 313,
        other => panic!("{other:?}"),
    }
}

pub fn cause(cause: Unavailable) -> u32 {
    match cause {
        Unavailable::NoSurface => 300,
        Unavailable::Unacknowledged => 318,
        Unavailable::CorruptTree => 106,
        Unavailable::Stale { .. } => 301,
        Unavailable::LinkLost { .. } => 302,
        Unavailable::Rejections { .. } => 304,
        Unavailable::Delayed { .. } => 305,
        Unavailable::NoDirection => 308,
        Unavailable::CutShort => 309,
        Unavailable::NotFinite => 310,
        Unavailable::NoSide => 315,
        Unavailable::NoPose => 317,
        Unavailable::Query(QueryError::Uncovered { .. }) => 206,
        other => panic!("{other:?}"),
    }
}

pub fn side(side: Side) -> u32 {
    match side {
        Side::Outside => 0,
        Side::Inside => 1,
        Side::Crossing => 2,
        Side::Either => 10,
        Side::Undefined(NoSide::NotAsked) => 3,
        Side::Undefined(NoSide::BelowAccuracy) => 6,
        other => panic!("{other:?}"),
    }
}
