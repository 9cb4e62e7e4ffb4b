//! The triangles that a tool's axis may meet.

/// Most of them. An axis through a vertex touches six or so.
const MOST: usize = 32;

/// Rows of the triangles that the axis may meet. A search leaves them, so that a depth need not look for them.
#[derive(Clone, Copy, Debug)]
pub(in crate::query) struct Touched {
    rows: [u32; MOST],
    /// Beyond [`MOST`], they are not known.
    count: usize,
}

impl Touched {
    pub const fn new() -> Self {
        Self { rows: [0; MOST], count: 0 }
    }

    /// Forgets all rows. If they are not looked for, they are not known.
    #[inline(always)]
    pub(super) fn reset(&mut self, is_known: bool) {
        self.count = if is_known { 0 } else { MOST + 1 };
    }

    #[inline(always)]
    pub(super) fn push(&mut self, row: u32) {
        if let Some(place) = self.rows.get_mut(self.count) {
            *place = row;
        }
        self.count = self.count.saturating_add(1);
    }

    /// The rows, if they are known.
    pub fn rows(&self) -> Option<&[u32]> {
        self.rows.get(..self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::{MOST, Touched};

    #[test]
    fn rows_are_known_unless_there_are_too_many() {
        let mut touched = Touched::new();
        touched.reset(true);
        for row in 0..MOST as u32 {
            touched.push(row);
        }
        assert!(touched.rows().is_some_and(|rows| rows.iter().copied().eq(0..MOST as u32)));
        touched.push(99);
        assert_eq!(touched.rows(), None);
        touched.reset(false);
        touched.push(1);
        assert_eq!(touched.rows(), None);
        touched.reset(true);
        assert_eq!(touched.rows(), Some(&[][..]));
    }
}
