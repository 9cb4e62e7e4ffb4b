//! A tick's closest pair and all contacts, within one budget.

use super::{Purpose, Tracker, TrackerAnswer};
use crate::query::contacts::Pair;
use crate::query::{Contacts, NoSide, Options, Side};
use crate::unavailable::QueryError;
use crate::{Index, MovingSurface, Tool};

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// The closest pair, and all contacts within `margin` (mm), as in [`Query::contacts`](crate::Query::contacts).
    ///
    /// Where the surface is within the margin, a range search finds the other contacts. The tracker remembers up to
    /// `RANGE` nodes that it opened, and how long their other children stay beyond the margin. This memory restarts
    /// for another surface, for a tool that moved by a 16th of the root sphere's radius, and once all slots are used
    /// ([`opened_in_range`](Self::opened_in_range)). If the budget ends, the list's bound can be lower than a query's,
    /// which searches near parts first.
    ///
    /// Cost: that of [`closest`](Self::closest), a few instructions for each opened node, and a query's comparisons of
    /// the triangles within the margin. The closest pair is searched first, and the list within the rest of the budget.
    /// If the rest does not cover the start of that search, the closest pair is the list's only contact.
    ///
    /// # Errors
    /// Same as [`Query::contacts`](crate::Query::contacts).
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
        // A search that is complete but for the side has found all contacts: the last tick's side is merged after them.
        if !is_cut {
            let TrackerAnswer { closest, is_kept, .. } = &mut tracked;
            let nearest = closest.lower;
            *is_kept = self.keep_certain(surface, tool, options, closest, nearest)?;
        }
        if tracked.is_kept && !is_cut {
            contacts.resolve_side(&tracked.closest);
        }
        tracked.closest.add_position_error(surface);
        contacts.raise_bound(tracked.closest.interval().lower);
        Ok(tracked)
    }
}
