//! A tick's closest pair with all contacts, in one budget.

use super::{Purpose, Tracker, TrackerAnswer};
use crate::query::contacts::Pair;
use crate::query::{Contacts, NoSide, Options, Side};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Tool};

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// The closest pair, and all contacts within `margin` (mm): those of [`Query::contacts`](crate::Query::contacts).
    ///
    /// Where the surface is within the margin, a range search finds the others. The tracker remembers the nodes that it
    /// opened, up to `RANGE`, and for how long their other children are beyond the margin. It starts anew for another surface, for a tool as
    /// far from the last as a 16th of the root sphere's radius, and once all places are used
    /// ([`opened_in_range`](Self::opened_in_range)). Where the budget ends, the list's bound can be less than a query's, which looks at near parts first.
    ///
    /// Cost: that of [`closest`](Self::closest), a few instructions for each opened node, and what a query takes to compare
    /// the triangles within the margin.
    ///
    /// # Errors
    /// Those of [`Query::contacts`](crate::Query::contacts).
    pub fn contacts<S: MovingSurface + ?Sized, T: Tool, const N: usize, const NEAR: usize>(
        &mut self,
        surface: &S,
        tool: &T,
        margin: f32,
        options: &Options,
        contacts: &mut Contacts<N, NEAR>,
    ) -> Result<TrackerAnswer, QueryError> {
        contacts.begin(margin, self.tree.has_adjacency())?;
        let found = self.add_contacts(surface, tool, options, contacts);
        contacts.unless_failed(found)
    }

    fn add_contacts<S: MovingSurface + ?Sized, T: Tool, const N: usize, const NEAR: usize>(
        &mut self,
        surface: &S,
        tool: &T,
        options: &Options,
        contacts: &mut Contacts<N, NEAR>,
    ) -> Result<TrackerAnswer, QueryError> {
        let mut tracked = self.within(surface, tool, options, f32::INFINITY, Purpose::Contacts)?;
        let is_cut = tracked.is_kept || tracked.closest.side == Side::Undefined(NoSide::CutShort);
        let mut closest = tracked.closest;
        closest.add_position_error(surface);
        let rest = options.after(closest.tests());
        let (tree, closest) = (&self.tree, &closest);
        let pair = Pair { tree, vertices: surface, tool, closest, surface: 0, number: 0 };
        if tracked.is_kept {
            contacts.lower_bound(closest.lower);
        }
        let made = match surface.motion() {
            Some(_) => {
                let front = self.memory.range.now(self.memory.clock, options.part);
                contacts.add_tracked(&pair, &mut self.stack, &rest, front)?
            }
            None => contacts.add(&pair, &mut self.stack, &rest)?,
        };
        tracked.closest.add_tests(made);
        // A search that found all but the side has found all contacts: the last tick's side comes after them.
        if !is_cut {
            let TrackerAnswer { closest, is_kept, .. } = &mut tracked;
            let nearest = closest.lower;
            *is_kept = self.keep_certain(surface, tool, options, closest, nearest)?;
        }
        tracked.closest.add_position_error(surface);
        if tracked.is_kept && !is_cut {
            contacts.resolve_side(&tracked.closest);
        }
        Ok(tracked)
    }
}
