//! Selects the triangles near a tool that are closer than their surroundings.
//!
//! The distance from the tool is a height over the surface, and each valley of it is a contact. A watershed fills the
//! valleys from the lowest triangle on and merges two that only a low ridge parts: a flat wall along a capsule is one
//! valley, however many triangles are equally far.

use crate::math::sqrt::sqrt;
use crate::{Index, Tree};

/// A triangle, and the square of its distance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub square: f32,
    pub row: u32,
}

/// The same as a number that sorts by the distance, then by the row: bits of floats above zero sort as integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key(u64);

impl Key {
    fn of(near: Near) -> Self {
        Self(u64::from(near.square.to_bits()) << 32 | u64::from(near.row))
    }

    fn square(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }

    fn row(self) -> u32 {
        self.0 as u32
    }

    fn near(self) -> Near {
        Near { square: self.square(), row: self.row() }
    }
}

/// No entry.
const NONE: u16 = u16::MAX;

/// The nearest triangles, at most `N`; then their valleys.
#[derive(Clone, Debug)]
pub(super) struct Basins<const N: usize> {
    near: [Key; N],
    /// Whether they are a heap, the farthest first.
    is_heap: bool,
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
            near: [Key(0); N],
            is_heap: false,
            lower: [NONE; N],
            heads: [NONE; N],
            next: [NONE; N],
            is_contact: [false; N],
            count: 0,
        }
    }

    pub fn clear(&mut self) {
        (self.count, self.is_heap) = (0, false);
    }

    /// Keeps a triangle, and drops the farthest if there is no room. Returns the largest square kept, once full.
    pub fn push(&mut self, near: Near) -> Option<f32> {
        let key = Key::of(near);
        if let Some(place) = self.near.get_mut(self.count) {
            *place = key;
            self.count += 1;
            return None;
        }
        if !self.is_heap {
            self.is_heap = true;
            heap(&mut self.near);
        }
        if key < *self.near.first()? {
            sink(&mut self.near, 0, key);
        }
        self.near.first().map(|farthest| farthest.square())
    }

    /// Finds the valleys: ridges of at most `ridge` above the higher valley do not count. Calls back with the lowest
    /// triangle of each, nearest first.
    pub fn each_valley<I: Index>(
        &mut self,
        tree: &Tree<'_, I>,
        ridge: f32,
        mut visit: impl FnMut(Near),
    ) {
        sort(self.near.get_mut(..self.count).unwrap_or_default(), self.is_heap);
        self.is_heap = false;
        self.heads.fill(NONE);
        for entry in 0..self.count {
            self.flood(tree, entry, ridge);
        }
        for entry in 0..self.count {
            let is_lowest = self.lower.get(entry).is_some_and(|&lower| usize::from(lower) == entry);
            let was_cut_off = self.is_contact.get(entry).is_some_and(|&is| is);
            if let Some(key) = self.near.get(entry).filter(|_| is_lowest || was_cut_off) {
                visit(key.near());
            }
        }
    }

    /// Joins an entry with the valleys next to it, all of them lower.
    fn flood<I: Index>(&mut self, tree: &Tree<'_, I>, entry: usize, ridge: f32) {
        let Some(&key) = self.near.get(entry) else { return };
        let row = key.row();
        let mut valleys = [NONE; 3];
        let mut lowest = entry as u16;
        for (valley, edge) in valleys.iter_mut().zip(0..) {
            if let Some(known) = tree.row_across(row, edge).and_then(|across| self.find(across)) {
                *valley = self.bottom(known);
                if *valley < lowest {
                    lowest = *valley;
                }
            }
        }
        for valley in valleys.into_iter().filter(|&valley| valley != NONE && valley != lowest) {
            let bottom = self.near.get(usize::from(valley)).map_or(0.0, |key| key.square());
            if sqrt(key.square()) - sqrt(bottom) > ridge
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
            if near.row() == row {
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
}

/// Sorts the nearest to the front, through a heap.
fn sort(keys: &mut [Key], is_heap: bool) {
    if !is_heap {
        heap(keys);
    }
    let mut end = keys.len();
    while let Some(last) = end.checked_sub(1)
        && let Some((key, heap)) = keys.get_mut(..end).and_then(<[_]>::split_last_mut)
        && let Some(&farthest) = heap.first()
    {
        let key = core::mem::replace(key, farthest);
        sink(heap, 0, key);
        end = last;
    }
}

/// Makes a heap of keys, the farthest first.
fn heap(keys: &mut [Key]) {
    for at in (0..keys.len() / 2).rev() {
        if let Some(&key) = keys.get(at) {
            sink(keys, at, key);
        }
    }
}

/// Puts a key in the place of another, above or among what is below that.
fn sink(heap: &mut [Key], mut at: usize, key: Key) {
    while let Some(&left) = heap.get(2 * at + 1) {
        let right = heap.get(2 * at + 2).copied().filter(|&right| right > left);
        let (child, farther) = right.map_or((2 * at + 1, left), |right| (2 * at + 2, right));
        if farther <= key {
            break;
        }
        if let Some(place) = heap.get_mut(at) {
            *place = farther;
        }
        at = child;
    }
    if let Some(place) = heap.get_mut(at) {
        *place = key;
    }
}
