//! A simulated hand that pushes an instrument against a surface, at 1 kHz.

use std::ops::ControlFlow;

use controller::{ACCOUNT, Hand, MARGIN, PERIOD as TICK, SPRING};
use dibs_build::{Builder, Mesh, Motion, generate};
use dibs_nostd::constraint::{ForbiddenRegion, Proxy, VelocityRow};
use dibs_nostd::filter::{Filter, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Contacts, Odometer, Options, Query, Sphere, Tracker, Unavailable};
use glam::Vec3;

use crate::surfaces::{ball, sheet};

/// Ticks of a push.
const TICKS: u32 = 4_000;

/// The instrument's radius (mm).
const RADIUS: f32 = 1.0;

/// Gain (1/s) of velocity rows.
const GAIN: f32 = 100.0;

/// The velocity closest to a wanted one that satisfies the rows (Hildreth 1957).
fn allowed(rows: &[VelocityRow], wanted: Vec3) -> Vec3 {
    let (mut velocity, mut pushes) = (wanted, vec![0.0_f32; rows.len()]);
    for _ in 0..200 {
        for (row, push) in rows.iter().zip(&mut pushes) {
            let linear = Vec3::from(row.linear);
            let more = (row.least - linear.dot(velocity)) / linear.length_squared();
            let next = (*push + more).max(0.0);
            velocity += linear * (next - *push);
            *push = next;
        }
    }
    velocity
}

/// A surface, the hand's first position, and the direction of its push.
pub struct Scene {
    /// Its name.
    pub name: &'static str,
    mesh: Mesh,
    motion: Option<Motion>,
    from: Vec3,
    push: Vec3,
}

/// The result of a push.
#[derive(Clone, Copy, Debug)]
pub struct Pushed {
    /// Least signed separation (mm). Below minus the radius, the instrument's centre has passed through the surface.
    pub least: f32,
    /// Largest change of the force from one tick to the next (N).
    pub step: f32,
    /// Largest energy (mJ) that the force had given to the hand at any time, minus the energy that the hand had given
    /// before, relative to the wall.
    pub given: f32,
}

impl Pushed {
    /// Whether the instrument's centre passed through the surface.
    #[must_use]
    pub fn is_through(&self) -> bool {
        self.least < -RADIUS
    }
}

/// A flat wall; a corner of four slopes; a gap narrower than two margins; a groove whose walls are so steep that one
/// wall alone cannot hold the hand; a ball; and a beating heart.
///
/// # Panics
/// Never: the sizes are valid.
#[must_use]
pub fn scenes() -> Vec<Scene> {
    let down = |name, mesh, from| Scene { name, mesh, motion: None, from, push: Vec3::NEG_Z };
    // Two walls on a floor, at the floor less than two margins apart, at the top a little more.
    let gap = sheet(60, 60.0, |x, _| 60.0 * ((x.abs() - 4.5) / 1.5).clamp(0.0, 1.0));
    let sideways = Vec3::new(-1.0, 0.1, 0.0).normalize();
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a valid size");
    // Into the heart's side with the least x, from just outside the margin.
    let side = mesh.positions.iter().copied().min_by(|a, b| a.x.total_cmp(&b.x));
    let side = side.expect("has vertices") - Vec3::X * (MARGIN + RADIUS + 0.5);
    vec![
        down("flat wall", sheet(20, 60.0, |_, _| 0.0), Vec3::new(0.3, 0.2, 6.5)),
        down("corner", sheet(40, 40.0, |x, y| x.abs() + y.abs()), Vec3::new(0.5, 0.4, 14.0)),
        Scene { push: sideways, ..down("gap", gap, Vec3::new(1.0, 0.3, 30.0)) },
        down("groove", sheet(40, 40.0, |x, _| 4.7 * x.abs()), Vec3::new(0.2, 0.3, 35.0)),
        down("sphere", ball(4), Vec3::new(0.4, 0.3, 46.5)),
        Scene { name: "beating heart", mesh, motion: Some(motion), from: side, push: Vec3::X },
    ]
}

impl Scene {
    /// Pushes against the force of all contacts, limited by an energy account, or of the closest pair only.
    ///
    /// # Panics
    /// If a query fails.
    #[must_use]
    pub fn push(&self, by_all: bool) -> Pushed {
        let built = Builder::new().stretch(2.0).build(&self.mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut contacts = Contacts::<8>::new();
        let proxy = Proxy::new(SPRING, MARGIN).expect("a valid margin");
        let alone = ForbiddenRegion::new(SPRING, MARGIN).expect("a valid margin");
        let mut account = ACCOUNT;
        let (mut hand, mut given) = (Hand::new(self.from), 0.0);
        let mut pushed = Pushed { least: f32::INFINITY, step: 0.0, given: 0.0 };
        let mut before: Option<Vec3> = None;
        let mut tick = |now: u32| {
            let (rows, velocities) = self.surface(now);
            let (rows, velocities) = (built.to_rows(&rows), built.to_rows(&velocities));
            let Hand { at, velocity } = hand;
            let tool = Sphere::new(at, RADIUS).expect("a finite place");
            let closest = query
                .contacts(rows.as_slice(), &tool, 2.0 * MARGIN, &Options::new(), &mut contacts)
                .expect("an answer");
            contacts.move_with(velocities.as_slice()).expect("a velocity each");
            pushed.least = pushed.least.min(closest.separation);
            let corners = closest.corners.into_iter().zip(closest.barycentric);
            let wall = corners.map(|(row, share)| velocities[row as usize] * share).sum::<Vec3>();
            let force = if by_all {
                let within = contacts.within(2.0 * MARGIN);
                let wanted =
                    proxy.wrench(within, contacts.accuracy(), at, velocity, Vec3::ZERO).force;
                account.pass(wanted, velocity - wall, TICK)
            } else {
                alone.force(&Ok::<_, Unavailable>(closest), velocity - wall).force
            };
            if let Some(before) = before {
                pushed.step = pushed.step.max(before.distance(force));
            }
            before = Some(force);
            hand.push(self.push * Hand::PUSH, force, TICK);
            given += force.dot(hand.velocity - wall) * TICK;
            pushed.given = pushed.given.max(given);
            if pushed.least < -10.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let _ended = (0..TICKS).try_for_each(&mut tick);
        pushed
    }

    /// Commands the instrument to move as the push would in free space: filtered, or limited by velocity rows only.
    ///
    /// # Panics
    /// If a query fails.
    #[must_use]
    pub fn command(&self, is_filtered: bool) -> Pushed {
        let built = Builder::new().stretch(2.0).build(&self.mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut tracker = Tracker::<u16, MAX_STACK, 512>::new(&tree).expect("deep enough");
        let mut odometer = Odometer::new(&tree);
        let mut contacts = Contacts::<8>::new();
        let command = Hand::free(self.push * Hand::PUSH);
        let most = 2.0 * command.length();
        // The gap's slivers take long to tell sides apart; budgets are the subject of other checks.
        let filter = Filter::new(0.0, most).expect("in range").budget(2_000_000);
        let uncertainty = Uncertainty::new(self.fastest());
        let mut at = self.from;
        let mut pushed = Pushed { least: f32::INFINITY, step: 0.0, given: 0.0 };
        let mut before: Option<Vec<Vec3>> = None;
        for now in 0..TICKS {
            let (rows, velocities) = self.surface(now);
            let (rows, velocities) = (built.to_rows(&rows), built.to_rows(&velocities));
            let tool = Sphere::new(at, RADIUS).expect("a finite place");
            let surface = match &before {
                None => odometer.start(rows.as_slice()),
                Some(before) => odometer.step(before.as_slice(), rows.as_slice()).after(),
            };
            let closest = query
                .contacts(&surface, &tool, 2.0 * MARGIN, &Options::new(), &mut contacts)
                .expect("an answer");
            contacts.move_with(velocities.as_slice()).expect("a velocity each");
            pushed.least = pushed.least.min(closest.separation);
            if pushed.least < -10.0 {
                break;
            }
            at += if is_filtered {
                let motion = RigidMotion::new(at, command * TICK, Vec3::ZERO);
                let mut pairs = [(&mut tracker, &surface, &tool)];
                let admitted = filter.admit(&mut pairs, &motion, TICK, &uncertainty, &[]);
                admitted.expect("an answer").motion.translation
            } else {
                let rows: Vec<VelocityRow> = contacts
                    .iter()
                    .map(|contact| VelocityRow::new(contact, contacts.accuracy(), at).gain(GAIN))
                    .collect();
                allowed(&rows, command) * TICK
            };
            before = Some(rows);
        }
        pushed
    }

    /// The largest speed (mm/s) of a vertex.
    fn fastest(&self) -> f32 {
        let Some(Motion { frames, rate, .. }) = &self.motion else { return 0.0 };
        let pairs = frames.iter().zip(frames.iter().cycle().skip(1));
        let steps = pairs.flat_map(|(a, b)| a.iter().zip(b));
        steps.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max) * rate * 1.001
    }

    /// Positions and velocities of the vertices at a tick.
    fn surface(&self, tick: u32) -> (Vec<Vec3>, Vec<Vec3>) {
        let Some(Motion { frames, rate, .. }) = &self.motion else {
            return (self.mesh.positions.clone(), vec![Vec3::ZERO; self.mesh.positions.len()]);
        };
        let time = tick as f32 * TICK * rate;
        let (frame, share) = (time as usize, time.fract());
        let [from, to] = [frame, frame + 1].map(|frame| &frames[frame % frames.len()]);
        let pairs = || from.iter().zip(to);
        let positions = pairs().map(|(from, to)| from.lerp(*to, share)).collect();
        (positions, pairs().map(|(from, to)| (*to - *from) * *rate).collect())
    }
}
