//! Follows a script of ticks with a tracker, and runs a whole query beside it.
//!
//! A script is a tree, then frames and ticks, all little-endian words; `cargo xtask guarantees` makes it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Capsule, Fallback, MeasuredStretch, MovingSurface, Odometer, Options, Query, Step, Tracker,
    Tree, TriangleRow, measure_stretch,
};

use crate::{Fault, Machine, point, put, word};

/// The meanings of the word at the start of a record.
pub mod command {
    /// End of the script.
    pub const END: u32 = 0;
    /// The next frame: three `f32` for each of the tree's vertices.
    pub const FRAME: u32 = 1;
    /// A tick: the surface (0 held, 1 interpolated), its share of the way between frames, the axis' ends and the
    /// capsule's radius. Answered by [`ANSWER_WORDS`](super::ANSWER_WORDS).
    pub const TICK: u32 = 2;
}

/// Words of an answer: the clock's counts for the tracker and for a whole query (warm, with measured stretch), the
/// tracker's node and triangle tests, its [`Fallback`] (0 for none), its used places of [`OPENED`], its separation, and
/// the difference from the query's separation in units of both accuracies.
pub const ANSWER_WORDS: usize = 8;
/// Largest tree, in bytes.
pub const TREE_BYTES: usize = 1 << 20;
/// Most vertices.
pub const VERTICES: usize = 26_000;
const STACK: usize = 128;
/// Opened nodes that the tracker remembers.
pub const OPENED: usize = 184;

/// Memory for a tree and two frames.
pub struct Memory {
    tree: [u8; TREE_BYTES],
    frames: [[Vec3; VERTICES]; 2],
}

impl Memory {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { tree: [0; TREE_BYTES], frames: [[Vec3::ZERO; VERTICES]; 2] }
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
    let length = word(machine)? as usize;
    let Memory { tree, frames } = memory;
    machine.read(tree.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
    let tree = Tree::<u16>::from_bytes(tree.get(..length).ok_or(Fault)?).map_err(|_| Fault)?;
    let count = tree.vertex_count() as usize;
    let [before, after] = frames.each_mut().map(|rows| rows.get_mut(..count));
    let (mut before, mut after) = (before.ok_or(Fault)?, after.ok_or(Fault)?);
    // The tracker is not moved: the board's stack has no room for a second one.
    let Ok(mut tracker) = Tracker::new(&tree) else { return Err(Fault) };
    let query = Query::new(&tree).map_err(|_| Fault)?;
    let mut session = Session { query, tracker: &mut tracker, last: None };
    let mut odometer = Odometer::new(&tree);
    let mut stretch: Option<MeasuredStretch> = None;
    let mut next = word(machine)?;
    while next == command::FRAME {
        core::mem::swap(&mut before, &mut after);
        for row in after.iter_mut() {
            *row = point(machine)?;
        }
        let measured = measure_stretch(&tree, &*after).map_err(|_| Fault)?;
        let both = stretch.unwrap_or(measured).or_larger(measured).ok_or(Fault)?;
        let step = odometer.step(&*before, &*after);
        next = session.ticks(&step, both, measured, machine)?;
        stretch = Some(measured);
    }
    if next == command::END { Ok(()) } else { Err(Fault) }
}

/// The state from frame to frame.
struct Session<'s, 't> {
    query: Query<'t, u16, STACK>,
    tracker: &'s mut Tracker<'t, u16, STACK, OPENED>,
    last: Option<TriangleRow>,
}

impl Session<'_, '_> {
    /// Runs the ticks of a frame. Returns the first other command.
    fn ticks(
        &mut self,
        step: &Step<'_, [Vec3], [Vec3]>,
        both: MeasuredStretch,
        measured: MeasuredStretch,
        machine: &mut impl Machine,
    ) -> Result<u32, Fault> {
        loop {
            match word(machine)? {
                command::TICK => (),
                other => return Ok(other),
            }
            let kind = word(machine)?;
            let share = f32::from_bits(word(machine)?);
            let (start, end) = (point(machine)?, point(machine)?);
            let radius = f32::from_bits(word(machine)?);
            let tool = Capsule::new(start, end, radius).map_err(|_| Fault)?;
            let answer = match kind {
                0 => self.ask(&step.after(), &tool, measured, machine),
                1 => self.ask(&step.at(share), &tool, both, machine),
                _ => return Err(Fault),
            }?;
            put(machine, &answer)?;
        }
    }

    fn ask(
        &mut self,
        surface: &impl MovingSurface,
        tool: &Capsule,
        stretch: MeasuredStretch,
        machine: &impl Machine,
    ) -> Result<[u32; ANSWER_WORDS], Fault> {
        let options = Options::cold().unsigned().stretch(stretch);
        let before = machine.clock();
        let tracked = self.tracker.closest(surface, tool, &options).map_err(|_| Fault)?;
        let took = machine.clock().wrapping_sub(before);
        let options = options.warm_start(self.last);
        let before = machine.clock();
        let whole = self.query.closest(surface, tool, &options).map_err(|_| Fault)?;
        let whole_took = machine.clock().wrapping_sub(before);
        self.last = whole.triangle;
        let found = &tracked.closest;
        let apart = found.separation - whole.separation;
        let apart = if apart < 0.0 { -apart } else { apart } / (found.accuracy + whole.accuracy);
        let fallback = match tracked.fallback {
            None => 0,
            Some(Fallback::Start) => 1,
            Some(Fallback::Surface) => 2,
            Some(Fallback::Jump) => 3,
            Some(_) => 4,
        };
        Ok([
            took,
            whole_took,
            found.node_tests,
            found.triangle_tests,
            fallback,
            tracked.opened,
            found.separation.to_bits(),
            apart.to_bits(),
        ])
    }
}
