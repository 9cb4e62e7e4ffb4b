//! The order of a batch's children on the stack.

use core::array;
use core::hint::black_box;

use super::{BatchedSearch, next};
use crate::query::search::WaitingNode;
use crate::tree::format::{NodeLink, whole_node};
use crate::{Index, Tool, VertexTable};

/// Trees with more nodes than this do not fit a processor's first-level cache.
const CACHED: u32 = 4096;

/// The low bits of a key: the child's index, counted down.
const INDEX: u32 = 63;

/// A key that is below all others.
const NONE: i32 = -1;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> BatchedSearch<'_, '_, I, V, T> {
    /// Pushes the children in a set, the nearest on top.
    ///
    /// A child's position is the number of children that are farther. Counting takes more comparisons than an insertion
    /// sort, but four at a time and without a branch.
    #[inline(always)]
    pub(super) fn push(&mut self, mut set: u64) -> Option<()> {
        let Self { search, records, lowers, keys, .. } = self;
        let lowers = lowers.as_flattened();
        let mut count = 0;
        while let Some(at) = next(&mut set) {
            if search.tree.node_count() > CACHED
                && let NodeLink::Children { first, .. } =
                    NodeLink::decode(whole_node::<I>(records, at as u32)?.link)
            {
                // A prefetch: on a large mesh loads take longer than the arithmetic.
                black_box(search.tree.whole_record(first)?.pin);
            }
            // Positive numbers sort as their bits. The low six bits hold the child's index; ties go to the later child.
            let distance = (lowers.get(at)? + search.scale).to_bits() & !(1 << 31);
            *keys.as_flattened_mut().get_mut(count)? =
                (distance & !INDEX | (INDEX - at as u32)) as i32;
            count += 1;
        }
        *keys.as_flattened_mut().get_mut(count..)?.first_chunk_mut()? = [NONE; 8];
        let all = keys.as_flattened().as_chunks::<8>().0.get(..count.div_ceil(8))?;
        let stack = search.stack.get_mut(search.waiting..)?;
        if count > stack.len() {
            return None;
        }
        for own in keys.get(..count.div_ceil(4))? {
            let mut farther = [0; 4];
            // Not flattened, so that the compiler does not vectorise along the keys instead.
            for keys in all {
                for key in keys {
                    farther = array::from_fn(|i| farther[i] + u32::from(*key > own[i]));
                }
            }
            for (key, position) in own.iter().zip(farther) {
                let at = INDEX - (*key as u32 & INDEX);
                // Out of range where the block is longer than the stack.
                if let Some(slot) = stack.get_mut(position as usize) {
                    let link = whole_node::<I>(records, at)?.link;
                    *slot = WaitingNode { lower: *lowers.get(at as usize)?, link };
                }
            }
        }
        search.waiting += count;
        Some(())
    }
}
