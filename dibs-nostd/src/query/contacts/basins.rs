//! Selects the triangles near a tool that are closer than their surroundings.
//!
//! The distance from the tool is a height over the surface, and each basin of it is a contact. A basin grows from each
//! low triangle, the lowest first: it descends to a triangle with no lower neighbour. Then it rises over triangles in
//! nearly the same direction by the prominence up to which a contact has activation 0, so no contact ends while it
//! acts. If it meets the basin of a lower triangle in nearly the same direction, both are one basin: a flat wall along
//! a capsule is one basin, however many triangles are equally far; two walls are two, however low the ridge between
//! them.
//!
//! Over a triangle the height is convex. So the path from its lowest point to a neighbour crosses no ridge exactly if
//! that point is on their common edge.
//!
//! If memory or budget runs out, a basin does not rise. Then one basin may be reported as two, but none is missing,
//! unless the neighbours of a triangle could not be tested.
//!
//! One file, because basins and triangles keep their fields private.

// Requirement: S-04

use glam::Vec3;

use super::activation::{self, TriangleTester};
use crate::math::sqrt::sqrt;
use crate::query::prices::{BASIN, EDGE, ENTRY};
use crate::tool::AxisPair;
use crate::unavailable::QueryError;
use crate::{Index, Tool, Tree, VertexTable};

/// A triangle, the square of its distance, and its closest point.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearTriangle {
    pub square: f32,
    pub row: u32,
    pub point: ClosestPoint,
}

/// The closest point of a triangle: the direction to the tool, in 9 bits per axis, and the edges that contain it, one
/// bit each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ClosestPoint(u32);

impl ClosestPoint {
    /// No direction, and no edge.
    pub const NONE: Self = Self(0);
    const DIRECTION: u32 = (1 << 27) - 1;
    /// Largest distance of two unit vectors in nearly the same direction: 7 degrees.
    const ALIKE: f32 = 0.125;
    const SCALE: f32 = 255.0;
    /// Weight of the corner beyond an edge, for a point on the edge.
    const ON_EDGE: f32 = 1e-4;

    /// The closest point of a pair. It has no direction if the points are at most `least` apart.
    #[inline(always)]
    pub fn of(pair: &AxisPair, least: f32) -> Self {
        let [a, b, c] = pair.barycentric.map(|weight| u32::from(!(weight > Self::ON_EDGE)));
        let edges = (b << 2 | a << 1 | c) << 27;
        let vector = pair.on_axis - pair.on_surface;
        let length = sqrt(vector.length_squared());
        if !(length > least) {
            return Self(edges);
        }
        let bits = |axis: f32| (axis / length * Self::SCALE) as i32 as u32 & 0x1FF;
        Self(edges | bits(vector.x) | bits(vector.y) << 9 | bits(vector.z) << 18)
    }

    pub const fn is_on(self, edge: u32) -> bool {
        self.0 >> (27 + edge) & 1 == 1
    }

    /// Whether both directions are nearly the same, or one is missing.
    fn is_like(self, other: Self) -> bool {
        let axis = |bits: u32, at: u32| ((bits << (23 - at)) as i32 >> 23) as f32;
        let vector = |Self(bits)| Vec3::new(axis(bits, 0), axis(bits, 9), axis(bits, 18));
        let has_direction = |Self(bits)| bits & Self::DIRECTION != 0;
        let most = Self::ALIKE * Self::SCALE;
        let apart = (vector(self) - vector(other)).length_squared();
        !has_direction(self) || !has_direction(other) || apart <= most * most
    }
}

/// A `NearTriangle` as integers that sort by distance, then by row: bits of positive floats sort as integers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Key {
    square: u32,
    row: u32,
    point: ClosestPoint,
}

impl Key {
    const NONE: Self = Self { square: 0, row: 0, point: ClosestPoint::NONE };

    fn of(near: NearTriangle) -> Self {
        Self { square: near.square.to_bits(), row: near.row, point: near.point }
    }

    fn square(self) -> f32 {
        f32::from_bits(self.square)
    }

    fn near(self) -> NearTriangle {
        NearTriangle { square: self.square(), row: self.row, point: self.point }
    }
}

const NONE: u16 = u16::MAX;

/// The nearest low triangles, at most half of `N`; then the triangles that basins have reached.
#[derive(Clone, Debug)]
pub(super) struct Basins<const N: usize> {
    near: [Key; N],
    /// Whether the low triangles are a heap with the farthest on top.
    is_heap: bool,
    /// Hash table of the entries: the first entry for each remainder of a row by `N`, and the next entry with the same
    /// remainder.
    heads: [u16; N],
    next: [u16; N],
    /// For each entry, the low triangle whose basin reached it.
    reached_by: [u16; N],
    /// Entries that the current basin has reached, in order.
    reached: [u16; N],
    count: usize,
}

/// How the growth of a basin ended.
enum BasinEnd {
    /// It has reached everything below its level; the lowest triangle. If that is beyond a ridge and in another
    /// direction, also the lowest before the ridge.
    Complete(NearTriangle, Option<NearTriangle>),
    /// It has met the basin of a lower triangle in nearly the same direction.
    Joined,
    /// Memory or budget ran out; a neighbour may be lower.
    CutShort,
}

impl<const N: usize> Basins<N> {
    pub const fn new() -> Self {
        Self {
            near: [Key::NONE; N],
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
    pub fn push(&mut self, near: NearTriangle) -> Option<f32> {
        let key = Key::of(near);
        let low = self.near.get_mut(..N.div_ceil(2))?;
        if let Some(slot) = low.get_mut(self.count) {
            *slot = key;
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

    /// Finds the basins. Between basins in nearly the same direction, prominences that leave the higher one without
    /// activation are ignored (`prominences`: see [`activation::least_prominence`]). Calls back with the lowest
    /// triangle of each, nearest first. Points that differ by at most the prominences' error count as equally far.
    /// Triangles that `is_left_out` are skipped.
    ///
    /// Returns the square of the distance beyond which basins may be missing, if any.
    pub fn each_basin<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        tree: &Tree<'_, I>,
        prominences: (f32, f32),
        is_left_out: impl Fn(u32) -> bool,
        tester: &mut TriangleTester<'_, '_, I, V, T>,
        mut visit: impl FnMut(NearTriangle) -> Result<(), QueryError>,
    ) -> Result<Option<f32>, QueryError> {
        sort(self.near.get_mut(..self.count).unwrap_or_default(), self.is_heap);
        self.is_heap = false;
        self.heads.fill(NONE);
        let low = self.count;
        for entry in 0..low {
            self.enter(entry);
        }
        let mut missing = None;
        let mut miss = |square: f32| {
            if missing.is_none_or(|least| square < least) {
                missing = Some(square);
            }
        };
        for entry in 0..low {
            match self.grow(tree, entry as u16, prominences, &is_left_out, tester)? {
                BasinEnd::Complete(lowest, beside) => {
                    for basin in [Some(lowest), beside].into_iter().flatten() {
                        match tester.pay_for(BASIN) {
                            Some(()) => visit(basin)?,
                            None => miss(basin.square),
                        }
                    }
                }
                BasinEnd::Joined => (),
                BasinEnd::CutShort => {
                    if let Some(key) = self.near.get(entry) {
                        miss(key.square());
                    }
                }
            }
        }
        Ok(missing)
    }

    /// Grows a basin around a low triangle up to a prominence above the lowest point.
    fn grow<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        tree: &Tree<'_, I>,
        low: u16,
        prominences: (f32, f32),
        is_left_out: &impl Fn(u32) -> bool,
        tester: &mut TriangleTester<'_, '_, I, V, T>,
    ) -> Result<BasinEnd, QueryError> {
        let Some(&(mut lowest)) = self.near.get(usize::from(low)) else {
            return Ok(BasinEnd::Joined);
        };
        let mut height = sqrt(lowest.square());
        let (prominence, error) =
            (activation::least_prominence(height, prominences), prominences.1);
        // The lowest before any ridge; the entry of the lowest; whether that is beyond a ridge; the lowest triangle
        // there that another basin has reached.
        let (mut own, mut at_lowest, mut has_crossed, mut other_lowest) =
            (lowest, low, false, None);
        let mut count = 0;
        if !self.reach(low, low, &mut count) {
            return Ok(BasinEnd::Joined);
        }
        // Numbers of entries whose lower neighbours have been visited, and whose other edges have been crossed. The
        // basin rises only if no way down is left; otherwise it would take a slope for a basin.
        let (mut descended, mut risen) = (0, 0);
        for _ in 0..2 * N {
            let rises = descended == count;
            let at = if rises { &mut risen } else { &mut descended };
            let Some(&entry) = self.reached.get(*at).filter(|_| *at < count) else { break };
            *at += 1;
            let Some(&from) = self.near.get(usize::from(entry)) else { break };
            let Some(()) = tester.pay_for(ENTRY) else {
                if rises {
                    break;
                }
                return Ok(BasinEnd::CutShort);
            };
            for edge in 0..3 {
                let is_over = from.point.is_on(edge);
                let is_level = is_over && sqrt(from.square()) <= height + error;
                if !(rises || is_level) {
                    continue;
                }
                let Some(()) = tester.pay_for(EDGE) else {
                    if is_level {
                        return Ok(BasinEnd::CutShort);
                    }
                    continue;
                };
                let Some(across) = tree.row_across(from.row, edge) else { continue };
                if is_left_out(across) {
                    continue;
                }
                let Some(next) = self.entry(across, &mut |row| tester.triangle(row))? else {
                    if is_level {
                        return Ok(BasinEnd::CutShort);
                    }
                    continue;
                };
                let at = usize::from(next);
                let (Some(&key), Some(&by)) = (self.near.get(at), self.reached_by.get(at)) else {
                    continue;
                };
                let top = height + prominence;
                let is_within = sqrt(key.square()) <= top;
                if by == low || !is_within || !(is_level || key.point.is_like(own.point)) {
                    continue;
                }
                // Both may be low with a high edge between them. If the budget runs out, the basin does not rise.
                if !is_over && !tester.edge(from.row, edge)?.is_some_and(|over| over <= top) {
                    continue;
                }
                if !self.reach(next, low, &mut count) {
                    let other = self.near.get(usize::from(by));
                    let is_other = other.is_some_and(|other| !other.point.is_like(own.point));
                    if (has_crossed || !is_level) && is_other {
                        if other_lowest.is_none_or(|met| key < met) {
                            other_lowest = Some(key);
                        }
                        continue;
                    }
                    return Ok(BasinEnd::Joined);
                }
                if key < lowest {
                    (lowest, at_lowest) = (key, next);
                    height = sqrt(lowest.square());
                    has_crossed |= !is_level;
                    if !has_crossed {
                        own = key;
                    }
                }
            }
        }
        // The basin's direction is that of its lowest triangle.
        for entry in self.reached.iter().take(count) {
            if let Some(by) = self.reached_by.get_mut(usize::from(*entry)) {
                *by = at_lowest;
            }
        }
        let leads_away = other_lowest.is_some_and(|met| met < lowest);
        if !has_crossed || !leads_away && lowest.point.is_like(own.point) {
            return Ok(BasinEnd::Complete(lowest.near(), None));
        }
        Ok(if leads_away {
            BasinEnd::Complete(own.near(), None)
        } else {
            BasinEnd::Complete(lowest.near(), Some(own.near()))
        })
    }

    /// Adds an entry to the basin of `low`, of `count` entries. Returns whether it was in no basin before.
    fn reach(&mut self, entry: u16, low: u16, count: &mut usize) -> bool {
        let by = self.reached_by.get_mut(usize::from(entry));
        let (Some(by), Some(slot)) = (by, self.reached.get_mut(*count)) else { return false };
        if *by != NONE {
            return false;
        }
        (*by, *slot) = (low, entry);
        *count += 1;
        true
    }

    /// The entry of a triangle, created if missing. `None` if memory or budget ran out.
    pub(super) fn entry(
        &mut self,
        row: u32,
        test: &mut impl FnMut(u32) -> Result<Option<NearTriangle>, QueryError>,
    ) -> Result<Option<u16>, QueryError> {
        let known = self.find(row);
        if known.is_some() {
            return Ok(known);
        }
        let Some(slot) = self.near.get_mut(self.count) else { return Ok(None) };
        let Some(near) = test(row)? else { return Ok(None) };
        *slot = Key::of(near);
        self.enter(self.count);
        self.count += 1;
        Ok(Some((self.count - 1) as u16))
    }

    pub(super) fn at(&self, entry: u16) -> Option<NearTriangle> {
        self.near.get(usize::from(entry)).map(|key| key.near())
    }

    pub(super) fn height(&self, entry: u16) -> Option<f32> {
        self.at(entry).map(|near| sqrt(near.square))
    }

    /// Clears the marks of all entries, including those of basins.
    pub(super) fn forget(&mut self) {
        self.reached_by.get_mut(..self.count).unwrap_or_default().fill(NONE);
    }

    pub(super) fn mark(&mut self, entry: u16) {
        if let Some(by) = self.reached_by.get_mut(usize::from(entry)) {
            *by = entry;
        }
    }

    pub(super) fn is_marked(&self, entry: u16) -> bool {
        self.reached_by.get(usize::from(entry)).is_none_or(|&by| by != NONE)
    }

    /// Enters an entry into the hash table.
    fn enter(&mut self, entry: usize) {
        let Some(row) = self.near.get(entry).map(|key| key.row) else { return };
        let bucket = (row as usize).checked_rem(N).unwrap_or_default();
        if let (Some(head), Some(next), Some(by)) =
            (self.heads.get_mut(bucket), self.next.get_mut(entry), self.reached_by.get_mut(entry))
        {
            (*next, *by) = (*head, NONE);
            *head = entry as u16;
        }
    }

    pub(super) fn find(&self, row: u32) -> Option<u16> {
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
}

/// Sorts the nearest to the front, by a heap.
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

/// Makes a heap of keys with the farthest on top.
fn heap(keys: &mut [Key]) {
    for at in (0..keys.len() / 2).rev() {
        if let Some(&key) = keys.get(at) {
            sink(keys, at, key);
        }
    }
}

/// Replaces the key at `at` and moves the new key down to its slot in the heap.
fn sink(heap: &mut [Key], mut at: usize, key: Key) {
    while let Some(&left) = heap.get(2 * at + 1) {
        let right = heap.get(2 * at + 2).copied().filter(|&right| right > left);
        let (child, farther) = right.map_or((2 * at + 1, left), |right| (2 * at + 2, right));
        if farther <= key {
            break;
        }
        if let Some(slot) = heap.get_mut(at) {
            *slot = farther;
        }
        at = child;
    }
    if let Some(slot) = heap.get_mut(at) {
        *slot = key;
    }
}
