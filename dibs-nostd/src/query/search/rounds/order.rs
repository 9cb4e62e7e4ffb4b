//! The order in which a round's children wait.

use core::array;
use core::hint::black_box;

use super::{Rounds, next};
use crate::query::search::Waiting;
use crate::tree::format::{Link, whole_node};
use crate::{Index, Tool, VertexTable};

/// Trees with more nodes than this are larger than a processor's nearest cache.
const CACHED: u32 = 4096;

/// The low bits of a key, which name a child.
const NAME: u32 = 63;

/// A key that is below all others.
const NONE: i32 = -1;

impl<I: Index, V: VertexTable + ?Sized, T: Tool> Rounds<'_, '_, I, V, T> {
    /// Lets the children in a set wait, the nearest of all on top.
    ///
    /// A child's place is the number of those that are farther: counting takes more comparisons than sorting by
    /// insertion, but four at a time, and no branch depends on them.
    #[inline(always)]
    pub(super) fn push(&mut self, mut set: u64) -> Option<()> {
        let Self { search, records, lowers, keys, .. } = self;
        let lowers = lowers.as_flattened();
        let mut count = 0;
        while let Some(at) = next(&mut set) {
            if search.tree.node_count() > CACHED
                && let Link::Children { first, .. } =
                    Link::decode(whole_node::<I>(records, at as u32)?.link)
            {
                // Only to have it fetched: on a large mesh the memory takes longer than all the rest.
                black_box(search.tree.whole_record(first)?.pin);
            }
            // Positive numbers are ordered as their bits are. Names make keys differ; of two that are as far, the
            // later is the nearer.
            let distance = (lowers.get(at)? + search.scale).to_bits() & !(1 << 31);
            *keys.as_flattened_mut().get_mut(count)? =
                (distance & !NAME | (NAME - at as u32)) as i32;
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
            // Not flattened: the compiler would count along the keys instead.
            for keys in all {
                for key in keys {
                    farther = array::from_fn(|i| farther[i] + u32::from(*key > own[i]));
                }
            }
            for (key, place) in own.iter().zip(farther) {
                let at = NAME - (*key as u32 & NAME);
                // None where the block is longer than the stack.
                if let Some(place) = stack.get_mut(place as usize) {
                    let link = whole_node::<I>(records, at)?.link;
                    *place = Waiting { lower: *lowers.get(at as usize)?, link };
                }
            }
        }
        search.waiting += count;
        Some(())
    }
}
