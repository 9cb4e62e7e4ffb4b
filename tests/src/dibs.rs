//! The library under test as a method of the benchmark. It uses the batched search, which is the one for hosts.

use dibs_build::BuiltTree;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Index, MeasuredStretch, Options, Query, StretchError, Tree, TriangleRow, VertexTable,
    measure_stretch,
};
use glam::Vec3;

use crate::method::{Found, Method, Probe};

/// Entries of the traversal's stack: enough for every built tree.
const STACK: usize = MAX_STACK;

/// What a query knows in addition to the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Knowledge {
    /// Whether the frame's stretch is measured in `update`.
    pub measured: bool,
    /// Whether it starts from the triangle of the last answer.
    pub warm: bool,
}

/// Queries on a built tree of either index width.
///
/// # Panics
/// If the bytes are not those of a tree.
#[must_use]
pub fn queries<'t>(built: &'t BuiltTree, knowledge: Knowledge) -> Box<dyn Method + 't> {
    match built.index_bits() {
        16 => Box::new(Dibs::new(built, built.tree::<u16>().expect("valid"), knowledge)),
        _ => Box::new(Dibs::new(built, built.tree::<u32>().expect("valid"), knowledge)),
    }
}

/// The same queries with vertices in the mesh's order, read through the tree's, to measure the benefit of that order.
///
/// # Panics
/// If the bytes are not those of a tree.
#[must_use]
pub fn unordered_queries(built: &BuiltTree) -> Box<dyn Method + '_> {
    match built.index_bits() {
        16 => Box::new(Unordered::new(built, built.tree::<u16>().expect("valid"))),
        _ => Box::new(Unordered::new(built, built.tree::<u32>().expect("valid"))),
    }
}

/// Returns the largest stretch of a frame (its positions in the mesh's order), or `None` beyond the limit.
pub type StretchOf<'t> = Box<dyn Fn(&[Vec3]) -> Option<f32> + 't>;

/// Measures frames on a built tree of either index width.
///
/// # Panics
/// If the bytes are not those of a tree with its rest shape.
#[must_use]
pub fn stretch(built: &BuiltTree) -> StretchOf<'_> {
    match built.index_bits() {
        16 => stretch_on(built, built.tree::<u16>().expect("valid")),
        _ => stretch_on(built, built.tree::<u32>().expect("valid")),
    }
}

fn stretch_on<'t, I: Index>(built: &'t BuiltTree, tree: Tree<'t, I>) -> StretchOf<'t> {
    Box::new(move |positions| match measure_stretch(&tree, built.to_rows(positions).as_slice()) {
        Ok(stretch) => Some(stretch.sigma()),
        Err(StretchError::Exceeded { .. }) => None,
        Err(error) => panic!("{error}"),
    })
}

struct Dibs<'t, I> {
    query: Query<'t, I, STACK>,
    order: &'t [u32],
    rows: Vec<Vec3>,
    knowledge: Knowledge,
    stretch: Option<MeasuredStretch>,
    last: Option<TriangleRow>,
}

impl<'t, I: Index> Dibs<'t, I> {
    fn new(built: &'t BuiltTree, tree: Tree<'t, I>, knowledge: Knowledge) -> Self {
        let query = Query::new(&tree).expect("enough for any tree");
        let order = built.vertex_order();
        Self { query, order, rows: Vec::new(), knowledge, stretch: None, last: None }
    }
}

impl<I: Index> Method for Dibs<'_, I> {
    fn load(&mut self, positions: &[Vec3]) {
        self.rows.clear();
        self.rows.extend(self.order.iter().map(|&vertex| positions[vertex as usize]));
    }

    fn update(&mut self) {
        if self.knowledge.measured {
            let measured = measure_stretch(self.query.tree(), self.rows.as_slice());
            self.stretch = Some(measured.expect("streams keep to the limit"));
        }
    }

    fn find(&mut self, tool: &Probe) -> Found {
        let mut options = Options::cold();
        if let Some(stretch) = self.stretch {
            options = options.stretch(stretch);
        }
        if self.knowledge.warm {
            options = options.warm_start(self.last);
        }
        let (found, last) = ask(&mut self.query, self.rows.as_slice(), tool, &options);
        self.last = last;
        found
    }
}

struct Unordered<'t, I> {
    query: Query<'t, I, STACK>,
    table: Looked<'t>,
}

/// Positions in the mesh's order, as a table in the order of the tree's rows.
struct Looked<'t> {
    order: &'t [u32],
    positions: Vec<Vec3>,
}

impl VertexTable for Looked<'_> {
    fn len(&self) -> usize {
        self.order.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.positions.get(*self.order.get(vertex as usize)? as usize).copied()
    }
}

impl<'t, I: Index> Unordered<'t, I> {
    fn new(built: &'t BuiltTree, tree: Tree<'t, I>) -> Self {
        let query = Query::new(&tree).expect("enough for any tree");
        Self { query, table: Looked { order: built.vertex_order(), positions: Vec::new() } }
    }
}

impl<I: Index> Method for Unordered<'_, I> {
    fn load(&mut self, positions: &[Vec3]) {
        self.table.positions.clear();
        self.table.positions.extend_from_slice(positions);
    }

    fn update(&mut self) {}

    fn find(&mut self, tool: &Probe) -> Found {
        ask(&mut self.query, &self.table, tool, &Options::cold()).0
    }
}

fn ask<I: Index>(
    query: &mut Query<'_, I, STACK>,
    vertices: &(impl VertexTable + ?Sized),
    tool: &Probe,
    options: &Options,
) -> (Found, Option<TriangleRow>) {
    let options = &options.unsigned();
    let answer = match tool {
        Probe::Sphere(sphere) => query.closest_batched(vertices, sphere, options),
        Probe::Capsule(capsule) => query.closest_batched(vertices, capsule, options),
    };
    let answer = answer.expect("streams hold finite positions");
    let tests = Some([answer.node_tests, answer.triangle_tests]);
    (Found { separation: answer.separation.max(0.0), tests }, answer.triangle)
}
