//! The low triangles of a pair: from a new search, or from the front of the last one.

use super::Contacts;
use super::add::{Pair, near};
use super::basins::Basins;
use crate::math::sqrt::sqrt;
use crate::query::Options;
use crate::query::made::Tests;
use crate::query::memory::range::RangeFrontMut;
use crate::query::search::{Search, WaitingNode};
use crate::tool::AxisPair;
use crate::tree::RootSet;
use crate::unavailable::QueryError;
use crate::{Index, Tool, VertexTable};

/// The result of a search for low triangles. All that are closer than both distances were collected.
pub(super) struct SearchExtent {
    /// From here on there was no room for more triangles.
    pub complete: f32,
    /// From here on triangles were not visited.
    pub beyond: f32,
    pub tests: Tests,
}

impl SearchExtent {
    /// That of a search that a tick's budget does not cover: nothing was visited.
    pub const NOT_BEGUN: Self = Self { complete: f32::INFINITY, beyond: 0.0, tests: Tests::NONE };
}

impl<const N: usize, const NEAR: usize> Contacts<N, NEAR> {
    /// Adds the contacts of a pair. Returns the tests made.
    pub(in crate::query) fn add<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        pair: &Pair<'_, I, V, T>,
        stack: &mut [WaitingNode],
        options: &Options,
    ) -> Result<Tests, QueryError> {
        self.add_from(pair, stack, options, |basins, search, options, (limit, prominence)| {
            let mut low = Low::new(basins, limit, search.accuracy());
            let visit = |row, at: &AxisPair| low.add(row, at);
            let (beyond, tests) = search.each_low(limit, (prominence, options), visit)?;
            Ok(SearchExtent { complete: low.complete, beyond, tests })
        })
    }

    /// The same for a surface that carries its motion. Parts that the last search proved to be far are skipped.
    pub(in crate::query) fn add_tracked<I: Index, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        pair: &Pair<'_, I, V, T>,
        stack: &mut [WaitingNode],
        options: &Options,
        mut front: RangeFrontMut<'_>,
    ) -> Result<Tests, QueryError> {
        let mut is_begun = false;
        let made =
            self.add_from(pair, stack, options, |basins, search, options, (limit, prominence)| {
                is_begun = true;
                let mut low = Low::new(basins, limit, search.accuracy());
                let visit = |row, at: &AxisPair| low.add(row, at);
                let (beyond, tests) =
                    search.each_low_from(&mut front, limit, (prominence, options), visit)?;
                front.keep(beyond == f32::INFINITY);
                Ok(SearchExtent { complete: low.complete, beyond, tests })
            })?;
        // Beyond the margin, inside, or without a budget nothing was searched: the front is as it was.
        if !is_begun {
            front.keep(false);
        }
        Ok(made)
    }
}

impl<'s, I: Index, V: VertexTable + ?Sized, T: Tool> Pair<'s, I, V, T> {
    /// The search of this pair's contacts.
    #[inline(always)]
    pub(super) fn over_range(
        &self,
        stack: &'s mut [WaitingNode],
        options: &Options,
    ) -> Result<Search<'s, 's, I, V, T>, QueryError> {
        let &Self { tree, vertices, tool, .. } = self;
        let search = Search::start(RootSet::ALL, tree, stack, vertices, tool, options, None, None)?;
        Ok(search.over_range(options))
    }
}

/// The low triangles, as they are found.
struct Low<'b, const NEAR: usize> {
    basins: &'b mut Basins<NEAR>,
    /// All closer triangles are collected.
    complete: f32,
    accuracy: f32,
}

impl<'b, const NEAR: usize> Low<'b, NEAR> {
    fn new(basins: &'b mut Basins<NEAR>, limit: f32, accuracy: f32) -> Self {
        basins.clear();
        Self { basins, complete: limit, accuracy }
    }

    /// Collects a triangle. Returns the distance beyond which there is no room for more.
    #[inline(always)]
    fn add(&mut self, row: u32, at: &AxisPair) -> f32 {
        if let Some(farthest) = self.basins.push(near(row, at, self.accuracy)) {
            self.complete = sqrt(farthest);
        }
        self.complete
    }
}
