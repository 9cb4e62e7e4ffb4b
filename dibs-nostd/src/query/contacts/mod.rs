//! All locally closest pairs of a tool and a surface within a margin.

mod basins;

use glam::Vec3;

use super::search::Search;
use super::side::{self, Side};
use super::{Budget, NoSide, Options, Proximity, Query};
use crate::math::sqrt::sqrt;
use crate::unavailable::{QueryError, Unavailable};
use crate::{Index, Tool, TriangleRow, VertexTable};
use basins::{Basins, Near};

/// Ridges of this part of the margin do not part two contacts.
const RIDGE: f32 = 1.0 / 64.0;

/// A pair of points of tool and surface that is closer than any next to it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Contact {
    /// Signed separation (mm), as [`Proximity::separation`].
    pub separation: f32,
    /// Unit vector that leads out of the surface; never zero.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub normal: Vec3,
    /// The surface's point of the pair.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_surface: Vec3,
    /// The tool's point of the pair, on the tool's own surface.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_tool: Vec3,
    /// Parameter of the pair along the tool's axis: 0 at its start, 1 at its end.
    pub axis_parameter: f32,
    /// The triangle of `point_on_surface`.
    pub triangle: TriangleRow,
    /// That triangle's corners, as rows of the vertex table.
    pub corners: [u32; 3],
    /// Weights of the corners at `point_on_surface`.
    pub barycentric: [f32; 3],
    /// Velocity of the surface there (mm/s): zero until [`Contacts::move_with`] sets it.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub velocity: Vec3,
}

impl Contact {
    const NONE: Self = Self {
        separation: f32::INFINITY,
        normal: Vec3::ZERO,
        point_on_surface: Vec3::ZERO,
        point_on_tool: Vec3::ZERO,
        axis_parameter: 0.0,
        triangle: TriangleRow(0),
        corners: [0; 3],
        barycentric: [0.0; 3],
        velocity: Vec3::ZERO,
    };

    /// The contact at a pair, if a direction leads out.
    fn at(pair: &Proximity) -> Option<Self> {
        let is_unit = (pair.direction.length_squared() - 1.0).abs() < 1e-3;
        let triangle = pair.triangle.filter(|_| is_unit)?;
        Some(Self {
            separation: pair.lower,
            normal: pair.direction,
            point_on_surface: pair.point_on_surface,
            point_on_tool: pair.point_on_tool,
            axis_parameter: pair.axis_parameter,
            triangle,
            corners: pair.corners,
            barycentric: pair.barycentric,
            velocity: Vec3::ZERO,
        })
    }
}

/// Up to `N` contacts, deepest first, and a bound on the others. A query compares up to `NEAR` triangles: 15 bytes
/// each.
///
/// Make it once, in a `static` or at start-up, and use it at every tick.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{Capsule, Contacts, Options, Query, Tree, glam::Vec3};
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
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Contacts<const N: usize, const NEAR: usize = 512> {
    found: List<N>,
    basins: Basins<NEAR>,
}

/// The contacts found, and a bound on the others.
#[derive(Clone, Debug)]
struct List<const N: usize> {
    list: [Contact; N],
    count: usize,
    bound: f32,
    accuracy: f32,
    is_full: bool,
    /// The margin that was asked for.
    margin: f32,
    is_cut_short: bool,
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
        let found = List {
            list: [Contact::NONE; N],
            count: 0,
            bound: f32::NEG_INFINITY,
            accuracy: 0.0,
            is_full: false,
            margin: f32::NEG_INFINITY,
            is_cut_short: true,
        };
        Self { found, basins: Basins::new() }
    }

    /// The contacts, deepest first.
    pub fn iter(&self) -> impl Iterator<Item = &Contact> + Clone {
        self.found.list.iter().take(self.found.count)
    }

    /// Number of contacts.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.found.count
    }

    /// Whether there are no contacts.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.found.count == 0
    }

    /// The contacts, deepest first, for a constraint that acts within `margin` (mm). A full list is no error: it has the
    /// deepest.
    ///
    /// # Errors
    /// [`Unavailable::CutShort`] if the budget ended before all contacts within the margin were known, or no query
    /// filled the list; [`QueryError::Margin`] if the query's margin was less.
    pub fn within(
        &self,
        margin: f32,
    ) -> Result<impl Iterator<Item = &Contact> + Clone, Unavailable> {
        let List { bound, is_cut_short, .. } = self.found;
        if is_cut_short && !(bound >= margin) {
            return Err(Unavailable::CutShort);
        }
        if !(margin <= self.found.margin) {
            return Err(QueryError::Margin { bits: margin.to_bits() }.into());
        }
        Ok(self.iter())
    }

    /// Every contact whose separation is below this (mm) is in the list. It is the margin, unless the list or `NEAR`
    /// was too short or the budget ran out; negative infinity if it ran out before the side was known.
    #[must_use]
    pub const fn bound(&self) -> f32 {
        self.found.bound
    }

    /// No separation is off by more than this.
    #[must_use]
    pub const fn accuracy(&self) -> f32 {
        self.found.accuracy
    }

    /// Whether the list is full, so that the farthest contacts within the margin were left out.
    #[must_use]
    pub const fn is_full(&self) -> bool {
        self.found.is_full
    }

    /// Sets each contact's velocity to that of the surface there, from a table of the vertices' velocities (mm/s).
    ///
    /// # Errors
    /// [`QueryError::VertexCount`] if a contact's corner has no row in the table.
    pub fn move_with<V: VertexTable + ?Sized>(&mut self, velocities: &V) -> Result<(), QueryError> {
        for contact in self.found.list.iter_mut().take(self.found.count) {
            let mut velocity = Vec3::ZERO;
            for (corner, weight) in contact.corners.into_iter().zip(contact.barycentric) {
                let found = velocities.len() as u32;
                let expected = corner.saturating_add(1);
                let moving = velocities.position(corner);
                velocity += weight * moving.ok_or(QueryError::VertexCount { expected, found })?;
            }
            contact.velocity = velocity;
        }
        Ok(())
    }
}

impl<const N: usize> List<N> {
    fn clear(&mut self) {
        self.count = 0;
        self.bound = f32::NEG_INFINITY;
        self.is_full = false;
        self.margin = f32::NEG_INFINITY;
        self.is_cut_short = true;
    }

    /// Inserts a contact in order, and drops the farthest if there is no room.
    fn insert(&mut self, contact: Contact) {
        let mut at = self.count;
        if at < N {
            self.count += 1;
        } else {
            self.is_full = true;
            let farthest = self.list.last().map_or(f32::NEG_INFINITY, |last| last.separation);
            let dropped = if contact.separation > farthest { contact.separation } else { farthest };
            if dropped < self.bound {
                self.bound = dropped;
            }
            if !(contact.separation < farthest) {
                return;
            }
            at = at.saturating_sub(1);
        }
        while let Some(before) = at.checked_sub(1)
            && let Some(&other) = self.list.get(before)
            && other.separation > contact.separation
        {
            if let Some(place) = self.list.get_mut(at) {
                *place = other;
            }
            at = before;
        }
        if let Some(place) = self.list.get_mut(at) {
            *place = contact;
        }
    }
}

impl<I: Index, const STACK: usize> Query<'_, I, STACK> {
    /// Finds all locally closest pairs of the tool and the outer side of the surface whose separation is at most
    /// `margin` (mm). For a tool that is inside the only contact is its deepest pair; for one that crosses the surface
    /// that pair is the first.
    ///
    /// Two valleys of the distance are one contact unless a ridge of more than a 64th of the margin parts them, so a
    /// flat wall along a capsule is one. Pairs with the inner side of a sheet, say the far side of an organ, are not
    /// contacts. Where the side is undefined the tool is taken to be outside. If that is because the budget ended,
    /// contacts may be missing at any distance: see [`Contacts::within`].
    ///
    /// Cost: that of [`closest`](Self::closest), a range search, and some hundred instructions for each triangle within
    /// the margin.
    ///
    /// # Errors
    /// [`QueryError`]: those of [`closest`](Self::closest); [`QueryError::NoAdjacency`] for a tree without;
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
        let Contacts { found, basins } = contacts;
        found.clear();
        basins.clear();
        if N == 0 || NEAR == 0 || NEAR >= usize::from(u16::MAX) {
            return Err(QueryError::Contacts { capacity: N as u32, near: NEAR as u32 });
        }
        // Written so that NaN fails.
        let is_possible = margin >= 0.0 && margin.is_finite();
        if !is_possible {
            return Err(QueryError::Margin { bits: margin.to_bits() });
        }
        if !self.tree.has_adjacency() {
            return Err(QueryError::NoAdjacency);
        }
        let closest = self.closest(vertices, tool, options)?;
        (found.accuracy, found.margin) = (closest.accuracy, margin);
        // The search below takes the positions as exact; the answer's accuracy has their error already.
        let accuracy = closest.accuracy - vertices.position_error();
        let has_side = closest.side != Side::Undefined(NoSide::CutShort);
        if closest.side == Side::Inside || (closest.lower > margin && has_side) {
            (found.bound, found.is_cut_short) = (margin, false);
            if let Some(contact) = Contact::at(&closest).filter(|at| at.separation <= margin) {
                found.insert(contact);
            }
            return Ok(closest);
        }
        let Budget { node_tests, triangle_tests } = options.budget;
        let budget = Budget {
            node_tests: node_tests.saturating_sub(closest.node_tests),
            triangle_tests: triangle_tests.saturating_sub(closest.triangle_tests),
        };
        let limit = tool.radius() + margin;
        let mut complete = limit;
        let options = options.budget(budget);
        let search = Search::start(&self.tree, &mut self.stack, vertices, tool, &options, None)?;
        let left = search.each_within(limit, |row, square| {
            if let Some(farthest) = basins.push(Near { square, row }) {
                complete = sqrt(farthest);
            }
            complete
        })?;
        let least = if left < complete { left } else { complete };
        found.is_cut_short = !has_side || left < limit;
        // Without a side the tool may be inside, deeper than every pair seen.
        found.bound = if has_side { least - tool.radius() } else { f32::NEG_INFINITY };
        let is_crossing = closest.side == Side::Crossing;
        if is_crossing && let Some(contact) = Contact::at(&closest) {
            found.insert(contact);
        }
        let ridge = (margin * RIDGE) + 2.0 * accuracy;
        let tree = self.tree;
        let mut failed = None;
        basins.each_valley(&tree, ridge, |near| {
            let is_on = sqrt(near.square) <= accuracy;
            // The crossing pair, inserted above, stands for these triangles.
            if is_crossing && is_on {
                return;
            }
            match pair_at(&tree, vertices, tool, near, accuracy) {
                Ok(pair) if pair.side == Side::Inside || pair.separation > margin => (),
                Ok(pair) => {
                    if let Some(contact) = Contact::at(&pair) {
                        found.insert(contact);
                    }
                }
                Err(error) => failed = Some(error),
            }
        });
        match failed {
            Some(error) => {
                found.clear();
                Err(error)
            }
            None => Ok(closest),
        }
    }
}

/// The pair of a tool and the lowest triangle of a valley.
fn pair_at<I: Index, V: VertexTable + ?Sized, T: Tool>(
    tree: &crate::Tree<'_, I>,
    vertices: &V,
    tool: &T,
    near: Near,
    accuracy: f32,
) -> Result<Proximity, QueryError> {
    let row = near.row;
    let corners = tree.triangle(row).ok_or(QueryError::Corrupt { row })?;
    let [a, b, c] = corners;
    let position = |vertex| vertices.position(vertex).ok_or(QueryError::Corrupt { row: vertex });
    let positions = [position(a)?, position(b)?, position(c)?];
    let found = tool.closest_on_triangle(&positions, f32::INFINITY);
    let found = found.ok_or(QueryError::Position { vertex: a })?;
    let axis_distance = sqrt(found.distance_squared);
    let towards = found.on_axis - found.on_surface;
    let length = sqrt(towards.length_squared());
    let direction = if length > 0.0 { towards / length } else { Vec3::ZERO };
    let separation = axis_distance - tool.radius();
    let mut pair = Proximity {
        separation,
        lower: separation,
        accuracy,
        side: Side::Undefined(NoSide::NotAsked),
        axis_distance,
        point_on_surface: found.on_surface,
        point_on_tool: found.on_axis,
        direction,
        axis_parameter: found.axis_parameter,
        triangle: Some(TriangleRow(row)),
        corners,
        barycentric: found.barycentric,
        node_tests: 0,
        triangle_tests: 0,
    };
    let at = side::of_point(tree, vertices, &pair, found.on_axis)?;
    pair.side = at.side;
    if at.outward != Vec3::ZERO {
        pair.direction = at.outward;
    }
    pair.point_on_tool = found.on_axis - pair.direction * tool.radius();
    Ok(pair)
}
