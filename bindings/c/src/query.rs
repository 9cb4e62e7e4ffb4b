//! Queries: the closest pair, signed, within a budget.

use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Budget, Cost, Coverage, Interval, NoSide, Options, Proximity, Query, Side, TriangleRow,
};

use crate::border::{Handle, Input, Kind, Output, Storage};
use crate::code::dibs_code;
use crate::frame::{ask, dibs_frame};
use crate::tool::{Shape, dibs_tool, dibs_vec3};
use crate::tree::{Row, dibs_tree};

/// Bytes of a query's storage.
pub const DIBS_QUERY_SIZE: usize = 4_864;

/// Entries of the stack: as many as the format allows, so that every tree can be searched.
pub(crate) const STACK: usize = 512;

/// A query on one tree. It starts its search from its last answer.
///
/// One context at a time.
pub struct dibs_query(pub(crate) Query<'static, Row, STACK>);

impl Kind for dibs_query {
    const MARK: u32 = 0x6462_7108;
    const SIZE: usize = DIBS_QUERY_SIZE;
}

/// For a budget: unlimited work. For a pair of limits: no limit.
pub const DIBS_UNLIMITED: u32 = u32::MAX;

const _: () = assert!(Budget::UNLIMITED.tests() == DIBS_UNLIMITED);

// The documentation of the options' budget states this number.
const _: () = assert!(Budget::TRIANGLE == 8);

/// A flag of options: neither answer nor cost depends on earlier queries.
pub const DIBS_COLD: u32 = 1;

/// A flag of options: the side is not determined, which saves its cost. The separation is that of a tool outside.
pub const DIBS_UNSIGNED: u32 = 2;

/// A flag of options: lists only contacts of the triangles with the options' label, as if the others did not exist.
pub const DIBS_CONTACTS_OF: u32 = 4;

/// Options of a query. Null for none: no budget, a warm start, signed.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_options {
    /// The most work, in tests of spheres and planes, where an exact triangle test counts as 8:
    /// `dibs_budget_for_instructions`. 0 allows next to no work, so set it.
    pub budget: u32,
    /// Largest length (mm) of the interval of a depth if the tool's axis crosses the surface; 0 for a 512th of the
    /// axis' length.
    pub depth_tolerance: f32,
    /// Any sum of `DIBS_COLD`, `DIBS_UNSIGNED` and `DIBS_CONTACTS_OF`.
    pub flags: u32,
    /// A triangle's label, for `DIBS_CONTACTS_OF`: at most 255.
    pub label: u32,
}

impl dibs_options {
    /// Converts them to the core's options.
    pub(crate) fn of(options: *const Self) -> Result<Options, dibs_code> {
        options.get_if_any()?.map_or(Ok(Options::new()), Options::try_from)
    }
}

impl TryFrom<dibs_options> for Options {
    type Error = dibs_code;

    fn try_from(given: dibs_options) -> Result<Self, dibs_code> {
        let known = DIBS_COLD | DIBS_UNSIGNED | DIBS_CONTACTS_OF;
        if given.flags & !known != 0 || !(given.depth_tolerance >= 0.0) {
            return Err(dibs_code::Argument);
        }
        let mut options = Self::new().budget(Budget::new(given.budget));
        if given.flags & DIBS_COLD != 0 {
            options = options.warm_start(None);
        }
        if given.flags & DIBS_UNSIGNED != 0 {
            options = options.unsigned();
        }
        if given.flags & DIBS_CONTACTS_OF != 0 {
            let label = u8::try_from(given.label).map_err(|_| dibs_code::Argument)?;
            options = options.contacts_of(label);
        }
        if given.depth_tolerance > 0.0 {
            options = options.depth_tolerance(given.depth_tolerance);
        }
        Ok(options)
    }
}

/// The side of the surface on which a tool's axis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_side {
    /// Outside: from there the triangles' corners appear counter-clockwise.
    Outside = 0,
    /// The whole axis is inside.
    Inside = 1,
    /// The axis crosses the surface.
    Crossing = 2,
    /// No side: not requested.
    NotAsked = 3,
    /// No side: the tree has no adjacency.
    NoAdjacency = 4,
    /// No side: the closest point is on an open boundary of the surface.
    OpenBoundary = 5,
    /// No side: the axis is closer to the surface, or to a tie between its features, than the accuracy resolves.
    BelowAccuracy = 6,
    /// No side: the triangles at the closest point have no clear normal.
    Degenerate = 7,
    /// No side: the budget ran out.
    CutShort = 8,
    /// No side: the closest point is on an edge of more than two triangles that do not form pairs.
    NonManifold = 9,
    /// Of a tracker's kept answer: outside or not, its interval holds the separation.
    Either = 10,
}

/// Each side with its number.
const SIDES: [(dibs_side, Side); 11] = [
    (dibs_side::Outside, Side::Outside),
    (dibs_side::Inside, Side::Inside),
    (dibs_side::Crossing, Side::Crossing),
    (dibs_side::NotAsked, Side::Undefined(NoSide::NotAsked)),
    (dibs_side::NoAdjacency, Side::Undefined(NoSide::NoAdjacency)),
    (dibs_side::OpenBoundary, Side::Undefined(NoSide::OpenBoundary)),
    (dibs_side::BelowAccuracy, Side::Undefined(NoSide::BelowAccuracy)),
    (dibs_side::Degenerate, Side::Undefined(NoSide::Degenerate)),
    (dibs_side::CutShort, Side::Undefined(NoSide::CutShort)),
    (dibs_side::NonManifold, Side::Undefined(NoSide::NonManifold)),
    (dibs_side::Either, Side::Either),
];

/// How it is known that the tree's spheres cover the surface, so that no part of it is nearer than the answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_coverage {
    /// The stretch was measured on these positions.
    Measured = 0,
    /// A bound on the stretch follows from measured frames.
    Proven = 1,
    /// Nothing was measured: the tree's stretch limit is assumed to hold. If it does not, a nearer part of the surface
    /// can be missed.
    Assumed = 2,
}

const COVERAGES: [(dibs_coverage, Coverage); 3] = [
    (dibs_coverage::Measured, Coverage::Measured),
    (dibs_coverage::Proven, Coverage::Proven),
    (dibs_coverage::Assumed, Coverage::Assumed),
];

/// Row of a triangle if there is none.
pub const DIBS_NO_TRIANGLE: u32 = u32::MAX;

/// The closest pair. `dibs_proximity_interval` gives the interval that contains its separation.
///
/// If the side is none of the first three, the numbers are those of a tool outside.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_proximity {
    /// Signed separation (mm) of the best pair found: negative if tool and surface overlap.
    pub separation: f32,
    /// The interval's lower bound (mm): equal to `separation`, unless the budget ran out or the axis crosses the
    /// surface.
    pub lower: f32,
    /// Largest error (mm) of the separations above.
    pub accuracy: f32,
    /// A `dibs_side`.
    pub side: u32,
    /// A `dibs_coverage`: whether the stretch that the answer depends on was checked.
    pub coverage: u32,
    /// Distance (mm) from the tool's axis to the surface: 0 if they cross.
    pub axis_distance: f32,
    /// The surface's point of the pair (mm).
    pub point_on_surface: dibs_vec3,
    /// The tool's point of the pair, on the tool's surface (mm).
    pub point_on_tool: dibs_vec3,
    /// Unit vector that points out of the surface; zero if it is undefined.
    pub direction: dibs_vec3,
    /// Position of the pair along the tool's axis: 0 at its start, 1 at its end; 0 for a sphere.
    pub axis_parameter: f32,
    /// Row of the triangle of `point_on_surface`, or `DIBS_NO_TRIANGLE`.
    pub triangle: u32,
    /// That triangle's corners: rows of vertices, for `dibs_tree_vertex_number`.
    pub corners: [u32; 3],
    /// Weights of the corners at `point_on_surface`: not negative, sum 1.
    pub barycentric: [f32; 3],
    /// Sphere bounds evaluated.
    pub node_tests: u32,
    /// Exact tests of tool and triangle.
    pub triangle_tests: u32,
}

impl From<Proximity> for dibs_proximity {
    fn from(found: Proximity) -> Self {
        let side = SIDES.iter().find(|(_, side)| *side == found.side);
        let coverage = COVERAGES.iter().find(|(_, coverage)| *coverage == found.coverage);
        Self {
            separation: found.separation,
            lower: found.lower,
            accuracy: found.accuracy,
            side: side.map_or(dibs_side::NotAsked, |(number, _)| *number) as u32,
            coverage: coverage.map_or(dibs_coverage::Assumed, |(number, _)| *number) as u32,
            axis_distance: found.axis_distance,
            point_on_surface: found.point_on_surface.into(),
            point_on_tool: found.point_on_tool.into(),
            direction: found.direction.into(),
            axis_parameter: found.axis_parameter,
            triangle: found.triangle.map_or(DIBS_NO_TRIANGLE, |TriangleRow(row)| row),
            corners: found.corners,
            barycentric: found.barycentric,
            node_tests: found.node_tests,
            triangle_tests: found.triangle_tests,
        }
    }
}

impl TryFrom<dibs_proximity> for Proximity {
    type Error = dibs_code;

    fn try_from(given: dibs_proximity) -> Result<Self, dibs_code> {
        let side = SIDES.iter().find(|(number, _)| *number as u32 == given.side);
        let mut found = Self::NOWHERE;
        found.separation = given.separation;
        found.lower = given.lower;
        found.accuracy = given.accuracy;
        found.side = side.ok_or(dibs_code::Argument)?.1;
        let coverage = COVERAGES.iter().find(|(number, _)| *number as u32 == given.coverage);
        found.coverage = coverage.ok_or(dibs_code::Argument)?.1;
        found.axis_distance = given.axis_distance;
        found.point_on_surface = given.point_on_surface.into();
        found.point_on_tool = given.point_on_tool.into();
        found.direction = Vec3::from(given.direction);
        found.axis_parameter = given.axis_parameter;
        found.triangle =
            (given.triangle != DIBS_NO_TRIANGLE).then_some(TriangleRow(given.triangle));
        found.corners = given.corners;
        found.barycentric = given.barycentric;
        found.node_tests = given.node_tests;
        found.triangle_tests = given.triangle_tests;
        Ok(found)
    }
}

/// An interval of separations (mm).
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_interval {
    /// Lower bound of the true separation.
    pub lower: f32,
    /// Upper bound of the true separation.
    pub upper: f32,
}

/// The certified interval of a separation: both bounds include the accuracy, rounded outwards. Act on the lower one.
///
/// Without a side the tool may be inside to any depth: the lower bound is negative infinity. With `DIBS_SIDE_NOT_ASKED`
/// and `DIBS_SIDE_NO_ADJACENCY` it is that of a tool outside.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` for an invalid side or coverage, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_proximity_interval(
    proximity: *const dibs_proximity,
    interval: *mut dibs_interval,
) -> dibs_code {
    dibs_code::of(|| {
        let (place, proximity) = (interval.check()?, Proximity::try_from(proximity.get()?)?);
        let Interval { lower, upper } = proximity.interval();
        place.set(dibs_interval { lower, upper });
        Ok(())
    })
}

/// Makes a query on a tree.
///
/// @param storage  `DIBS_QUERY_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param tree     The tree.
/// @param query    Receives the query's address.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_query_init(
    storage: *mut c_void,
    size: usize,
    tree: *mut dibs_tree,
    query: *mut *mut dibs_query,
) -> dibs_code {
    dibs_code::of(|| storage.make(size, query, || Ok(dibs_query(Query::new(&tree.share()?.tree)?))))
}

/// The closest pair of the tool and the surface in the frame.
///
/// Exact within `accuracy`, as long as the surface is within its stretch limit. A budget that runs out is not an error:
/// the interval is then wider.
///
/// Cost: at most the budget.
///
/// @param query      The query.
/// @param frame      The surface.
/// @param tool       The tool.
/// @param options    Options, or null.
/// @param proximity  Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` for an empty frame, `DIBS_CODE_TOOL_COORDINATE` to
///         `DIBS_CODE_QUERY_FAILED`, `DIBS_CODE_TREE_CORRUPT`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_query_closest(
    query: *mut dibs_query,
    frame: *mut dibs_frame,
    tool: *const dibs_tool,
    options: *const dibs_options,
    proximity: *mut dibs_proximity,
) -> dibs_code {
    dibs_code::of(|| {
        let (proximity, options) = (proximity.check()?, dibs_options::of(options)?);
        let shape = Shape::try_from(tool.get()?)?;
        let (mut query, frame) = (query.open()?, frame.open()?);
        let found: Result<Proximity, dibs_code> =
            ask!(frame, shape, |table, tool| query.0.closest(table, tool, &options));
        proximity.set(found?.into());
        Ok(())
    })
}

/// A processor and a kind of tool whose instructions were measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_cost {
    /// A sphere on a Cortex-M7.
    M7Sphere = 0,
    /// A capsule on a Cortex-M7.
    M7Capsule = 1,
    /// A sphere on x86-64.
    X86Sphere = 2,
    /// A capsule on x86-64.
    X86Capsule = 3,
    /// A tick of a tracker or guard on a Cortex-M7, with contacts or without.
    M7Tick = 4,
    /// The same on a surface that nodes carry.
    M7NodesTick = 5,
}

/// The budget of a query or tick that must end within this number of instructions, by a fitted model with a margin.
///
/// @param cost  A `dibs_cost`.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_ARGUMENT` for a number that is not a `dibs_cost`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_budget_for_instructions(
    instructions: u32,
    cost: u32,
    budget: *mut u32,
) -> dibs_code {
    dibs_code::of(|| {
        let cost = cost_of(cost)?;
        budget.check()?.set(Budget::for_instructions(instructions, cost).tests());
        Ok(())
    })
}

/// The cost model that a number from C stands for.
pub(crate) fn cost_of(cost: u32) -> Result<&'static Cost, dibs_code> {
    const COSTS: [(dibs_cost, &Cost); 6] = [
        (dibs_cost::M7Sphere, &Cost::M7_SPHERE),
        (dibs_cost::M7Capsule, &Cost::M7_CAPSULE),
        (dibs_cost::X86Sphere, &Cost::X86_64_SPHERE),
        (dibs_cost::X86Capsule, &Cost::X86_64_CAPSULE),
        (dibs_cost::M7Tick, &Cost::M7_TICK),
        (dibs_cost::M7NodesTick, &Cost::M7_NODES_TICK),
    ];
    let found = COSTS.iter().find(|(number, _)| *number as u32 == cost);
    found.map(|(_, cost)| *cost).ok_or(dibs_code::Argument)
}
