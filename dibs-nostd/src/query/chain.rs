//! Several tools and several surfaces: the closest of all pairs.

use glam::Vec3;

use super::search::Search;
use super::{Budget, NoSide, Options, Proximity, Query, Side, signed};
use crate::unavailable::QueryError;
use crate::{Index, Tool, TriangleRow, VertexTable};

/// Tools that may be passed over: one for each bit of a set.
const PASSED: usize = 64;

/// The closest pair of a chain of tools and the surfaces of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Closest {
    /// The surface's index in its slice; 0 for a single surface.
    pub surface: usize,
    /// The tool's index in its slice.
    pub tool: usize,
    /// The pair. Its interval begins at the least lower end of all pairs, its accuracy is the worst, its tests are
    /// those of all.
    pub proximity: Proximity,
}

impl<I: Index, const STACK: usize> Query<'_, I, STACK> {
    /// As [`closest`](Self::closest), but looks only for a pair whose unsigned separation is at most `separation` (mm):
    /// a far surface costs a few tests that way.
    ///
    /// Where there is no such pair, the answer's interval begins at that separation, and its side is not known
    /// ([`NoSide::CutShort`]). A separation that is not a number limits nothing.
    ///
    /// # Errors
    /// Those of [`closest`](Self::closest).
    pub fn closest_within<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tool: &T,
        separation: f32,
        options: &Options,
    ) -> Result<Proximity, QueryError> {
        // A corner beyond the limit would lower no cutoff.
        let limit = separation + tool.radius();
        let first = self.first_corner(vertices, options);
        let first =
            first.filter(|(_, corner)| !(tool.axis_distance_squared(*corner) > limit * limit));
        let first = first.map(|(first, _)| first);
        let mut search =
            Search::start(&self.tree, &mut self.stack, vertices, tool, options, first)?;
        let limit = search.limit_to(separation);
        let found = search.run::<true>(limit)?;
        self.triangle = found.triangle.or(self.triangle);
        let error = vertices.position_error();
        signed(&self.tree, &mut self.stack, vertices, tool, options, found, error)
    }

    /// The closest pair between the surface and a chain of tools; `None` for an empty slice.
    ///
    /// A tool is searched no farther than the closest so far, and again without that limit if another one is found
    /// inside or crossing. That suffices for a chain, whose axes touch each other: it cannot have one tool outside and
    /// another one inside unless one of them crosses the surface. Query tools that do not touch one by one.
    ///
    /// Cost: the budget at most, for all tools together, and a node test a tool.
    ///
    /// # Errors
    /// Those of [`closest`](Self::closest).
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
        self.add_to(&mut scene, 0, vertices, tools)?;
        Ok(scene.finish())
    }

    /// The closest pair between a chain of tools and the surfaces of a scene, each with its query; `None` without either.
    ///
    /// Signed options search each surface at least once without a limit, since a tool deep inside it is far from it.
    /// Unsigned ones search no surface farther than the closest pair so far, nearest surface of the last answers first.
    ///
    /// Cost: the budget at most, for all pairs together, and a node test a pair.
    ///
    /// # Errors
    /// Those of [`closest`](Self::closest), of any surface.
    pub fn closest_in_scene<V: VertexTable + ?Sized, T: Tool>(
        surfaces: &mut [(&mut Self, &V)],
        tools: &[T],
        options: &Options,
    ) -> Result<Option<Closest>, QueryError> {
        let mut scene = Scene::new(options);
        let (mut nearest, mut least) = (0, f32::INFINITY);
        for (at, (query, vertices)) in surfaces.iter().enumerate() {
            let (_, squared) = query.nearest(*vertices, tools, options);
            if squared < least {
                (nearest, least) = (at, squared);
            }
        }
        for at in nearest_first(nearest, surfaces.len()) {
            if let Some((query, vertices)) = surfaces.get_mut(at) {
                query.add_to(&mut scene, at, *vertices, tools)?;
            }
        }
        Ok(scene.finish())
    }

    /// Adds this surface, number `surface` of the scene.
    fn add_to<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        scene: &mut Scene,
        surface: usize,
        vertices: &V,
        tools: &[T],
    ) -> Result<(), QueryError> {
        scene.enter();
        let (nearest, _) = self.nearest(vertices, tools, &scene.options);
        let (mut passed, mut best) = (0_u64, None);
        for number in nearest_first(nearest, tools.len()) {
            let Some(tool) = tools.get(number) else { continue };
            let limit = if number < PASSED { scene.limit() } else { f32::INFINITY };
            let found = self.closest_within(vertices, tool, limit, &scene.options)?;
            if !(found.separation <= limit) {
                passed |= 1_u64.checked_shl(number as u32).unwrap_or(0);
            }
            scene.add(surface, number, found, &mut best);
        }
        if !scene.is_outside {
            for (number, tool) in tools.iter().enumerate().take(PASSED) {
                if passed >> number & 1 != 0 {
                    let found =
                        self.closest_within(vertices, tool, f32::INFINITY, &scene.options)?;
                    scene.add(surface, number, found, &mut best);
                }
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

/// The numbers below `count`, `nearest` first.
fn nearest_first(nearest: usize, count: usize) -> impl Iterator<Item = usize> {
    let others = (0..count).filter(move |&number| number != nearest);
    [nearest].into_iter().filter(move |&number| number < count).chain(others)
}

/// The pairs so far.
struct Scene {
    best: Option<Closest>,
    lower: f32,
    accuracy: f32,
    node_tests: u32,
    triangle_tests: u32,
    /// With the rest of the budget.
    options: Options,
    /// A tool of the chain was searched on the present surface.
    is_entered: bool,
    /// No tool was found inside or crossing the present surface.
    is_outside: bool,
}

impl Scene {
    fn new(options: &Options) -> Self {
        Self {
            best: None,
            lower: f32::INFINITY,
            accuracy: 0.0,
            node_tests: 0,
            triangle_tests: 0,
            options: *options,
            is_entered: false,
            is_outside: true,
        }
    }

    /// The next surface.
    fn enter(&mut self) {
        self.is_entered = !self.options.is_signed;
        self.is_outside = true;
    }

    /// A tool outside that is farther than this is not the closest; infinite while the chain may be inside, where
    /// another tool may be deeper.
    fn limit(&self) -> f32 {
        match &self.best {
            Some(best) if self.is_entered && self.is_outside => best.proximity.separation,
            _ => f32::INFINITY,
        }
    }

    /// Adds a pair, and keeps the surface's closest in `own`.
    fn add(&mut self, surface: usize, tool: usize, found: Proximity, own: &mut Option<Proximity>) {
        self.is_entered = true;
        let Budget { node_tests, triangle_tests } = self.options.budget;
        self.options.budget = Budget {
            node_tests: node_tests.saturating_sub(found.node_tests),
            triangle_tests: triangle_tests.saturating_sub(found.triangle_tests),
        };
        self.node_tests = self.node_tests.saturating_add(found.node_tests);
        self.triangle_tests = self.triangle_tests.saturating_add(found.triangle_tests);
        let side = found.side;
        if matches!(side, Side::Inside | Side::Crossing | Side::Undefined(NoSide::BelowAccuracy)) {
            self.is_outside = false;
        }
        if found.lower < self.lower {
            self.lower = found.lower;
        }
        if found.accuracy > self.accuracy {
            self.accuracy = found.accuracy;
        }
        if own.is_none_or(|own| found.separation < own.separation) {
            *own = Some(found);
        }
        if self.best.is_none_or(|best| found.separation < best.proximity.separation) {
            self.best = Some(Closest { surface, tool, proximity: found });
        }
    }

    fn finish(self) -> Option<Closest> {
        let Self { lower, accuracy, node_tests, triangle_tests, .. } = self;
        let Closest { surface, tool, proximity } = self.best?;
        let proximity = Proximity { lower, accuracy, node_tests, triangle_tests, ..proximity };
        Some(Closest { surface, tool, proximity })
    }
}
