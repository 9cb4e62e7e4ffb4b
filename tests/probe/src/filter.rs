//! Follows a script of ticks of a filter of commands: an instrument of two capsules on a surface that moves.
//!
//! A script is a tree, then walks, all little-endian words; `cargo xtask guarantees` makes it from walks on the host, whose
//! answers it knows.

use dibs_nostd::filter::{AdmittedMotion, Filter, MotionRow, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Capsule, MeasuredStretch, MovingSurface, Odometer, Options, Tracker, Tree, measure_stretch,
};

use crate::track::Memory;
use crate::{Fault, Machine, point, put, word};

/// The meanings of the word at the start of a record.
pub mod command {
    /// End of the script.
    pub const END: u32 = 0;
    /// A walk, whose trackers start anew: stand-off (mm), the robot's speed (mm/s), the approach's time constant (s),
    /// instructions of a tick, period (s), 1 for queries with the measured stretch, and a label with its stand-off (mm),
    /// or [`UNLABELLED`](super::UNLABELLED).
    pub const WALK: u32 = 1;
    /// The next frame: three `f32` for each of the tree's vertices.
    pub const FRAME: u32 = 2;
    /// A tick: the surface's share of the way between the last two frames, or [`HELD`](super::HELD); the three joints, both
    /// radii, the commanded translation and rotation about the first joint, the tissue's speed and two errors. Answered
    /// by [`ANSWER_WORDS`](super::ANSWER_WORDS).
    pub const TICK: u32 = 3;
}

/// The share of a surface that is the last frame.
pub const HELD: u32 = u32::MAX;

/// Instead of a label: no label has a stand-off of its own.
pub const UNLABELLED: u32 = u32::MAX;

/// Words of an answer: the clock's counts, then [`words`] of what was admitted.
pub const ANSWER_WORDS: usize = 1 + ADMITTED_WORDS;
/// Of these, the words of what was admitted.
pub const ADMITTED_WORDS: usize = 10;

/// Opened nodes that a tracker remembers, for small surfaces and for large ones: the script's first word is 1 for these.
pub const OPENED: [usize; 2] = [128, 512];

/// An instrument's trackers.
pub struct Trackers<const OPENED: usize>([Option<Follower<OPENED>>; 2]);

type Follower<const OPENED: usize> = Tracker<'static, u16, MAX_STACK, OPENED>;

impl<const OPENED: usize> Trackers<OPENED> {
    /// None yet.
    #[must_use]
    pub const fn new() -> Self {
        Self([const { None }; 2])
    }
}

impl<const OPENED: usize> Default for Trackers<OPENED> {
    fn default() -> Self {
        Self::new()
    }
}

/// The bits of what was admitted.
#[must_use]
pub fn words(admitted: &AdmittedMotion) -> [u32; ADMITTED_WORDS] {
    let RigidMotion { translation, rotation, .. } = admitted.motion;
    let ([a, b, c], [d, e, f]) = (translation.to_array(), rotation.to_array());
    let [a, b, c, d, e, f, least] = [a, b, c, d, e, f, admitted.least_separation].map(f32::to_bits);
    [a, b, c, d, e, f, least, admitted.reason as u32, admitted.queries, admitted.instructions]
}

/// Follows a script to its end.
///
/// # Errors
/// [`Fault`] where the script makes no sense, or a query fails.
pub fn run(
    memory: &'static mut Memory,
    small: &mut Trackers<{ OPENED[0] }>,
    large: &mut Trackers<{ OPENED[1] }>,
    machine: &mut impl Machine,
) -> Result<(), Fault> {
    let is_large = word(machine)? == 1;
    let length = word(machine)? as usize;
    let Memory { tree, frames } = memory;
    machine.read(tree.get_mut(..length.next_multiple_of(4)).ok_or(Fault)?)?;
    let tree = Tree::<u16>::from_bytes(tree.get(..length).ok_or(Fault)?).map_err(|_| Fault)?;
    let count = tree.vertex_count() as usize;
    let [before, after] = frames.each_mut().map(|rows| rows.get_mut(..count));
    let mut frames = [before.ok_or(Fault)?, after.ok_or(Fault)?];
    let mut next = word(machine)?;
    while next == command::WALK {
        next = if is_large {
            walk(&tree, &mut frames, large, machine)?
        } else {
            walk(&tree, &mut frames, small, machine)?
        };
    }
    if next == command::END { Ok(()) } else { Err(Fault) }
}

/// A walk's numbers.
struct Walk<const LABELS: usize> {
    filter: Filter<LABELS>,
    period: f32,
    is_measured: bool,
}

/// Follows a walk. Returns the first other command.
fn walk<const OPENED: usize>(
    tree: &Tree<'static, u16>,
    frames: &mut [&mut [Vec3]; 2],
    trackers: &mut Trackers<OPENED>,
    machine: &mut impl Machine,
) -> Result<u32, Fault> {
    let [stand_off, robot, approach] = [number(machine)?, number(machine)?, number(machine)?];
    let instructions = word(machine)?;
    let filter = Filter::new(stand_off, robot).map_err(|_| Fault)?;
    let filter = filter.approach(approach).map_err(|_| Fault)?;
    let filter = filter.budget(instructions);
    let (period, is_measured) = (number(machine)?, word(machine)? == 1);
    match word(machine)? {
        UNLABELLED => {
            follow(tree, frames, trackers, &Walk { filter, period, is_measured }, machine)
        }
        label => {
            let label = label.try_into().map_err(|_| Fault)?;
            let filter = filter.stand_off_of([(label, number(machine)?)]).map_err(|_| Fault)?;
            follow(tree, frames, trackers, &Walk { filter, period, is_measured }, machine)
        }
    }
}

/// Follows the frames and ticks of a walk.
fn follow<const OPENED: usize, const LABELS: usize>(
    tree: &Tree<'static, u16>,
    [before, after]: &mut [&mut [Vec3]; 2],
    Trackers(trackers): &mut Trackers<OPENED>,
    walk: &Walk<LABELS>,
    machine: &mut impl Machine,
) -> Result<u32, Fault> {
    for tracker in &mut *trackers {
        place(tree, tracker)?;
    }
    let mut odometer = Odometer::new(tree);
    let mut stretch: Option<MeasuredStretch> = None;
    let mut is_first = true;
    let mut next = word(machine)?;
    while next == command::FRAME {
        core::mem::swap(before, after);
        for row in after.iter_mut() {
            *row = point(machine)?;
        }
        let mut walk = Walk { ..*walk };
        if walk.is_measured {
            let measured = measure_stretch(tree, &**after).map_err(|_| Fault)?;
            let both = stretch.unwrap_or(measured).or_larger(measured).ok_or(Fault)?;
            walk.filter = walk.filter.options(Options::new().stretch(both));
            stretch = Some(measured);
        }
        let (before, after): (&[Vec3], &[Vec3]) = (before, after);
        let mut step = None;
        let mut is_new = true;
        loop {
            next = word(machine)?;
            if next != command::TICK {
                break;
            }
            let share = word(machine)?;
            if share != HELD {
                let step = step.get_or_insert_with(|| odometer.step(before, after));
                walk.tick(&step.at(f32::from_bits(share)), trackers, machine)?;
                continue;
            }
            let surface = if is_new && is_first {
                odometer.start(after)
            } else {
                odometer.step(if is_new { before } else { after }, after).after()
            };
            walk.tick(&surface, trackers, machine)?;
            (is_new, is_first) = (false, false);
        }
    }
    Ok(next)
}

impl<const LABELS: usize> Walk<LABELS> {
    fn tick<const OPENED: usize>(
        &self,
        surface: &impl MovingSurface,
        trackers: &mut [Option<Follower<OPENED>>; 2],
        machine: &mut impl Machine,
    ) -> Result<(), Fault> {
        let [a, b, c] = [point(machine)?, point(machine)?, point(machine)?];
        let radii = [number(machine)?, number(machine)?];
        let command = RigidMotion::new(a, point(machine)?, point(machine)?);
        let tissue = Uncertainty::new(number(machine)?);
        let tissue = tissue.error(number(machine)?).error(number(machine)?);
        let [tip, shaft] = [(a, b, radii[0]), (b, c, radii[1])];
        let capsule = |(start, end, radius)| Capsule::new(start, end, radius).map_err(|_| Fault);
        let (tip, shaft) = (capsule(tip)?, capsule(shaft)?);
        let [Some(one), Some(other)] = trackers else { return Err(Fault) };
        let mut pairs = [(one, surface, &tip), (other, surface, &shaft)];
        const NONE: [MotionRow; 0] = [];
        let start = machine.clock();
        let admitted = self.filter.admit(&mut pairs, &command, self.period, &tissue, &NONE);
        let took = machine.clock().wrapping_sub(start);
        put(machine, &[took])?;
        put(machine, &words(&admitted.map_err(|_| Fault)?))
    }
}

/// Makes a tracker. A separate function, because it passes over the stack.
#[inline(never)]
fn place<const OPENED: usize>(
    tree: &Tree<'static, u16>,
    tracker: &mut Option<Follower<OPENED>>,
) -> Result<(), Fault> {
    *tracker = Some(Tracker::new(tree).map_err(|_| Fault)?);
    Ok(())
}

fn number(machine: &mut impl Machine) -> Result<f32, Fault> {
    Ok(f32::from_bits(word(machine)?))
}
