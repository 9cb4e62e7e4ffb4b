//! The labels that a tree's triangles have.

// Requirement: A-12

/// A set of labels: one bit each. A tracker has it, so that a control tick can tell a label that no triangle has without a
/// test of every triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LabelSet([u64; 4]);

impl LabelSet {
    pub const fn of(mut labels: &[u8]) -> Self {
        let mut set = Self([0; 4]);
        while let [label, rest @ ..] = labels {
            set = set.with(*label);
            labels = rest;
        }
        set
    }

    const fn with(self, label: u8) -> Self {
        let Self([a, b, c, d]) = self;
        let bit = 1_u64.wrapping_shl(label as u32);
        Self(match label >> 6 {
            0 => [a | bit, b, c, d],
            1 => [a, b | bit, c, d],
            2 => [a, b, c | bit, d],
            _ => [a, b, c, d | bit],
        })
    }

    pub const fn contains(self, label: u8) -> bool {
        let Self([a, b, c, d]) = self;
        let word = match label >> 6 {
            0 => a,
            1 => b,
            2 => c,
            _ => d,
        };
        word.wrapping_shr(label as u32) & 1 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::LabelSet;

    #[test]
    fn it_has_the_labels_it_was_made_of_and_no_other() {
        let labels = [0, 1, 63, 64, 65, 127, 128, 200, 255];
        let set = LabelSet::of(&labels);
        for label in 0..=u8::MAX {
            assert_eq!(set.contains(label), labels.contains(&label), "{label}");
        }
        assert_eq!(LabelSet::of(&[]), LabelSet([0; 4]));
    }
}
