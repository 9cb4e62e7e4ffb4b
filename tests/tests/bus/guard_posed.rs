//! Frames with rigid poses: answers on the moved mesh, compared with exhaustive search in f64 by hill climbing.

// Requirement: F-08

use dibs_nostd::glam::{DVec3, Quat, Vec3};
use dibs_nostd::guard::{Bus, Guard, GuardLimits, PosedRows, Surface};
use dibs_nostd::wire::NoMac;
use dibs_nostd::{Advance, Capsule, Millis, ReceiveError, SurfaceLimits, TreeBytes};
use dibs_tests::posed::{Heart, Sent, beyond, exact, off, steady, truth};
use fastrand::Rng;

pub const ROWS: usize = 162;

/// Milliseconds between two frames.
pub const PERIOD: u32 = 30;

pub type TheBus<'s, 't> = Bus<'s, 't, u16, NoMac, PosedRows>;
pub type TheGuard<'s, 't> = Guard<'s, 't, u16, 64, 96, PosedRows>;

/// Without a limit on speed.
pub fn limits() -> GuardLimits {
    let surfaces = SurfaceLimits::reach_mm(3_000.0).speed(f32::INFINITY).recovery_mm(f32::INFINITY);
    GuardLimits::new(300.0, Millis(200)).automatic().surfaces(surfaces)
}

/// Sends a frame, whole.
pub fn send(
    bus: &mut TheBus<'_, '_>,
    rows: &[Vec3],
    pose: &Sent,
    now: u32,
) -> Result<Advance, ReceiveError> {
    bus.frame_at(rows, *pose, Millis(now), Millis(now))?;
    work(bus)
}

/// Does all checks of a frame.
pub fn work(bus: &mut TheBus<'_, '_>) -> Result<Advance, ReceiveError> {
    loop {
        match bus.work(50) {
            Ok(Advance::Pending) => (),
            other => return other,
        }
    }
}

/// A tool beside three frames, and a time after the last.
#[derive(Clone, Copy, Debug)]
struct Case {
    poses: [Sent; 3],
    grown: [f32; 3],
    ends: [Vec3; 2],
    radius: f32,
    age: u32,
    /// Whether the third frame continues the motion of the first two.
    is_steady: bool,
}

impl Case {
    fn draw(heart: &Heart, rng: &mut Rng) -> Self {
        let mut number = |size: f32| (rng.f32() - 0.5) * 2.0 * size;
        let mut vector = |size: f32| Vec3::new(number(size), number(size), number(size));
        let turned = Quat::from_scaled_axis(vector(1.8)).normalize();
        let start = (turned, vector(400.0));
        let (spin, flow) = (vector(0.25), vector(8.0));
        let second = steady(heart, &start, spin, flow, 1.0);
        let (rotation, shift) = exact(&second);
        let middle = (rotation * heart.centre.as_dvec3() + shift).as_vec3();
        let at = middle + vector(1.0).normalize_or_zero() * (90.0 + number(40.0));
        let growth = number(0.01);
        let end = if rng.bool() { at } else { at + (at - middle) * 0.4 };
        Self {
            poses: [start, second, steady(heart, &start, spin, flow, 2.0)],
            grown: [0.0, 1.0, 2.0].map(|time| time * growth),
            ends: [at, end],
            radius: 3.0 * rng.f32(),
            age: rng.u32(0..=2 * PERIOD),
            is_steady: rng.bool(),
        }
    }

    /// The same with a small random change of one number.
    fn changed(&self, rng: &mut Rng) -> Self {
        let size = 10.0_f32.powf(-4.0 * rng.f32());
        let mut number = |size: f32| (rng.f32() - 0.5) * 2.0 * size;
        let mut vector = |size: f32| Vec3::new(number(size), number(size), number(size));
        let (turn, by, far) = (vector(0.2 * size), vector(20.0 * size), vector(100.0 * size));
        let mut next = *self;
        let pose = rng.usize(0..3);
        match rng.u8(0..5) {
            0 => {
                let (rotation, _) = &mut next.poses[pose];
                *rotation = (Quat::from_scaled_axis(turn) * *rotation).normalize();
            }
            1 => next.poses[pose].1 += by,
            2 => {
                next.poses.iter_mut().for_each(|(_, shift)| *shift += far);
                next.ends.iter_mut().for_each(|end| *end += far);
            }
            3 => next.age = rng.u32(0..=2 * PERIOD),
            _ if self.ends[0] == self.ends[1] => next.ends = [self.ends[0] + by; 2],
            _ => next.ends[rng.usize(0..2)] += by,
        }
        next
    }

    /// The error of the answer relative to its accuracy, and the accuracy.
    fn off(&self, heart: &Heart) -> Option<(f64, f32)> {
        let mut poses = self.poses;
        if self.is_steady {
            let (rotation, shift) = beyond(&poses[0], &poses[1], 1.0, heart.centre.as_dvec3());
            poses[2] = (rotation.as_quat(), shift.as_vec3());
        }
        let frames = self.grown.map(|part| heart.grown(part));
        let surface: Surface<ROWS, PosedRows> = Surface::new();
        let tree = TreeBytes::<u16>::new(heart.built.blob());
        let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
            surface.start(tree, limits()).expect("valid");
        let mut now = 1_000;
        for (rows, pose) in frames.iter().zip(&poses) {
            now += PERIOD;
            send(&mut bus, rows, pose, now).expect("admitted");
        }
        let tool = Capsule::new(self.ends[0], self.ends[1], self.radius).expect("valid");
        let answer = guard.closest(&tool, Millis(now + self.age));
        let found = answer.tracked.expect("an answer").closest;
        let searched = answer.searched.expect("a surface");
        let t = f64::from(searched.t);
        let goes_on = [(0, 1), (1, 2)].into_iter().all(|(from, to)| {
            let (from, to) = (exact(&poses[from]).0, exact(&poses[to]).0);
            from.angle_between(to) < 0.4999
        });
        assert!(!goes_on || self.age == 0 || t > 1.0, "held");
        let [_, before, after] = frames.map(|rows| heart.built.to_rows(&rows));
        let rows: Vec<DVec3> = before
            .iter()
            .zip(&after)
            .map(|(a, b)| a.as_dvec3() + (b.as_dvec3() - a.as_dvec3()) * t)
            .collect();
        let pose = beyond(&poses[1], &poses[2], t - 1.0, heart.centre.as_dvec3());
        let truth = truth(&heart.triangles, &rows, pose, self.ends, self.radius);
        Some((off(&truth, &found)?, found.accuracy))
    }
}

/// Frames that never had a pose give the answers of rows alone, to the bit: on frames, between them, and held.
#[test]
fn without_poses_the_answers_are_those_of_rows_alone() {
    let heart = Heart::new(Vec3::new(20.0, 30.0, -10.0));
    let tree = TreeBytes::<u16>::new(heart.built.blob());
    let (surface, rows_alone): (Surface<ROWS, PosedRows>, Surface<ROWS>) =
        (Surface::new(), Surface::new());
    let (mut bus, mut guard): (TheBus<'_, '_>, TheGuard<'_, '_>) =
        surface.start(tree, limits()).expect("valid");
    let (mut other_bus, mut other_guard) =
        rows_alone.start::<_, 64, 96>(tree, limits()).expect("valid");
    let mut extrapolated = 0;
    for now in 1_000..1_400_u32 {
        if now % PERIOD == 0 && now < 1_300 {
            let (rows, at) = (heart.grown(1e-4 * (now - 1_000) as f32), Millis(now));
            bus.frame(&rows, at, at).expect("a good frame");
            other_bus.frame(&rows, at, at).expect("a good frame");
            work(&mut bus).expect("admitted");
            while other_bus.work(50).expect("admitted") == Advance::Pending {}
        }
        let tip = heart.centre + Vec3::new(110.0, 9.0, 5.0);
        let tool = Capsule::new(tip, tip + Vec3::X * 40.0, 2.0).expect("valid");
        let answer = guard.closest(&tool, Millis(now));
        let alone = other_guard.closest(&tool, Millis(now));
        assert_eq!(format!("{answer:?}"), format!("{alone:?}"), "{now}");
        let searched = answer.searched.filter(|searched| searched.t > 1.0);
        extrapolated += u32::from(searched.is_some());
    }
    assert!(extrapolated > 200, "{extrapolated}");
}

/// Cold ticks on frames and between them: no error exceeds the accuracy, even after hill climbing towards large errors.
#[test]
fn answers_are_those_of_the_moved_mesh() {
    let starts = if cfg!(debug_assertions) { 4 } else { 60 };
    let (mut worst, mut asked, mut widest) = (0.0_f64, 0, 0.0_f32);
    for (seed, shift) in [Vec3::ZERO, Vec3::new(300.0, -500.0, 200.0)].into_iter().enumerate() {
        let heart = Heart::new(shift);
        let mut rng = Rng::with_seed(seed as u64);
        for _ in 0..starts {
            let mut case = Case::draw(&heart, &mut rng);
            let Some((mut best, _)) = case.off(&heart) else { continue };
            for _ in 0..100 {
                let next = case.changed(&mut rng);
                let Some((part, accuracy)) = next.off(&heart) else { continue };
                assert!(part <= 1.0, "{part} of {accuracy}: {next:?}");
                asked += 1;
                if next.is_steady {
                    widest = widest.max(accuracy);
                }
                if part > best {
                    (case, best) = (next, part);
                }
            }
            worst = worst.max(best);
        }
    }
    println!(
        "{asked} answers, off by {worst} of their accuracy, at most {widest} mm of steady motions"
    );
    assert!(worst > 0.02 && asked > starts * 60 && widest < 0.05);
}
