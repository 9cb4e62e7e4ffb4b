//! Poses against f64: bounds on motion and rounding, with a search for counterexamples.

// Requirement: F-08

extern crate std;

use std::prelude::rust_2024::*;
use std::println;

use fastrand::Rng;
use glam::{DQuat, DVec3, Quat, Vec3};

use super::step::{MOST_SINE, PoseStep};
use super::{PoseError, RigidPose};

fn vector(rng: &mut Rng, size: f32) -> Vec3 {
    let mut draw = || (rng.f32() - 0.5) * 2.0 * size;
    Vec3::new(draw(), draw(), draw())
}

/// Shorter ones, too.
fn any(rng: &mut Rng, size: f32) -> Vec3 {
    let part = rng.f32();
    vector(rng, size * part)
}

/// The values varied by a search: two poses, a centre, an arm and a fraction of the step.
#[derive(Clone, Copy, Debug)]
struct Case {
    before: RigidPose,
    after: RigidPose,
    centre: Vec3,
    point: Vec3,
    part: f32,
}

/// A pose near another one, rotated by at most this angle.
fn beside(rng: &mut Rng, pose: &RigidPose, angle: f32, shift: f32) -> RigidPose {
    let turn = vector(rng, 1.0).normalize_or_zero() * (angle * rng.f32());
    // Lengths within 2^-20 of one count as one.
    let length = 1.0 + (rng.f32() - 0.5) * 4e-7;
    let rotation = (Quat::from_scaled_axis(turn) * pose.rotation()).normalize() * length;
    let sign = if rng.bool() { 1.0 } else { -1.0 };
    let shift = pose.shift() + any(rng, shift);
    RigidPose::new(rotation * sign, shift).expect("a rotation")
}

impl Case {
    fn draw(rng: &mut Rng) -> Self {
        let start = RigidPose::new(Quat::IDENTITY, any(rng, 500.0)).expect("one");
        let before = beside(rng, &start, 3.0, 0.0);
        let size = if rng.bool() { 0.5 } else { 1e-3 };
        let after = beside(rng, &before, size, 20.0 * size);
        let (centre, point) = (any(rng, 300.0), vector(rng, 100.0));
        let part = [0.0, 1.0, 2.0, -1.0, rng.f32() * 3.0 - 1.0][rng.usize(0..5)];
        Self { before, after, centre, point, part }
    }

    /// Changes one number a little.
    fn changed(&self, rng: &mut Rng) -> Self {
        let size = 10.0_f32.powf(-4.0 * rng.f32());
        let mut next = *self;
        match rng.u8(0..5) {
            0 => next.before = beside(rng, &self.before, 0.5 * size, 10.0 * size),
            1 => next.after = beside(rng, &self.after, 0.5 * size, 10.0 * size),
            2 => next.centre += vector(rng, 100.0 * size),
            3 => next.part = (next.part + (rng.f32() - 0.5) * size).clamp(-1.0, 2.0),
            _ => next.point += vector(rng, 100.0 * size),
        }
        next
    }

    /// The exact pose after the last frame, at the case's fraction of the step: the rotation, and the position of the
    /// mesh's origin.
    fn exact(&self) -> (DQuat, DVec3) {
        let ((a, s), (b, t)) = (exact(&self.before), exact(&self.after));
        let turn = b * a.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let (centre, part) = (self.centre.as_dvec3(), f64::from(self.part));
        let rotation = DQuat::from_scaled_axis(turn.to_scaled_axis() * part) * b;
        let ends = [a * centre + s, b * centre + t];
        let middle = ends[1] + (ends[1] - ends[0]) * part;
        (rotation, middle - rotation * centre)
    }
}

fn exact(pose: &RigidPose) -> (DQuat, DVec3) {
    (pose.rotation().as_dquat().normalize(), pose.shift().as_dvec3())
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
        most = most.max(best);
        assert!(best <= 1.0, "{best} of the bound: {case:?}");
    }
    most
}

/// The motion of points between two poses, as a fraction of the bound: never above 1, and nearly 1 if the arm is
/// perpendicular to the axis and the centre moves in the same direction.
#[test]
fn no_point_moves_farther_than_the_bound() {
    let most = climbed(1, 2_000, 400, |case| {
        let ((a, s), (b, t)) = (exact(&case.before), exact(&case.after));
        let arm = case.point.as_dvec3();
        let point = case.centre.as_dvec3() + arm;
        let lever = case.point.length().next_up();
        let moved = ((b * point + t) - (a * point + s)).length();
        let bound = case.before.step(&case.after, case.centre, lever);
        Some(moved / f64::from(bound))
    });
    println!("moved {most} of the bound");
    assert!(most > 0.99, "{most}");
    let pose = Case::draw(&mut Rng::with_seed(2)).after;
    assert_eq!(pose.step(&pose, Vec3::ONE, 100.0), 0.0);
}

/// A tool's point in mesh coordinates is within the stated rounding of the exact one, at received poses and between and
/// beyond.
#[test]
fn a_point_in_the_mesh_is_off_by_no_more_than_its_rounding() {
    let off = |case: &Case, (rotation, shift): (DQuat, DVec3), pose: &RigidPose| {
        // A point of the world near the mesh.
        let at = pose.apply(case.point);
        let truth = rotation.inverse() * (at.as_dvec3() - shift);
        let local = pose.apply_inverse(at);
        ((local.as_dvec3() - truth).length(), local)
    };
    let most = climbed(3, 1_000, 400, |case| {
        let (off, local) = off(case, exact(&case.after), &case.after);
        Some(off / f64::from(RigidPose::rounding(local)))
    });
    let beyond = climbed(4, 1_000, 400, |case| {
        let step = PoseStep::between(&case.before, &case.after, case.centre)?;
        let pose = step.beyond(case.part);
        let (off, local) = off(case, case.exact(), &pose);
        Some(off / f64::from(step.rounding(local, &pose, case.part)))
    });
    println!("off by {most} and {beyond} of the bounds");
    assert!(most > 0.02 && beyond > 0.02);
}

#[test]
fn a_velocity_is_that_of_the_points() {
    let mut rng = Rng::with_seed(5);
    let mut checked = 0;
    for _ in 0..2_000 {
        let case = Case::draw(&mut rng);
        let Some(step) = PoseStep::between(&case.before, &case.after, case.centre) else {
            continue;
        };
        let at = |part: f32| {
            let (rotation, shift) = Case { part, ..case }.exact();
            rotation * case.point.as_dvec3() + shift
        };
        let truth = (at(case.part + 1e-3) - at(case.part - 1e-3)) * 500.0;
        let found = step.velocity(case.part, at(case.part).as_vec3());
        let limit = 1e-3 + 1e-4 * truth.length();
        assert!((found.as_dvec3() - truth).length() < limit, "{found} {truth} {case:?}");
        checked += 1;
    }
    assert!(checked > 1_500, "{checked}");
}

/// A step of half a radian is extrapolated, a larger one is not; a quaternion and its negative are one rotation.
#[test]
fn a_step_that_turns_by_more_than_half_a_radian_does_not_go_on() {
    let turned =
        |angle: f32| RigidPose::new(Quat::from_rotation_y(angle), Vec3::ZERO).expect("a rotation");
    let rest = RigidPose::IDENTITY;
    assert!((MOST_SINE.asin() - 0.25).abs() < 1e-6);
    for (angle, goes_on) in [(0.499, true), (-0.499, true), (0.501, false), (3.1, false)] {
        let step = PoseStep::between(&rest, &turned(angle), Vec3::ZERO);
        assert_eq!(step.is_some(), goes_on, "{angle}");
        let other = RigidPose::new(-turned(angle).rotation(), Vec3::ZERO).expect("a rotation");
        let same = PoseStep::between(&rest, &other, Vec3::ZERO);
        assert_eq!(same.is_some(), goes_on, "{angle}");
        if let Some(same) = same {
            let point = same.beyond(1.0).apply(Vec3::X);
            assert!(point.abs_diff_eq(turned(2.0 * angle).apply(Vec3::X), 1e-6), "{point}");
            assert!(rest.step(&other, Vec3::ZERO, 1.0) < 0.5);
        }
    }
}

/// Values that are not a rotation, or NaN, are refused with their cause.
#[test]
fn hostile_numbers_are_no_pose() {
    let refused =
        |rotation: [f32; 4], shift: Vec3| RigidPose::new(Quat::from_array(rotation), shift).err();
    let unit = [0.0, 0.0, 0.0, 1.0];
    for wrong in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for slot in 0..4 {
            let mut rotation = unit;
            rotation[slot] = wrong;
            assert_eq!(refused(rotation, Vec3::ZERO), Some(PoseError::NotFinite));
        }
        for shift in [Vec3::X, Vec3::Y, Vec3::Z] {
            // 0 times infinity is no number either.
            assert_eq!(refused(unit, shift * wrong), Some(PoseError::NotFinite));
        }
    }
    let scaled =
        |scale: f32| refused([0.5 * scale, -0.5 * scale, 0.5 * scale, 0.5 * scale], Vec3::ZERO);
    for scale in [0.0, 1e-30, 0.5, 1.0 - 1e-6, 1.0 + 1e-6, 1.1, 2.0, 1e30] {
        assert!(matches!(scaled(scale), Some(PoseError::NoRotation { .. })), "{scale}");
    }
    for scale in [1.0, -1.0, 1.0 + 4e-7, 1.0 - 4e-7] {
        assert_eq!(scaled(scale), None, "{scale}");
    }
    let far = 134_217_728.0;
    assert_eq!(refused(unit, Vec3::Y * far), None);
    let error = PoseError::TooFar { value: -134_217_744.0 };
    assert_eq!(refused(unit, Vec3::Y * -134_217_744.0), Some(error));
}
