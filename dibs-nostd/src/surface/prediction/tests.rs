//! The motion of an extrapolated surface as stated by its odometer, which only the crate can read.

// Requirement: T-04

extern crate std;

use std::prelude::rust_2024::*;
use std::println;

use dibs_build::{Builder, generate};
use fastrand::Rng;
use glam::Vec3;

use super::{Prediction, PredictionCheck};
use crate::surface::motion::{MotionReading, Unit};
use crate::wire::{Encoding, FrameEncoder, FrameId};
use crate::{
    Advance, Assembler, Frames, Millis, MovingSurface, StretchMonitor, SurfaceLimits, Tree,
    VertexTable,
};

/// Vertices of the heart of 320 triangles.
const ROWS: usize = 162;

#[derive(Clone, Copy, PartialEq)]
enum Motion {
    /// Velocities change a little from frame to frame, at steady rates of frames and ticks.
    Steady,
    /// The same at irregular rates.
    Smooth,
    /// With sudden changes now and then.
    Sudden,
    /// By a few units in the last place of a coordinate, far from the origin.
    Creeping,
}

type Bus<'t> = Assembler<'t, StretchMonitor<'t, u16, 2>>;

/// Sends a frame that is published.
fn send(bus: &mut Bus<'_>, mesh_id: u32, epoch: u32, rows: &[Vec3], now: u32) {
    let id = FrameId { mesh_id, session: 1, epoch };
    let mut packets = FrameEncoder::<_, 512>::new(id, Encoding::Float, rows).unwrap();
    let mut packet = [0; 512];
    while let Some(packet) = packets.next_packet(&mut packet) {
        bus.accept(packet, Millis(now)).unwrap();
    }
    while bus.advance(100).unwrap() == Advance::Pending {}
    assert_eq!(bus.published(), Some(id));
}

fn positions(surface: &impl VertexTable) -> Vec<Vec3> {
    (0..ROWS as u32).map(|row| surface.position(row).unwrap()).collect()
}

/// The largest distance between corresponding rows.
fn apart(before: &[Vec3], now: &[Vec3]) -> f64 {
    let of = |(a, b): (&Vec3, &Vec3)| a.as_dvec3().distance(b.as_dvec3());
    before.iter().zip(now).map(of).fold(0.0, f64::max)
}

/// Between any two ticks, on the same frame, at a new one or after skipped ones, no vertex moves farther than the
/// odometer states, nor through any number of ticks. At a new frame it does not overstate by much.
#[test]
fn no_vertex_moves_farther_than_its_course_says() {
    for motion in [Motion::Steady, Motion::Smooth, Motion::Sudden, Motion::Creeping] {
        follow(motion);
    }
}

fn follow(motion: Motion) {
    let mut rng = Rng::with_seed(3);
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(4.0).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let frames = Frames::<ROWS, 3>::new();
    let (writer, mut reader) = frames.split().unwrap();
    let mut bus = Assembler::continuous(writer, &tree, SurfaceLimits::reach_mm(1e4)).unwrap();
    let unit = Unit::of(&tree);
    let far = if motion == Motion::Creeping { Vec3::splat(400.0) } else { Vec3::ZERO };
    let mut rows: Vec<Vec3> = built.to_rows(&mesh.positions).iter().map(|row| *row + far).collect();
    // Bound on a position's rounding, at either end.
    let rounding = (100.0 + 2.0 * f64::from(far.x)) * f64::from(32.0 * f32::EPSILON);
    let step = if motion == Motion::Creeping { 1e-4 } else { 0.01 };
    let mut velocity = Vec3::ZERO;
    let mut now = 40_u32.wrapping_neg();
    // The last tick, and the motion stated since an earlier one.
    let mut last: Option<(MotionReading, Vec<Vec3>, u32)> = None;
    let mut earlier: Option<(Vec<Vec3>, f64)> = None;
    let (mut new, mut sums) = (0, [0.0; 2]);
    for epoch in 1..1_500_u32 {
        let most = if rng.u32(..9) == 0 { 60 } else { 20 };
        let ticks = if motion == Motion::Steady { 17 } else { rng.u32(1..most) };
        now = now.wrapping_add(ticks);
        let mut any = || Vec3::new(rng.f32(), rng.f32(), rng.f32()) - 0.5;
        velocity = velocity * 0.95 + any() * step;
        let change = any() * step * 0.2;
        if motion == Motion::Sudden && rng.u32(..5) == 0 {
            velocity = -velocity;
        }
        for row in &mut rows {
            *row += (velocity + change * (row.dot(change) * 1e4).sin()) * ticks as f32;
        }
        send(&mut bus, tree.mesh_id(), epoch, &rows, now);
        let is_steady = motion == Motion::Steady;
        let mut tick = if is_steady { now.wrapping_add(4) } else { now };
        for _ in 0..if is_steady { 17 } else { rng.u32(..4) } {
            tick = tick.wrapping_add(if is_steady { 1 } else { rng.u32(..8) });
            let frame = reader.latest(Millis(tick)).of_any_age().unwrap();
            let surface = frame.extrapolated();
            let motion = surface.motion().unwrap();
            let found = positions(&surface);
            if let Some((before, positions, seen)) = &last {
                let units = motion.since(before).unwrap();
                let stated = f64::from(unit.length(units as i32));
                let moved = apart(positions, &found);
                assert!(moved <= stated + rounding, "{epoch}: {moved} {stated}");
                if epoch == seen + 1 {
                    sums = [sums[0] + moved, sums[1] + stated];
                    new += 1;
                }
                if let Some((positions, sum)) = &mut earlier {
                    *sum += stated;
                    let moved = apart(positions, &found);
                    assert!(moved <= *sum + rounding, "{epoch}: {moved} {sum}");
                }
            }
            if earlier.is_none() || rng.u32(..500) == 0 {
                earlier = Some((found.clone(), 0.0));
            }
            last = Some((motion, found, epoch));
        }
        // A tick may be delayed, and so come after the next frame.
        now = if is_steady || rng.bool() { now } else { tick };
    }
    let [moved, stated] = sums;
    println!("{new} new frames, {moved} moved, {stated} stated");
    assert!(new > 300);
    assert!(motion != Motion::Steady || stated < 2.0 * moved, "{sums:?}");
}

/// Steps of one length, and readings compared in either order: of the later frame and of the earlier one.
#[test]
fn the_order_of_two_readings_does_not_matter() {
    let mesh = generate::heart(320).unwrap().mesh;
    let built = Builder::new().stretch(4.0).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let frames = Frames::<ROWS, 3>::new();
    let (writer, mut reader) = frames.split().unwrap();
    let mut bus = Assembler::continuous(writer, &tree, SurfaceLimits::reach_mm(1e4)).unwrap();
    // Sums of coarse numbers are exact.
    let rows = built.to_rows(&mesh.positions);
    let coarse = |row: &Vec3| (row * 64.0).round() / 64.0;
    let mut seen = Vec::new();
    for epoch in 1..8_u16 {
        let rows: Vec<Vec3> =
            rows.iter().map(|row| coarse(row) + Vec3::X * f32::from(epoch)).collect();
        let now = 16 * u32::from(epoch);
        send(&mut bus, tree.mesh_id(), epoch.into(), &rows, now);
        for age in [0, 8, 24] {
            let frame = reader.latest(Millis(now + age)).of_any_age().unwrap();
            let surface = frame.extrapolated();
            seen.push((surface.motion().unwrap(), positions(&surface)));
        }
    }
    for (motion, rows) in &seen {
        for (other, others) in &seen {
            let Some(units) = motion.since(other) else { continue };
            let stated = f64::from(Unit::of(&tree).length(units as i32));
            let moved = apart(others, rows);
            assert!(moved <= stated + 1e-4, "{moved} {stated}");
        }
    }
}

/// For any numbers, however large, a prediction gives no bound or one of at least the motion.
#[test]
fn a_course_is_not_cut_to_the_numbers_that_fit() {
    let mut rng = Rng::with_seed(8);
    let any = |rng: &mut Rng| rng.u32(..u32::MAX) >> rng.u32(..32);
    let (mut known, mut unknown) = (0, 0);
    for _ in 0..100_000 {
        let (passed, off, units) = (any(&mut rng), any(&mut rng), any(&mut rng).max(1));
        // Of all `t` alike: a small one hardly ever makes a number that does not fit.
        let t = rng.u32(..2_000) as f32 / 999.5;
        let ahead = PredictionCheck { passed, off, ..PredictionCheck::UNKNOWN };
        let prediction = Prediction::new(units.into(), &ahead, t);
        if prediction == Prediction::NONE {
            let most = f64::from(passed.max(off)) * f64::from(1.0 + t);
            assert!(most > f64::from(u32::MAX) / 2.0, "{passed} {off} {t}");
            unknown += 1;
            continue;
        }
        let residual = any(&mut rng);
        let stated = prediction.since(units.into(), residual).unwrap();
        let grown = f64::from(1.0 + t);
        let farthest =
            (f64::from(passed) * grown - f64::from(residual)).abs() + f64::from(off) * grown;
        assert!(stated as f64 >= farthest - 2.0, "{passed} {off} {units} {t}: {stated} {farthest}");
        known += 1;
    }
    assert!(known > 10_000 && unknown > 1_000, "{known} {unknown}");
    let ahead = PredictionCheck { passed: 5, off: 5, ..PredictionCheck::UNKNOWN };
    assert_eq!(Prediction::new(1 << 32, &ahead, 1.0), Prediction::NONE);
    assert_ne!(Prediction::new((1 << 32) - 1, &ahead, 1.0), Prediction::NONE);
}

/// An odometer whose counter would overflow restarts.
#[test]
fn a_reading_that_does_not_fit_is_a_start() {
    let start = MotionReading::start(7);
    let far = start.along(u64::MAX - 5);
    assert_eq!(far.since(&start), Some(u64::MAX - 5));
    assert_eq!(far.along(5).since(&far), Some(5));
    assert_eq!(far.along(6).since(&far), None);
}
