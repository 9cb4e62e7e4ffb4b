//! Follows a script of ticks with a tracker on a surface that weights move, and runs a whole query beside it.
//!
//! A script is a tree with its modes, then frames and ticks, all little-endian words; `cargo xtask guarantees` makes it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::modes::{ModalReader, Modes};
use dibs_nostd::{
    Capsule, FrameLabel, FrameWriter, Frames, Millis, Options, Query, Tracker, Tree, TriangleRow,
};

use crate::{Fault, Machine, point, put, word};

/// The meanings of the word at the start of a record.
pub mod command {
    /// End of the script.
    pub const END: u32 = 0;
    /// The next frame: its time in ms, then a weight for each mode.
    pub const FRAME: u32 = 1;
    /// A tick: its time in ms, the axis' ends, and the capsule's radius. Answered by
    /// [`ANSWER_WORDS`](super::ANSWER_WORDS).
    pub const TICK: u32 = 2;
}

/// Words of an answer: the clock's counts for the tracker, with the surface's making, and for a whole query (warm); the
/// tracker's node and triangle tests; 1 if it fell back; the difference from the query's separation in units of both
/// accuracies.
pub const ANSWER_WORDS: usize = 6;
/// Largest tree, in bytes.
pub const TREE_BYTES: usize = 2 << 20;
const STACK: usize = 128;
/// Opened nodes that the tracker remembers.
pub const OPENED: usize = 256;

type Follower = Tracker<'static, u16, STACK, OPENED>;

/// Memory for a tree, a tracker, and the weights of `K` modes.
pub struct Memory<const K: usize> {
    frames: Frames<K>,
    tracker: Option<Follower>,
}

impl<const K: usize> Memory<K> {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { frames: Frames::new(), tracker: None }
    }
}

impl<const K: usize> Default for Memory<K> {
    fn default() -> Self {
        Self::new()
    }
}

/// Follows a script of `K` modes to its end.
///
/// # Errors
/// [`Fault`] where the script makes no sense, or a query fails.
#[inline(never)]
pub fn run<const K: usize>(
    bytes: &'static mut [u8; TREE_BYTES],
    Memory { frames, tracker }: &mut Memory<K>,
    machine: &mut impl Machine,
) -> Result<(), Fault> {
    let length = word(machine)? as usize;
    machine.read(bytes.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
    let tree = Tree::<u16>::from_bytes(bytes.get(..length).ok_or(Fault)?).map_err(|_| Fault)?;
    let modes = Modes::of(&tree).map_err(|_| Fault)?;
    let (mut writer, reader) = frames.split().map_err(|_| Fault)?;
    let mut reader = ModalReader::<K>::new(reader, &modes).map_err(|_| Fault)?;
    place(&tree, tracker)?;
    let tracker = tracker.as_mut().ok_or(Fault)?;
    let mut query = Query::<_, STACK>::new(&tree).map_err(|_| Fault)?;
    let mut last: Option<TriangleRow> = None;
    for epoch in 0.. {
        match word(machine)? {
            command::END => break,
            command::FRAME => publish::<K>(&modes, &mut writer, epoch, machine)?,
            command::TICK => {
                let now = word(machine)?;
                let (start, end) = (point(machine)?, point(machine)?);
                let radius = f32::from_bits(word(machine)?);
                let tool = Capsule::new(start, end, radius).map_err(|_| Fault)?;
                let before = machine.clock();
                let frame = reader.latest(Millis(now)).of_any_age().map_err(|_| Fault)?;
                let surface = frame.interpolated();
                let found = tracker
                    .closest(&surface, &tool, &Options::cold().unsigned())
                    .map_err(|_| Fault)?;
                let took = machine.clock().wrapping_sub(before);
                let options = Options::cold().unsigned().warm_start(last);
                let before = machine.clock();
                let whole = query.closest(&surface, &tool, &options).map_err(|_| Fault)?;
                let whole_took = machine.clock().wrapping_sub(before);
                last = whole.triangle;
                let closest = &found.closest;
                let apart = (closest.separation - whole.separation).abs();
                let apart = apart / (closest.accuracy + whole.accuracy);
                let fallback = u32::from(found.fallback.is_some());
                let tests = [closest.node_tests, closest.triangle_tests];
                put(machine, &[took, whole_took, tests[0], tests[1], fallback, apart.to_bits()])?;
            }
            _ => return Err(Fault),
        }
    }
    Ok(())
}

/// Makes a tracker. A separate function, because it passes over the stack.
#[inline(never)]
fn place(tree: &Tree<'static, u16>, tracker: &mut Option<Follower>) -> Result<(), Fault> {
    *tracker = Some(Tracker::new(tree).map_err(|_| Fault)?);
    Ok(())
}

/// Publishes the script's next weights, with the bound on their stretch.
fn publish<const K: usize>(
    modes: &Modes<'_>,
    writer: &mut FrameWriter<'_>,
    epoch: u32,
    machine: &mut impl Machine,
) -> Result<(), Fault> {
    let received = Millis(word(machine)?);
    let mut weights = [0.0; K];
    for weight in &mut weights {
        *weight = f32::from_bits(word(machine)?);
    }
    writer.begin();
    for weight in weights {
        writer.push(Vec3::new(weight, 0.0, 0.0)).map_err(|_| Fault)?;
    }
    let stretch = Some(modes.stretch_bound(&weights).map_err(|_| Fault)?);
    let position_error = modes.position_error();
    let label = FrameLabel { epoch, received, position_error, stretch };
    writer.publish(label).map_err(|_| Fault)
}
