//! All locally closest pairs of a tool and a surface within a margin.

// Requirement: S-04

mod across;
mod activation;
mod add;
mod basins;
mod list;
mod low;

use glam::Vec3;

use super::{Options, Proximity, Query, Side};
#[cfg(all(feature = "bus", feature = "control"))]
use crate::math::round::{sum_down, sum_up};
use crate::unavailable::{QueryError, Unavailable};
use crate::{Index, Tool, TriangleRow, VertexTable};
use across::AcrossPoint;
pub(super) use add::Pair;
use basins::Basins;
use list::List;

/// A pair of points of tool and surface that is a local minimum of the distance.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct Contact {
    /// Signed separation (mm): the lower end of the pair's interval, as [`Proximity::lower`]. If the tool crosses or is
    /// inside, it may be too low by the depth's tolerance, or by more if the budget ended. If the axis is at the
    /// surface with its side below the accuracy, it is that of an axis equally far inside: too low by at most some four
    /// accuracies.
    pub separation: f32,
    /// Unit vector that leads out of the surface; never zero.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub normal: Vec3,
    /// The pair's point on the surface.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_surface: Vec3,
    /// The pair's point on the tool's surface.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_tool: Vec3,
    /// Parameter of the pair along the tool's axis: 0 at its start, 1 at its end.
    pub axis_parameter: f32,
    /// The surface's index in the slice of a scene; 0 for a single surface.
    pub surface: usize,
    /// The tool's index in the slice of a chain; 0 for a single tool.
    pub tool: usize,
    /// The triangle of `point_on_surface`.
    pub triangle: TriangleRow,
    /// That triangle's corners, as rows of the vertex table.
    pub corners: [u32; 3],
    /// Weights of the corners at `point_on_surface`.
    pub barycentric: [f32; 3],
    /// Velocity of the surface at that point (mm/s): zero until [`Contacts::move_with`] sets it.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub velocity: Vec3,
    /// The second triangle that bounds the depth, if the tool crosses or is inside.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) across: AcrossPoint,
    /// 0 where it starts next to a nearer one, 1 from full prominence on (see `activation`).
    #[cfg_attr(feature = "serde", serde(skip))]
    pub(crate) activation: f32,
}

impl Contact {
    pub(crate) const NONE: Self = Self {
        separation: f32::INFINITY,
        normal: Vec3::ZERO,
        point_on_surface: Vec3::ZERO,
        point_on_tool: Vec3::ZERO,
        axis_parameter: 0.0,
        surface: 0,
        tool: 0,
        triangle: TriangleRow(0),
        corners: [0; 3],
        barycentric: [0.0; 3],
        velocity: Vec3::ZERO,
        across: AcrossPoint::NONE,
        activation: 1.0,
    };
}

/// Up to `N` contacts, deepest first, and a bound on the missing ones. A query compares up to `NEAR` triangles: those
/// near a contact, and local minima, at most half of `NEAR`.
///
/// RAM on a 32-bit processor: 152 bytes for each of `N`, 20 for each of `NEAR`, plus 28.
///
/// Create it once, in a `static` or at start-up, and use it at every tick.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{Capsule, ContactIter, Contacts, Options, Query, Tree, glam::Vec3};
///
/// let heart = generate::heart(1_000)?.mesh;
/// let built = Builder::new().build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let rows = built.to_rows(&heart.positions);
/// let mut query = Query::<_, 32>::new(&tree)?;
///
/// let mut contacts = Contacts::<8>::new();
/// let tool = Capsule::new(Vec3::new(-60.0, 0.0, 20.0), Vec3::new(-60.0, 0.0, 80.0), 2.5)?;
/// query.contacts(rows.as_slice(), &tool, 15.0, &Options::new(), &mut contacts)?;
/// assert!(contacts.iter().all(|contact| contact.separation <= 15.0));
/// assert!(contacts.bound() >= 15.0); // all there are
/// let near: ContactIter<'_> = contacts.within(10.0)?; // what a constraint acts on
/// assert!(near.is_complete());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Contacts<const N: usize, const NEAR: usize = 512> {
    found: List<N>,
    /// Workspace of a search, emptied before each. It is here because 20 bytes for each of `NEAR` are much for a
    /// controller's stack, and a query without contacts should not have them.
    basins: Basins<NEAR>,
}

/// The contacts on which a constraint acts, deepest first: see [`Contacts::within`].
#[derive(Clone, Debug)]
pub struct ContactIter<'c> {
    contacts: core::slice::Iter<'c, Contact>,
    bound: f32,
    is_complete: bool,
}

impl ContactIter<'_> {
    /// Whether these are all contacts within the margin; for a guard's list also those that error and age of the
    /// surface may bring within it. If not, `N` or `NEAR` was too small or the budget ended: walls may be missing
    /// beyond [`bound`](Self::bound).
    #[must_use]
    pub const fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// All contacts with a separation below this (mm) are included: [`Contacts::bound`].
    #[must_use]
    pub const fn bound(&self) -> f32 {
        self.bound
    }
}

impl<'c> Iterator for ContactIter<'c> {
    type Item = &'c Contact;

    fn next(&mut self) -> Option<Self::Item> {
        self.contacts.next()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.contacts.size_hint()
    }
}

impl<const N: usize, const NEAR: usize> Default for Contacts<N, NEAR> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize, const NEAR: usize> Contacts<N, NEAR> {
    /// An empty list.
    #[must_use]
    pub const fn new() -> Self {
        Self { found: List::new(), basins: Basins::new() }
    }

    /// The same list, with less memory for searches: bindings keep it beside an answer.
    #[doc(hidden)]
    #[must_use]
    pub fn without_search(&self) -> Contacts<N, 1> {
        Contacts { found: self.found.clone(), basins: Basins::new() }
    }

    /// The contacts, deepest first.
    pub fn iter(&self) -> impl Iterator<Item = &Contact> + Clone {
        self.found.list.iter()
    }

    /// Number of contacts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.found.list.len()
    }

    /// Whether there are no contacts.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.found.list.is_empty()
    }

    /// The contacts, deepest first, for a constraint that acts within `margin` (mm). None is deeper than the first: if the
    /// budget ended before the deepest was certain, that is the closest pair found, with the interval's least separation.
    /// Others may be missing, see [`ContactIter::is_complete`]. Contacts beyond `margin`, from a query with a larger
    /// one, are included too.
    ///
    /// # Errors
    /// [`Unavailable::CutShort`] if the budget ended before the side or any pair was known, or no query filled the list, or,
    /// of a label's part, before its deepest contact was known;
    /// [`Unavailable::NoSide`] if the tool may be inside and no contact is within the margin; [`QueryError::Margin`] if
    /// the query's margin was smaller.
    pub fn within(&self, margin: f32) -> Result<ContactIter<'_>, Unavailable> {
        let List { bound, is_open, has_no_side, accuracy, .. } = self.found;
        let is_complete = bound >= margin;
        if is_open && !is_complete {
            return Err(Unavailable::CutShort);
        }
        if !(margin <= self.found.margin) {
            return Err(QueryError::Margin { bits: margin.to_bits() }.into());
        }
        let acts = |first: &Contact| first.separation - accuracy < margin;
        if has_no_side && !self.iter().next().is_some_and(acts) {
            return Err(Unavailable::NoSide);
        }
        let contacts = self.found.list.iter();
        Ok(ContactIter { contacts, bound, is_complete })
    }

    /// Completes a list whose tool may be inside because its closest pair has no side. `closest` has the side that the
    /// last tick makes certain. It becomes a contact, and the only one unless the tool is outside. Other lists are not
    /// changed, nor is one whose `closest` has no direction.
    pub(super) fn resolve_side(&mut self, closest: &Proximity) {
        if !self.found.has_no_side {
            return;
        }
        let Some(contact) = add::contact(closest) else { return };
        self.found.has_no_side = false;
        // The search may have listed the same point without its side.
        let is_other = |at: Vec3| {
            let apart = at.distance_squared(contact.point_on_surface);
            apart > closest.accuracy * closest.accuracy
        };
        let is_outside = closest.side == Side::Outside;
        self.found.list.retain(|own| is_outside && is_other(own.point_on_surface));
        if contact.separation <= self.found.margin {
            self.found.insert(contact);
        }
    }

    /// All contacts with a separation below this (mm) are in the list. It is the margin or a little more, unless the
    /// list or `NEAR` was too small or the budget ran out; negative infinity if it ran out before the side was known.
    #[must_use]
    pub const fn bound(&self) -> f32 {
        self.found.bound
    }

    /// Error bound (mm): no separation is too high by more than this.
    #[must_use]
    pub const fn accuracy(&self) -> f32 {
        self.found.accuracy
    }

    /// Whether the list is full, so that the farthest contacts within the margin were left out.
    #[must_use]
    pub const fn is_full(&self) -> bool {
        self.found.is_full
    }

    /// Sets each contact's velocity to the surface's velocity at its point, from a table of the vertices' velocities
    /// (mm/s).
    ///
    /// # Errors
    /// [`QueryError::VertexCount`] if a contact's corner has no row in the table.
    pub fn move_with<V: VertexTable + ?Sized>(&mut self, velocities: &V) -> Result<(), QueryError> {
        let velocity = |corners: [u32; 3], weights: [f32; 3]| {
            let mut velocity = Vec3::ZERO;
            for (corner, weight) in corners.into_iter().zip(weights) {
                let found = velocities.len() as u32;
                let expected = corner.saturating_add(1);
                let moving = velocities.position(corner);
                velocity += weight * moving.ok_or(QueryError::VertexCount { expected, found })?;
            }
            Ok(velocity)
        };
        self.set_velocities(velocity)
    }

    /// Sets each contact's velocity to that of a point of a triangle.
    pub(crate) fn set_velocities(
        &mut self,
        velocity: impl Fn([u32; 3], [f32; 3]) -> Result<Vec3, QueryError>,
    ) -> Result<(), QueryError> {
        for contact in &mut self.found.list {
            contact.velocity = velocity(contact.corners, contact.barycentric)?;
            let across = &mut contact.across;
            if across.weight > 0.0 {
                across.speed = across.normal.dot(velocity(across.corners, across.barycentric)?);
            }
        }
        Ok(())
    }

    /// Empties the list, as if no query had filled it.
    #[cfg(all(feature = "bus", feature = "control"))]
    pub(crate) fn clear(&mut self) {
        self.found.clear();
    }

    /// Transforms each contact to another frame, by functions for points and vectors.
    #[cfg(all(feature = "bus", feature = "control"))]
    pub(crate) fn transform(
        &mut self,
        point: impl Fn(Vec3) -> Vec3,
        vector: impl Fn(Vec3) -> Vec3,
    ) {
        for contact in &mut self.found.list {
            contact.normal = vector(contact.normal);
            contact.point_on_surface = point(contact.point_on_surface);
            contact.point_on_tool = point(contact.point_on_tool);
            contact.velocity = vector(contact.velocity);
            contact.across.normal = vector(contact.across.normal);
            contact.across.on_axis = point(contact.across.on_axis);
        }
    }

    /// No contact has a separation below `least`.
    pub(super) fn raise_bound(&mut self, least: f32) {
        self.found.raise_bound(least);
    }

    /// Widens the accuracy by a further error (mm) of the surface, and lowers the bound by the total difference between
    /// the true surface and the searched one.
    #[cfg(all(feature = "bus", feature = "control"))]
    pub(crate) fn widen(&mut self, error: f32, off: f32) {
        self.found.accuracy = sum_up(self.found.accuracy, error);
        self.found.bound = sum_down(self.found.bound, -off);
    }
}

impl<I: Index, const STACK: usize> Query<'_, I, STACK> {
    /// Finds all locally closest pairs of the tool and the outer side of the surface whose separation is at most
    /// `margin` (mm). For a tool that is inside, the only contact is its deepest pair; for one that crosses the
    /// surface, that pair is the first. An axis that meets the surface in several places may have several parts inside:
    /// only the deepest is a contact, and its separation is the list's [bound](Contacts::bound).
    ///
    /// Two basins of the distance in nearly the same direction, within 7 degrees, are one contact unless the
    /// prominence of the higher one is more than a 128th of the axis' distance there, or of the margin if that is less.
    /// So a flat wall along a capsule is one contact; two walls within 15 degrees may be one. In other directions each basin is
    /// a contact of its own if its prominence is more than a 512th of that distance and a 128th of the margin; with
    /// less it may be. Pairs with the inner side of a sheet, such as the far side of an organ, are not contacts.
    /// If the side is undefined, the tool is taken to be outside. If that is because the budget ended, contacts may be
    /// missing at any distance: see [`Contacts::within`].
    ///
    /// If the list is too small, or the budget ends once the side is known, it still begins with the closest pair, and its
    /// [bound](Contacts::bound) tells how far it is complete. One wall may then be several contacts.
    ///
    /// If the tool crosses or is inside, up to five more searches of a point, usually one, find the second triangle at
    /// its deepest point, for [`VelocityRow`](crate::constraint::VelocityRow). If the budget does not cover them, there
    /// is none.
    ///
    /// Cost: that of [`closest`](Self::closest), a range search that compares the corners of each triangle within the
    /// margin, and exact tests of about an eighth of these and of those around a contact: a second time for each
    /// contact but the closest, to find its prominence over nearer ones, with the remaining budget.
    ///
    /// # Errors
    /// [`QueryError`] as for [`closest`](Self::closest); [`QueryError::NoAdjacency`] for a tree without it;
    /// [`QueryError::Contacts`] for a list without room; [`QueryError::Margin`] for a margin that is not a number of at
    /// least 0. The list is then empty.
    pub fn contacts<V: VertexTable + ?Sized, T: Tool, const N: usize, const NEAR: usize>(
        &mut self,
        vertices: &V,
        tool: &T,
        margin: f32,
        options: &Options,
        contacts: &mut Contacts<N, NEAR>,
    ) -> Result<Proximity, QueryError> {
        contacts.begin(margin, self.tree.has_adjacency())?;
        let found = self.add_contacts(vertices, tool, options, contacts);
        contacts.unless_failed(found)
    }

    /// The closest pair has a search of its own, before that of the range: a tool that is inside, or beyond the margin,
    /// needs no other, and its side and depth decide what the list contains. It takes about a seventh of the whole.
    fn add_contacts<V: VertexTable + ?Sized, T: Tool, const N: usize, const NEAR: usize>(
        &mut self,
        vertices: &V,
        tool: &T,
        options: &Options,
        contacts: &mut Contacts<N, NEAR>,
    ) -> Result<Proximity, QueryError> {
        let closest = self.closest(vertices, tool, options)?;
        let options = options.after(closest.tests()).unpriced();
        let pair =
            Pair { tree: &self.tree, vertices, tool, closest: &closest, surface: 0, number: 0 };
        contacts.add(&pair, &mut self.stack, &options)?;
        Ok(closest)
    }
}
