//! Answers a script of queries, on the board under QEMU and on the host in any build.
//!
//! A script is a stream of little-endian 32-bit words, written by `cargo xtask guarantees`; the answers are such a
//! stream too. Board and host run this same code, so that a difference comes from the compiler or the processor.
//!
//! One file, because the words of a script and of its answers belong together.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod bus;
pub mod filter;
pub mod nodes;
pub mod receive;
pub mod rows;
pub mod tick;
pub mod track;
pub mod weights;

use dibs_nostd::glam::Vec3;
use dibs_nostd::modes::{MAX_MODES, Memo, ModalSurface, Modes};
use dibs_nostd::nodes::{EmbeddedSurface, Nodes};
use dibs_nostd::{
    Budget, Capsule, Contacts, MeasuredStretch, NoSide, Odometer, Options, Proximity, Query,
    QueryError, Side, Sphere, SurfaceBlend, Tool, Tree, TriangleRow, VertexTable, measure_stretch,
};

/// The meanings of the word at the start of a record.
pub mod command {
    /// End of the script.
    pub const END: u32 = 0;
    /// A tree of 16-bit indices: its length in bytes, then the bytes, padded to a word.
    pub const TREE: u32 = 1;
    /// A frame: three `f32` for each of the tree's vertices. Answered by the clock's counts for measuring its stretch,
    /// and the stretch's bits.
    pub const FRAME: u32 = 2;
    /// A query: [`QUERY_WORDS`](super::QUERY_WORDS). Answered by [`ANSWER_WORDS`](super::ANSWER_WORDS).
    pub const QUERY: u32 = 3;
    /// The same by the batched search, on a frame of rows.
    pub const QUERY_IN_ROUNDS: u32 = 5;
    /// A modal frame, of a tree with modes: 1 for queries that remember positions and 0 for others, the number of
    /// weights, then an `f32` each. Answered by the clock's counts for bounding its stretch and the bound's bits; then
    /// by the counts for computing every position, and a hash of their bits.
    pub const WEIGHTS: u32 = 4;
    /// The rows of the next frame, three `f32` each, then a time: 0 for the frame before, 1 for this one. Not answered. The
    /// queries that follow are of the surface at that time.
    pub const MOVE: u32 = 6;
    /// A frame of nodes, of a tree with such: three `f32` each. Not answered. The queries that follow are of its surface.
    pub const NODES: u32 = 7;
}

/// A query's options: the bits of one of its words.
pub mod how {
    /// With the measured stretch.
    pub const MEASURED: u32 = 1;
    /// With side and signed separation.
    pub const SIGNED: u32 = 2;
    /// Also with the contacts within [`MARGIN`](super::MARGIN), on a frame of rows.
    pub const CONTACTS: u32 = 4;
}

/// Words of a query: the axis' ends, the radius, 1 for a capsule and 0 for a sphere, the options ([`how`]), the warm
/// start or `u32::MAX`, and the budget's node and triangle tests.
pub const QUERY_WORDS: usize = 12;
/// Words of an answer: its counts on the clock, then the fields of a [`Proximity`].
pub const ANSWER_WORDS: usize = 25;
/// Margin of the contacts, in mm.
pub const MARGIN: f32 = 5.0;
/// Largest tree, in bytes.
pub const TREE_BYTES: usize = 1 << 20;
/// Most vertices.
pub const VERTICES: usize = 1 << 15;

/// Entries of the query's stack: more than the scripts' trees need.
const STACK: usize = 128;

/// Slots of the cache of a modal frame's positions.
const SLOTS: usize = 256;

/// The source of positions.
enum Table<'a> {
    /// From the rows of a frame.
    Rows,
    /// From the rows of a frame, for the batched search.
    Batched,
    /// From weights.
    Modal(ModalSurface<'a, MAX_MODES>),
    /// From weights, with a cache.
    Remembered(ModalSurface<'a, MAX_MODES>),
    /// From the rows of two frames.
    Moving(SurfaceBlend<'a, [Vec3], [Vec3]>),
    /// From nodes.
    Embedded(EmbeddedSurface<'a, 'a, [Vec3]>),
}

/// The machine on which a script runs.
pub trait Machine {
    /// Fills the buffer from the script.
    ///
    /// # Errors
    /// [`Fault`] if the script ends too early.
    fn read(&mut self, buffer: &mut [u8]) -> Result<(), Fault>;

    /// Appends to the answers.
    ///
    /// # Errors
    /// [`Fault`] if the write fails.
    fn write(&mut self, bytes: &[u8]) -> Result<(), Fault>;

    /// A free-running counter.
    fn clock(&self) -> u32;
}

/// The script is invalid, or a query failed.
#[derive(Clone, Copy, Debug)]
pub struct Fault;

/// Memory for a tree and a frame.
pub struct Memory {
    tree: [u8; TREE_BYTES],
    rows: [Vec3; VERTICES],
    before: [Vec3; VERTICES],
}

impl Memory {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { tree: [0; TREE_BYTES], rows: [Vec3::ZERO; VERTICES], before: [Vec3::ZERO; VERTICES] }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// Follows a script to its end.
///
/// # Errors
/// [`Fault`] where the script makes no sense, or a query fails.
pub fn run(memory: &mut Memory, machine: &mut impl Machine) -> Result<(), Fault> {
    let mut next = word(machine)?;
    while next == command::TREE {
        let length = word(machine)? as usize;
        let Memory { tree, rows, before } = memory;
        machine.read(tree.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
        let bytes = tree.get(..length).ok_or(Fault)?;
        let tree = Tree::from_bytes(bytes).map_err(|_| Fault)?;
        next = queries(&tree, rows, before, machine)?;
    }
    if next == command::END { Ok(()) } else { Err(Fault) }
}

/// Answers frames and queries of one tree. Returns the first other command.
fn queries(
    tree: &Tree<'_, u16>,
    rows: &mut [Vec3],
    before: &mut [Vec3],
    machine: &mut impl Machine,
) -> Result<u32, Fault> {
    let mut query = Query::<_, STACK>::new(tree).map_err(|_| Fault)?;
    let rows = rows.get_mut(..tree.vertex_count() as usize).ok_or(Fault)?;
    let mut measured = None;
    let mut table = Table::Rows;
    let mut next = word(machine)?;
    loop {
        match next {
            command::FRAME => {
                read(rows, machine)?;
                let start = machine.clock();
                let stretch = measure_stretch(tree, &*rows).map_err(|_| Fault)?;
                let took = machine.clock().wrapping_sub(start);
                measured = Some(stretch);
                table = Table::Rows;
                put(machine, &[took, stretch.sigma().to_bits()])?;
            }
            command::QUERY => {
                let answer = ask(&mut query, &table, rows, measured, machine)?;
                put(machine, &answer)?;
            }
            command::QUERY_IN_ROUNDS => {
                let answer = ask(&mut query, &Table::Batched, rows, measured, machine)?;
                put(machine, &answer)?;
            }
            command::WEIGHTS => {
                let remembers = word(machine)? != 0;
                let (surface, bound) = modal(&Modes::of(tree).map_err(|_| Fault)?, machine)?;
                measured = Some(bound);
                table = if remembers { Table::Remembered(surface) } else { Table::Modal(surface) };
            }
            command::MOVE => {
                let before = before.get_mut(..rows.len()).ok_or(Fault)?;
                before.copy_from_slice(rows);
                read(rows, machine)?;
                let mut odometer = Odometer::new(tree);
                let surface = odometer.step(&*before, &*rows).at(f32::from_bits(word(machine)?));
                next = all_of(&mut query, &Table::Moving(surface), rows, machine)?;
                continue;
            }
            command::NODES => {
                let nodes = Nodes::of(tree).map_err(|_| Fault)?;
                let frame = before.get_mut(..nodes.count() as usize).ok_or(Fault)?;
                read(frame, machine)?;
                let surface = nodes.surface(&*frame);
                next = all_of(&mut query, &Table::Embedded(surface), rows, machine)?;
                continue;
            }
            other => return Ok(other),
        }
        next = word(machine)?;
    }
}

/// Answers the queries that follow, of one surface. Returns the first other command.
fn all_of(
    query: &mut Query<'_, u16, STACK>,
    table: &Table<'_>,
    rows: &[Vec3],
    machine: &mut impl Machine,
) -> Result<u32, Fault> {
    loop {
        match word(machine)? {
            command::QUERY => {
                let answer = ask(query, table, rows, None, machine)?;
                put(machine, &answer)?;
            }
            other => return Ok(other),
        }
    }
}

/// Reads the rows of a frame.
fn read(rows: &mut [Vec3], machine: &mut impl Machine) -> Result<(), Fault> {
    for row in rows {
        *row = point(machine)?;
    }
    Ok(())
}

/// The surface of a modal frame, and the bound of its stretch.
fn modal<'a>(
    modes: &Modes<'a>,
    machine: &mut impl Machine,
) -> Result<(ModalSurface<'a, MAX_MODES>, MeasuredStretch), Fault> {
    let mut weights = [0.0; MAX_MODES];
    let count = word(machine)? as usize;
    let weights = weights.get_mut(..count).ok_or(Fault)?;
    for weight in weights.iter_mut() {
        *weight = f32::from_bits(word(machine)?);
    }
    let start = machine.clock();
    let bound = modes.stretch_bound(weights).map_err(|_| Fault)?;
    let took = machine.clock().wrapping_sub(start);
    put(machine, &[took, bound.sigma().to_bits()])?;
    let start = machine.clock();
    let surface = modes.surface(weights).map_err(|_| Fault)?;
    let mut hash = 0;
    for row in 0..modes.vertex_count() {
        for axis in surface.position(row).ok_or(Fault)?.to_array() {
            hash = u32::rotate_left(hash, 5) ^ axis.to_bits();
        }
    }
    let took = machine.clock().wrapping_sub(start);
    put(machine, &[took, hash])?;
    Ok((surface, bound))
}

fn ask(
    query: &mut Query<'_, u16, STACK>,
    table: &Table<'_>,
    rows: &[Vec3],
    measured: Option<MeasuredStretch>,
    machine: &mut impl Machine,
) -> Result<[u32; ANSWER_WORDS], Fault> {
    let (start, end) = (point(machine)?, point(machine)?);
    let radius = f32::from_bits(word(machine)?);
    let is_capsule = word(machine)? != 0;
    let how = word(machine)?;
    let warm = word(machine)?;
    let budget = Budget::new(word(machine)?);
    let mut options = Options::cold().budget(budget);
    if how & how::SIGNED == 0 {
        options = options.unsigned();
    }
    if warm != u32::MAX {
        options = options.warm_start(Some(TriangleRow(warm)));
    }
    if how & how::MEASURED != 0
        && let Some(measured) = measured
    {
        options = options.stretch(measured);
    }
    if is_capsule {
        let tool = Capsule::new(start, end, radius).map_err(|_| Fault)?;
        timed(query, table, rows, &tool, how, &options, machine)
    } else {
        let tool = Sphere::new(start, radius).map_err(|_| Fault)?;
        timed(query, table, rows, &tool, how, &options, machine)
    }
}

/// Asks for contacts. A separate function keeps their list out of the stack frame of queries on modal surfaces.
#[inline(never)]
fn contacts(
    query: &mut Query<'_, u16, STACK>,
    rows: &[Vec3],
    tool: &impl Tool,
    options: &Options,
    machine: &impl Machine,
) -> Result<[u32; ANSWER_WORDS], Fault> {
    // A constant is copied into its place once: a call's result may be made elsewhere on the stack first.
    let mut contacts = const { Contacts::<8>::new() };
    clocked(machine, || query.contacts(rows, tool, MARGIN, options, &mut contacts))
}

fn timed(
    query: &mut Query<'_, u16, STACK>,
    table: &Table<'_>,
    rows: &[Vec3],
    tool: &impl Tool,
    how: u32,
    options: &Options,
    machine: &impl Machine,
) -> Result<[u32; ANSWER_WORDS], Fault> {
    // As in a controller, the compiler must not see through the pointer.
    let rows = core::hint::black_box(rows);
    match table {
        Table::Rows if how & how::CONTACTS != 0 => contacts(query, rows, tool, options, machine),
        Table::Rows => clocked(machine, || query.closest(rows, tool, options)),
        Table::Batched => clocked(machine, || query.closest_batched(rows, tool, options)),
        // The code of all tables is larger than the memory for code of a Cortex-M55's board.
        _ if cfg!(m55) => Err(Fault),
        Table::Modal(surface) => clocked(machine, || query.closest(surface, tool, options)),
        Table::Remembered(surface) => {
            clocked(machine, || query.closest(&Memo::<_, SLOTS>::new(surface), tool, options))
        }
        Table::Moving(surface) => clocked(machine, || query.closest(surface, tool, options)),
        Table::Embedded(surface) => clocked(machine, || query.closest(surface, tool, options)),
    }
}

/// The measured function: not inlined, because callgrind looks for it.
#[inline(never)]
fn clocked(
    machine: &impl Machine,
    ask: impl FnOnce() -> Result<Proximity, QueryError>,
) -> Result<[u32; ANSWER_WORDS], Fault> {
    let before = machine.clock();
    let answer = ask();
    let took = machine.clock().wrapping_sub(before);
    Ok(words(took, &answer.map_err(|_| Fault)?))
}

fn words(took: u32, answer: &Proximity) -> [u32; ANSWER_WORDS] {
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    let [sx, sy, sz] = bits(answer.point_on_surface);
    let [tx, ty, tz] = bits(answer.point_on_tool);
    let [dx, dy, dz] = bits(answer.direction);
    let [a, b, c] = answer.corners;
    let [u, v, w] = answer.barycentric.map(f32::to_bits);
    [
        took,
        answer.node_tests,
        answer.triangle_tests,
        answer.separation.to_bits(),
        answer.lower.to_bits(),
        answer.accuracy.to_bits(),
        answer.axis_distance.to_bits(),
        answer.axis_parameter.to_bits(),
        answer.triangle.map_or(u32::MAX, |triangle| triangle.0),
        sx,
        sy,
        sz,
        tx,
        ty,
        tz,
        dx,
        dy,
        dz,
        a,
        b,
        c,
        u,
        v,
        w,
        side(answer.side),
    ]
}

/// A number for each side, and for each reason that there is none.
fn side(side: Side) -> u32 {
    match side {
        Side::Outside => 0,
        Side::Inside => 1,
        Side::Crossing => 2,
        Side::Either => 10,
        Side::Undefined(reason) => match reason {
            NoSide::NotAsked => 3,
            NoSide::NoAdjacency => 4,
            NoSide::OpenBoundary => 5,
            NoSide::BelowAccuracy => 6,
            NoSide::Degenerate => 7,
            NoSide::CutShort => 8,
            NoSide::NonManifold => 9,
            _ => u32::MAX,
        },
        _ => u32::MAX,
    }
}

fn word(machine: &mut impl Machine) -> Result<u32, Fault> {
    let mut bytes = [0; 4];
    machine.read(&mut bytes)?;
    Ok(u32::from_le_bytes(bytes))
}

fn point(machine: &mut impl Machine) -> Result<Vec3, Fault> {
    let mut number = || Ok(f32::from_bits(word(machine)?));
    Ok(Vec3::new(number()?, number()?, number()?))
}

fn put(machine: &mut impl Machine, words: &[u32]) -> Result<(), Fault> {
    for word in words {
        machine.write(&word.to_le_bytes())?;
    }
    Ok(())
}
