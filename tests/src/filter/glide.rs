//! An instrument of two capsules that is commanded along and against a beating heart.

use dibs_build::{Builder, Mesh, Motion};
use dibs_nostd::filter::{Filter, Reason, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Contacts, Options, Query, Tracker, measure_stretch};
use glam::Vec3;

use super::{Asked, Beat, Listener, Moment, Settings};
use crate::deform::unit;
use fastrand::Rng;

/// Seconds of a tick.
const TICK: f32 = 0.001;
/// Stand-off (mm).
const STAND_OFF: f32 = 1.0;
/// Speed of the robot (mm/s).
const ROBOT: f32 = 200.0;
/// Instruction budget of a tick's queries.
const INSTRUCTIONS: u32 = 200_000;
/// Radius of the capsules (mm).
const RADIUS: f32 = 2.5;

/// The cost of a glide, and the parts of the commands that were admitted.
#[derive(Clone, Copy, Debug, Default)]
pub struct Glided {
    /// Ticks after the first hundred.
    pub ticks: u32,
    /// Sum of the instructions, by the cost model.
    pub instructions: u64,
    /// Most instructions of a tick.
    pub most: u32,
    /// Most instructions of one of the first hundred ticks, in which the trackers start.
    pub most_at_start: u32,
    /// Number of queries.
    pub queries: u64,
    /// Ticks in free space.
    pub free: u32,
    /// Ticks in free space whose command was admitted unchanged.
    pub whole: u32,
    /// Ticks along one wall.
    pub along: u32,
    /// The least ratio of the admitted to the commanded speed along the wall.
    pub least_along: f32,
    /// The sum of these ratios.
    pub sum_along: f64,
    /// Ticks without a safe motion.
    pub unsafe_ticks: u32,
    /// Ticks against the wall.
    pub against: u32,
}

/// Glides near a moving mesh, for this many ticks, with a stated error of registration (mm).
///
/// # Panics
/// If the tree cannot be built or a query fails.
#[must_use]
pub fn glide(
    mesh: &Mesh,
    motion: &Motion,
    stretch: f32,
    (ticks, seed): (u32, u64),
    registration: f32,
) -> Glided {
    glide_told(mesh, motion, stretch, (ticks, seed, registration), &mut ())
}

/// The same with a listener.
///
/// # Panics
/// If the tree cannot be built or a query fails.
#[must_use]
pub fn glide_told(
    mesh: &Mesh,
    motion: &Motion,
    stretch: f32,
    (ticks, seed, registration): (u32, u64, f32),
    listener: &mut impl Listener,
) -> Glided {
    let built = Builder::new().stretch(stretch).build(mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: Vec<Vec<Vec3>> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let tissue = fastest(motion);
    let filter = Filter::new(STAND_OFF, ROBOT).expect("in range");
    let filter = filter.budget(INSTRUCTIONS);
    listener.walk(&Settings {
        stand_off: STAND_OFF,
        labels: &[],
        robot: ROBOT,
        approach: 0.0,
        instructions: INSTRUCTIONS,
        period: TICK,
        is_measured: true,
    });
    let stretches: Vec<_> = frames
        .iter()
        .map(|rows| measure_stretch(&tree, rows.as_slice()).expect("within the limit"))
        .collect();
    let mut trackers =
        [(); 2].map(|()| Tracker::<_, MAX_STACK, 512>::new(&tree).expect("deep enough"));
    let mut query = Query::<_, MAX_STACK>::new(&tree).expect("deep enough");
    let mut contacts = Contacts::<4>::new();
    let mut rng = Rng::with_seed(seed);
    let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
    let mut outward = unit(&mut rng);
    let mut joints = [100.0, 112.0, 182.0].map(|far| middle + outward * far);
    let mut glided = Glided { least_along: f32::INFINITY, ..Glided::default() };
    let mut beat = Beat::new(&tree, &frames, motion.rate);
    listener.frame(&frames[0]);
    let mut goal = middle;
    for tick in 0..ticks {
        let Moment { surface, frames: [from, to], share, is_next } = beat.at(tick as f32 * TICK);
        if is_next {
            listener.frame(&frames[to]);
        }
        let measured = stretches[from].or_larger(stretches[to]).expect("one tree");
        let uncertainty = Uncertainty::new(tissue).error(registration);
        if tick % 700 == 0 {
            // Towards it, along it, away from it.
            outward = (joints[0] - middle).normalize();
            goal = match tick / 700 % 4 {
                0 | 2 => middle,
                1 => joints[0] + unit(&mut rng) * 400.0,
                _ => joints[0] + outward * 60.0 + unit(&mut rng) * 30.0,
            };
        }
        let way = (goal - joints[0]).clamp_length_max(ROBOT * TICK);
        let turn = unit(&mut rng) * 0.0005;
        let command = RigidMotion::new(joints[0], way, turn);
        let tools =
            [0, 1].map(|at| Capsule::new(joints[at], joints[at + 1], RADIUS).expect("finite"));
        let filter = filter.options(Options::new().stretch(measured));
        let [one, other] = &mut trackers;
        let near = |tracker: &Tracker<'_, _, MAX_STACK, 512>, tool| {
            tracker.clone().closest(&surface, tool, &Options::new()).expect("an answer").closest
        };
        let (tip, shaft) = (near(one, &tools[0]), near(other, &tools[1]));
        let is_shaft = shaft.separation < tip.separation;
        let (near, far) = if is_shaft { (shaft, tip) } else { (tip, shaft) };
        let mut pairs = [(one, &surface, &tools[0]), (other, &surface, &tools[1])];
        let admitted =
            filter.admit(&mut pairs, &command, TICK, &uncertainty, &[]).expect("an answer");
        let (share, radii, tissue) = (Some(share), [RADIUS; 2], [tissue, 0.0, registration]);
        listener.tick(&Asked { share, joints, radii, command, tissue, admitted });
        let moved = admitted.motion;
        if tick < 100 {
            glided.most_at_start = glided.most_at_start.max(admitted.instructions);
        } else {
            glided.ticks += 1;
            glided.instructions += u64::from(admitted.instructions);
            glided.most = glided.most.max(admitted.instructions);
            glided.queries += u64::from(admitted.queries);
            glided.unsafe_ticks += u32::from(admitted.reason == Reason::NoSafeMotion);
            let free = STAND_OFF + uncertainty.stand_off(TICK) + 2.0 * ROBOT * TICK;
            if near.separation > free {
                glided.free += 1;
                glided.whole += u32::from(admitted.reason == Reason::Commanded);
            } else {
                glided.against += u32::from(way.dot(near.direction) < 0.0);
                let along = way - near.direction * way.dot(near.direction);
                let nearer = if is_shaft { &tools[1] } else { &tools[0] };
                query
                    .contacts(&surface, nearer, free, &Options::new(), &mut contacts)
                    .expect("an answer");
                let is_one_wall = far.separation > free && contacts.len() == 1;
                if along.length() > 0.3 * ROBOT * TICK && is_one_wall {
                    let share = moved.translation.dot(along) / along.length_squared();
                    glided.along += 1;
                    glided.least_along = glided.least_along.min(share);
                    glided.sum_along += f64::from(share);
                }
            }
        }
        joints = joints.map(|joint| moved.apply(joint));
    }
    glided
}

/// The largest speed (mm/s) of a vertex from frame to frame.
pub fn fastest(motion: &Motion) -> f32 {
    let next = motion.frames.iter().cycle().skip(1);
    let steps = motion.frames.iter().zip(next).flat_map(|(a, b)| a.iter().zip(b));
    steps.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max) * motion.rate * 1.001
}
