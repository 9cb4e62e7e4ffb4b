//! A simulated hand that pushes an instrument into something, at 1 kHz.

use std::ops::ControlFlow;

use dibs_build::{Builder, Mesh, Motion, generate};
use dibs_nostd::constraint::{ForbiddenRegion, Proxy, SpringDamper};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Contacts, Options, Query, Sphere, Unavailable};
use glam::Vec3;

use crate::surfaces::{ball, sheet};

/// Seconds of a tick, and number of ticks of a push.
const TICK: f32 = 0.001;
const TICKS: u32 = 4_000;

/// Stiffness (N/mm), damping (N s/mm), largest force (N) and margin (mm) of the constraint: the demo's.
const STIFFNESS: f32 = 1.0;
const DAMPING: f32 = 0.002;
const MOST: f32 = 5.0;
const MARGIN: f32 = 5.0;

/// The hand's push (N): nine tenths of the saturation.
pub const PUSH: f32 = 0.9 * MOST;

/// The hand's mass (200 g, in N s^2/mm) and damper (N s/mm), and the instrument's radius (mm).
const MASS: f32 = 2e-4;
const DAMPER: f32 = 0.02;
const RADIUS: f32 = 1.0;

/// A surface, the hand's first position, and the direction of its push.
pub struct Scene {
    /// Its name.
    pub name: &'static str,
    mesh: Mesh,
    motion: Option<Motion>,
    from: Vec3,
    push: Vec3,
}

/// The outcome of a push.
#[derive(Clone, Copy, Debug)]
pub struct Pushed {
    /// Least signed separation (mm). Below minus the radius, the instrument's centre went through the surface.
    pub least: f32,
    /// Largest change of the force from one tick to the next (N).
    pub step: f32,
}

impl Pushed {
    /// Whether the instrument's centre went through the surface.
    #[must_use]
    pub fn is_through(&self) -> bool {
        self.least < -RADIUS
    }
}

/// A flat wall; a corner of four slopes; a gap narrower than two margins; a groove whose walls are so steep that one
/// alone cannot bear the hand; a ball; and a beating heart.
///
/// # Panics
/// Never: the sizes are valid.
#[must_use]
pub fn scenes() -> Vec<Scene> {
    let down = |name, mesh, from| Scene { name, mesh, motion: None, from, push: Vec3::NEG_Z };
    // Two walls on a floor, less than two margins apart there and a little more at the top.
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
    /// Pushes against the force of all contacts, or of the closest pair alone.
    ///
    /// # Panics
    /// If a query fails.
    #[must_use]
    pub fn push(&self, by_all: bool) -> Pushed {
        let built = Builder::new().stretch(2.0).build(&self.mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut contacts = Contacts::<8>::new();
        let spring = SpringDamper::stiffness(STIFFNESS).damping(DAMPING).max_force(MOST);
        let proxy = Proxy::new(spring, MARGIN).expect("a valid margin");
        let alone = ForbiddenRegion::new(spring, MARGIN).expect("a valid margin");
        let (mut at, mut velocity) = (self.from, Vec3::ZERO);
        let mut pushed = Pushed { least: f32::INFINITY, step: 0.0 };
        let mut before: Option<Vec3> = None;
        let mut tick = |now: u32| {
            let (rows, velocities) = self.surface(now);
            let (rows, velocities) = (built.to_rows(&rows), built.to_rows(&velocities));
            let tool = Sphere::new(at, RADIUS).expect("a finite place");
            let closest = query
                .contacts(rows.as_slice(), &tool, 2.0 * MARGIN, &Options::new(), &mut contacts)
                .expect("an answer");
            contacts.move_with(velocities.as_slice()).expect("a velocity each");
            pushed.least = pushed.least.min(closest.separation);
            let force = if by_all {
                let within = contacts.within(2.0 * MARGIN);
                proxy.wrench(within, contacts.accuracy(), at, velocity, Vec3::ZERO).force
            } else {
                let corners = closest.corners.into_iter().zip(closest.barycentric);
                let wall =
                    corners.map(|(row, share)| velocities[row as usize] * share).sum::<Vec3>();
                alone.force(&Ok::<_, Unavailable>(closest), velocity - wall).force
            };
            if let Some(before) = before {
                pushed.step = pushed.step.max(before.distance(force));
            }
            before = Some(force);
            velocity += (force + self.push * PUSH - velocity * DAMPER) * (TICK / MASS);
            at += velocity * TICK;
            if pushed.least < -10.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let _ended = (0..TICKS).try_for_each(&mut tick);
        pushed
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
