//! The closest of the tools that form an instrument.

use super::{Budget, NoSide, Options, Proximity, Query, Side};
use crate::unavailable::QueryError;
use crate::{Index, Tool, TriangleRow, VertexTable};

/// Tools that may be passed over: one for each bit of a set.
const PASSED: usize = 64;

impl<I: Index, const STACK: usize> Query<'_, I, STACK> {
    /// The closest pair between the surface and a chain of tools, with the tool's number in the slice; `None` for an
    /// empty slice.
    ///
    /// The answer has the least signed separation of all tools, and the least lower end; its tests are those of all. A
    /// tool is searched no farther than the closest so far, and again without that limit if another one is found inside
    /// or crossing. That suffices for a chain, whose axes touch each other: it cannot have one tool outside and another
    /// one inside unless one of them crosses the surface. Query tools that do not touch one by one.
    ///
    /// Only pairs whose unsigned separation is at most `separation` (mm) are looked for, as by
    /// [`closest_within`](Self::closest_within): in a scene of several surfaces that of the closest pair so far, else
    /// `f32::INFINITY`.
    ///
    /// Cost: the budget at most, for all tools together.
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
    /// let closest = query.closest_of(rows.as_slice(), &chain, f32::INFINITY, &Options::new())?;
    /// assert!(closest.is_some_and(|(tool, _)| tool == 2));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn closest_of<V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        vertices: &V,
        tools: &[T],
        separation: f32,
        options: &Options,
    ) -> Result<Option<(usize, Proximity)>, QueryError> {
        let mut chain = Chain::new(options);
        let nearest = self.nearest(vertices, tools, options);
        let mut passed = 0_u64;
        let others = (0..tools.len()).filter(|&number| number != nearest);
        for number in [nearest].into_iter().chain(others) {
            let Some(tool) = tools.get(number) else { continue };
            let limit = if number < PASSED { chain.limit() } else { f32::INFINITY };
            let limit = if limit < separation { limit } else { separation };
            let found = self.closest_within(vertices, tool, limit, &chain.options)?;
            if !(found.separation <= limit) {
                passed |= 1_u64.checked_shl(number as u32).unwrap_or(0);
            }
            chain.add(number, found);
        }
        if !chain.is_outside {
            for (number, tool) in tools.iter().enumerate().take(PASSED) {
                if passed >> number & 1 != 0 {
                    let found = self.closest_within(vertices, tool, separation, &chain.options)?;
                    chain.add(number, found);
                }
            }
        }
        let best = chain.finish();
        self.triangle = best.and_then(|(_, closest)| closest.triangle).or(self.triangle);
        Ok(best)
    }

    /// The number of the tool that is nearest to the triangle that a query would test first.
    fn nearest<V: VertexTable + ?Sized, T: Tool>(
        &self,
        vertices: &V,
        tools: &[T],
        options: &Options,
    ) -> usize {
        let first = options.first(self.triangle);
        let corners = first.and_then(|TriangleRow(row)| self.tree.triangle(row));
        let Some(at) = corners.and_then(|[corner, ..]| vertices.position(corner)) else { return 0 };
        let (mut nearest, mut least) = (0, f32::INFINITY);
        for (number, tool) in tools.iter().enumerate() {
            let squared = tool.axis_distance_squared(at);
            if squared < least {
                (nearest, least) = (number, squared);
            }
        }
        nearest
    }
}

/// The answers of a chain's tools so far.
struct Chain {
    best: Option<(usize, Proximity)>,
    /// No tool was found inside or crossing.
    is_outside: bool,
    lower: f32,
    accuracy: f32,
    node_tests: u32,
    triangle_tests: u32,
    /// With the rest of the budget.
    options: Options,
}

impl Chain {
    fn new(options: &Options) -> Self {
        Self {
            best: None,
            is_outside: true,
            lower: f32::INFINITY,
            accuracy: 0.0,
            node_tests: 0,
            triangle_tests: 0,
            options: *options,
        }
    }

    /// A tool outside that is farther than this is not the closest; infinite once a tool was found inside or crossing,
    /// since others may then be deeper.
    fn limit(&self) -> f32 {
        match &self.best {
            Some((_, closest)) if self.is_outside => closest.separation,
            _ => f32::INFINITY,
        }
    }

    fn add(&mut self, number: usize, found: Proximity) {
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
        if self.best.is_none_or(|(_, best)| found.separation < best.separation) {
            self.best = Some((number, found));
        }
    }

    fn finish(self) -> Option<(usize, Proximity)> {
        let Self { lower, accuracy, node_tests, triangle_tests, .. } = self;
        let (number, best) = self.best?;
        Some((number, Proximity { lower, accuracy, node_tests, triangle_tests, ..best }))
    }
}
