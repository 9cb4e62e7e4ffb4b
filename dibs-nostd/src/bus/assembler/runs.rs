//! Which packets of a frame have come, without a mark for each.

use core::ops::Range;

/// Separate runs of sequence numbers that can be noted besides the first: so many places of a frame
/// can be missing at once.
pub(super) const GAPS: usize = 7;

/// The packets that have come: consecutive in sequence, and their rows.
#[derive(Clone, Copy, Debug)]
struct Run {
    /// Sequence numbers, `from..to`; empty where the place is free.
    from: u16,
    to: u16,
    /// Rows, `first..end`.
    first: u32,
    end: u32,
}

impl Run {
    const FREE: Self = Self { from: 0, to: 0, first: 0, end: 0 };
}

/// A frame's packets so far, as runs.
///
/// # Why this proves completeness
///
/// Rows are in the order of the sequence. Each run holds consecutive sequence numbers, and the rows of
/// a packet were compared with those of its neighbours in the run when it was joined to them: in an
/// exact frame they follow each other without a gap, in any frame without an overlap. So once the
/// first run, which begins at sequence 1 and row 0, reaches the commit, and its rows the last row, every
/// row was in exactly one packet; whatever a sender makes up, it cannot have skipped one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Runs {
    /// From the frame's first packet on.
    prefix: Run,
    /// The others, in no order.
    islands: [Run; GAPS],
    /// How many of these are in use.
    used: u8,
    /// Rows must follow each other without a gap.
    is_exact: bool,
}

/// Why a packet cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Misplaced {
    /// It came before.
    Duplicate,
    /// Its rows do not fit between those of the packets before and after it.
    Order,
    /// There is no room to note another gap.
    Gaps,
}

/// Where a packet belongs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    sequence: u16,
    rows: Range32,
    /// Places of the runs that end before it and begin after it.
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

/// Stands for the first run among the islands' places.
const PREFIX: usize = GAPS;

impl Runs {
    /// Nothing has come. In an exact frame every row comes.
    pub const fn new(is_exact: bool) -> Self {
        let prefix = Run { from: 1, to: 1, first: 0, end: 0 };
        Self { prefix, islands: [Run::FREE; GAPS], used: 0, is_exact }
    }

    /// The next sequence number of the first run.
    pub const fn next(&self) -> u16 {
        self.prefix.to
    }

    /// Rows below this one will not change any more: those of the first run, and what it left out.
    pub const fn ready(&self) -> u32 {
        self.prefix.end
    }

    /// Whether a packet with this sequence number or a later one has come.
    pub fn reaches(&self, sequence: u16) -> bool {
        self.prefix.to > sequence || self.islands.iter().any(|run| run.to > sequence)
    }

    /// Where a packet belongs, if it does. O(1) in order, O([`GAPS`]) otherwise.
    #[inline]
    pub fn locate(&self, sequence: u16, rows: Range<u32>) -> Result<Place, Misplaced> {
        let rows = Range32 { first: rows.start, end: rows.end };
        let mut place = Place { sequence, rows, before: None, after: None, free: GAPS };
        self.meet(&self.prefix, PREFIX, &mut place)?;
        if self.used == 0 {
            place.free = 0;
            return Ok(place);
        }
        for (at, run) in self.islands.iter().enumerate() {
            if run.from == run.to {
                place.free = at;
            } else {
                self.meet(run, at, &mut place)?;
            }
        }
        let is_alone = place.before.is_none() && place.after.is_none();
        if is_alone && place.free == GAPS { Err(Misplaced::Gaps) } else { Ok(place) }
    }

    /// Holds a packet against one run.
    #[inline]
    fn meet(&self, run: &Run, at: usize, place: &mut Place) -> Result<(), Misplaced> {
        let Place { sequence, rows, .. } = *place;
        let fits = if run.to <= sequence {
            if run.to == sequence {
                place.before = Some(at);
            }
            if self.is_exact && run.to == sequence {
                run.end == rows.first
            } else {
                run.end <= rows.first
            }
        } else if sequence < run.from {
            let touches = sequence.checked_add(1) == Some(run.from);
            if touches {
                place.after = Some(at);
            }
            if self.is_exact && touches { rows.end == run.first } else { rows.end <= run.first }
        } else {
            return Err(Misplaced::Duplicate);
        };
        if fits { Ok(()) } else { Err(Misplaced::Order) }
    }

    /// Notes a packet where it was found to belong.
    #[inline]
    pub fn insert(&mut self, place: Place) {
        let Place { sequence, rows, before, after, free } = place;
        let to = sequence.saturating_add(1);
        match (before, after) {
            (None, None) => {
                if let Some(run) = self.islands.get_mut(free) {
                    *run = Run { from: sequence, to, first: rows.first, end: rows.end };
                    self.used = self.used.saturating_add(1);
                }
            }
            (Some(before), None) => {
                if let Some(run) = self.run_mut(before) {
                    (run.to, run.end) = (to, rows.end);
                }
            }
            (None, Some(after)) => {
                if let Some(run) = self.run_mut(after) {
                    (run.from, run.first) = (sequence, rows.first);
                }
            }
            (Some(before), Some(after)) => {
                // The first run comes before all others, so what is joined to another is an island.
                let Some(island) = self.islands.get_mut(after) else { return };
                let Run { to, end, .. } = core::mem::replace(island, Run::FREE);
                self.used = self.used.saturating_sub(1);
                if let Some(run) = self.run_mut(before) {
                    (run.to, run.end) = (to, end);
                }
            }
        }
    }

    fn run_mut(&mut self, at: usize) -> Option<&mut Run> {
        if at == PREFIX { Some(&mut self.prefix) } else { self.islands.get_mut(at) }
    }
}
