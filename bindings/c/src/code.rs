//! Error codes, each with its text.

use core::ffi::{CStr, c_char};

/// The outcome of a call. Numbers stay the same in all versions; those from 1 to 99 are misuses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_code {
    /// No error.
    Ok = 0,
    /// A pointer is null.
    Null = 1,
    /// A pointer is not aligned for its type.
    Misaligned = 2,
    /// The storage has fewer bytes than the object's `_SIZE`.
    StorageSize = 3,
    /// The storage is not aligned to `DIBS_ALIGNMENT`.
    StorageAlignment = 4,
    /// No object of this kind was made in that storage.
    NotInitialised = 5,
    /// Another call that has not returned uses the object.
    InUse = 6,
    /// This end of the surface's buffers was taken before: there is one receiver and one reader.
    Taken = 7,
    /// A frame is held already: release it first.
    Held = 8,
    /// The objects are of different trees, or of different numbers of vertices.
    OtherTree = 9,
    /// A number that is not allowed: flags, counts, states.
    Argument = 10,
    /// The caller's buffer is too small for the result.
    Capacity = 11,
    /// The library is of another version than the header.
    Version = 12,
    /// The tree has fewer bytes than its header states.
    TreeLength = 100,
    /// The bytes are not a tree.
    TreeMagic = 101,
    /// The tree is of another format version: build it again.
    TreeVersion = 102,
    /// The tree's indices have another width than the library's: 16 bits, or 32 with the feature `large`.
    TreeWidth = 103,
    /// The tree's bytes changed since they were written.
    TreeChecksum = 104,
    /// The tree is not well formed: no builder writes such bytes.
    TreeForm = 105,
    /// The tree's bytes changed since they were validated.
    TreeCorrupt = 106,
    /// The tree was built without the section that stretch is measured with.
    TreeNoMetric = 107,
    /// The tree was built without adjacency: sides and contacts need it.
    TreeNoAdjacency = 108,
    /// The tree was built without its rest shape, or has no such row.
    TreeNoRestShape = 109,
    /// The tree was built without displacement modes, or without the rest shape that they displace.
    TreeNoModes = 110,
    /// A coordinate of the tool is not finite or too large.
    ToolCoordinate = 200,
    /// The tool's radius is negative, not finite or too large.
    ToolRadius = 201,
    /// The surface's number of vertices is not the tree's.
    VertexCount = 202,
    /// The position of a vertex is not finite or too large.
    Position = 203,
    /// The stretch was measured with another tree.
    StretchOfOtherTree = 204,
    /// The stretch was measured on another frame.
    StretchOfOtherFrame = 205,
    /// The surface is stretched beyond the limit given to the query.
    Uncovered = 206,
    /// The margin is negative, not finite, or larger than that of the contacts.
    Margin = 207,
    /// The query failed for another cause.
    QueryFailed = 208,
    /// No surface was published, or not for long enough since the start, or the frame is empty.
    NoSurface = 300,
    /// The surface is older than allowed.
    Stale = 301,
    /// No good packet came for longer than allowed.
    LinkLost = 302,
    /// No heartbeat came for longer than allowed.
    HeartbeatLost = 303,
    /// More frames were refused or abandoned than allowed.
    Rejections = 304,
    /// The transit of the surface was longer than allowed.
    Delayed = 305,
    /// The surface was older than allowed when it was sent.
    SourceStale = 306,
    /// More packets were forged than allowed.
    Forgeries = 307,
    /// The tool's axis touches the surface: no direction leads out.
    NoDirection = 308,
    /// The budget ended before the side or the contacts were known.
    CutShort = 309,
    /// A number is not finite.
    NotFinite = 310,
    /// A triangle is stretched beyond its limit.
    StretchExceeded = 311,
    /// A region of the surface has shrunk below its limit.
    Shrunk = 312,
    /// A vertex moved farther than the limits on speed and recovery allow.
    TooFast = 313,
    /// There is no surface, for another cause.
    Unavailable = 314,
    /// The tool's side is not known, so it may be inside.
    NoSide = 315,
    /// A closed surface is mirrored or inside out.
    InsideOut = 316,
    /// The tool has no pose at this tick.
    NoPose = 317,
    /// The surface was good for long enough, and the safe state waits for its acknowledgement.
    Unacknowledged = 318,
    /// The packet's checksum does not match, or it is too short for one.
    PacketDamaged = 400,
    /// The packet is of another version of the protocol.
    PacketVersion = 401,
    /// The packet's checksum is right, but its form is not.
    PacketForm = 402,
    /// The packet is of another mesh.
    PacketMesh = 403,
    /// The packet's tag is missing or not authentic.
    PacketForged = 404,
    /// The packet's frame is not later than the published one.
    PacketStale = 405,
    /// The packet's frame is not being received.
    PacketUnexpected = 406,
    /// The previous frame is still being checked.
    PacketBusy = 407,
    /// The partial frame is not based on the published frame.
    PacketBase = 408,
    /// Rows came before the published frame was copied up to them.
    PacketNotReady = 409,
    /// The frame's rows are not those of this surface.
    PacketRows = 410,
    /// The frame's content or encoding is not accepted here.
    PacketEncoding = 411,
    /// The packet's position in the frame does not fit the others, or leaves too many gaps.
    PacketOrder = 412,
    /// A coordinate in the packet is not finite.
    PacketNotFinite = 413,
    /// A coordinate in the packet is beyond the reach.
    PacketTooFar = 414,
    /// The packets are not all of one frame.
    PacketDigest = 415,
    /// Bytes between two zeros of the stream are not a packet.
    Framing = 416,
    /// The packet was refused for another cause.
    PacketRefused = 417,
    /// The surface was captured before the published one.
    PacketEarlier = 418,
    /// The surface's age was 65,535 ms or more when it was sent, or its capture is in the future.
    PacketTooOld = 419,
    /// A hello came too soon after another one to be answered at once.
    PacketThrottled = 420,
    /// A stiffness, damping, largest force or margin is out of range.
    Gain = 500,
    /// A safe limit is below the degraded one.
    LimitOrder = 501,
    /// A limit is 2^31 or more, or the age has no limit.
    LimitTooLong = 502,
    /// The tissue's speed is negative or not finite.
    LimitSpeed = 503,
    /// The number of frames that recover is 0.
    LimitRecovery = 504,
    /// The acknowledgement came before the machine waited for it.
    Acknowledge = 505,
    /// A limit is so high that its input can never exceed it.
    LimitUntrippable = 506,
    /// A stand-off, speed, lever arm, approach, period or uncertainty of a filter is out of range, or no triangle has a
    /// label that it names.
    Filter = 507,
    /// A sender's target is invalid, or cannot be opened.
    SenderTarget = 600,
    /// The positions are not a frame of the sender's surface, or cannot be sent.
    SenderFrame = 601,
    /// The sender's connection broke.
    SenderLine = 602,
    /// Another sender has taken over the receiver.
    SenderSuperseded = 603,
    /// The receiver has another surface than the sender.
    SenderOtherSurface = 604,
    /// The sender has a key, but the receiver has not answered with its challenge yet.
    SenderNoChallenge = 605,
}

impl dibs_code {
    /// The code of a fallible function.
    pub fn of(call: impl FnOnce() -> Result<(), Self>) -> Self {
        match call() {
            Ok(()) => Self::Ok,
            Err(code) => code,
        }
    }

    /// The code as an error; `DIBS_CODE_OK` as success.
    pub fn done(self) -> Result<(), Self> {
        if self == Self::Ok { Ok(()) } else { Err(self) }
    }

    /// Every code.
    const ALL: &'static [Self] = &[
        Self::Ok,
        Self::Null,
        Self::Misaligned,
        Self::StorageSize,
        Self::StorageAlignment,
        Self::NotInitialised,
        Self::InUse,
        Self::Taken,
        Self::Held,
        Self::OtherTree,
        Self::Argument,
        Self::Capacity,
        Self::Version,
        Self::TreeLength,
        Self::TreeMagic,
        Self::TreeVersion,
        Self::TreeWidth,
        Self::TreeChecksum,
        Self::TreeForm,
        Self::TreeCorrupt,
        Self::TreeNoMetric,
        Self::TreeNoAdjacency,
        Self::TreeNoRestShape,
        Self::TreeNoModes,
        Self::ToolCoordinate,
        Self::ToolRadius,
        Self::VertexCount,
        Self::Position,
        Self::StretchOfOtherTree,
        Self::StretchOfOtherFrame,
        Self::Uncovered,
        Self::Margin,
        Self::QueryFailed,
        Self::NoSurface,
        Self::Stale,
        Self::LinkLost,
        Self::HeartbeatLost,
        Self::Rejections,
        Self::Delayed,
        Self::SourceStale,
        Self::Forgeries,
        Self::NoDirection,
        Self::CutShort,
        Self::NotFinite,
        Self::StretchExceeded,
        Self::Shrunk,
        Self::TooFast,
        Self::Unavailable,
        Self::NoSide,
        Self::InsideOut,
        Self::NoPose,
        Self::Unacknowledged,
        Self::PacketDamaged,
        Self::PacketVersion,
        Self::PacketForm,
        Self::PacketMesh,
        Self::PacketForged,
        Self::PacketStale,
        Self::PacketUnexpected,
        Self::PacketBusy,
        Self::PacketBase,
        Self::PacketNotReady,
        Self::PacketRows,
        Self::PacketEncoding,
        Self::PacketOrder,
        Self::PacketNotFinite,
        Self::PacketTooFar,
        Self::PacketDigest,
        Self::Framing,
        Self::PacketRefused,
        Self::PacketEarlier,
        Self::PacketTooOld,
        Self::PacketThrottled,
        Self::Gain,
        Self::LimitOrder,
        Self::LimitTooLong,
        Self::LimitSpeed,
        Self::LimitRecovery,
        Self::Acknowledge,
        Self::LimitUntrippable,
        Self::Filter,
        Self::SenderTarget,
        Self::SenderFrame,
        Self::SenderLine,
        Self::SenderSuperseded,
        Self::SenderOtherSurface,
        Self::SenderNoChallenge,
    ];

    /// The code that a number from C stands for.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.iter().copied().find(|code| *code as u32 == number)
    }

    const fn text(self) -> &'static CStr {
        match self {
            Self::Ok => c"no error",
            Self::Null => c"a pointer is null",
            Self::Misaligned => c"a pointer is not aligned for its type",
            Self::StorageSize => c"the storage is too small for the object",
            Self::StorageAlignment => c"the storage is not aligned to DIBS_ALIGNMENT",
            Self::NotInitialised => c"no object of this kind was made in that storage",
            Self::InUse => c"another call uses the object",
            Self::Taken => c"this end of the surface was taken before",
            Self::Held => c"a frame is held already",
            Self::OtherTree => c"the objects are not of one tree",
            Self::Argument => c"an argument is not one of the values allowed",
            Self::Capacity => c"the buffer is too small for the result",
            Self::Version => c"the library is of another version than the header",
            Self::TreeLength => c"the tree's bytes are cut short",
            Self::TreeMagic => c"the bytes are no tree",
            Self::TreeVersion => c"the tree is of another format version",
            Self::TreeWidth => c"the tree's indices have another width than the library's",
            Self::TreeChecksum => c"the tree's checksum does not match",
            Self::TreeForm => c"the tree is not well formed",
            Self::TreeCorrupt => c"the tree's bytes changed since they were validated",
            Self::TreeNoMetric => c"the tree has no rest metric",
            Self::TreeNoAdjacency => c"the tree has no sides: its triangles are wound against each other (dibs build --orient), or it was built without adjacency",
            Self::TreeNoRestShape => c"the tree has no such rest position",
            Self::TreeNoModes => c"the tree has no displacement modes",
            Self::ToolCoordinate => c"a coordinate of the tool is not finite or too large",
            Self::ToolRadius => c"the tool's radius is negative, not finite or too large",
            Self::VertexCount => c"the surface has another number of vertices than the tree",
            Self::Position => c"the position of a vertex is not finite or too large",
            Self::StretchOfOtherTree => c"the stretch was measured with another tree",
            Self::StretchOfOtherFrame => c"the stretch was measured on another frame",
            Self::Uncovered => c"the surface is stretched beyond what the query was told",
            Self::Margin => c"the margin is negative, not finite or larger than asked for",
            Self::QueryFailed => c"the query failed",
            Self::NoSurface => c"there is no surface, or not for long enough yet",
            Self::Stale => c"the surface is older than allowed",
            Self::LinkLost => c"no good packet came for longer than allowed",
            Self::HeartbeatLost => c"no heartbeat came for longer than allowed",
            Self::Rejections => c"more frames were refused or abandoned than allowed",
            Self::Delayed => c"the surface was longer in transit than allowed",
            Self::SourceStale => c"the surface was older than allowed when it was sent",
            Self::Forgeries => c"more packets were forged than allowed",
            Self::NoDirection => c"the tool's axis touches the surface",
            Self::CutShort => c"the budget ended before the side or the contacts were known",
            Self::NotFinite => c"a number is not finite",
            Self::StretchExceeded => c"a triangle or tetrahedron is stretched beyond its limit",
            Self::Shrunk => c"a region of the surface has shrunk below its limit",
            Self::TooFast => c"a vertex moved farther than its limit",
            Self::Unavailable => c"the surface is not available",
            Self::NoSide => c"the tool's side is not known",
            Self::InsideOut => c"the surface or a tetrahedron is mirrored or inside out",
            Self::NoPose => c"the tool has no pose",
            Self::Unacknowledged => c"the safe state was not acknowledged",
            Self::PacketDamaged => c"the packet is damaged",
            Self::PacketVersion => c"the packet is of another protocol version",
            Self::PacketForm => c"the packet is malformed",
            Self::PacketMesh => c"the packet is of another mesh",
            Self::PacketForged => c"the packet has no genuine tag",
            Self::PacketStale => c"the packet's frame is not later than the published one",
            Self::PacketUnexpected => c"the packet's frame is not being received",
            Self::PacketBusy => c"the frame before is still being checked",
            Self::PacketBase => c"the frame changes another one than that published",
            Self::PacketNotReady => c"rows came before the published frame was copied that far",
            Self::PacketRows => c"the frame's rows are not those of this surface",
            Self::PacketEncoding => c"the frame's content or encoding is not accepted",
            Self::PacketOrder => c"the packet's place does not fit the others",
            Self::PacketNotFinite => c"a coordinate in the packet is not finite",
            Self::PacketTooFar => c"a coordinate in the packet is beyond the reach",
            Self::PacketDigest => c"the packets are not all of one frame",
            Self::Framing => c"bytes of the stream are no packet",
            Self::PacketRefused => c"the packet was refused",
            Self::PacketEarlier => c"the surface was captured before the published one",
            Self::PacketTooOld => c"the surface was too old when it was sent to say how old",
            Self::PacketThrottled => c"a hello came too soon after the one before",
            Self::Gain => c"a gain of the constraint is out of range",
            Self::LimitOrder => c"a safe limit is below the degraded one",
            Self::LimitTooLong => c"a limit is 2^31 or more",
            Self::LimitSpeed => c"the tissue's speed is negative or not finite",
            Self::LimitRecovery => c"recovery needs at least one frame",
            Self::Acknowledge => c"the acknowledgement came too early",
            Self::LimitUntrippable => c"a limit can never be exceeded",
            Self::Filter => c"a number of the filter is out of range",
            Self::SenderTarget => c"the sender's target is none, or cannot be opened",
            Self::SenderFrame => c"the positions are no frame of the sender's surface",
            Self::SenderLine => c"the sender's connection broke",
            Self::SenderSuperseded => c"another sender has taken over the receiver",
            Self::SenderOtherSurface => c"the receiver has another surface than the sender",
            Self::SenderNoChallenge => c"the receiver has not answered with its challenge yet",
        }
    }
}

/// One sentence about a code, in English, without a full stop.
///
/// Never null, even for a number that is not a code. The text is static.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_code_text(code: u32) -> *const c_char {
    dibs_code::from_number(code).map_or(c"no code of this library", dibs_code::text).as_ptr()
}
