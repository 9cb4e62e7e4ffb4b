//! Motions to try: the nearest one that the rows allow, shortened to the smallest that they allow, then to rest.

use super::nearest::{Vector, add};

/// Least fractions.
const LEAST: f32 = 1.0 / 16.0;

pub(super) struct Proposal {
    /// The smallest motion that the rows allow.
    pub least: Vector,
    /// The motion nearest to the command.
    pub whole: Vector,
    /// Whether it is the command.
    pub is_command: bool,
}

/// How far a proposal is shortened.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Extent {
    /// The fraction of the path from the smallest motion to the whole one.
    pub fraction: f32,
    /// The fraction of the smallest motion.
    scale: f32,
}

impl Proposal {
    pub fn at(&self, extent: Extent) -> Vector {
        if extent == Extent::WHOLE {
            return self.whole;
        }
        let mut step = self.whole;
        add(&mut step, &self.least, -1.0);
        let mut point = self.least.map(|part| part * extent.scale);
        add(&mut point, &step, extent.fraction);
        point
    }
}

impl Extent {
    pub const WHOLE: Self = Self { fraction: 1.0, scale: 1.0 };

    /// Number of extents shorter than the whole.
    pub const SHORTER: u32 = 9;

    /// The next shorter one.
    pub fn shorter(self) -> Option<Self> {
        let Self { fraction, scale } = self;
        if fraction > LEAST {
            Some(Self { fraction: fraction * 0.5, scale })
        } else if fraction > 0.0 {
            Some(self.to_smallest())
        } else if scale > LEAST {
            Some(Self { fraction, scale: scale * 0.5 })
        } else {
            None
        }
    }

    /// Without the path to the whole motion.
    pub fn to_smallest(self) -> Self {
        Self { fraction: 0.0, ..self }
    }
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
        let extents = || core::iter::successors(Some(Extent::WHOLE), |extent| extent.shorter());
        assert_eq!(extents().count() as u32, 1 + Extent::SHORTER);
        let at = |number| proposal.at(extents().nth(number).expect("an extent"));
        assert_eq!(at(0), whole);
        assert_eq!((at(1)[0], at(1)[1]), (2.0, 0.5));
        assert_eq!(at(5), least);
        assert_eq!((at(9)[0], at(9)[1]), (0.0, 1.0 / 16.0));
    }
}
