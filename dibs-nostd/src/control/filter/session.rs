//! One tick of a filter: rows propose motions, queries verify them.
//!
//! One file, because rows, states and budget of a tick change together.

use glam::Vec3;
use heapless::Vec;

use super::known::{PairState, PoseDistance};
use super::motion::{inside, most_turn, shortened};
use super::nearest::{Nearest, Vector, add};
use super::pair::{ClosestPair, Pair};
use super::part::Part;
use super::proposal::{Extent, Proposal};
use super::row::Rows;
use super::{
    AdmittedMotion, EPSILON, Filter, FilterError, MOST_PAIRS, MotionRow, Reason, RigidMotion,
    Uncertainty, path,
};
use crate::math::order::{larger, smaller, smaller_or_nan};
use crate::math::sqrt::sqrt;
use crate::{Budget, Cost};

/// Number of motions tried in full, and of shortened ones after that.
const WHOLE: u32 = 4;
const SHORTENED: u32 = 4;

/// Rounding of a tool's pose and of a distance's terms, relative to the coordinates' size.
const ROUNDING: f32 = 16.0 / 16_777_216.0;

/// With fewer node tests a query is not worth its base cost, but for the first of a pair: it also gives the last tick's
/// interval, less the motion since.
const LEAST_TESTS: u32 = 32;

/// The same of a label's part, whose search takes 80 before the first.
const LEAST_TESTS_OF_PART: u32 = 112;

/// Node tests for each bound that runs out. With fewer, the budget ends more searches, and those admit nothing.
const TESTS_OF_DUE: u64 = 10;

/// Motions (mm) of a period within which a wall is near.
const NEAR: f32 = 4.0;

/// Instructions of work besides searches: a product or sum of two vectors, a pair's path, its distances on it, and an
/// estimate's part for each opened node. Typical, fitted so that no tick on the emulated board takes more than its budget.
const PRODUCT: u32 = 32;
const PATH: u32 = 300;
const DISTANCES: u32 = 200;
const ESTIMATE: u32 = 6;

/// Instructions of the active set's first steps, which the searches at the start leave, besides those for each row.
const FIRST_SOLUTION: u32 = 24 * PRODUCT;

/// A motion, and its distances from the tissue.
#[derive(Clone, Copy)]
struct Candidate {
    motion: RigidMotion,
    /// Least separation from the whole surface during the motion.
    separation: f32,
    /// The same, or that from a label's part less what its stand-off is larger, during the motion and at its end.
    least: f32,
    last: f32,
    /// Upper bound (mm) on the motion of a point of an axis.
    moved: f32,
    /// Whether it keeps every pair's least distance.
    is_admissible: bool,
}

pub(super) struct Session<'f, const LABELS: usize> {
    filter: &'f Filter<LABELS>,
    command: Vector,
    /// The command was beyond the robot's speed.
    is_cut: bool,
    about: Vec3,
    lever: f32,
    rows: Rows,
    /// Of each pair, then of each pair with one label's part after another.
    states: Vec<PairState, MOST_PAIRS>,
    /// Of each of these, the distance at the end that its rows require.
    wanted: Vec<f32, MOST_PAIRS>,
    /// Limit (mm) on the motion of the reference point, and on that of the lever's end by rotation.
    most: f32,
    /// The uncertainty (mm) of the tissue's position at the start, and its growth until the end.
    margin: f32,
    grow: f32,
    /// The fraction of the distance beyond the least one that a motion may use up.
    fraction: f32,
    /// The cost of a search.
    cost: Cost,
    queries: u32,
    instructions: u32,
}

impl<'f, const LABELS: usize> Session<'f, LABELS> {
    pub fn new(
        filter: &'f Filter<LABELS>,
        command: &RigidMotion,
        period: f32,
        uncertainty: &Uncertainty,
        (rows, lever, cost): (&[MotionRow], f32, Cost),
    ) -> Result<Self, FilterError> {
        let most = filter.speed * period;
        let within = RigidMotion {
            translation: shortened(command.translation, most),
            rotation: shortened(command.rotation, most_turn(most, lever)),
            ..*command
        };
        Ok(Self {
            filter,
            command: within.to_vector(lever),
            is_cut: within != *command,
            about: command.about,
            lever,
            rows: Rows::new(rows, lever)?,
            states: Vec::new(),
            wanted: Vec::new(),
            most,
            margin: uncertainty.now,
            grow: uncertainty.grown(period),
            fraction: if filter.approach > period { period / filter.approach } else { 1.0 },
            cost,
            queries: 0,
            instructions: 0,
        })
    }

    pub fn run<P: Pair>(mut self, pairs: &mut [P]) -> Result<AdmittedMotion, FilterError> {
        let rest = RigidMotion { about: self.about, ..RigidMotion::translation(Vec3::ZERO) };
        let first_motion = self.price_of_first_motion(pairs.len() * self.filter.layers().count());
        for part in self.filter.layers() {
            let mut to_come = pairs.len() as u32;
            for (number, pair) in pairs.iter_mut().enumerate() {
                to_come -= 1;
                // A part goes without a search.
                let others = if part.is_none() { to_come } else { 0 };
                let reserved = others.saturating_mul(self.cost.base).saturating_add(first_motion);
                self.start(pair, (number, part), reserved, &rest)?;
            }
        }
        let paths = (PATH + DISTANCES).saturating_mul(self.states.len() as u32);
        self.pay(paths);
        let stand_still = self.verify(pairs, &rest)?;
        let mut best = stand_still;
        let mut extent = Extent::WHOLE;
        for attempt in 0..=WHOLE + SHORTENED {
            if attempt == WHOLE + SHORTENED {
                extent = extent.max(Extent::SMALLEST);
            } else if attempt >= WHOLE {
                extent = extent.shorter();
            }
            if !self.pay(paths) {
                break;
            }
            let proposal = self.propose();
            let is_covered = self.shorten(pairs, &proposal, &mut extent);
            if !is_covered && self.worthwhile(0, LEAST_TESTS).is_none() {
                break;
            }
            let point = proposal.at(extent);
            let motion = RigidMotion::from_vector(self.about, &point, self.lever);
            if !motion.is_finite() || !self.rows.allow(&point) {
                continue;
            }
            let found = self.verify(pairs, &motion)?;
            if found.is_admissible {
                let is_whole = extent == Extent::WHOLE;
                let reason = if is_whole && proposal.is_command {
                    Reason::Commanded
                } else if point == [0.0; 6] {
                    Reason::Stopped
                } else if extent >= Extent::SMALLEST
                    || proposal.whole == proposal.least
                    || self.command == [0.0; 6]
                {
                    Reason::Retreating
                } else if is_whole {
                    Reason::Nearest
                } else {
                    Reason::Shortened
                };
                return Ok(self.admitted(&found, reason));
            }
            // Farther at the end than any other, and during the motion no nearer than at rest, unless it leads straight
            // out.
            let gained = found.last - stand_still.last;
            let is_retreat = found.least >= stand_still.least || gained >= 0.5 * found.moved;
            if is_retreat && found.last > best.last {
                best = found;
            }
        }
        let reason = if best.is_admissible { Reason::Stopped } else { Reason::NoSafeMotion };
        Ok(self.admitted(&best, reason))
    }

    fn admitted(&self, found: &Candidate, reason: Reason) -> AdmittedMotion {
        // A tool that starts nearer than the stand-off may leave, but has not kept it.
        let is_kept = found.least >= self.filter.stand_off - EPSILON;
        AdmittedMotion {
            motion: found.motion,
            least_separation: found.separation,
            reason: if is_kept { reason } else { Reason::NoSafeMotion },
            queries: self.queries,
            instructions: self.instructions,
        }
    }

    /// Searches a pair at its current pose, or a part of its surface. The instructions that are `reserved` cover the pairs to
    /// come, each of which gets an answer, if only the last tick's, and the first motion.
    fn start<P: Pair>(
        &mut self,
        pair: &mut P,
        (number, part): (usize, Option<Part>),
        reserved: u32,
        rest: &RigidMotion,
    ) -> Result<(), FilterError> {
        let (ends, radius) = (pair.ends(), pair.radius());
        let mut size = radius;
        for end in ends {
            size += end.abs().max_element();
        }
        let reach = radius + self.margin + ROUNDING * (size + self.most);
        let reach = part.map_or(reach, |part| reach + part.more);
        let kept = reach + self.filter.stand_off;
        // No part of the surface is nearer than all of it.
        let whole = self.states.get(number).map(|state| state.start.distance);
        let near = kept + self.grow + NEAR * self.most;
        let found = match (part, whole) {
            (Some(part), Some(whole)) if whole > 0.0 && whole < near => {
                let near = Some((part.label, near));
                self.worthwhile(reserved, LEAST_TESTS_OF_PART)
                    .map(|left| self.search(pair, ends, false, near, left))
                    .transpose()?
            }
            (Some(_), _) => None,
            (None, _) => self
                .left(reserved)
                .map(|left| self.search(pair, ends, false, None, left))
                .transpose()?,
        };
        let least_known = whole.filter(|_| part.is_some()).unwrap_or(f32::NEG_INFINITY);
        let distance = found.map_or(least_known, |found| larger(found.distance, least_known));
        // Where nothing is known, nothing is admitted.
        let is_below = distance < kept && distance > f32::NEG_INFINITY;
        let least = if is_below { distance } else { kept };
        // What is not certainly outside of the whole surface is kept out by that.
        let is_out = part.is_none() || distance > 0.0;
        let least = if is_out { least } else { f32::NEG_INFINITY };
        let farthest = distance + self.most;
        let wanted = kept + self.grow;
        let wanted = if is_below && farthest < wanted { farthest } else { wanted };
        let room = distance - wanted;
        let wanted = if room > 0.0 && room < f32::INFINITY {
            distance - room * self.fraction
        } else {
            wanted
        };
        let number = self.states.len();
        if let Some(found) = found
            && distance < wanted + NEAR * self.most
        {
            self.add_wall(number, &found, (ends, distance), rest);
        }
        // `wanted` has as many slots as there are pairs.
        let _ = self.wanted.push(wanted);
        let start = PoseDistance { ends, distance };
        let axis_distance = found.map_or(f32::INFINITY, |found| found.axis_distance);
        let _ = self.states.push(PairState { start, end: None, reach, least, axis_distance });
        Ok(())
    }

    fn add_wall(
        &mut self,
        number: usize,
        found: &ClosestPair,
        ([start, end], distance): ([Vec3; 2], f32),
        at: &RigidMotion,
    ) {
        let on_axis = start + (end - start) * found.axis_parameter;
        self.rows.add_wall(number, on_axis, found.direction, distance, at);
    }

    /// The motion nearest to a wanted one within the rows, as far as the budget lasts.
    fn solve(&mut self, wanted: &Vector) -> Nearest {
        let left = self.filter.instructions.saturating_sub(self.instructions);
        let found = self.rows.nearest(wanted, &self.wanted, left / PRODUCT);
        self.instructions = self.instructions.saturating_add(found.work.saturating_mul(PRODUCT));
        found
    }

    /// The instructions of the first motion besides its searches, for so many pairs and parts: its rows, and the paths at
    /// rest, of its estimate and of the motion.
    fn price_of_first_motion(&self, pairs: usize) -> u32 {
        let walls = pairs as u32;
        let rows = (self.rows.own() + walls).saturating_mul(2 * PRODUCT);
        FIRST_SOLUTION
            .saturating_add(rows)
            .saturating_add(walls.saturating_mul(3 * PATH + 2 * DISTANCES))
    }

    /// Pays for work besides searches. Returns whether the budget covers it.
    fn pay(&mut self, price: u32) -> bool {
        let paid = self.instructions.saturating_add(price);
        let is_paid = paid <= self.filter.instructions;
        if is_paid {
            self.instructions = paid;
        }
        is_paid
    }

    /// The smallest motion that the rows allow, and the nearest one.
    fn propose(&mut self) -> Proposal {
        let least = self.solve(&[0.0; 6]).point;
        let least = self.within_speed(&least);
        let nearest = self.solve(&self.command.clone());
        if nearest.is_inside && nearest.point == self.command {
            return Proposal { least, whole: self.command, is_command: !self.is_cut };
        }
        let mut whole = least;
        if nearest.is_inside {
            let mut step = nearest.point;
            add(&mut step, &least, -1.0);
            let ([a, b, c, d, e, f], [u, v, w, x, y, z]) = (least, step);
            let turn = most_turn(self.most, self.lever) * self.lever;
            let straight = inside(Vec3::new(a, b, c), Vec3::new(u, v, w), self.most);
            let turned = inside(Vec3::new(d, e, f), Vec3::new(x, y, z), turn);
            add(&mut whole, &step, smaller(turned, straight));
        }
        Proposal { least, whole, is_command: false }
    }

    /// Shortens a proposal until the budget left probably covers its searches: one that the budget ends admits nothing,
    /// and its way there and back makes the next tick's dearer. Returns whether it does.
    fn shorten<P: Pair>(&mut self, pairs: &[P], proposal: &Proposal, extent: &mut Extent) -> bool {
        let before = self.instructions;
        let needed = self.needed(pairs, &proposal.at(*extent));
        let estimate = u64::from(self.instructions - before);
        let last = if proposal.least == [0.0; 6] { Extent::SMALLEST } else { Extent::LAST };
        if needed.is_some_and(|needed| self.covers(needed)) || *extent >= last {
            return needed.is_some_and(|needed| self.covers(needed));
        }
        // Bisection, because most often a shorter motion needs less. Another estimate is made only if the budget still
        // covers the searches of the longest motion found so far.
        let (mut longer, mut shorter, mut kept) = (*extent, last, None);
        while let Some(middle) = longer.middle(shorter) {
            if !self.covers(kept.unwrap_or(0) + estimate) {
                break;
            }
            match self.needed(pairs, &proposal.at(middle)) {
                Some(needed) if self.covers(needed) => (shorter, kept) = (middle, Some(needed)),
                _ => longer = middle,
            }
        }
        *extent = shorter;
        kept.or_else(|| self.needed(pairs, &proposal.at(shorter)))
            .is_some_and(|needed| self.covers(needed))
    }

    /// The motion, limited to the robot's speed.
    fn within_speed(&self, point: &Vector) -> Vector {
        let motion = RigidMotion::from_vector(self.about, point, self.lever);
        let (translation, rotation) = (motion.translation, motion.rotation);
        let within = RigidMotion {
            translation: shortened(translation, self.most),
            rotation: shortened(rotation, most_turn(self.most, self.lever)),
            ..motion
        };
        if within == motion { *point } else { within.to_vector(self.lever) }
    }

    /// The distances of a motion. Searches if the known distances do not suffice; a pair that comes too near adds a
    /// row.
    fn verify<P: Pair>(
        &mut self,
        pairs: &mut [P],
        motion: &RigidMotion,
    ) -> Result<Candidate, FilterError> {
        let mut found = Candidate {
            motion: *motion,
            separation: f32::INFINITY,
            least: f32::INFINITY,
            last: f32::INFINITY,
            moved: 0.0,
            is_admissible: true,
        };
        for (layer, part) in self.filter.layers().enumerate() {
            let first = layer * pairs.len();
            for (number, pair) in pairs.iter_mut().enumerate() {
                self.verify_pair(pair, (number, first + number, part), &mut found)?;
            }
        }
        Ok(found)
    }

    /// The same for one pair, or a part of its surface, whose state is in slot `at`.
    fn verify_pair<P: Pair>(
        &mut self,
        pair: &mut P,
        (number, at, part): (usize, usize, Option<Part>),
        found: &mut Candidate,
    ) -> Result<(), FilterError> {
        let Some(&state) = self.states.get(at) else { return Ok(()) };
        let PairState { start, reach, least, .. } = state;
        let motion = found.motion;
        let (ends, moved, arc) = self.path(&start, &motion);
        found.moved = larger(found.moved, moved);
        let mut last = state.distance_at(&ends);
        if part.is_some()
            && let Some(whole) = self.states.get(number)
        {
            last = larger(last, whole.distance_at(&ends));
        }
        let grow = self.grow;
        let on_path = |last| path::least(start.distance, last, moved, grow) - arc;
        let is_enough = |nearest: f32| nearest >= least - EPSILON;
        let mut nearest = on_path(last);
        // From there on the path is far enough, whatever is between its ends.
        let near = part.map(|part| (part.label, least + moved + 2.0 * (grow + arc)));
        let least_tests = if part.is_some() { LEAST_TESTS_OF_PART } else { LEAST_TESTS };
        // At rest the start's search suffices.
        if !is_enough(nearest)
            && moved > 0.0
            && let Some(left) = self.worthwhile(0, least_tests)
        {
            let searched = self.search(pair, ends, start.distance > 0.0, near, left)?;
            last = larger(last, searched.distance);
            nearest = on_path(last);
            let known = PoseDistance { ends, distance: last };
            if let Some(state) = self.states.get_mut(at) {
                state.end = Some(known);
            }
            if !is_enough(nearest)
                && let Some(wanted) = self.wanted.get_mut(at)
            {
                // The end is far enough, but the middle is not.
                let lacks = least - nearest;
                if last >= *wanted - EPSILON && lacks < moved {
                    *wanted += 2.0 * lacks;
                }
                self.add_wall(at, &searched, (ends, searched.distance), &motion);
            }
        }
        found.is_admissible &= is_enough(nearest);
        found.least = smaller_or_nan(found.least, nearest - reach);
        found.last = smaller_or_nan(found.last, last - grow - reach);
        if part.is_none() {
            found.separation = smaller_or_nan(found.separation, nearest - reach);
        }
        Ok(())
    }

    /// Instructions that the searches at a motion's end probably take; `None` if the budget does not cover this
    /// estimate.
    fn needed<P: Pair>(&mut self, pairs: &[P], point: &Vector) -> Option<u64> {
        let motion = RigidMotion::from_vector(self.about, point, self.lever);
        let mut needed = 0_u64;
        for (number, pair) in pairs.iter().enumerate() {
            let Some(&state) = self.states.get(number) else { break };
            self.pay(PATH).then_some(())?;
            let (ends, moved, arc) = self.path(&state.start, &motion);
            let last = state.distance_at(&ends);
            let nearest = path::least(state.start.distance, last, moved, self.grow) - arc;
            if nearest >= state.least - EPSILON {
                continue;
            }
            self.pay(pair.opened().saturating_mul(ESTIMATE)).then_some(())?;
            // Each bound falls by the motion, and the distance may grow by it.
            let due = pair.due_within(state.axis_distance + 2.0 * moved);
            let tests = TESTS_OF_DUE * u64::from(due);
            needed += u64::from(self.cost.base) + tests * u64::from(self.cost.node_test);
        }
        Some(needed)
    }

    fn covers(&self, instructions: u64) -> bool {
        u64::from(self.instructions) + instructions <= u64::from(self.filter.instructions)
    }

    /// An axis' ends after a motion, an upper bound (mm) on the motion of its points, and the height of their arcs.
    fn path(&self, start: &PoseDistance, motion: &RigidMotion) -> ([Vec3; 2], f32, f32) {
        let ends = start.ends.map(|end| motion.apply(end));
        let mut arc = 0.0;
        for end in start.ends {
            let height = motion.arc(sqrt(end.distance_squared(self.about)));
            if height > arc {
                arc = height;
            }
        }
        (ends, start.moved(&ends), arc)
    }

    /// The budget left for a query, less what is reserved for others (instructions); `None` if that is below the base
    /// cost.
    fn left(&self, reserved: u32) -> Option<Budget> {
        let Self { filter: Filter { instructions, .. }, cost, .. } = self;
        let left = instructions.checked_sub(self.instructions)?.checked_sub(reserved)?;
        (left >= cost.base).then(|| Budget::for_instructions(left, cost))
    }

    /// The same, if a query is worth its base cost.
    fn worthwhile(&self, reserved: u32, least_tests: u32) -> Option<Budget> {
        self.left(reserved).filter(|left| left.tests() >= least_tests)
    }

    /// The closest pair with the axis at these ends, or that of a label's triangles within a distance, within a budget. A
    /// tool that `is_outside` at the start of its path needs no side later.
    fn search<P: Pair>(
        &mut self,
        pair: &mut P,
        ends: [Vec3; 2],
        is_outside: bool,
        near: Option<(u8, f32)>,
        left: Budget,
    ) -> Result<ClosestPair, FilterError> {
        let options = self.filter.options.signed().budget(left);
        let found = match near {
            // Without labels that is not compiled.
            Some(near) if LABELS > 0 => {
                ClosestPair::of_label(&pair.closest_of_label(ends, near, &options)?)
            }
            _ => ClosestPair::of(&pair.closest(ends, &options)?, pair.radius(), is_outside),
        };
        let ClosestPair { node_tests, triangle_tests, .. } = found;
        // The root's test is included in the base cost.
        let spent = self.cost.instructions(node_tests.saturating_sub(1), triangle_tests);
        let spent = u32::try_from(spent).unwrap_or(u32::MAX);
        self.instructions = self.instructions.saturating_add(spent);
        self.queries += 1;
        Ok(found)
    }
}
