//! Walks of an instrument with filtered commands, towards and along a moving surface.

use std::collections::VecDeque;
use std::ops::AddAssign;

use dibs_nostd::filter::{AdmittedMotion, Filter, MotionRow, Reason, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, MovingSurface, Odometer, Tracker};
use fastrand::Rng;
use glam::Vec3;

use super::medial::medial_centre;
use super::truth::Truth;
use super::{Asked, Course, Listener, Scene, Settings};
use crate::deform::unit;

/// Number of times in a tick at which the true separation is computed.
const INSTANTS: u32 = 5;

/// Allowance (mm) for a separation below the stand-off, in addition to the accuracy.
pub const SLACK: f64 = 0.02;

type Follower<'t> = Tracker<'t, u16, MAX_STACK, 128>;

/// The settings of a walk.
#[derive(Clone, Copy, Debug)]
pub struct Episode {
    /// Number of ticks.
    pub ticks: u32,
    /// Period (s).
    pub period: f64,
    /// Stand-off (mm).
    pub stand_off: f32,
    /// Largest speed of the robot (mm/s).
    pub robot: f32,
    /// Largest speed of the tissue (mm/s).
    pub tissue: f32,
    /// Most ticks between frames; frames are late by at most as many ticks, and sometimes lost.
    pub frames: u32,
    /// Error of the registration (mm).
    pub registration: f32,
    /// Budget of a tick, in instructions of a Cortex-M7.
    pub instructions: u32,
    /// Whether each command is the worst of several.
    pub climbs: bool,
    /// Time constant of the approach (s).
    pub approach: f32,
    /// Whether the commands lead to the medial axis, where the closest point jumps.
    pub is_medial: bool,
}

impl Episode {
    /// Random settings.
    #[must_use]
    pub fn any(rng: &mut Rng) -> Self {
        Self {
            ticks: 400,
            period: rng.choice([0.0005, 0.001, 0.002, 0.004]).expect("four"),
            stand_off: rng.choice([0.0, 0.2, 1.0, 3.0]).expect("four"),
            robot: rng.choice([100.0, 300.0, 1_000.0]).expect("three"),
            tissue: rng.choice([0.0, 30.0, 150.0, 300.0]).expect("four"),
            frames: rng.choice([1, 1, 8, 33]).expect("four"),
            registration: rng.choice([0.0, 0.0, 0.5]).expect("three"),
            instructions: rng.choice([30_000, 60_000, 200_000, 200_000]).expect("four"),
            climbs: rng.u32(..8) == 0,
            approach: rng.choice([0.0, 0.0, 0.005, 0.05]).expect("four"),
            // The next number is only looked at, which leaves all other walks as they are.
            is_medial: rng.clone().u32(..8) == 0,
        }
    }
}

/// The results of walks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    /// Number of ticks.
    pub ticks: u64,
    /// Ticks with a separation below the stand-off whose reason promised otherwise.
    pub violations: u64,
    /// Ticks with a separation below the certified one.
    pub uncertain: u64,
    /// Ticks without a safe motion.
    pub unsafe_ticks: u64,
    /// Ticks without a safe motion and with a separation below the stand-off.
    pub below: u64,
    /// Ticks on a convex surface with new frames, with a robot faster than it.
    pub easy: u64,
    /// Those of them in which the safe motion was lost.
    pub cries: u64,
    /// Ticks near the surface.
    pub near: u64,
    /// Ticks with the tip at the medial axis, within 0.1 mm.
    pub medial: u64,
    /// Ticks near a label whose stand-off leaves less room than that of the whole surface.
    pub near_label: u64,
    /// Most instructions of a tick.
    pub most_instructions: u32,
    /// Ticks that count more instructions than their budget.
    pub over_budget: u64,
    /// Sum of the instructions.
    pub instructions: u64,
    /// Number of queries.
    pub queries: u64,
    /// Ticks in which the admitted motion was faster than the robot.
    pub too_fast: u64,
    /// Ticks by reason: commanded, nearest, shortened, stopped, retreating.
    pub reasons: [u64; 5],
    /// Largest shortfall (mm) from the stand-off in ticks whose reason promised otherwise, negative where it was kept;
    /// none without such a tick.
    pub worst: Option<f64>,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.ticks += other.ticks;
        self.violations += other.violations;
        self.uncertain += other.uncertain;
        self.unsafe_ticks += other.unsafe_ticks;
        self.below += other.below;
        self.near += other.near;
        self.medial += other.medial;
        self.near_label += other.near_label;
        self.easy += other.easy;
        self.cries += other.cries;
        self.most_instructions = self.most_instructions.max(other.most_instructions);
        self.over_budget += other.over_budget;
        self.instructions += other.instructions;
        self.queries += other.queries;
        self.too_fast += other.too_fast;
        for (one, more) in self.reasons.iter_mut().zip(other.reasons) {
            *one += more;
        }
        self.worst = self.worst.into_iter().chain(other.worst).reduce(f64::max);
    }
}

/// Runs a walk.
///
/// # Panics
/// If a query fails.
#[must_use]
pub fn walk(scene: &Scene, episode: &Episode, seed: u64) -> Tally {
    walk_told(scene, episode, seed, &mut ())
}

/// The same with a listener.
///
/// # Panics
/// If a query fails.
#[must_use]
pub fn walk_told(
    scene: &Scene,
    episode: &Episode,
    seed: u64,
    listener: &mut impl Listener,
) -> Tally {
    walk_by_label(scene, episode, [], seed, listener)
}

/// The same, with stand-offs of labels, each by how much it is larger than the filter's.
///
/// # Panics
/// If a query fails.
#[must_use]
pub fn walk_by_label<const LABELS: usize>(
    scene: &Scene,
    episode: &Episode,
    labels: [(u8, f32); LABELS],
    seed: u64,
    listener: &mut impl Listener,
) -> Tally {
    let mut rng = Rng::with_seed(seed);
    let tree = scene.tree.tree::<u16>().expect("16-bit indices");
    let filter = Filter::new(episode.stand_off, episode.robot).expect("in range");
    let filter = filter.budget(episode.instructions);
    let filter = filter.approach(episode.approach).expect("in range");
    // A scene may be so small that no triangle has the label, which a filter would refuse.
    let labels =
        labels.map(|(label, more)| (label, if tree.has_label(label) { more } else { 0.0 }));
    let stand_offs = labels.map(|(label, more)| (label, episode.stand_off + more));
    listener.walk(&Settings {
        stand_off: episode.stand_off,
        labels: &stand_offs,
        robot: episode.robot,
        approach: episode.approach,
        instructions: episode.instructions,
        period: episode.period as f32,
        is_measured: false,
    });
    let filter = filter.stand_off_of(stand_offs).expect("in range");
    let labels = labels.map(|(label, more)| (label, f64::from(more)));
    let most_more = labels.iter().fold(0.0, |most: f64, &(_, more)| most.max(more));
    let mut trackers = [(); 2].map(|()| Follower::new(&tree).expect("deep enough"));
    let course = Course::any(scene, f64::from(episode.tissue), &mut rng);
    let radii = [0.5 + 2.0 * rng.f32(), 1.0];
    // A tip of 10 mm on a shaft of 40 mm at an angle.
    let outward = (scene.from - scene.middle).normalize();
    let lean = (outward + 0.6 * unit(&mut rng)).normalize();
    let from = scene.from + outward * (episode.stand_off + radii[0] + 2.0 + most_more as f32);
    let mut joints = [from, from + lean * 10.0, from + lean * 10.0 + outward * 40.0];
    let most = episode.robot * episode.period as f32;
    let mut tally = Tally::default();
    let mut frames: VecDeque<(u32, Vec<Vec3>)> = VecDeque::new();
    let mut shown = (0_u32, Vec::new());
    let mut next = 0;
    let mut odometer = Odometer::new(&tree);
    let registration = unit(&mut rng) * episode.registration * 0.999;
    let is_easy = scene.is_convex
        && episode.frames == 1
        && episode.robot > 2.0 * episode.tissue
        && episode.instructions >= 200_000;
    let mut was_unsafe = true;
    let (mut goal, mut spin, mut until) = (Vec3::ZERO, Vec3::ZERO, 0);
    let (mut aims, mut medial) = (Rng::with_seed(!seed), None);
    for tick in 0..episode.ticks {
        let start = f64::from(tick) * episode.period;
        // Frames are captured at every tick, and delivered late.
        let now: Vec<Vec3> =
            scene.rest.iter().map(|&p| course.at(p, start).as_vec3() + registration).collect();
        frames.push_front((tick, now));
        frames.truncate(80);
        let before = shown.1.clone();
        if tick >= next {
            let is_lost = tick > 0 && episode.frames > 1 && rng.u32(..5) == 0;
            if !is_lost {
                let late =
                    if episode.frames > 1 { rng.usize(..episode.frames as usize) } else { 0 };
                let frame = &frames[late.min(frames.len() - 1)];
                if frame.0 >= shown.0 {
                    shown = frame.clone();
                }
            }
            next = tick + 1 + rng.u32(..episode.frames);
        }
        if before != shown.1 {
            listener.frame(&shown.1);
        }
        let surface = if before.is_empty() {
            odometer.start(shown.1.as_slice())
        } else {
            odometer.step(before.as_slice(), shown.1.as_slice()).after()
        };
        let age = f64::from(tick - shown.0) * episode.period;
        let aged = (f64::from(episode.tissue) * age * (1.0 + 1e-6)) as f32;
        let uncertainty = Uncertainty::new(episode.tissue).error(aged).error(episode.registration);
        // A target beyond the surface, a path along it, or a random one.
        if tick >= until {
            until = tick + 1 + rng.u32(..60);
            goal = match rng.u32(..4) {
                0 | 1 => (scene.middle - joints[0]).normalize_or_zero() + 0.5 * unit(&mut rng),
                2 => unit(&mut rng),
                _ => -outward + unit(&mut rng),
            };
            spin = unit(&mut rng) * rng.f32() / 40.0;
            if episode.is_medial {
                let rows = &frames[0].1;
                medial = medial_point(scene, rows, joints[0], 40.0 * most, &mut aims);
            }
        }
        let axes = [[joints[0], joints[1]], [joints[1], joints[2]]];
        let tools =
            [0, 1].map(|at| Capsule::new(axes[at][0], axes[at][1], radii[at]).expect("finite"));
        let way = match medial {
            Some(centre) => (centre - joints[0]).clamp_length_max(most),
            None => goal.normalize_or_zero() * most,
        };
        let is_at = |centre: Vec3| centre.distance(joints[0]) < 0.1;
        tally.medial += u64::from(medial.is_some_and(is_at));
        let mut command = RigidMotion::new(joints[0], way, spin * most);
        let period = episode.period;
        let truth = Truth { scene, course, start, period, radii, labels: &labels };
        if episode.climbs {
            // The worst of a few commands, by the separation that results from the admitted motion.
            let mut worst = f64::INFINITY;
            for other in 0..3 {
                let tried = if other == 0 {
                    command
                } else {
                    RigidMotion::new(joints[0], unit(&mut rng) * most, unit(&mut rng) * most / 40.0)
                };
                let mut trackers = trackers.clone();
                let admitted =
                    ask(&filter, &mut trackers, &surface, &tools, &tried, (episode, &uncertainty));
                let apart = truth.separations(&axes, &admitted.motion, 1.0, true).room;
                if apart < worst {
                    (worst, command) = (apart, tried);
                }
            }
        }
        let admitted =
            ask(&filter, &mut trackers, &surface, &tools, &command, (episode, &uncertainty));
        let tissue = [episode.tissue, aged, episode.registration];
        listener.tick(&Asked { share: None, joints, radii, command, tissue, admitted });
        tally.judge(&truth, &axes, &admitted, episode, rng.bool());
        let is_unsafe = admitted.reason == Reason::NoSafeMotion;
        tally.easy += u64::from(is_easy);
        tally.cries += u64::from(is_easy && is_unsafe && !was_unsafe);
        was_unsafe = is_unsafe;
        joints = joints.map(|joint| admitted.motion.apply(joint));
    }
    tally
}

/// A point of the medial axis, the nearest of a few, at most so far on the way to the region's middle.
fn medial_point(scene: &Scene, rows: &[Vec3], from: Vec3, far: f32, rng: &mut Rng) -> Option<Vec3> {
    let inwards = (scene.middle - from).clamp_length_max(far);
    let points = (0..4).filter_map(|_| {
        let near = from + inwards * rng.f32() + unit(rng) * 6.0 * rng.f32();
        medial_centre(rows, &scene.triangles, near)
    });
    points.min_by(|a, b| a.distance(from).total_cmp(&b.distance(from)))
}

fn ask<const LABELS: usize>(
    filter: &Filter<LABELS>,
    trackers: &mut [Follower<'_>; 2],
    surface: &impl MovingSurface,
    tools: &[Capsule; 2],
    command: &RigidMotion,
    (episode, uncertainty): (&Episode, &Uncertainty),
) -> AdmittedMotion {
    let [one, other] = trackers;
    let mut pairs = [(one, surface, &tools[0]), (other, surface, &tools[1])];
    const NONE: [MotionRow; 0] = [];
    filter.admit(&mut pairs, command, episode.period as f32, uncertainty, &NONE).expect("an answer")
}

impl Tally {
    fn judge(
        &mut self,
        truth: &Truth<'_>,
        axes: &[[Vec3; 2]; 2],
        admitted: &AdmittedMotion,
        episode: &Episode,
        by_arc: bool,
    ) {
        self.ticks += 1;
        self.instructions += u64::from(admitted.instructions);
        self.most_instructions = self.most_instructions.max(admitted.instructions);
        self.over_budget += u64::from(admitted.instructions > episode.instructions);
        self.queries += u64::from(admitted.queries);
        let most = episode.robot * episode.period as f32;
        let motion = &admitted.motion;
        self.too_fast += u64::from(!(motion.translation.length() <= most * 1.0001));
        let says = admitted.reason == Reason::NoSafeMotion;
        self.unsafe_ticks += u64::from(says);
        let reason = match admitted.reason {
            Reason::Commanded => Some(0),
            Reason::Nearest => Some(1),
            Reason::Shortened => Some(2),
            Reason::Stopped => Some(3),
            Reason::Retreating => Some(4),
            _ => None,
        };
        if let Some(reason) = reason {
            self.reasons[reason] += 1;
        }
        let certified = f64::from(admitted.least_separation);
        let stand_off = f64::from(episode.stand_off);
        // If the separation is large, there is nothing to check unless the tool came much closer.
        let end = truth.separations(axes, motion, 1.0, by_arc);
        let moved = axes.iter().flatten().map(|&p| motion.apply(p).distance(p)).fold(0.0, f32::max);
        let moved = f64::from(moved) + f64::from(episode.tissue) * episode.period;
        let mut least = end;
        self.near += u64::from(end.whole < stand_off + 5.0);
        self.near_label += u64::from(end.room < end.whole && end.room < stand_off + 0.5);
        if end.room - moved < stand_off || end.whole - moved < certified {
            for instant in 0..INSTANTS {
                let share = f64::from(instant) / f64::from(INSTANTS);
                least = least.or_less(truth.separations(axes, motion, share, by_arc));
            }
        }
        // The accuracy of queries here is below a micrometre.
        self.uncertain += u64::from(least.whole < certified - 1e-3);
        let lacks = stand_off - least.room;
        self.below += u64::from(says && lacks > SLACK);
        if !says {
            self.worst = self.worst.into_iter().chain([lacks]).reduce(f64::max);
            self.violations += u64::from(lacks > SLACK + 1e-3);
        }
    }
}
