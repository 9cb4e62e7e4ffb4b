//! The low triangles of a pair: found anew, or from the front of the last search on.

use super::Contacts;
use super::add::{Pair, near};
use super::basins::Basins;
use crate::math::sqrt::sqrt;
use crate::query::Options;
use crate::query::made::Tests;
use crate::query::memory::range::RangeFrontMut;
use crate::query::search::{Search, Waiting};
use crate::tool::AxisPair;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tool, VertexTable};

/// The end of a search for low triangles. All that are closer than both distances were entered.
pub(super) struct Found {
    /// There was no room for triangles that are farther.
    pub complete: f32,
    /// Triangles that are farther were not visited.
    pub beyond: f32,
    pub tests: Tests,
}

impl<const N: usize, const NEAR: usize> Contacts<N, NEAR> {
    /// Adds the contacts of a pair. Returns the tests made.
    pub(in crate::query) fn add<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        pair: &Pair<'_, I, V, T>,
        stack: &mut [Waiting],
        options: &Options,
    ) -> Result<Tests, QueryError> {
        self.add_from(pair, stack, options, |basins, stack, options, limit, ridge| {
            let mut low = Low::new(basins, limit, pair);
            let search = over_range(pair, stack, options)?;
            let visit = |row, at: &AxisPair| low.add(row, at);
            let (beyond, tests) = search.each_low(limit, (ridge, options.part), visit)?;
            Ok(Found { complete: low.complete, beyond, tests })
        })
    }

    /// The same for a surface that carries its motion. Parts that the last search showed to be far are not looked at.
    pub(in crate::query) fn add_tracked<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        pair: &Pair<'_, I, V, T>,
        stack: &mut [Waiting],
        options: &Options,
        mut front: RangeFrontMut<'_>,
    ) -> Result<Tests, QueryError> {
        self.add_from(pair, stack, options, |basins, stack, options, limit, ridge| {
            let mut low = Low::new(basins, limit, pair);
            let search = over_range(pair, stack, options)?;
            let visit = |row, at: &AxisPair| low.add(row, at);
            let (beyond, tests) =
                search.each_low_from(&mut front, limit, (ridge, options.part), visit)?;
            front.keep(beyond == f32::INFINITY);
            Ok(Found { complete: low.complete, beyond, tests })
        })
    }
}

/// The search of a pair's contacts.
#[inline(always)]
fn over_range<'s, I: Index, V: VertexTable + ?Sized, T: Tool>(
    &Pair { tree, vertices, tool, .. }: &Pair<'s, I, V, T>,
    stack: &'s mut [Waiting],
    options: &Options,
) -> Result<Search<'s, 's, I, V, T>, QueryError> {
    let search = Search::start(RootSet::ALL, tree, stack, vertices, tool, options, None, None)?;
    Ok(search.over_range(options))
}

/// The low triangles, as they are found.
struct Low<'b, const NEAR: usize> {
    basins: &'b mut Basins<NEAR>,
    /// All that are closer are entered.
    complete: f32,
    accuracy: f32,
}

impl<'b, const NEAR: usize> Low<'b, NEAR> {
    fn new<I, V: ?Sized, T>(
        basins: &'b mut Basins<NEAR>,
        limit: f32,
        pair: &Pair<'_, I, V, T>,
    ) -> Self {
        basins.clear();
        Self { basins, complete: limit, accuracy: pair.closest.accuracy }
    }

    /// Enters a triangle. Returns the distance from which on others would have no room.
    #[inline(always)]
    fn add(&mut self, row: u32, at: &AxisPair) -> f32 {
        if let Some(farthest) = self.basins.push(near(row, at, self.accuracy)) {
            self.complete = sqrt(farthest);
        }
        self.complete
    }
}
