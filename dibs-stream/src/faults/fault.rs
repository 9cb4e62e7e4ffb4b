//! The kinds of faults.

/// Faults of a line, a sender or an attacker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Fault {
    /// One bit is flipped.
    FlipOne,
    /// Two bits are flipped.
    FlipTwo,
    /// A run of up to 64 bits is overwritten.
    Burst,
    /// The packet is lost.
    Drop,
    /// The packet arrives twice.
    Duplicate,
    /// The packet arrives after up to four of its successors.
    Reorder,
    /// The end of the packet is missing.
    Truncate,
    /// Bytes in the middle are missing; on a stream possibly also the delimiter between two packets.
    Overrun,
    /// The packet has an earlier epoch. Sealed.
    StaleEpoch,
    /// One packet or all packets of an earlier frame are sent again, unchanged.
    Replay,
    /// The packet has another mesh id. Sealed.
    WrongMesh,
    /// Vertices beyond the surface. Sealed.
    OutOfRange,
    /// A position, or the quantisation box, is infinite or not a number. Sealed.
    NotFinite,
    /// A position, or the quantisation box, is farther out than any surface. Sealed.
    TooFar,
    /// A vertex is far from its neighbours, and the frame's digest confirms it. Sealed.
    Stretch,
    /// The pose is no rotation, is too far, or is another than the commit confirms. Sealed. Only for packets with a pose.
    Pose,
    /// The tag or a byte that it covers is changed. Sealed. Only for packets with tags.
    Forgery,
    /// The sender restarts in the middle of a frame.
    SenderRestart,
    /// The receiver restarts in the middle of a frame.
    ReceiverRestart,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 19] = [
        Self::FlipOne,
        Self::FlipTwo,
        Self::Burst,
        Self::Drop,
        Self::Duplicate,
        Self::Reorder,
        Self::Truncate,
        Self::Overrun,
        Self::StaleEpoch,
        Self::Replay,
        Self::WrongMesh,
        Self::OutOfRange,
        Self::NotFinite,
        Self::TooFar,
        Self::Stretch,
        Self::Pose,
        Self::Forgery,
        Self::SenderRestart,
        Self::ReceiverRestart,
    ];

    /// A short name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FlipOne => "bit flip (1)",
            Self::FlipTwo => "bit flip (2)",
            Self::Burst => "burst",
            Self::Drop => "drop",
            Self::Duplicate => "duplicate",
            Self::Reorder => "reorder",
            Self::Truncate => "truncate",
            Self::Overrun => "overrun",
            Self::StaleEpoch => "stale epoch",
            Self::Replay => "replay",
            Self::WrongMesh => "wrong mesh id",
            Self::OutOfRange => "index out of range",
            Self::NotFinite => "NaN or infinity",
            Self::TooFar => "out of box",
            Self::Stretch => "stretch violation",
            Self::Pose => "altered pose",
            Self::Forgery => "forged MAC",
            Self::SenderRestart => "sender restart",
            Self::ReceiverRestart => "receiver restart",
        }
    }

    /// Whether the fault damages bytes, as a line may do even to a packet's framing:
    /// [`Injector::damage`](super::Injector::damage).
    #[must_use]
    pub const fn is_damage(self) -> bool {
        matches!(self, Self::FlipOne | Self::FlipTwo | Self::Burst | Self::Truncate | Self::Overrun)
    }

    /// Whether the fault is the restart of a program, which an injector cannot cause.
    #[must_use]
    pub const fn is_restart(self) -> bool {
        matches!(self, Self::SenderRestart | Self::ReceiverRestart)
    }
}
