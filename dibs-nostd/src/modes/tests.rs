//! The motion of a modal surface as stated by its odometer, which only the crate can read.

// Requirements: F-06, T-04

use dibs_build::modes::ModalFit;
use dibs_build::{Builder, BuiltTree, Motion, generate};
use fastrand::Rng;
use glam::Vec3;

use super::{ModalFrame, ModalReader, Modes};
use crate::surface::motion::Unit;
use crate::{FrameLabel, FrameWriter, Frames, Millis, MovingSurface, Tree, VertexTable};

pub(super) const MODES: usize = 8;

/// A beating heart with three travelling waves.
pub(super) fn surface() -> BuiltTree {
    let generate::MovingMesh { mesh, mut motion } = generate::heart(320).unwrap();
    for (time, frame) in (0_u8..).zip(&mut motion.frames) {
        for (position, rest) in frame.iter_mut().zip(&mesh.positions) {
            for wave in 1..=3_u8 {
                let (axis, wave) = (Vec3::AXES[usize::from(wave % 3)], f32::from(wave));
                let phase = rest.dot(axis) * 0.05 * wave + 0.2 * wave * f32::from(time);
                *position += axis * phase.sin() * 3.0;
            }
        }
    }
    let fit = ModalFit::new(&mesh, &motion).unwrap();
    Builder::new().stretch(3.0).build(&mesh).unwrap().with_modes(&fit, MODES).unwrap()
}

/// The largest motion of a vertex from one surface to another.
fn moved(before: &impl VertexTable, after: &impl VertexTable) -> f32 {
    let rows = 0..before.len() as u32;
    rows.map(|row| before.position(row).unwrap().distance(after.position(row).unwrap()))
        .fold(0.0, f32::max)
}

fn publish(writer: &mut FrameWriter<'_>, weights: &[f32], epoch: u32, received: u32) {
    writer.begin();
    for weight in weights {
        writer.push(Vec3::new(*weight, 0.0, 0.0)).unwrap();
    }
    let received = Millis(received);
    let label = FrameLabel { epoch, received, position_error: 0.0, stretch: None };
    writer.publish(label).unwrap();
}

/// Between any two surfaces of a reader (frames, between frames and beyond them) no vertex moved farther than the
/// odometer states, and it does not overstate by much. Some frames repeat the number and time of the previous one.
#[test]
fn no_vertex_moves_farther_than_the_odometer_says() {
    let built = surface();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let modes = Modes::of(&tree).unwrap();
    let frames = Frames::<MODES>::new();
    let (mut writer, reader) = frames.split().unwrap();
    let mut reader = ModalReader::new(reader, &modes).unwrap();
    let unit = Unit::of(&tree);
    let mut rng = Rng::with_seed(5);
    let mut before: [Option<ModalFrame<'_, MODES>>; 3] = [None; 3];
    let (mut sums, mut now) = ([[0.0; 2]; 3], 9_u32.wrapping_neg());
    let mut weights = [0.0; MODES];
    let (mut epoch, mut received) = (0, now);
    for _ in 0..400 {
        let ranges = (0..MODES).map(|mode| modes.range(mode).unwrap());
        for (weight, [low, high]) in weights.iter_mut().zip(ranges) {
            *weight += 0.1 * (low + (high - low) * rng.f32() - *weight);
        }
        if rng.u32(..6) > 0 {
            (epoch, received) = (epoch + 1, now);
        }
        publish(&mut writer, &weights, epoch, received);
        for _ in 0..rng.u32(1..8) {
            now = now.wrapping_add(rng.u32(0..6));
            let frame = reader.latest(Millis(now)).of_any_age().unwrap();
            let surfaces = [frame, frame.interpolated(), frame.extrapolated()];
            for ((surface, before), sums) in surfaces.iter().zip(&mut before).zip(&mut sums) {
                if let Some(before) = before {
                    let units = surface.motion().unwrap().since(&before.motion().unwrap());
                    let (stated, found) =
                        (unit.length(units.unwrap() as i32), moved(before, surface));
                    assert!(found <= stated + 1e-4, "{epoch}: {found} {stated}");
                    *sums = [sums[0] + found, sums[1] + stated];
                }
                if before.is_none() || rng.bool() {
                    *before = Some(*surface);
                }
            }
        }
    }
    for [found, stated] in sums {
        assert!(found > 100.0 && stated < 3.0 * found, "{sums:?}");
    }
}

/// With weights that swing through their ranges and rest at the ends, at a steady frame rate: at a new frame an
/// extrapolated surface moves no farther than its odometer states, and not much less.
#[test]
fn a_steady_extrapolation_moves_by_its_error() {
    let built = surface();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let modes = Modes::of(&tree).unwrap();
    let frames = Frames::<MODES>::new();
    let (mut writer, reader) = frames.split().unwrap();
    let mut reader = ModalReader::new(reader, &modes).unwrap();
    let unit = Unit::of(&tree);
    let mut before: Option<ModalFrame<'_, MODES>> = None;
    let mut sums = [0.0; 2];
    for epoch in 1..600_u16 {
        let weights: [f32; MODES] = core::array::from_fn(|mode| {
            let [low, high] = modes.range(mode).unwrap();
            let swing = libm::sinf(f32::from(epoch) * 0.08 + mode as f32) * 0.75;
            (low + (high - low) * (0.5 + swing)).clamp(low, high)
        });
        let received = u32::from(epoch) * 17;
        publish(&mut writer, &weights, epoch.into(), received);
        for age in 4..21 {
            let surface =
                reader.latest(Millis(received + age)).of_any_age().unwrap().extrapolated();
            if let Some(before) = &before {
                let units = surface.motion().unwrap().since(&before.motion().unwrap());
                let (stated, found) = (unit.length(units.unwrap() as i32), moved(before, &surface));
                assert!(found <= stated + 1e-4, "{epoch}, {age}: {found} {stated}");
                if age == 4 {
                    sums = [sums[0] + found, sums[1] + stated];
                }
            }
            before = Some(surface);
        }
    }
    let [found, stated] = sums;
    assert!(found > 100.0 && stated < 2.0 * found, "{sums:?}");
}

/// At hundreds of radii a frame the numbers of a prediction do not fit: the odometer's bound is then looser, but never
/// too small.
#[test]
fn no_speed_makes_the_odometer_understate() {
    let mesh = generate::heart(320).unwrap().mesh;
    let mut farthest = 0.0_f64;
    for speed in 1..40_u8 {
        // A root radius is about 128 mm.
        let step = 700.0 * f32::from(speed);
        let moved_by = |frame: i8| {
            mesh.positions.iter().map(|p| *p + Vec3::X * step * f32::from(frame)).collect()
        };
        let frames = (-8..=8).map(moved_by).collect();
        let motion = Motion { frames, ..Motion::default() };
        let fit = ModalFit::new(&mesh, &motion).unwrap();
        let built = Builder::new().stretch(1.5).build(&mesh).unwrap().with_modes(&fit, 1).unwrap();
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        let modes = Modes::of(&tree).unwrap();
        let weights = &built.modal_motion().unwrap().weights;
        let frames = Frames::<1>::new();
        let (mut writer, reader) = frames.split().unwrap();
        let mut reader = ModalReader::new(reader, &modes).unwrap();
        let unit = f64::from(Unit::of(&tree).length(1 << 20)) / f64::from(1 << 20);
        let mut before: Option<ModalFrame<'_, 1>> = None;
        for epoch in 0..8_u8 {
            writer.begin();
            writer.push(Vec3::new(weights[4 + usize::from(epoch)][0], 0.0, 0.0)).unwrap();
            let (received, position_error) = (Millis(100 * u32::from(epoch)), 0.0);
            let stretch = Some(modes.stretch_bound(&weights[4 + usize::from(epoch)]).unwrap());
            let epoch = u32::from(epoch) + 1;
            writer.publish(FrameLabel { epoch, received, position_error, stretch }).unwrap();
            for age in [10, 150, 200] {
                let at = Millis(received.0 + age);
                let surface = reader.latest(at).of_any_age().unwrap().extrapolated();
                let motion = before.as_ref().and_then(MovingSurface::motion);
                let units = motion.and_then(|before| surface.motion()?.since(&before));
                if let (Some(before), Some(units)) = (&before, units) {
                    let (stated, found) = (units as f64 * unit, f64::from(moved(before, &surface)));
                    assert!(stated >= found * 0.999_99, "{step}, {epoch}, {age}: {found} {stated}");
                    farthest = farthest.max(found);
                }
                before = Some(surface);
            }
        }
    }
    assert!(farthest > 20_000.0, "{farthest}");
}

/// The same if a prediction's numbers barely fit: a surface that shrank on its way continues without shrinking further,
/// so its far end is farther from its shown position than the error of its expected position.
#[test]
fn a_course_of_weights_is_not_cut_to_the_numbers_that_fit() {
    const K: usize = 2;
    let mut mesh = generate::heart(320).unwrap().mesh;
    // Open, because the compressed shapes are inside out.
    mesh.triangles.pop();
    let built = Builder::new().stretch(20.0).build(&mesh).unwrap();
    let (unit, radius) = {
        let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
        (Unit::of(&tree), tree.node(0).unwrap().1)
    };
    // The length whose units no longer fit.
    let most = unit.length(1 << 30) * 4.0;
    let ends = mesh.positions.iter().fold([f32::MAX, f32::MIN], |[left, right], p| {
        [if p.x < left { p.x } else { left }, if p.x > right { p.x } else { right }]
    });
    // At `far` along its way, and compressed towards its left end by `shorter` radii.
    let shape = |(far, shorter): (f32, f32)| {
        let pressed = |p: &Vec3| (p.x - ends[0]) / (ends[1] - ends[0]) * shorter * radius;
        mesh.positions.iter().map(|p| *p + Vec3::X * (far * most - pressed(p))).collect()
    };
    let shown = [(-2.0, 0.0), (-1.33, 0.4), (-0.66, 0.8), (0.34, 0.8)];
    // The extrapolation of the third and the fourth frame: no weight leaves its range before.
    let beyond = [(0.68, 1.6), (2.4, 0.0)];
    let frames = shown.into_iter().chain(beyond).map(shape).collect();
    let motion = Motion { frames, ..Motion::default() };
    let built = built.with_modes(&ModalFit::new(&mesh, &motion).unwrap(), K).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let modes = Modes::of(&tree).unwrap();
    let weights = &built.modal_motion().unwrap().weights;
    let (mut unknown, mut known) = (0, 0);
    for (short, late) in (0..10_u16).flat_map(|short| (0..40_u32).map(move |late| (short, late))) {
        let frames = Frames::<K>::new();
        let (mut writer, reader) = frames.split().unwrap();
        let mut reader = ModalReader::<K>::new(reader, &modes).unwrap();
        let mut read = |now: [f32; K], epoch: u32, received: u32, age: u32| {
            writer.begin();
            now.iter().for_each(|&weight| writer.push(Vec3::X * weight).unwrap());
            let stretch = Some(modes.stretch_bound(&now).unwrap());
            let received = Millis(received);
            writer.publish(FrameLabel { epoch, received, position_error: 0.0, stretch }).unwrap();
            let at = Millis(received.0 + age);
            reader.latest(at).of_any_age().unwrap().extrapolated()
        };
        let [first, second, third, fourth] = [0, 1, 2, 3].map(|n| [weights[n][0], weights[n][1]]);
        let part = 1.0 - 5e-4 * f32::from(short);
        let last = [0, 1].map(|mode| third[mode] + (fourth[mode] - third[mode]) * part);
        read(first, 1, 0, 0);
        read(second, 2, 10_000, 0);
        // Its units barely fit.
        let before = read(third, 3, 20_000, 14_920);
        let after = read(last, 4, 34_860 + 5 * late, 0);
        let units = after.motion().unwrap().since(&before.motion().unwrap()).unwrap();
        let stated = units as f64 / 2f64.powi(32) * f64::from(most);
        let found = f64::from(moved(&before, &after));
        assert!(stated >= found * 0.999_99, "{short} {late}: {found} {stated}");
        // If there is no prediction, the distance between the frames counts.
        *(if stated > f64::from(most) { &mut unknown } else { &mut known }) += 1;
    }
    assert!(unknown > 50 && known > 50, "{unknown} {known}");
}
