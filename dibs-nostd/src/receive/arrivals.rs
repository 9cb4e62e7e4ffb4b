//! The packets of a frame that have arrived, as ranges instead of one mark per packet.

// Requirement: B-01

use core::ops::Range;

/// Contiguous ranges of sequence numbers besides the first: the most gaps that a frame can have at once.
pub(super) const GAPS: usize = 7;

/// Packets of consecutive sequence numbers, and their rows.
#[derive(Clone, Copy, Debug)]
struct Contig {
    /// Sequence numbers, `from..to`; empty where the slot is free.
    from: u16,
    to: u16,
    first: u32,
    end: u32,
}

impl Contig {
    const FREE: Self = Self { from: 0, to: 0, first: 0, end: 0 };
}

/// A frame's packets so far, as contiguous ranges.
///
/// # Why this proves completeness
///
/// Rows are in the order of the sequence. Each range holds consecutive sequence numbers. When a packet joins a range,
/// its rows are compared with its neighbours': in an exact frame they must follow without a gap, in any frame without
/// an overlap. So once the first range, which begins at sequence 1 and row 0, reaches the commit and the last row,
/// every row was in exactly one packet, whatever the sender states.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arrivals {
    /// From the frame's first packet on.
    prefix: Contig,
    /// The other ranges, unordered. No vector: a range keeps its slot while others come and go.
    others: [Contig; GAPS],
    /// Number of other ranges in use.
    used: u8,
    /// Rows must follow each other without a gap.
    is_exact: bool,
}

/// Why a packet cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PlacementError {
    /// It arrived before.
    Duplicate,
    /// Its rows do not fit between those of the packets before and after it.
    Order,
    /// There are [`GAPS`] gaps already.
    Gaps,
}

/// The position of a packet among the ranges.
#[derive(Clone, Copy, Debug)]
pub(super) struct PacketPosition {
    sequence: u16,
    rows: Range32,
    /// Slots of the ranges that end before it and begin after it.
    before: Option<usize>,
    after: Option<usize>,
    free: usize,
}

/// A range of rows that is `Copy`.
#[derive(Clone, Copy, Debug)]
struct Range32 {
    first: u32,
    end: u32,
}

/// The first range's slot: after the others'.
const PREFIX: usize = GAPS;

impl Arrivals {
    /// No packets yet. An exact frame needs every row.
    pub const fn new(is_exact: bool) -> Self {
        let prefix = Contig { from: 1, to: 1, first: 0, end: 0 };
        Self { prefix, others: [Contig::FREE; GAPS], used: 0, is_exact }
    }

    /// The next sequence number of the first range.
    pub const fn next(&self) -> u16 {
        self.prefix.to
    }

    /// Rows below this one are final: those of the first range, and the rows between them that a partial frame leaves
    /// out.
    pub const fn ready(&self) -> u32 {
        self.prefix.end
    }

    /// Whether a packet with this sequence number or a later one has arrived.
    pub fn reaches(&self, sequence: u16) -> bool {
        self.prefix.to > sequence || self.others.iter().any(|range| range.to > sequence)
    }

    /// The position of a packet. O(1) in order, O([`GAPS`]) otherwise.
    #[inline]
    pub fn locate(
        &self,
        sequence: u16,
        rows: Range<u32>,
    ) -> Result<PacketPosition, PlacementError> {
        let rows = Range32 { first: rows.start, end: rows.end };
        let mut position = PacketPosition { sequence, rows, before: None, after: None, free: GAPS };
        self.meet(&self.prefix, PREFIX, &mut position)?;
        if self.used == 0 {
            position.free = 0;
            return Ok(position);
        }
        for (at, range) in self.others.iter().enumerate() {
            if range.from == range.to {
                position.free = at;
            } else {
                self.meet(range, at, &mut position)?;
            }
        }
        let is_alone = position.before.is_none() && position.after.is_none();
        if is_alone && position.free == GAPS { Err(PlacementError::Gaps) } else { Ok(position) }
    }

    /// Compares a packet with one range.
    #[inline]
    fn meet(
        &self,
        range: &Contig,
        at: usize,
        position: &mut PacketPosition,
    ) -> Result<(), PlacementError> {
        let PacketPosition { sequence, rows, .. } = *position;
        let fits = if range.to <= sequence {
            if range.to == sequence {
                position.before = Some(at);
            }
            if self.is_exact && range.to == sequence {
                range.end == rows.first
            } else {
                range.end <= rows.first
            }
        } else if sequence < range.from {
            let touches = sequence.checked_add(1) == Some(range.from);
            if touches {
                position.after = Some(at);
            }
            if self.is_exact && touches { rows.end == range.first } else { rows.end <= range.first }
        } else {
            return Err(PlacementError::Duplicate);
        };
        if fits { Ok(()) } else { Err(PlacementError::Order) }
    }

    /// Notes a packet at its position.
    #[inline]
    pub fn insert(&mut self, position: PacketPosition) {
        let PacketPosition { sequence, rows, before, after, free } = position;
        let to = sequence.saturating_add(1);
        match (before, after) {
            (None, None) => {
                if let Some(range) = self.others.get_mut(free) {
                    *range = Contig { from: sequence, to, first: rows.first, end: rows.end };
                    self.used = self.used.saturating_add(1);
                }
            }
            (Some(before), None) => {
                if let Some(range) = self.range_mut(before) {
                    (range.to, range.end) = (to, rows.end);
                }
            }
            (None, Some(after)) => {
                if let Some(range) = self.range_mut(after) {
                    (range.from, range.first) = (sequence, rows.first);
                }
            }
            (Some(before), Some(after)) => {
                // The first range begins before all others, so it is never the one after a packet.
                let Some(other) = self.others.get_mut(after) else { return };
                let Contig { to, end, .. } = core::mem::replace(other, Contig::FREE);
                self.used = self.used.saturating_sub(1);
                if let Some(range) = self.range_mut(before) {
                    (range.to, range.end) = (to, end);
                }
            }
        }
    }

    fn range_mut(&mut self, at: usize) -> Option<&mut Contig> {
        if at == PREFIX { Some(&mut self.prefix) } else { self.others.get_mut(at) }
    }
}
