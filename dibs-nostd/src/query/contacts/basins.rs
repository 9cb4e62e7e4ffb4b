//! Selects the triangles near a tool that are closer than their surroundings.
//!
//! The distance from the tool is a height over the surface, and each valley of it is a contact. A flood from each low
//! triangle, the lowest first, rises by the height of a ridge. If it runs into the flood of a lower one, both are one
//! valley: a flat wall along a capsule is one, however many triangles are equally far.

use crate::math::sqrt::sqrt;
use crate::unavailable::QueryError;
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

/// The nearest low triangles, at most half of `N`; then those that floods have met.
#[derive(Clone, Debug)]
pub(super) struct Basins<const N: usize> {
    near: [Key; N],
    /// Whether the low triangles are a heap, the farthest first.
    is_heap: bool,
    /// Hash table of the entries: the first for each remainder of rows by `N`, and the next with the same one.
    heads: [u16; N],
    next: [u16; N],
    /// The low triangle whose flood has reached each entry.
    reached_by: [u16; N],
    /// Entries that the flood has reached, in order.
    reached: [u16; N],
    count: usize,
}

/// The end of a flood.
enum Flood {
    /// It has reached all that is below its level; the lowest.
    Ended(Near),
    /// It has met the flood of a lower triangle.
    Joined,
    /// No room for another triangle, or no budget.
    CutShort,
}

impl<const N: usize> Basins<N> {
    pub const fn new() -> Self {
        Self {
            near: [Key(0); N],
            is_heap: false,
            heads: [NONE; N],
            next: [NONE; N],
            reached_by: [NONE; N],
            reached: [NONE; N],
            count: 0,
        }
    }

    pub fn clear(&mut self) {
        (self.count, self.is_heap) = (0, false);
    }

    /// Keeps a low triangle, and drops the farthest if there is no room. Returns the largest square kept, once full.
    pub fn push(&mut self, near: Near) -> Option<f32> {
        let key = Key::of(near);
        let low = self.near.get_mut(..N.div_ceil(2))?;
        if let Some(place) = low.get_mut(self.count) {
            *place = key;
            self.count += 1;
            return None;
        }
        if !self.is_heap {
            self.is_heap = true;
            heap(low);
        }
        if key < *low.first()? {
            sink(low, 0, key);
        }
        low.first().map(|farthest| farthest.square())
    }

    /// Finds the valleys: ridges of at most `ridge` above the higher valley do not count. Calls back with the lowest
    /// triangle of each, nearest first. `height` is the square of a triangle's distance, or `None` without budget.
    ///
    /// Returns the square of the distance from which on valleys may be missing, if any.
    pub fn each_valley<I: Index>(
        &mut self,
        tree: &Tree<'_, I>,
        ridge: f32,
        mut height: impl FnMut(u32) -> Result<Option<f32>, QueryError>,
        mut visit: impl FnMut(Near) -> Result<(), QueryError>,
    ) -> Result<Option<f32>, QueryError> {
        sort(self.near.get_mut(..self.count).unwrap_or_default(), self.is_heap);
        self.is_heap = false;
        self.heads.fill(NONE);
        let low = self.count;
        for entry in 0..low {
            self.enter(entry);
        }
        for entry in 0..low {
            match self.flood(tree, entry as u16, ridge, &mut height)? {
                Flood::Ended(lowest) => visit(lowest)?,
                Flood::Joined => (),
                Flood::CutShort => return Ok(self.near.get(entry).map(|key| key.square())),
            }
        }
        Ok(None)
    }

    /// Floods the surroundings of a low triangle up to the height of a ridge above it.
    fn flood<I: Index>(
        &mut self,
        tree: &Tree<'_, I>,
        low: u16,
        ridge: f32,
        height: &mut impl FnMut(u32) -> Result<Option<f32>, QueryError>,
    ) -> Result<Flood, QueryError> {
        let Some(&(mut lowest)) = self.near.get(usize::from(low)) else {
            return Ok(Flood::Joined);
        };
        let level = sqrt(lowest.square()) + ridge;
        let mut count = 0;
        if !self.reach(low, low, &mut count) {
            return Ok(Flood::Joined);
        }
        for at in 0..N {
            let Some(&entry) = self.reached.get(at).filter(|_| at < count) else { break };
            let Some(row) = self.near.get(usize::from(entry)).map(|key| key.row()) else { break };
            for across in (0..3).filter_map(|edge| tree.row_across(row, edge)) {
                let Some(next) = self.entry(across, height)? else { return Ok(Flood::CutShort) };
                let at = usize::from(next);
                let (Some(&key), Some(&by)) = (self.near.get(at), self.reached_by.get(at)) else {
                    return Ok(Flood::CutShort);
                };
                if by == low || key.square() > level * level {
                    continue;
                }
                if !self.reach(next, low, &mut count) {
                    return Ok(Flood::Joined);
                }
                // By rounding only: lower valleys were flooded before.
                if key < lowest {
                    lowest = key;
                }
            }
        }
        Ok(Flood::Ended(lowest.near()))
    }

    /// Adds an entry to the flood of `low`, of `count` entries. Returns whether it is the first to reach it.
    fn reach(&mut self, entry: u16, low: u16, count: &mut usize) -> bool {
        let by = self.reached_by.get_mut(usize::from(entry));
        let (Some(by), Some(place)) = (by, self.reached.get_mut(*count)) else { return false };
        if *by != NONE {
            return false;
        }
        (*by, *place) = (low, entry);
        *count += 1;
        true
    }

    /// The entry of a triangle, made if there is none. `None` without room or budget.
    fn entry(
        &mut self,
        row: u32,
        height: &mut impl FnMut(u32) -> Result<Option<f32>, QueryError>,
    ) -> Result<Option<u16>, QueryError> {
        let known = self.find(row);
        if known.is_some() {
            return Ok(known);
        }
        let Some(place) = self.near.get_mut(self.count) else { return Ok(None) };
        let Some(square) = height(row)? else { return Ok(None) };
        *place = Key::of(Near { square, row });
        self.enter(self.count);
        self.count += 1;
        Ok(Some((self.count - 1) as u16))
    }

    /// Enters an entry into the hash table.
    fn enter(&mut self, entry: usize) {
        let Some(row) = self.near.get(entry).map(|key| key.row()) else { return };
        let bucket = (row as usize).checked_rem(N).unwrap_or_default();
        if let (Some(head), Some(next), Some(by)) =
            (self.heads.get_mut(bucket), self.next.get_mut(entry), self.reached_by.get_mut(entry))
        {
            (*next, *by) = (*head, NONE);
            *head = entry as u16;
        }
    }

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
