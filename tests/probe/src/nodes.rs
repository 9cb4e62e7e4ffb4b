//! Follows a script of ticks with a guard whose frames are nodes, on the board and on the host.
//!
//! A script is a tree with its nodes, then packets and ticks, all little-endian words; `cargo xtask guarantees` makes it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Bus, Guard, GuardLimits, Surface};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::wire::NoMac;
use dibs_nostd::{
    Advance, Capsule, Millis, Options, QuantisedVertices, Tree, TreeBytes, VertexTable,
};

use crate::{Fault, Machine, point, put, side, word};

/// The meanings of the word at the start of a record.
pub mod command {
    /// End of the script.
    pub const END: u32 = 0;
    /// A packet: its time in ms, its length in bytes, then the bytes, padded to a word.
    pub const PACKET: u32 = 1;
    /// The frame is whole: it is checked in slices of [`WORK`](super::WORK). Answered by the clock's counts, and 1 if it was
    /// published.
    pub const WORK: u32 = 2;
    /// A tick: its time in ms, the axis' ends, and the capsule's radius. Answered by [`ANSWER_WORDS`](super::ANSWER_WORDS).
    pub const TICK: u32 = 3;
}

/// Words before all other answers: bytes of RAM of the loop's objects; the clock's counts for measuring all elements at rest,
/// of floats and of quantised nodes, and for reading all vertices, of nodes that are held and that are interpolated; the bits
/// of both stretches, and a hash of the vertices' sums.
pub const HEAD_WORDS: usize = 8;
/// Words of a frame's answer.
pub const FRAME_WORDS: usize = 2;
/// Words of a tick's answer: the clock's counts, the pair's separation, its lower bound, accuracy and side, the node and
/// triangle tests, and the bits of the relative velocity's coordinate along x.
pub const ANSWER_WORDS: usize = 8;
/// Nodes of the surface.
pub const NODES: usize = 720;
/// Largest tree, in bytes.
pub const TREE_BYTES: usize = 3 << 19;
/// Elements and rows of a slice of the check.
pub const WORK: u32 = 200;
const STACK: usize = 128;
/// Opened nodes that the tracker remembers.
pub const OPENED: usize = 256;

type Rows = Surface<NODES, Nodes<'static>>;
type Receiver = Bus<'static, 'static, u16, NoMac, Nodes<'static>>;
type Follower = Guard<'static, 'static, u16, STACK, OPENED, Nodes<'static>>;

/// The rows of the frames.
pub static HEART: Rows = Rows::new();

/// The two ends, and a frame quantised.
pub struct Memory {
    bus: Option<Receiver>,
    guard: Option<Follower>,
    nodes: [[Vec3; NODES]; 2],
    quantised: [[u16; 3]; NODES],
}

impl Memory {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { bus: None, guard: None, nodes: [[Vec3::ZERO; NODES]; 2], quantised: [[0; 3]; NODES] }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// The guard's limits.
#[must_use]
pub const fn limits() -> GuardLimits {
    GuardLimits::new(300.0, Millis(150))
        .automatic()
        .without_transit()
        .options(Options::new().depth_tolerance(f32::INFINITY))
}

/// Follows a script to its end.
///
/// # Errors
/// [`Fault`] where the script makes no sense, or the tree is not one of so many nodes.
#[inline(never)]
pub fn run(
    bytes: &'static mut [u8; TREE_BYTES],
    surface: &'static Rows,
    memory: &mut Memory,
    machine: &mut impl Machine,
) -> Result<(), Fault> {
    let length = word(machine)? as usize;
    machine.read(bytes.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
    let bytes = bytes.get(..length).ok_or(Fault)?;
    let tree = Tree::<u16>::from_bytes(bytes).map_err(|_| Fault)?;
    measure(&tree, memory, machine)?;
    start(surface, bytes, memory)?;
    let bus = memory.bus.as_mut().ok_or(Fault)?;
    let guard = memory.guard.as_mut().ok_or(Fault)?;
    loop {
        match word(machine)? {
            command::END => return Ok(()),
            command::PACKET => {
                let now = word(machine)?;
                let mut packet = [0; 1_024];
                let length = word(machine)? as usize;
                machine.read(packet.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
                let packet = packet.get(..length).ok_or(Fault)?;
                bus.packet(packet, Millis(now)).map_err(|_| Fault)?;
            }
            command::WORK => {
                let before = machine.clock();
                let outcome = loop {
                    match bus.work(WORK) {
                        Ok(Advance::Pending) => (),
                        other => break other,
                    }
                };
                let took = machine.clock().wrapping_sub(before);
                let is_published = matches!(outcome, Ok(Advance::Published { .. }));
                put(machine, &[took, is_published.into()])?;
            }
            command::TICK => {
                let now = Millis(word(machine)?);
                let (start, end) = (point(machine)?, point(machine)?);
                let radius = f32::from_bits(word(machine)?);
                let tool = Capsule::new(start, end, radius).map_err(|_| Fault)?;
                let before = machine.clock();
                let answer = guard.closest(&tool, now);
                let took = machine.clock().wrapping_sub(before);
                let closest = answer.tracked.map_err(|_| Fault)?.closest;
                let [separation, lower, accuracy, velocity] =
                    [closest.separation, closest.lower, closest.accuracy, answer.velocity.x]
                        .map(f32::to_bits);
                let (side, tests) = (side(closest.side), closest.node_tests);
                let words = [
                    took,
                    separation,
                    lower,
                    accuracy,
                    side,
                    tests,
                    closest.triangle_tests,
                    velocity,
                ];
                put(machine, &words)?;
            }
            _ => return Err(Fault),
        }
    }
}

/// Makes the two ends. A separate function, because they pass over the stack.
#[inline(never)]
fn start(surface: &'static Rows, bytes: &'static [u8], memory: &mut Memory) -> Result<(), Fault> {
    let (bus, guard) = surface.start(TreeBytes::new(bytes), limits()).map_err(|_| Fault)?;
    (memory.bus, memory.guard) = (Some(bus), Some(guard));
    Ok(())
}

/// Measures elements and reads vertices.
#[inline(never)]
fn measure(
    tree: &Tree<'static, u16>,
    Memory { nodes: [before, after], quantised, .. }: &mut Memory,
    machine: &mut impl Machine,
) -> Result<(), Fault> {
    let nodes = Nodes::of(tree).map_err(|_| Fault)?;
    let low = nodes.rest_position(0).ok_or(Fault)?;
    for (node, ((before, after), row)) in
        (0..).zip(before.iter_mut().zip(after.iter_mut()).zip(quantised.iter_mut()))
    {
        *before = nodes.rest_position(node).ok_or(Fault)?;
        *after = *before + Vec3::new(0.01 * before.y, 0.0, 0.02 * before.x);
        // The first node is a box's corner.
        *row = ((*before - low) * QUANTA).to_array().map(|way| way as u16);
    }
    let (before, after) = (core::hint::black_box(&before[..]), core::hint::black_box(&after[..]));
    let quantised = QuantisedVertices::new(quantised, low, Vec3::splat(1.0 / QUANTA));
    let mut counts = [0; 4];
    let start = machine.clock();
    let floats = nodes.measure(after).map_err(|_| Fault)?;
    counts[0] = machine.clock().wrapping_sub(start);
    let start = machine.clock();
    let steps = nodes.measure(core::hint::black_box(&quantised)).map_err(|_| Fault)?;
    counts[1] = machine.clock().wrapping_sub(start);
    let step = nodes.odometer().step(before, after);
    let (held, between) = (step.after(), step.at(0.3));
    let start = machine.clock();
    let first = sum(&nodes.surface(&held))?;
    counts[2] = machine.clock().wrapping_sub(start);
    let start = machine.clock();
    let second = sum(&nodes.surface(&between))?;
    counts[3] = machine.clock().wrapping_sub(start);
    let hash = (first + 0.5 * second).to_array().map(f32::to_bits);
    let hash = hash.iter().fold(0, |hash: u32, bits| hash.rotate_left(5) ^ bits);
    let ram = size_of::<Rows>() + size_of::<Receiver>() + size_of::<Follower>();
    let ram = if cfg!(target_pointer_width = "32") { ram as u32 } else { 0 };
    let [a, b, c, d] = counts;
    put(machine, &[ram, a, b, c, d, floats.sigma().to_bits(), steps.sigma().to_bits(), hash])
}

/// Reads all vertices.
#[inline(never)]
fn sum(surface: &impl VertexTable) -> Result<Vec3, Fault> {
    let mut sum = Vec3::ZERO;
    for row in 0..surface.len() as u32 {
        sum += surface.position(row).ok_or(Fault)?;
    }
    Ok(sum)
}

/// Steps of the quantised nodes in a millimetre.
const QUANTA: f32 = 256.0;
