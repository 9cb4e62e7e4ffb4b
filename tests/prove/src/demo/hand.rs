//! Results of a simulated hand's pushes: against the wall's force, and by commands that a filter admits.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;
use controller::telemetry::{Push, Tick};
use controller::{ACCOUNT, PERIOD, STAND_OFF};
use dibs_nostd::Budget;
use dibs_nostd::failsafe::State;
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::sides;
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use xtask::qemu;

use super::check::Checked;
use super::scene::Scene;
use super::sender::{Link, Sent};

/// Tolerance (mm) on the separation after a filter's admitted motion, in addition to the accuracy: the documentation
/// states half of it.
const SLACK: f64 = 0.02;

/// Largest penetration (mm) of the hand against the wall's force: the force is limited to 5 N, so a wall that moves
/// faster than 25 mm/s towards a push of 4.5 N catches up with it.
const YIELDS: f64 = 1.0;

/// Largest energy (mJ) that the wall may give to the hand, whatever the mesh: the controller's tank and what its force
/// gives while it falls, with an allowance of 1 microjoule for the rounding of sums over a run. The checks hold the
/// generated heart, where the force need not fall, to the tank alone.
const GIVEN: f64 = ((ACCOUNT.most(PERIOD) * 1e3) as u32 + 1) as f64 / 1e3;
/// Largest step of its force (N): the controller's limit.
const STEP: f32 = 0.5;

/// Names of the codes of [`controller::telemetry::reason_code`].
const REASONS: [&str; 8] = [
    "",
    "commanded",
    "nearest",
    "shortened",
    "stopped",
    "retreating",
    "no safe motion",
    "nothing admitted",
];

/// The first of these codes that promises nothing.
const UNSAFE: u32 = 6;

/// A tick in which the surface was trusted.
#[derive(Clone, Copy)]
pub struct Moment {
    pub tick: Tick,
    pub push: Push,
}

impl Moment {
    /// Whether the hand commands a motion; otherwise the wall's force resists it.
    pub const fn is_commanded(&self) -> bool {
        self.push.outcome > 0
    }

    pub fn reason(&self) -> Option<&'static str> {
        let reason = REASONS.get(self.push.outcome as usize).copied();
        reason.filter(|_| self.is_commanded())
    }

    /// Speeds (mm/s): of the unresisted motion, and of the instrument.
    pub fn speeds(&self) -> [f32; 2] {
        [self.push.commanded, self.push.moved].map(|velocity| Vec3::from(velocity).length())
    }

    /// Whether the wall or the filter changes the hand's motion.
    fn is_held(&self) -> bool {
        if self.is_commanded() {
            self.push.outcome > 1
        } else {
            Vec3::from(self.tick.force) != Vec3::ZERO
        }
    }

    /// Instructions of the guard's answer, including those of the filter.
    pub fn instructions(&self) -> u64 {
        u64::from(self.tick.query_counts) * u64::from(qemu::INSTRUCTIONS_A_COUNT)
    }
}

/// A hand's run.
#[derive(Clone, Serialize)]
pub struct Hand {
    by_force: Way,
    by_commands: Way,
    /// Largest force of the wall, and its largest change from tick to tick, in N.
    push_force_max_n: f32,
    push_force_step_max_n: f32,
    /// Largest energy (mJ) that the wall had given to the hand at any time, minus what the hand had given before.
    energy_given_max_mj: f64,
    /// Number of ticks by the filter's reason.
    reasons: BTreeMap<&'static str, usize>,
    /// Ticks after an admitted motion that came closer than the stand-off minus 0.02 mm and the accuracy, although its
    /// reason promises otherwise.
    admitted_too_near: usize,
    /// Instructions of a filter's queries by the cost model.
    filter_instructions_mean: f64,
    filter_instructions_max: u32,
    #[serde(skip)]
    pub moments: Vec<Moment>,
}

/// The pushes of one kind.
#[derive(Clone, Copy, Default, Serialize)]
pub struct Way {
    ticks: usize,
    /// Ticks in which wall or filter changed the hand's motion.
    ticks_held: usize,
    /// Least separation (mm) from the surface that the controller searched.
    separation_min_mm: f64,
    /// Least separation (mm) from the heart itself, at the ticks in which a frame was captured, and their number.
    heart_separation_min_mm: f64,
    heart_instants: usize,
    /// Largest penetration (mm) of either surface.
    penetration_max_mm: f64,
    /// Mean speeds (mm/s) while it was held: of the unresisted motion, and of the instrument.
    speed_commanded_mean: f64,
    speed_moved_mean: f64,
    answer_instructions_mean: f64,
    answer_instructions_max: u64,
    /// Largest fraction of the closest pair's budget that a tick used.
    budget_used_max: f64,
}

impl Hand {
    /// The results of a run.
    pub fn new(
        scene: &Scene,
        link: &Link,
        ticks: &[Tick],
        pushes: Vec<Push>,
        checked: &[Checked],
    ) -> Result<Self> {
        let pairs = ticks.iter().zip(pushes);
        let is_trusted = |tick: &Tick| tick.is_answered() && tick.state != State::Safe as u32;
        let moments: Vec<Moment> = pairs
            .filter(|(tick, push)| tick.tick == push.tick && is_trusted(tick))
            .map(|(&tick, push)| Moment { tick, push })
            .collect();
        let at = |tick: u32| {
            let place = moments.binary_search_by_key(&tick, |moment| moment.tick.tick).ok()?;
            Some(&moments[place])
        };
        // The heart itself, at the ticks in which a frame was captured.
        let heart: Vec<(u32, f64)> = link
            .all()
            .par_iter()
            .filter_map(|sent| Some((sent.captured, apart(scene, sent, &at(sent.captured)?.tick))))
            .collect();
        let separations: Vec<(u32, f64)> = checked
            .iter()
            .filter(|checked| at(checked.tick).is_some())
            .map(|checked| (checked.tick, checked.separation))
            .collect();
        // A push by commands begins where a push by force ended, which may be too close: it is checked from its first
        // safe motion on.
        let mut is_settled = false;
        let mut unsettled = BTreeSet::new();
        for moment in &moments {
            if !moment.is_commanded() {
                is_settled = false;
            } else if !is_settled {
                unsettled.insert(moment.tick.tick);
                is_settled = moment.push.outcome < UNSAFE;
            }
        }
        let way = |is_commanded: bool| {
            let is_of = |moment: &&Moment| moment.is_commanded() == is_commanded;
            let counts = |tick: u32| at(tick).filter(is_of).is_some() && !unsettled.contains(&tick);
            let least = |of: &[(u32, f64)]| {
                let own = of.iter().filter(|(tick, _)| counts(*tick));
                own.fold((0, f64::INFINITY), |(count, least), (_, apart)| {
                    (count + 1, least.min(*apart))
                })
            };
            let budget = scene.budget();
            Way::new(&moments.iter().filter(is_of), budget, least(&separations).1, least(&heart))
        };
        let commanded: Vec<&Moment> = moments.iter().filter(|m| m.is_commanded()).collect();
        let mut reasons = BTreeMap::new();
        for moment in &commanded {
            *reasons.entry(moment.reason().unwrap_or("unknown")).or_insert(0) += 1;
        }
        let instructions = || commanded.iter().map(|moment| moment.push.instructions);
        let sum: f64 = instructions().map(f64::from).sum();
        let near = separations.iter().filter(|(tick, apart)| {
            // The motion was admitted in the previous tick.
            let Some(before) = tick.checked_sub(1).and_then(at) else { return false };
            let says = before.push.outcome >= UNSAFE;
            let least =
                f64::from(STAND_OFF) - SLACK - at(*tick).map_or(0.0, |now| accuracy(&now.tick));
            before.is_commanded() && !says && *apart < least
        });
        let mut hand = Self {
            by_force: way(false),
            by_commands: way(true),
            push_force_max_n: 0.0,
            push_force_step_max_n: 0.0,
            energy_given_max_mj: 0.0,
            reasons,
            admitted_too_near: near.count(),
            filter_instructions_mean: sum / commanded.len().max(1) as f64,
            filter_instructions_max: instructions().max().unwrap_or(0),
            moments: Vec::new(),
        };
        hand.add_forces(&moments);
        hand.moments = moments;
        Ok(hand)
    }

    fn add_forces(&mut self, moments: &[Moment]) {
        let mut given = 0.0_f64;
        for [before, now] in moments.array_windows() {
            if before.is_commanded() || now.is_commanded() || before.tick.tick + 1 != now.tick.tick
            {
                continue;
            }
            let [last, force] = [before, now].map(|moment| Vec3::from(moment.tick.force));
            self.push_force_max_n = self.push_force_max_n.max(force.length());
            self.push_force_step_max_n = self.push_force_step_max_n.max(force.distance(last));
            given += f64::from(last.dot(Vec3::from(now.push.velocity)) * PERIOD);
            self.energy_given_max_mj = self.energy_given_max_mj.max(given);
        }
    }

    /// The promises that the run broke, as text.
    pub fn broken(&self, seconds: u32) -> Vec<String> {
        let mut broken = Vec::new();
        let mut promise = |is_kept: bool, sentence: String| {
            if !is_kept {
                broken.push(sentence);
            }
        };
        let Way { penetration_max_mm: deepest, .. } = self.by_commands;
        promise(deepest <= SLACK, format!("by commands the instrument got {deepest:.3} mm in"));
        let near = self.admitted_too_near;
        promise(near == 0, format!("{near} admitted motions came too near without a word"));
        let deepest = self.by_force.penetration_max_mm;
        promise(deepest <= YIELDS, format!("by force the instrument got {deepest:.3} mm in"));
        let given = self.energy_given_max_mj;
        promise(given <= GIVEN, format!("the wall gave {given:.3} mJ to the hand"));
        let step = self.push_force_step_max_n;
        promise(step <= STEP, format!("the wall's force made a step of {step:.3} N"));
        // The run is longer than two pushes: one of each kind.
        let held = self.by_force.ticks_held.min(self.by_commands.ticks_held);
        promise(seconds < 3 || held > 0, "the hand never pushed against the surface".to_owned());
        broken
    }

    /// Lines for the user.
    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let mut rows = Vec::new();
        for (name, way) in
            [("pushed by force", &self.by_force), ("pushed by commands", &self.by_commands)]
        {
            rows.push((
                name,
                format!(
                    "{} ticks, held back in {}; {:.3} mm deep at most, {:.2} mm from the heart at the least of {} instants",
                    way.ticks,
                    way.ticks_held,
                    way.penetration_max_mm,
                    way.heart_separation_min_mm,
                    way.heart_instants
                ),
            ));
            rows.push((
                "",
                format!(
                    "{:.0} mm/s of {:.0} in the mean while held; {:.0} instructions an answer, {} at most; {:.0} % of the \
                     budget at most",
                    way.speed_moved_mean,
                    way.speed_commanded_mean,
                    way.answer_instructions_mean,
                    way.answer_instructions_max,
                    way.budget_used_max * 100.0
                ),
            ));
        }
        rows.push((
            "hand's force",
            format!(
                "{:.2} N at most, steps of {:.2} at most; the wall gave {:.2} mJ at most",
                self.push_force_max_n, self.push_force_step_max_n, self.energy_given_max_mj
            ),
        ));
        let reasons: Vec<String> =
            self.reasons.iter().map(|(name, count)| format!("{name} {count}")).collect();
        rows.push((
            "filter",
            format!(
                "{}; queries of {:.0} instructions by the cost model, {} at most",
                reasons.join(", "),
                self.filter_instructions_mean,
                self.filter_instructions_max
            ),
        ));
        rows
    }
}

impl Way {
    fn new<'m>(
        moments: &(impl Iterator<Item = &'m Moment> + Clone),
        budget: Budget,
        separation: f64,
        (instants, heart): (usize, f64),
    ) -> Self {
        let ticks = moments.clone().count();
        let held = moments.clone().filter(|moment| moment.is_held());
        let held_ticks = held.clone().count().max(1) as f64;
        let speed = |which: usize| {
            held.clone().map(|moment| f64::from(moment.speeds()[which])).sum::<f64>() / held_ticks
        };
        let instructions = || moments.clone().map(Moment::instructions);
        let used = moments.clone().map(|moment| {
            let Tick { node_tests, triangle_tests, .. } = moment.tick;
            // No budget counts the root's test and the triangle with which a warm query starts.
            let tests = node_tests + triangle_tests * Budget::TRIANGLE;
            f64::from(tests.saturating_sub(1 + Budget::TRIANGLE)) / f64::from(budget.tests())
        });
        Self {
            ticks,
            ticks_held: held.clone().count(),
            separation_min_mm: separation,
            heart_separation_min_mm: heart,
            heart_instants: instants,
            penetration_max_mm: (-separation.min(heart)).max(0.0),
            speed_commanded_mean: speed(0),
            speed_moved_mean: speed(1),
            answer_instructions_mean: instructions().sum::<u64>() as f64 / ticks.max(1) as f64,
            answer_instructions_max: instructions().max().unwrap_or(0),
            budget_used_max: used.fold(0.0, f64::max),
        }
    }
}

/// An answer's own accuracy, in mm.
fn accuracy(tick: &Tick) -> f64 {
    super::check::accuracy_of(tick)
}

/// The separation (mm) of a tick's instrument from the heart as it was captured then.
fn apart(scene: &Scene, sent: &Sent, tick: &Tick) -> f64 {
    let (start, end) = (Vec3::from(tick.tool_start), Vec3::from(tick.tool_end));
    let tool = Instrument::capsule(start, end, tick.tool_radius);
    let positions = scene.vertices(&sent.rows);
    let Some(truth) = exhaustive(&positions, &scene.triangles, &tool) else { return f64::NAN };
    sides::signed_separation(&positions, &scene.triangles, &tool, &truth, accuracy(tick)).0
}
