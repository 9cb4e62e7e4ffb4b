//! Several tools and several surfaces: the closest of all pairs.

// Requirement: A-09

use glam::Vec3;

use super::contacts::Pair;
use super::passed::{self, SkippedTools};
use super::search::WITHIN;
use super::{Contacts, NoSide, Options, Proximity, Query, Side};
use crate::math::order::larger;
use crate::unavailable::QueryError;
use crate::{Index, Tool, TriangleRow, VertexTable};

/// The closest pair of a chain of tools and the surfaces of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Closest {
    /// The surface's index in its slice; 0 for a single surface.
    pub surface: usize,
    /// The tool's index in its slice.
    pub tool: usize,
    /// The closest pair. Its `lower` is the least of all pairs, its accuracy the worst, its test counts are sums over
    /// all pairs. Its side is [`NoSide::CutShort`] if the budget ran out before the side at every pair was found.
    pub proximity: Proximity,
}

impl<I: Index, const STACK: usize> Query<'_, I, STACK> {
    /// As [`closest`](Self::closest), but only for pairs with an unsigned separation of at most `separation` (mm): a
    /// surface beyond that is rejected after a few tests.
    ///
    /// If there is no such pair, the answer's interval begins at `separation` and its side is [`NoSide::CutShort`]. NaN
    /// sets no limit.
    ///
    /// # Errors
    /// Same as [`closest`](Self::closest).
    pub fn closest_within<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        separation: f32,
        options: &Options,
    ) -> Result<Proximity, QueryError> {
        self.within(vertices, tool, separation, options).map(|(found, _)| found)
    }

    /// As [`closest_within`](Self::closest_within); also returns whether every pair is certainly farther.
    fn within<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        separation: f32,
        options: &Options,
    ) -> Result<(Proximity, bool), QueryError> {
        // A corner beyond the limit would not lower the cutoff.
        let limit = separation + tool.radius();
        let first = self.first_corner(vertices, options);
        let first =
            first.filter(|(_, corner)| !(tool.axis_distance_squared(*corner) > limit * limit));
        let first = first.map(|(first, _)| first);
        let mut search = self.search(vertices, tool, options, first)?;
        let limit = search.limit_to(separation);
        let found = search.run::<WITHIN>(limit)?;
        // A search that ran out of budget has a lower bound below the limit.
        let is_farther = !(found.separation <= separation) && found.lower >= limit - tool.radius();
        Ok((self.sided(vertices, tool, options, found)?, is_farther))
    }

    /// The closest pair between the surface and a chain of tools; `None` for an empty slice.
    ///
    /// Each tool is searched no farther than the smallest separation so far, and again without that limit if it may be
    /// inside. A link is not inside if an adjoining link is outside of a closed surface and neither touches it. Tools
    /// that do not touch each other, and all tools at an open surface, cost as much as one query for each tool.
    ///
    /// Cost: at most the budget for all tools together, plus one node test for each tool.
    ///
    /// # Errors
    /// Same as [`closest`](Self::closest).
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::{Capsule, Options, Query, Tree, glam::Vec3};
    ///
    /// let heart = generate::heart(1_000)?.mesh;
    /// let built = Builder::new().build(&heart)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// let rows = built.to_rows(&heart.positions);
    /// let mut query = Query::<_, 32>::new(&tree)?;
    ///
    /// let joints = [200.0, 140.0, 100.0, 80.0].map(|x| Vec3::new(x, 0.0, 20.0));
    /// let [shaft, wrist, jaw] = [0, 1, 2].map(|at| Capsule::new(joints[at], joints[at + 1], 2.5));
    /// let chain = [shaft?, wrist?, jaw?];
    /// let closest = query.closest_of(rows.as_slice(), &chain, &Options::new())?;
    /// assert!(closest.is_some_and(|closest| closest.tool == 2));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn closest_of<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tools: &[T],
        options: &Options,
    ) -> Result<Option<Closest>, QueryError> {
        let mut scene = Scene::new(options);
        self.add_to(&mut scene, 0, vertices, tools, |_, _, _, _| Ok(()))?;
        Ok(scene.finish())
    }

    /// The closest pair between a chain of tools and the surfaces of a scene, each with its query; `None` if there is
    /// no tool or no surface.
    ///
    /// With signed options each surface is searched at least once without a limit, since a tool deep inside is far from
    /// the surface. With unsigned options a surface is searched no farther than the closest pair so far. The surface
    /// whose last answer is nearest comes first.
    ///
    /// Cost: at most the budget for all pairs together, plus one node test for each pair.
    ///
    /// # Errors
    /// Same as [`closest`](Self::closest), for any surface.
    pub fn closest_in_scene<V: VertexTable + ?Sized, T: Tool>(
        surfaces: &mut [(&mut Self, &V)],
        tools: &[T],
        options: &Options,
    ) -> Result<Option<Closest>, QueryError> {
        let mut scene = Scene::new(options);
        for at in Self::nearest_surface_first(surfaces, tools, options) {
            if let Some((query, vertices)) = surfaces.get_mut(at) {
                query.add_to(&mut scene, at, *vertices, tools, |_, _, _, _| Ok(()))?;
            }
        }
        Ok(scene.finish())
    }

    /// The closest pair as [`closest_in_scene`](Self::closest_in_scene), and the contacts of all pairs in one list:
    /// [`Contact::surface`](crate::Contact::surface) and [`tool`](crate::Contact::tool) tell them apart. A chain and one
    /// surface are a scene too.
    ///
    /// Each pair is searched as far as the closest pair so far or the margin, whichever is larger. Its contacts are as
    /// in [`contacts`](Self::contacts); the list's bound holds for all pairs.
    ///
    /// Cost: at most the budget for all pairs together, plus one node test for each pair.
    ///
    /// # Errors
    /// Same as [`contacts`](Self::contacts), for any surface.
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::{Capsule, Contacts, Options, Query, Tree, glam::Vec3};
    ///
    /// let heart = generate::heart(1_000)?.mesh;
    /// let built = Builder::new().build(&heart)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// let rows = built.to_rows(&heart.positions);
    /// let beside: Vec<Vec3> = rows.iter().map(|row| *row + Vec3::new(130.0, 0.0, 0.0)).collect();
    ///
    /// let (mut one, mut other) = (Query::<_, 32>::new(&tree)?, Query::<_, 32>::new(&tree)?);
    /// let tool = Capsule::new(Vec3::new(80.0, 0.0, -40.0), Vec3::new(80.0, 0.0, 40.0), 2.5)?;
    /// let mut contacts = Contacts::<32>::new();
    /// let mut scene = [(&mut one, rows.as_slice()), (&mut other, beside.as_slice())];
    /// Query::contacts_in_scene(&mut scene, &[tool], 60.0, &Options::new(), &mut contacts)?;
    /// for surface in 0..2 {
    ///     assert!(contacts.iter().any(|contact| contact.surface == surface));
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn contacts_in_scene<
        V: VertexTable + ?Sized,
        T: Tool,
        const N: usize,
        const NEAR: usize,
    >(
        surfaces: &mut [(&mut Self, &V)],
        tools: &[T],
        margin: f32,
        options: &Options,
        contacts: &mut Contacts<N, NEAR>,
    ) -> Result<Option<Closest>, QueryError> {
        contacts.begin(margin, surfaces.iter().all(|(query, _)| query.tree.has_adjacency()))?;
        let scene = Scene { margin, ..Scene::new(options) };
        let found = Self::add_scene_contacts(scene, surfaces, tools, contacts);
        contacts.unless_failed(found)
    }

    fn add_scene_contacts<V: VertexTable + ?Sized, T: Tool, const N: usize, const NEAR: usize>(
        mut scene: Scene,
        surfaces: &mut [(&mut Self, &V)],
        tools: &[T],
        contacts: &mut Contacts<N, NEAR>,
    ) -> Result<Option<Closest>, QueryError> {
        for surface in Self::nearest_surface_first(surfaces, tools, &scene.options) {
            let Some((query, vertices)) = surfaces.get_mut(surface) else { continue };
            query.add_to(
                &mut scene,
                surface,
                *vertices,
                tools,
                |query, scene, number, closest| {
                    let Some(tool) = tools.get(number) else { return Ok(()) };
                    let Query { tree, stack, .. } = query;
                    let pair = Pair { tree, vertices: *vertices, tool, closest, surface, number };
                    let made = contacts.add(&pair, stack, &scene.options.unpriced())?;
                    scene.options = scene.options.after(made);
                    Ok(())
                },
            )?;
        }
        Ok(scene.finish())
    }

    /// Indices of the surfaces. The first is the one whose last answer is nearest to a tool now.
    fn nearest_surface_first<V: VertexTable + ?Sized, T: Tool>(
        surfaces: &[(&mut Self, &V)],
        tools: &[T],
        options: &Options,
    ) -> impl Iterator<Item = usize> + use<I, V, T, STACK> {
        let (mut nearest, mut least) = (0, f32::INFINITY);
        for (at, (query, vertices)) in surfaces.iter().enumerate() {
            let (_, squared) = query.nearest(*vertices, tools, options);
            if squared < least {
                (nearest, least) = (at, squared);
            }
        }
        nearest_first(nearest, surfaces.len())
    }

    /// Searches this surface, number `surface` of the scene. Calls `near` with the number and closest pair of each tool
    /// that is within the scene's limit, inside or crossing.
    fn add_to<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        scene: &mut Scene,
        surface: usize,
        vertices: &V,
        tools: &[T],
        mut near: impl FnMut(&mut Self, &mut Scene, usize, &Proximity) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        scene.enter(self.tree.has_adjacency(), self.tree.is_closed());
        let (nearest, _) = self.nearest(vertices, tools, &scene.options);
        let (mut passed, mut best) = (SkippedTools::new(), None);
        for number in nearest_first(nearest, tools.len()) {
            let Some(tool) = tools.get(number) else { continue };
            let limit = if number < passed::MOST { scene.limit() } else { f32::INFINITY };
            let (found, is_farther) = self.within(vertices, tool, limit, &scene.options)?;
            scene.add(surface, number, found, &mut best);
            let is_outside = found.side == Side::Outside;
            if is_outside || is_farther {
                // Less the accuracy, so that an axis end next to the surface does not count as outside. No test covers
                // this: such a tool is searched anyway.
                passed.add(number, found.lower + tool.radius() - found.accuracy, is_outside);
            }
            if !is_farther {
                scene.is_cut_short |= found.side == Side::Undefined(NoSide::CutShort);
                near(self, scene, number, &found)?;
            }
        }
        if scene.has_sides {
            for number in passed.unsure(tools) {
                let Some(tool) = tools.get(number) else { continue };
                let found = self.closest_within(vertices, tool, f32::INFINITY, &scene.options)?;
                scene.add(surface, number, found, &mut best);
                scene.is_cut_short |= found.side == Side::Undefined(NoSide::CutShort);
                near(self, scene, number, &found)?;
            }
        }
        self.triangle = best.and_then(|best: Proximity| best.triangle).or(self.triangle);
        Ok(())
    }

    /// The triangle that a query would test first, and a corner of it.
    fn first_corner<V: VertexTable + ?Sized>(
        &self,
        vertices: &V,
        options: &Options,
    ) -> Option<(TriangleRow, Vec3)> {
        let first = options.first(self.triangle)?;
        let [corner, ..] = self.tree.triangle(first.0)?;
        Some((first, vertices.position(corner)?))
    }

    /// The tool that is nearest to the triangle that a query would test first, and the square of its distance.
    fn nearest<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tools: &[T],
        options: &Options,
    ) -> (usize, f32) {
        let (mut nearest, mut least) = (0, f32::INFINITY);
        let Some((_, corner)) = self.first_corner(vertices, options) else {
            return (nearest, least);
        };
        for (number, tool) in tools.iter().enumerate() {
            let squared = tool.axis_distance_squared(corner);
            if squared < least {
                (nearest, least) = (number, squared);
            }
        }
        (nearest, least)
    }
}

/// The numbers below `count`, with `nearest` first.
fn nearest_first(nearest: usize, count: usize) -> impl Iterator<Item = usize> {
    let others = (0..count).filter(move |&number| number != nearest);
    [nearest].into_iter().filter(move |&number| number < count).chain(others)
}

struct Scene {
    /// The closest pair so far, with the interval and test counts of all pairs.
    best: Option<Closest>,
    /// With the remaining budget.
    options: Options,
    /// Pairs within this separation are searched even if another one is closer.
    margin: f32,
    /// A tool of the chain was searched on the current surface.
    is_entered: bool,
    /// No tool was found inside or crossing the current surface.
    is_outside: bool,
    /// The current surface has sides, and the options ask for the side.
    has_sides: bool,
    /// The budget ran out before the side of a tool was known.
    is_cut_short: bool,
}

impl Scene {
    fn new(options: &Options) -> Self {
        Self {
            best: None,
            options: *options,
            margin: f32::NEG_INFINITY,
            is_entered: false,
            is_outside: true,
            has_sides: false,
            is_cut_short: false,
        }
    }

    /// Starts the next surface. At an open surface the side is that of the closest sheet, which may be far away.
    fn enter(&mut self, has_sides: bool, is_closed: bool) {
        self.has_sides = has_sides && self.options.is_signed;
        self.is_entered = !self.has_sides;
        self.is_outside = is_closed || !self.has_sides;
    }

    /// A tool outside with a larger separation is not the closest; infinite while the chain may be inside, where
    /// another tool may be deeper.
    fn limit(&self) -> f32 {
        match &self.best {
            Some(best) if self.is_entered && self.is_outside => {
                let closest = best.proximity.separation;
                larger(self.margin, closest)
            }
            _ => f32::INFINITY,
        }
    }

    /// Adds a pair, and keeps the closest of this surface in `own`.
    fn add(&mut self, surface: usize, tool: usize, found: Proximity, own: &mut Option<Proximity>) {
        self.is_entered = true;
        self.options = self.options.after(found.tests());
        let is_near = found.side == Side::Undefined(NoSide::BelowAccuracy);
        if found.side.has_depth() || is_near {
            self.is_outside = false;
        }
        if own.is_none_or(|own| found.separation < own.separation) {
            *own = Some(found);
        }
        let new = Closest { surface, tool, proximity: found };
        self.best = Some(self.best.map_or(new, |best| {
            let proximity = best.proximity.or_nearer(found);
            let is_nearer = found.separation < best.proximity.separation;
            Closest { proximity, ..if is_nearer { new } else { best } }
        }));
    }

    fn finish(self) -> Option<Closest> {
        let mut best = self.best?;
        if self.is_cut_short {
            best.proximity.side = Side::Undefined(NoSide::CutShort);
        }
        Some(best)
    }
}
