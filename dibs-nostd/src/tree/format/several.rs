//! Several rows of a table with one bounds check, for the batched search.
//!
//! Reads have one size, so that no loop depends on a count. They may include rows after the requested ones, and zeros
//! past the end of the table.

use super::{Node, node_bytes};
use crate::Index;

/// Copies eight node records: a range of `count`, and the records after it.
#[inline(always)]
pub(crate) fn copy_nodes<I: Index>(
    nodes: &[u8],
    first: u32,
    count: u32,
    to: &mut [u8],
) -> Option<()> {
    let stride = node_bytes::<I>();
    let rows = nodes.get(first as usize * stride..)?;
    let needed = count as usize * stride;
    if I::BYTES == 2 {
        let mut last = None;
        *to.first_chunk_mut::<64>()? = *chunk(rows, needed, &mut last)?;
    } else {
        let mut last = None;
        *to.first_chunk_mut::<96>()? = *chunk(rows, needed, &mut last)?;
    }
    Some(())
}

/// The first four of copied node records.
#[inline(always)]
pub(crate) fn four_nodes<I: Index>(rows: &[u8]) -> Option<[Node; 4]> {
    if I::BYTES == 2 {
        let rows: &[_; 4] = rows.as_chunks().0.first_chunk()?;
        Some(rows.map(|row| {
            let (row, head) = (u64::from_le_bytes(row), u64::from_le_bytes(row) as u32);
            Node { pin: head & 0xFFFF, radius_code: head >> 16, link: (row >> 32) as u32 }
        }))
    } else {
        let words: &[_; 12] = rows.as_chunks().0.first_chunk()?;
        let [a, b, c, d, e, f, g, h, i, j, k, l] = words.map(u32::from_le_bytes);
        let rows = [[a, b, c], [d, e, f], [g, h, i], [j, k, l]];
        Some(rows.map(|[pin, radius_code, link]| Node { pin, radius_code, link }))
    }
}

/// Twelve vertices, of which the first `count + 2` belong to a leaf of `count` triangles: the first triangle's corners,
/// and the third corner of each other one, since only that may be new to the leaf.
#[inline(always)]
pub(crate) fn leaf_vertices<I: Index>(
    triangles: &[u8],
    first: u32,
    count: u32,
) -> Option<[u32; 12]> {
    let [a, b, c, _, _, d, _, _, e, _, _, f, _, _, g, _, _, h, _, _, i, _, _, j] =
        indices::<I, 24>(triangles, 3 * first as usize, 3 * count as usize)?;
    Some([a, b, c, d, e, f, g, h, i, j, j, j])
}

/// Four triangles: the first of a range of `count`, and any rows after a shorter range. All first corners, all second
/// and all third.
#[inline(always)]
pub(crate) fn four_triangles<I: Index>(
    triangles: &[u8],
    first: u32,
    count: u32,
) -> Option<[[u32; 4]; 3]> {
    let count = if count < 4 { count } else { 4 };
    let [a, b, c, d, e, f, g, h, i, j, k, l] =
        indices::<I, 12>(triangles, 3 * first as usize, 3 * count as usize)?;
    Some([[a, d, g, j], [b, e, h, k], [c, f, i, l]])
}

/// `N` indices from index `at` on, of which the first `needed` must exist.
#[inline(always)]
fn indices<I: Index, const N: usize>(bytes: &[u8], at: usize, needed: usize) -> Option<[u32; N]> {
    if I::BYTES == 2 {
        let mut last = None;
        let rows = chunk(bytes.as_chunks().0.get(at..)?, needed, &mut last)?;
        Some(rows.map(|row| u32::from(u16::from_le_bytes(row))))
    } else {
        let mut last = None;
        let rows = chunk(bytes.as_chunks().0.get(at..)?, needed, &mut last)?;
        Some(rows.map(u32::from_le_bytes))
    }
}

/// The first `N` rows, of which `needed` must exist. If there are fewer than `N`, they are copied to `last`, with zeros
/// appended.
#[inline(always)]
fn chunk<'r, T: Copy + Default, const N: usize>(
    rows: &'r [T],
    needed: usize,
    last: &'r mut Option<[T; N]>,
) -> Option<&'r [T; N]> {
    match rows.first_chunk() {
        Some(all) => Some(all),
        None => {
            *last = Some(fill_up(rows.get(..needed)?));
            last.as_ref()
        }
    }
}

#[cold]
fn fill_up<T: Copy + Default, const N: usize>(rows: &[T]) -> [T; N] {
    let mut all = [T::default(); N];
    for (slot, row) in all.iter_mut().zip(rows) {
        *slot = *row;
    }
    all
}
