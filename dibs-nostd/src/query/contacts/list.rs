//! The contacts found so far, deepest first, and a bound on the missing ones.

// Requirement: S-05

use heapless::Vec;

use super::Contact;
use crate::math::order::{larger, smaller};

#[derive(Clone, Debug)]
pub(super) struct List<const N: usize> {
    pub list: Vec<Contact, N>,
    pub bound: f32,
    pub accuracy: f32,
    pub is_full: bool,
    /// The requested margin.
    pub margin: f32,
    /// Something deeper than the first contact may be missing.
    pub is_open: bool,
    /// The tool may be inside a surface whose closest pair has no side.
    pub has_no_side: bool,
}

impl<const N: usize> List<N> {
    pub const fn new() -> Self {
        Self {
            list: Vec::new(),
            bound: f32::NEG_INFINITY,
            accuracy: 0.0,
            is_full: false,
            margin: f32::NEG_INFINITY,
            is_open: true,
            has_no_side: false,
        }
    }

    /// Empties the list, as if no query had filled it.
    pub fn clear(&mut self) {
        self.list.clear();
        self.bound = f32::NEG_INFINITY;
        self.accuracy = 0.0;
        self.is_full = false;
        self.margin = f32::NEG_INFINITY;
        self.is_open = true;
        self.has_no_side = false;
    }

    /// Empties the list for the contacts within `margin`.
    pub fn begin(&mut self, margin: f32) {
        self.clear();
        (self.bound, self.margin, self.is_open) = (margin, margin, false);
    }

    /// Contacts beyond `bound` may be missing.
    pub fn lower_bound(&mut self, bound: f32) {
        if bound < self.bound {
            self.bound = bound;
        }
    }

    /// No contact has a separation below `least`.
    pub fn raise_bound(&mut self, least: f32) {
        let least = smaller(self.margin, least);
        if least > self.bound {
            self.bound = least;
        }
    }

    /// Inserts a contact in order, and drops the farthest if there is no room.
    pub fn insert(&mut self, contact: Contact) {
        if self.list.is_full() {
            self.is_full = true;
            let farthest = self.list.last().map_or(f32::NEG_INFINITY, |last| last.separation);
            let dropped = larger(farthest, contact.separation);
            self.lower_bound(dropped);
            if !(contact.separation < farthest) {
                return;
            }
            self.list.pop();
        }
        let before = self.list.iter().take_while(|other| !(other.separation > contact.separation));
        let at = before.count();
        let mut last = contact;
        for other in self.list.iter_mut().skip(at) {
            core::mem::swap(other, &mut last);
        }
        let _ = self.list.push(last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In whatever order they come.
    #[test]
    fn a_full_list_keeps_the_deepest_and_is_bounded_by_the_next() {
        for order in [[1.0, 2.0, 3.0, 4.0], [4.0, 3.0, 2.0, 1.0], [3.0, 1.0, 4.0, 2.0]] {
            let mut kept = List::<2>::new();
            kept.begin(9.0);
            for separation in order {
                kept.insert(Contact { separation, ..Contact::NONE });
            }
            let separations = kept.list.iter().map(|contact| contact.separation);
            assert!(separations.eq([1.0, 2.0]), "{order:?}: {:?}", kept.list);
            assert_eq!((kept.bound, kept.is_full), (3.0, true), "{order:?}");
        }
    }
}
