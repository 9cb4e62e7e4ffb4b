//! Selects the triangles near a tool that are closer than their surroundings.
//!
//! The distance from the tool is a height over the surface, and each valley of it is a contact. A watershed fills the
//! valleys from the lowest triangle on and merges two that only a low ridge parts: a flat wall along a capsule is one
//! valley, however many triangles are equally far.

use crate::{Index, Tree};

/// A triangle, and the square of its distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub square: f32,
    pub row: u32,
}

/// No entry.
const NONE: u16 = u16::MAX;

/// The nearest triangles, at most `N`; then their valleys.
#[derive(Clone, Debug)]
pub(super) struct Basins<const N: usize> {
    near: [Near; N],
    /// For each entry one that is not higher: a chain that ends at the lowest of its valley.
    lower: [u16; N],
    /// Hash table of the flooded entries: the first for each remainder of rows by `N`, and the next with the same one.
    heads: [u16; N],
    next: [u16; N],
    is_contact: [bool; N],
    count: usize,
}

impl<const N: usize> Basins<N> {
    pub const fn new() -> Self {
        Self {
            near: [Near { square: 0.0, row: 0 }; N],
            lower: [NONE; N],
            heads: [NONE; N],
            next: [NONE; N],
            is_contact: [false; N],
            count: 0,
        }
    }

    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Keeps a triangle, and drops the farthest if there is no room. Returns the largest square kept, once full.
    pub fn push(&mut self, near: Near) -> Option<f32> {
        if let Some(place) = self.near.get_mut(self.count) {
            *place = near;
            self.count += 1;
            self.rise(self.count - 1);
            return None;
        }
        let farthest = self.near.first_mut()?;
        if near.square < farthest.square {
            *farthest = near;
            self.sink(self.count);
        }
        self.near.first().map(|farthest| farthest.square)
    }

    /// Finds the valleys: ridges of at most `ridge` above the higher valley do not count. Calls back with the lowest
    /// triangle of each, nearest first.
    pub fn each_valley<I: Index>(
        &mut self,
        tree: &Tree<'_, I>,
        ridge: f32,
        mut visit: impl FnMut(Near),
    ) {
        self.sort();
        self.heads.fill(NONE);
        for entry in 0..self.count {
            self.flood(tree, entry, ridge);
        }
        for entry in 0..self.count {
            let is_lowest = self.lower.get(entry).is_some_and(|&lower| usize::from(lower) == entry);
            let was_cut_off = self.is_contact.get(entry).is_some_and(|&is| is);
            if let Some(&near) = self.near.get(entry).filter(|_| is_lowest || was_cut_off) {
                visit(near);
            }
        }
    }

    /// Joins an entry with the valleys next to it, all of them lower.
    fn flood<I: Index>(&mut self, tree: &Tree<'_, I>, entry: usize, ridge: f32) {
        let Some(&Near { square, row }) = self.near.get(entry) else { return };
        let height = crate::math::sqrt::sqrt(square);
        let mut valleys = [NONE; 3];
        let mut lowest = entry as u16;
        for (valley, edge) in valleys.iter_mut().zip(0..) {
            if let Some(known) = tree.across(row, edge).and_then(|(across, _)| self.find(across)) {
                *valley = self.bottom(known);
                if *valley < lowest {
                    lowest = *valley;
                }
            }
        }
        for valley in valleys.into_iter().filter(|&valley| valley != NONE && valley != lowest) {
            let bottom = self.near.get(usize::from(valley)).map_or(0.0, |near| near.square);
            if height - crate::math::sqrt::sqrt(bottom) > ridge
                && let Some(is_contact) = self.is_contact.get_mut(usize::from(valley))
            {
                *is_contact = true;
            }
            self.set_lower(valley, lowest);
        }
        self.set_lower(entry as u16, lowest);
        if let Some(is_contact) = self.is_contact.get_mut(entry) {
            *is_contact = false;
        }
        let bucket = (row as usize).checked_rem(N).unwrap_or_default();
        if let (Some(head), Some(next)) = (self.heads.get_mut(bucket), self.next.get_mut(entry)) {
            *next = *head;
            *head = entry as u16;
        }
    }

    fn set_lower(&mut self, entry: u16, lower: u16) {
        if let Some(place) = self.lower.get_mut(usize::from(entry)) {
            *place = lower;
        }
    }

    /// The entry of a triangle, if it was flooded.
    fn find(&self, row: u32) -> Option<u16> {
        let bucket = (row as usize).checked_rem(N)?;
        let mut entry = *self.heads.get(bucket)?;
        for _ in 0..N {
            let near = self.near.get(usize::from(entry))?;
            if near.row == row {
                return Some(entry);
            }
            entry = *self.next.get(usize::from(entry))?;
        }
        None
    }

    /// The lowest entry of an entry's valley. Halves the chain to it on the way.
    fn bottom(&mut self, mut entry: u16) -> u16 {
        for _ in 0..N {
            let Some(&lower) = self.lower.get(usize::from(entry)) else { return entry };
            let lowest = self.lower.get(usize::from(lower)).copied().unwrap_or(lower);
            if lower == entry {
                return entry;
            }
            self.set_lower(entry, lowest);
            entry = lowest;
        }
        entry
    }

    /// Nearest first; of equally near ones, the lower row.
    fn sort(&mut self) {
        let mut end = self.count;
        while let Some(last) = end.checked_sub(1) {
            self.swap(0, last);
            end = last;
            self.sink(end);
        }
    }

    fn is_farther(&self, one: usize, other: usize) -> bool {
        match (self.near.get(one), self.near.get(other)) {
            (Some(a), Some(b)) => a.square > b.square || (a.square == b.square && a.row > b.row),
            _ => false,
        }
    }

    fn swap(&mut self, one: usize, other: usize) {
        if let (Some(&a), Some(&b)) = (self.near.get(one), self.near.get(other)) {
            if let Some(place) = self.near.get_mut(one) {
                *place = b;
            }
            if let Some(place) = self.near.get_mut(other) {
                *place = a;
            }
        }
    }

    fn rise(&mut self, mut entry: usize) {
        while entry > 0 && self.is_farther(entry, (entry - 1) / 2) {
            self.swap(entry, (entry - 1) / 2);
            entry = (entry - 1) / 2;
        }
    }

    /// Restores the heap of `end` entries after a change of the first.
    fn sink(&mut self, end: usize) {
        let mut entry = 0;
        loop {
            let left = 2 * entry + 1;
            let right = left + 1;
            let child = if right < end && self.is_farther(right, left) { right } else { left };
            if child >= end || !self.is_farther(child, entry) {
                return;
            }
            self.swap(entry, child);
            entry = child;
        }
    }
}
