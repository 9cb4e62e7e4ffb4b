//! A tool and its motion in mesh coordinates against f64, with a search for counterexamples to the stated errors.

// Requirement: F-08

extern crate std;

use std::prelude::rust_2024::*;
use std::println;

use fastrand::Rng;
use glam::{DQuat, DVec3, Quat, Vec3};

use super::TickPose;
use crate::filter::{Filter, RigidMotion};
use crate::surface::PoseStep;
use crate::{Capsule, RigidPose, Tool};

fn vector(rng: &mut Rng, size: f32) -> Vec3 {
    let mut draw = || (rng.f32() - 0.5) * 2.0 * size;
    Vec3::new(draw(), draw(), draw())
}

/// A size from a micrometre to a kilometre.
fn size(rng: &mut Rng) -> f32 {
    10.0_f32.powf(9.0 * rng.f32() - 3.0)
}

/// A pose of the world, a tool by its ends on the mesh, and the filter's command.
#[derive(Clone, Copy, Debug)]
struct Case {
    turn: Vec3,
    shift: Vec3,
    ends: [Vec3; 2],
    about: Vec3,
    translation: Vec3,
    rotation: Vec3,
    lever: f32,
    /// The step to this pose, and the fraction of it beyond the last frame.
    spin: Vec3,
    flow: Vec3,
    part: f32,
}

impl Case {
    fn draw(rng: &mut Rng) -> Self {
        let mut any = || {
            let size = size(rng);
            vector(rng, size)
        };
        let (shift, ends, about, flow) = (any(), [any(), any()], any(), any() * 0.01);
        let (translation, rotation) = (any(), any());
        let part = if rng.bool() { 0.0 } else { 2.0 * rng.f32() };
        let (turn, spin) = (vector(rng, 1.8), vector(rng, 0.2));
        let lever = 1.0 + size(rng);
        Self { turn, shift, ends, about, translation, rotation, lever, spin, flow, part }
    }

    fn changed(&self, rng: &mut Rng) -> Self {
        let part = 10.0_f32.powf(-5.0 * rng.f32());
        let mut change = |vector: &mut Vec3| {
            let to = vector.length() * part;
            *vector += self::vector(rng, to);
        };
        let mut next = *self;
        for each in [&mut next.turn, &mut next.shift, &mut next.about, &mut next.rotation] {
            change(each);
        }
        let [start, end] = &mut next.ends;
        change(start);
        change(end);
        next
    }

    fn placed(&self) -> TickPose {
        let turned = |turn: Vec3| Quat::from_scaled_axis(turn).normalize();
        let after = RigidPose::new(turned(self.turn), self.shift).expect("a rotation");
        let rotation = (turned(-self.spin) * turned(self.turn)).normalize();
        let before = RigidPose::new(rotation, self.shift - self.flow).expect("a rotation");
        let step = PoseStep::between(&before, &after, Vec3::ZERO).expect("a small step");
        let pose = step.beyond(self.part);
        TickPose { pose, step: Some((step, self.part, 30.0)), error: 0.0, residual: 0.0 }
    }

    fn tool(&self, placed: &TickPose) -> Option<Capsule> {
        let [start, end] = self.ends.map(|end| placed.pose.apply(end));
        Capsule::new(start, end, 0.0).ok()
    }
}

fn inverse(pose: &RigidPose, point: DVec3) -> DVec3 {
    let rotation = pose.rotation().as_dquat().normalize();
    rotation.inverse() * (point - pose.shift().as_dvec3())
}

fn ends(tool: &impl Tool) -> [DVec3; 2] {
    let start = tool.axis_start().as_dvec3();
    [start, start + tool.axis_span().as_dvec3()]
}

/// An error as a fraction of its bound.
fn part(off: f64, bound: f32) -> f64 {
    if off == 0.0 { 0.0 } else { off / f64::from(bound) }
}

/// The largest value found by hill climbing from many starts.
fn climbed(seed: u64, starts: usize, steps: usize, value: impl Fn(&Case) -> Option<f64>) -> f64 {
    let mut rng = Rng::with_seed(seed);
    let mut most = 0.0_f64;
    for _ in 0..starts {
        let mut case = Case::draw(&mut rng);
        let Some(mut best) = value(&case) else { continue };
        for _ in 0..steps {
            let next = case.changed(&mut rng);
            if let Some(found) = value(&next)
                && found > best
            {
                (case, best) = (next, found);
            }
        }
        assert!(best <= 1.0, "{best} of the bound: {case:?}");
        most = most.max(best);
    }
    most
}

/// Both ends of a moved tool are within the stated error, at any distance from the world's origin and any length.
#[test]
fn a_moved_tool_is_off_by_no_more_than_its_error() {
    let most = climbed(1, 4_000, 100, |case| {
        let placed = TickPose { step: None, ..Case { part: 0.0, ..*case }.placed() };
        let tool = case.tool(&placed)?;
        let moved = placed.tool(&tool);
        let (found, truth) = (ends(&moved), ends(&tool).map(|end| inverse(&placed.pose, end)));
        let off = (found[0] - truth[0]).length().max((found[1] - truth[1]).length());
        Some(part(off, placed.error(&tool)))
    });
    println!("off by {most} of the error");
    assert!(most > 0.02, "{most}");
}

/// A motion that a filter checks in mesh coordinates equals the one that the robot executes in the world, within the
/// stated error: for an admitted command, and for any other motion.
#[test]
fn a_motion_on_the_mesh_is_that_in_the_world() {
    let filter = Filter::new(0.0, 400.0).expect("in range");
    let most = climbed(2, 4_000, 100, |case| {
        // The pose is exact here: its error counts with the tool's.
        let placed = TickPose { step: None, ..Case { part: 0.0, ..*case }.placed() };
        let tool = case.tool(&placed)?;
        let filter = filter.lever(case.lever).expect("in range");
        let within = RigidMotion::new(placed.pose.apply(case.about), Vec3::ZERO, Vec3::ZERO);
        let (shift, turn) = filter.most(&tool, &within, 1e-3);
        let command = RigidMotion {
            translation: case.translation.clamp_length_max(shift),
            rotation: case.rotation.clamp_length_max(turn),
            ..within
        };
        let on_mesh = placed.motion(&command);
        let moved = placed.tool(&tool);
        let error = placed.error(&tool) + placed.error_of_motion(&moved, &on_mesh, (&filter, 1e-3));
        // As `RigidMotion::apply`, exactly.
        let apply = |motion: &RigidMotion, point: DVec3| {
            let about = motion.about.as_dvec3();
            let turn = DQuat::from_scaled_axis(motion.rotation.as_dvec3());
            about + turn * (point - about) + motion.translation.as_dvec3()
        };
        let mut off = 0.0_f64;
        for (checked, executed) in ends(&moved).into_iter().zip(ends(&tool)) {
            let truth = inverse(&placed.pose, apply(&command, executed));
            off = off.max((apply(&on_mesh, checked) - truth).length());
        }
        Some(part(off, error))
    });
    println!("off by {most} of the error");
    assert!(most > 0.02, "{most}");
}
