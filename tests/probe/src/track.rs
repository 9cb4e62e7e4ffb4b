//! Follows a script of ticks with a tracker, and runs a whole query beside it.
//!
//! A script is a tree, then frames and ticks, all little-endian words; `cargo xtask guarantees` makes it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Budget, Capsule, Contacts, Fallback, MeasuredStretch, MovingSurface, Options, Proximity, Query,
    QueryError, Side, Step, Tracker, TrackerAnswer, Tree, TriangleRow,
};

use crate::rows::Rows;
use crate::{Fault, MARGIN, Machine, point, put, word};

/// The meanings of the word at the start of a record.
pub mod command {
    /// End of the script.
    pub const END: u32 = 0;
    /// The next frame: three `f32` for each of the tree's vertices, or nodes.
    pub const FRAME: u32 = 1;
    /// A tick: the surface and the question ([`tick`](super::tick)), the surface's share of the way between frames, the
    /// axis' ends, of a chain all [`JOINTS`](super::JOINTS), and the capsules' radius. Answered by
    /// [`ANSWER_WORDS`](super::ANSWER_WORDS).
    pub const TICK: u32 = 2;
}

/// Bits of a tick's word.
pub mod tick {
    /// The surface is interpolated; without this bit it is held.
    pub const INTERPOLATED: u32 = 1 << 0;
    /// With the side, and the depth where the axis crosses.
    pub const SIGNED: u32 = 1 << 1;
    /// With the contacts within [`MARGIN`](crate::MARGIN).
    pub const CONTACTS: u32 = 1 << 2;
    /// A chain of [`LINKS`](super::LINKS) capsules, each with its tracker.
    pub const CHAIN: u32 = 1 << 3;
    /// With the side alone: where the axis crosses, any depth will do.
    pub const SIDE: u32 = 1 << 4;
    /// In a function of its own, so that a bound on a tick's instructions has a root.
    pub const APART: u32 = 1 << 5;
    /// From this bit on the tracker's budget, in tests; 0 for none. Within one there is no whole query beside it.
    pub const BUDGET: u32 = 8;
}

/// Capsules of a chain.
pub const LINKS: usize = 8;
/// Their ends.
pub const JOINTS: usize = LINKS + 1;

/// Words of an answer: the clock's counts for the tracker and for a whole query (warm, with measured stretch), the
/// tracker's node and triangle tests, its [`Fallback`] (0 for none), the pairs that it searched, its separation, and
/// the distance of its certified interval from the query's in units of both accuracies.
pub const ANSWER_WORDS: usize = 8;
/// Largest tree, in bytes.
pub const TREE_BYTES: usize = 5 << 19;
/// Most vertices.
pub const VERTICES: usize = 26_000;
/// Entries of a tracker's stack.
pub const STACK: usize = 128;
/// Opened nodes that the tracker remembers.
pub const OPENED: usize = 512;

/// Memory for a tree and two frames.
pub struct Memory {
    pub(crate) tree: [u8; TREE_BYTES],
    pub(crate) frames: [[Vec3; VERTICES]; 2],
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

/// The trackers of a chain, and the contacts of a tracker and a whole query, in a static: they are larger than the
/// board's stack.
pub struct Trackers {
    links: [Option<Follower>; LINKS],
    lists: [Contacts<8>; 2],
}

type Follower = Tracker<'static, u16, STACK, OPENED, OPENED>;

/// The sizes that the documentation states.
#[cfg(target_pointer_width = "32")]
const _: () = {
    assert!(size_of::<Contacts<8>>() == 152 * 8 + 20 * 512 + 28);
    assert!(size_of::<Contacts<1, 4>>() == 152 + 20 * 4 + 28);
    assert!(size_of::<Follower>() <= 16 * STACK + 56 * OPENED + 1_944);
};

impl Trackers {
    /// None yet.
    #[must_use]
    pub const fn new() -> Self {
        Self { links: [const { None }; LINKS], lists: [Contacts::new(), Contacts::new()] }
    }
}

impl Default for Trackers {
    fn default() -> Self {
        Self::new()
    }
}

/// The board's program that follows a script of frames with these rows and of ticks of these kinds, by [`run`].
#[macro_export]
macro_rules! follow {
    ($rows:ty, $kinds:expr) => {
        #[cortex_m_rt::entry]
        fn main() -> ! {
            static mut MEMORY: $crate::track::Memory = $crate::track::Memory::new();
            static mut TRACKERS: $crate::track::Trackers = $crate::track::Trackers::new();
            board::answer(|board| $crate::track::run::<$rows, { $kinds }>(MEMORY, TRACKERS, board))
        }
    };
}

/// Follows a script to its end, whose frames have these rows. Of a tick's bits those in `KINDS` count, so that a program may
/// hold the tracker once, as a controller does.
///
/// # Errors
/// [`Fault`] where the script makes no sense, or a query fails.
pub fn run<R: Rows, const KINDS: u32>(
    memory: &'static mut Memory,
    Trackers { links, lists }: &mut Trackers,
    machine: &mut impl Machine,
) -> Result<(), Fault> {
    let length = word(machine)? as usize;
    let Memory { tree, frames } = memory;
    machine.read(tree.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
    let tree = Tree::<u16>::from_bytes(tree.get(..length).ok_or(Fault)?).map_err(|_| Fault)?;
    let made = R::of(&tree)?;
    let count = made.count() as usize;
    let [before, after] = frames.each_mut().map(|rows| rows.get_mut(..count));
    let (mut before, mut after) = (before.ok_or(Fault)?, after.ok_or(Fault)?);
    for tracker in &mut *links {
        place(&tree, tracker)?;
    }
    let query = Query::new(&tree).map_err(|_| Fault)?;
    let mut session = Session { query, trackers: links, lists, last: None };
    let mut odometer = made.odometer();
    let mut stretch: Option<MeasuredStretch> = None;
    let mut next = word(machine)?;
    while next == command::FRAME {
        core::mem::swap(&mut before, &mut after);
        for row in after.iter_mut() {
            *row = point(machine)?;
        }
        let measured = made.measure(after)?;
        let both = stretch.unwrap_or(measured).or_larger(measured).ok_or(Fault)?;
        let step = odometer.step(&*before, &*after);
        next = session.ticks::<R, KINDS>(&made, &step, [both, measured], machine)?;
        stretch = Some(measured);
    }
    if next == command::END { Ok(()) } else { Err(Fault) }
}

/// Makes a tracker. A separate function, because it passes over the stack.
#[inline(never)]
fn place(tree: &Tree<'static, u16>, tracker: &mut Option<Follower>) -> Result<(), Fault> {
    *tracker = Some(Tracker::with_range(tree).map_err(|_| Fault)?);
    Ok(())
}

/// The state from frame to frame.
struct Session<'s, 't> {
    query: Query<'t, u16, STACK>,
    trackers: &'s mut [Option<Follower>; LINKS],
    lists: &'s mut [Contacts<8>; 2],
    last: Option<TriangleRow>,
}

/// A tracker's answer, or that of a chain's trackers.
struct Found {
    closest: Proximity,
    fallback: Option<Fallback>,
    searched: u32,
}

impl Session<'_, '_> {
    /// Runs the ticks of a frame. Returns the first other command.
    fn ticks<R: Rows, const KINDS: u32>(
        &mut self,
        made: &R,
        step: &Step<'_, [Vec3], [Vec3]>,
        [both, measured]: [MeasuredStretch; 2],
        machine: &mut impl Machine,
    ) -> Result<u32, Fault> {
        loop {
            match word(machine)? {
                command::TICK => (),
                other => return Ok(other),
            }
            let kind = word(machine)?;
            let kind = kind & (KINDS | u32::MAX << tick::BUDGET);
            let share = f32::from_bits(word(machine)?);
            let links = if kind & tick::CHAIN == 0 { 1 } else { LINKS };
            let mut joints = [Vec3::ZERO; JOINTS];
            for joint in joints.iter_mut().take(links + 1) {
                *joint = point(machine)?;
            }
            let radius = f32::from_bits(word(machine)?);
            let answer = if kind & tick::INTERPOLATED == 0 {
                let rows = step.after();
                let mut room = Default::default();
                let surface = made.surface(&rows, &mut room);
                self.ask::<KINDS>(surface, joints, radius, kind, measured, machine)
            } else {
                let rows = step.at(share);
                let mut room = Default::default();
                let surface = made.surface(&rows, &mut room);
                self.ask::<KINDS>(surface, joints, radius, kind, both, machine)
            }?;
            put(machine, &answer)?;
        }
    }

    fn ask<const KINDS: u32>(
        &mut self,
        surface: &impl MovingSurface,
        joints: [Vec3; JOINTS],
        radius: f32,
        kind: u32,
        stretch: MeasuredStretch,
        machine: &impl Machine,
    ) -> Result<[u32; ANSWER_WORDS], Fault> {
        let [a, b, c, d, e, f, g, h, i] = joints;
        let link = |from, to| Capsule::new(from, to, radius).map_err(|_| Fault);
        let first = link(a, b)?;
        let budget = match kind >> tick::BUDGET {
            0 => Budget::UNLIMITED,
            tests => Budget::new(tests),
        };
        let options = Options::cold().stretch(stretch).budget(budget);
        let kind = kind & KINDS;
        let options = match kind & (tick::SIGNED | tick::SIDE) {
            tick::SIGNED => options,
            tick::SIDE => options.depth_tolerance(f32::INFINITY),
            _ => options.unsigned(),
        };
        let [list, whole_list] = &mut *self.lists;
        let (took, found) = if kind & tick::CHAIN != 0 {
            let chain = [
                first,
                link(b, c)?,
                link(c, d)?,
                link(d, e)?,
                link(e, f)?,
                link(f, g)?,
                link(g, h)?,
                link(h, i)?,
            ];
            let before = machine.clock();
            let found = self.closest_of(surface, &chain, &options)?;
            let took = machine.clock().wrapping_sub(before);
            let mut closest = f32::INFINITY;
            for capsule in &chain {
                let whole = self.query.closest(surface, capsule, &options).map_err(|_| Fault)?;
                closest = if whole.separation < closest { whole.separation } else { closest };
            }
            let Proximity { separation, accuracy, .. } = found.closest;
            let apart = [separation - closest, closest - separation];
            return Ok(answer(took, 0, &found, apart, 2.0 * accuracy));
        } else {
            let [Some(tracker), ..] = &mut *self.trackers else { return Err(Fault) };
            let before = machine.clock();
            let tracked = if KINDS & tick::APART != 0 {
                closest(tracker, surface, &first, &options)
            } else if kind & tick::CONTACTS == 0 {
                tracker.closest(surface, &first, &options)
            } else {
                tracker.contacts(surface, &first, MARGIN, &options, list)
            };
            let took = machine.clock().wrapping_sub(before);
            let tracked = tracked.map_err(|_| Fault)?;
            let found = Found { closest: tracked.closest, fallback: tracked.fallback, searched: 1 };
            (took, found)
        };
        if budget != Budget::UNLIMITED {
            return Ok(answer(took, 0, &found, [0.0; 2], 1.0));
        }
        let options = options.warm_start(self.last);
        let before = machine.clock();
        let whole = if kind & tick::CONTACTS == 0 {
            self.query.closest(surface, &first, &options)
        } else {
            self.query.contacts(surface, &first, MARGIN, &options, whole_list)
        };
        let whole_took = machine.clock().wrapping_sub(before);
        let whole = whole.map_err(|_| Fault)?;
        self.last = whole.triangle;
        let tracked = &found.closest;
        let mut apart = [tracked.lower - whole.separation, whole.lower - tracked.separation];
        if kind & (tick::SIGNED | tick::SIDE) != 0 && tracked.side != whole.side {
            if is_other_side(tracked, &whole) {
                return Err(Fault);
            }
            // Next to the surface one side may be undefined.
            let distance = tracked.axis_distance - whole.axis_distance;
            apart = [distance, -distance];
        }
        let accuracy = tracked.accuracy + whole.accuracy;
        Ok(answer(took, whole_took, &found, apart, accuracy))
    }

    fn closest_of(
        &mut self,
        surface: &impl MovingSurface,
        chain: &[Capsule; LINKS],
        options: &Options,
    ) -> Result<Found, Fault> {
        let [Some(a), Some(b), Some(c), Some(d), Some(e), Some(f), Some(g), Some(h)] =
            &mut *self.trackers
        else {
            return Err(Fault);
        };
        let [i, j, k, l, m, n, o, p] = chain;
        let mut pairs = [
            (a, surface, i),
            (b, surface, j),
            (c, surface, k),
            (d, surface, l),
            (e, surface, m),
            (f, surface, n),
            (g, surface, o),
            (h, surface, p),
        ];
        let found = Tracker::closest_of(&mut pairs, options).map_err(|_| Fault)?.ok_or(Fault)?;
        Ok(Found { closest: found.closest, fallback: found.fallback, searched: found.searched })
    }
}

/// A tick's closest pair.
#[inline(never)]
fn closest(
    tracker: &mut Follower,
    surface: &impl MovingSurface,
    tool: &Capsule,
    options: &Options,
) -> Result<TrackerAnswer, QueryError> {
    tracker.closest(surface, tool, options)
}

/// Whether two answers' sides, which differ, cannot both be right.
fn is_other_side(tracked: &Proximity, whole: &Proximity) -> bool {
    // Where neither is certain, the last tick's interval still may be: next to the surface a tracker says so.
    let is_certain = |side| !matches!(side, Side::Undefined(_) | Side::Either);
    is_certain(tracked.side) && is_certain(whole.side) && whole.axis_distance > 2.0 * whole.accuracy
}

/// An answer whose interval lies so far above and below a whole query's.
fn answer(
    took: u32,
    whole_took: u32,
    found: &Found,
    [above, below]: [f32; 2],
    accuracy: f32,
) -> [u32; ANSWER_WORDS] {
    let closest = &found.closest;
    let apart = if above > below { above } else { below };
    let apart = if apart > 0.0 { apart / accuracy } else { 0.0 };
    let fallback = match found.fallback {
        None => 0,
        Some(Fallback::Start) => 1,
        Some(Fallback::Surface) => 2,
        Some(Fallback::Jump) => 3,
        Some(_) => 4,
    };
    [
        took,
        whole_took,
        closest.node_tests,
        closest.triangle_tests,
        fallback,
        found.searched,
        closest.separation.to_bits(),
        apart.to_bits(),
    ]
}
