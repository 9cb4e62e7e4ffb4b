//! Motions to try: the nearest one that the rows allow, shortened to the smallest that they allow, then to rest.

use super::nearest::{Vector, add};

pub(super) struct Proposal {
    /// The smallest motion that the rows allow.
    pub least: Vector,
    /// The motion nearest to the command.
    pub whole: Vector,
    /// Whether it is the command.
    pub is_command: bool,
}

/// How far a proposal is shortened: first the path from the smallest motion to the whole one is halved, to a sixteenth
/// and then to nothing, then the smallest motion to a sixteenth.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Extent(u8);

impl Proposal {
    pub fn at(&self, extent: Extent) -> Vector {
        if extent == Extent::WHOLE {
            return self.whole;
        }
        let mut step = self.whole;
        add(&mut step, &self.least, -1.0);
        let mut point = self.least.map(|part| part * extent.scale());
        add(&mut point, &step, extent.fraction());
        point
    }
}

impl Extent {
    pub const WHOLE: Self = Self(0);

    /// The smallest motion, without the path to the whole one.
    pub const SMALLEST: Self = Self(5);

    /// The shortest.
    pub const LAST: Self = Self(9);

    /// The next shorter one, or the shortest.
    pub fn shorter(self) -> Self {
        self.shortened_by(1)
    }

    /// The one in the middle of this one and one that is shorter by at least two; `None` if there is none between.
    pub fn middle(self, shorter: Self) -> Option<Self> {
        let by = shorter.0.saturating_sub(self.0) / 2;
        (by > 0).then(|| self.shortened_by(by))
    }

    fn shortened_by(self, by: u8) -> Self {
        Self(self.0.saturating_add(by)).min(Self::LAST)
    }

    /// The fraction of the path from the smallest motion to the whole one.
    fn fraction(self) -> f32 {
        if self < Self::SMALLEST { halved(self.0) } else { 0.0 }
    }

    /// The fraction of the smallest motion.
    fn scale(self) -> f32 {
        halved(self.0.saturating_sub(Self::SMALLEST.0))
    }
}

/// 1 halved this often.
fn halved(times: u8) -> f32 {
    1.0 / f32::from(1_u8 << (times & 7))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First the path to the command, then the retreat, each to a sixteenth.
    #[test]
    fn a_proposal_is_shortened_to_a_small_part_of_its_smallest_motion() {
        let (mut least, mut whole) = ([0.0; 6], [0.0; 6]);
        (least[1], whole[0]) = (1.0, 4.0);
        let proposal = Proposal { least, whole, is_command: false };
        let at =
            |number| proposal.at((0..number).fold(Extent::WHOLE, |extent, _| extent.shorter()));
        assert_eq!(at(0), whole);
        assert_eq!((at(1)[0], at(1)[1]), (2.0, 0.5));
        assert_eq!(at(5), least);
        assert_eq!((at(9)[0], at(9)[1]), (0.0, 1.0 / 16.0));
        assert_eq!(at(10), at(9));
    }

    /// So that a search by halves comes to its end.
    #[test]
    fn a_middle_is_between_two_extents_that_are_not_neighbours() {
        for (longer, shorter) in (0..=9).flat_map(|one| (0..=9).map(move |other| (one, other))) {
            let middle = Extent(longer).middle(Extent(shorter));
            assert_eq!(middle.is_some(), longer + 1 < shorter, "{longer} {shorter}");
            assert!(middle.is_none_or(|Extent(middle)| longer < middle && middle < shorter));
        }
    }
}
