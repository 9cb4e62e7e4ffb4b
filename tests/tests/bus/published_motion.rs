//! The motion of published frames, which uses up a tracker's bounds.

// Requirement: T-04

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
use dibs_nostd::{
    AdmissionCheck, Advance, Assembler, Fallback, FrameLabel, Frames, Millis, MovingSurface,
    Odometer, Options, Query, Sphere, StretchMonitor, SurfaceLimits, Tracker, Tree, VertexTable,
};
use dibs_tests::bus::collect;
use dibs_tests::deform::unit;
use fastrand::Rng;

/// Vertices of the heart of 320 triangles.
const ROWS: usize = 162;

/// The tracker's answers on published frames equal those of whole queries, whatever frames it never saw, and whether
/// frames are whole, partial, refused or abandoned.
#[test]
fn a_tracker_knows_the_motion_of_published_frames() {
    let mut rng = Rng::with_seed(1);
    let generate::MovingMesh { mesh, motion } = generate::heart(320).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: &'static Frames<ROWS> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let limits = SurfaceLimits::reach_mm(1_000.0);
    let mut assembler = Assembler::for_tree(writer, &tree, limits).expect("a metric");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(&tree).expect("deep enough");
    let (mut shift, mut centre) = (Vec3::ZERO, Vec3::X * 90.0);
    let (mut held, mut published) = (Vec::<Vec3>::new(), 0);
    let (mut counts, mut tests) = ([0; 5], [0_u64; 2]);
    for epoch in 1..1_500 {
        shift += unit(&mut rng) * if rng.u32(..6) == 0 { 12.0 } else { 0.2 };
        let mut rows = built.to_rows(&motion.frames[epoch as usize / 3 % motion.frames.len()]);
        rows.iter_mut().for_each(|row| *row += shift);
        let (is_partial, is_refused) = (rng.u32(..3) == 0 && published > 0, rng.u32(..9) == 0);
        if is_partial {
            rows.clone_from(&held);
            let far = rng.u32(..4) == 0;
            for _ in 0..rng.usize(1..60) {
                let by = if far { Vec3::ONE } else { unit(&mut rng) * 0.3 };
                rows[rng.usize(..ROWS)] += by;
            }
        }
        if is_refused {
            rows[rng.usize(..ROWS)] += Vec3::splat(300.0);
        }
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let mut packets = collect(if is_partial {
            FrameEncoder::<_, 256>::partial(id, Encoding::Float, &rows[..], published, &held[..])
                .expect("valid")
        } else {
            FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).expect("valid")
        });
        if rng.u32(..8) == 0 {
            // The frame is abandoned for the next one.
            packets.truncate(packets.len() / 2);
        }
        if packets.len() > 4 && rng.bool() {
            packets.swap(1, 2);
        }
        for packet in packets {
            if assembler.accept(&packet, Millis(epoch)).is_err() {
                counts[0] += 1;
            }
            let work = rng.u32(1..60);
            for _ in 0..if rng.bool() { 1 } else { 1_000 } {
                match assembler.advance(work) {
                    Ok(Advance::Published { epoch }) => (held, published) = (rows.clone(), epoch),
                    Ok(Advance::Pending) => continue,
                    Ok(_) => (),
                    Err(_) => counts[1] += 1,
                }
                break;
            }
        }
        while let Ok(Advance::Pending) = assembler.advance(50) {}
        if assembler.published().is_some_and(|id| id.epoch == epoch) && published != epoch {
            (held, published) = (rows.clone(), epoch);
        }
        // The tracker sees one frame in four.
        if published == 0 || rng.u32(..4) != 0 {
            continue;
        }
        for _ in 0..3 {
            centre += unit(&mut rng) * 0.3;
            let tool = Sphere::new(centre + shift, 2.0).expect("valid");
            let options = Options::cold().unsigned();
            let whole = query.closest(&held[..], &tool, &options).expect("an answer");
            let frame = reader.read().expect("published");
            let found = tracker.closest(&frame, &tool, &options).expect("an answer");
            let closest = &found.closest;
            let apart = (closest.separation - whole.separation).abs();
            assert!(apart <= closest.accuracy + whole.accuracy, "{epoch}: {found:?} {whole:?}");
            counts[2] += 1;
            counts[3] += usize::from(found.fallback == Some(Fallback::Surface));
            counts[4] += usize::from(found.fallback.is_none());
            tests[0] += u64::from(closest.node_tests);
            tests[1] += u64::from(whole.node_tests);
        }
    }
    println!("not taken, refused, ticks, unknown motion, kept: {counts:?}; node tests {tests:?}");
    let [_, refused, ticks, unknown, kept] = counts;
    assert!(refused > 50 && ticks > 900 && kept > 600, "{counts:?}");
    assert_eq!(unknown, 0, "{counts:?}");
}

/// After a small step a large one is measured again, to its last row, whatever work the admission check does: the
/// frames' readings advance as those of an odometer that measures whole frames.
#[test]
fn a_large_step_after_a_small_one_is_not_understated() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rest = built.to_rows(&mesh.positions);
    let monitor = StretchMonitor::new(&tree).expect("a metric");
    follow(&tree, &rest, monitor);
    follow(&tree, &rest, &tree);
}

/// The reading of a surface's odometer, which is only in its debug text.
fn reading(surface: &impl MovingSurface) -> u64 {
    let text = format!("{:?}", surface.motion().expect("measured"));
    let number = text.split("displacement: ").nth(1).and_then(|rest| rest.split(',').next());
    number.expect("a displacement").parse().expect("a number")
}

fn follow<G: AdmissionCheck>(tree: &Tree<'_, u16>, rest: &[Vec3], admission_check: G) {
    let frames: &'static Frames<ROWS> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let mut assembler = Assembler::new(writer, admission_check, tree.mesh_id(), 1_000.0);
    let mut query = Query::<u16, MAX_STACK>::new(tree).expect("deep enough");
    let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(tree).expect("deep enough");
    let tool = Sphere::new(Vec3::new(5.0, 5.0, 70.0), 2.0).expect("valid");
    let mut odometer = Odometer::new(tree);
    let (mut before, mut last) = (rest.to_vec(), 0);
    odometer.start(rest);
    // Shifts to the side, so that another part of the surface becomes the nearest. The first row stays.
    let shifts = [0.0, 0.001, 45.0, 45.001, -30.0, -30.001];
    for (epoch, shift) in (1..).zip(shifts) {
        let far = |row: &Vec3| (row.distance(rest[0]) / 110.0).min(1.0);
        let rows: Vec<Vec3> = rest.iter().map(|row| row + Vec3::X * shift * far(row)).collect();
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        for packet in collect(FrameEncoder::<_, 512>::new(id, Encoding::Float, &rows[..]).unwrap())
        {
            assembler.accept(&packet, Millis(0)).expect("taken");
        }
        while assembler.advance(3).expect("within the limits") == Advance::Pending {}
        assert_eq!(assembler.published(), Some(id));
        let whole = query.closest(&rows[..], &tool, &Options::cold()).expect("an answer");
        let frame = reader.read().expect("published");
        let now = reading(&frame);
        let expected = odometer.step(before.as_slice(), rows.as_slice());
        let counted = reading(&expected.after()) - reading(&expected.before());
        assert_eq!(now - last, if epoch == 1 { 0 } else { counted }, "{epoch}");
        (before, last) = (rows.clone(), now);
        let found = tracker.closest(&frame, &tool, &Options::new()).expect("an answer").closest;
        let apart = (found.separation - whole.separation).abs();
        assert!(apart <= found.accuracy + whole.accuracy, "{epoch}: {found:?} {whole:?}");
    }
}

/// A frame that was written directly has no measured motion, and neither has the next one.
#[test]
fn a_frame_published_by_hand_has_no_known_motion() {
    let mesh = generate::heart(320).expect("a valid size").mesh;
    let built = Builder::new().build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("16-bit indices");
    let rows = built.to_rows(&mesh.positions);
    let frames: &'static Frames<ROWS> = Box::leak(Box::new(Frames::new()));
    let (mut writer, mut reader) = frames.split().expect("once");
    writer.begin();
    rows.iter().for_each(|&row| writer.push(row).expect("in the table"));
    let label = FrameLabel { epoch: 1, received: Millis(0), position_error: 0.0, stretch: None };
    writer.publish(label).expect("complete");
    assert_eq!(reader.read().expect("published").motion(), None);
    let limits = SurfaceLimits::reach_mm(1_000.0);
    let mut assembler = Assembler::for_tree(writer, &tree, limits).expect("a metric");
    let mut readings = Vec::new();
    for epoch in 2..5 {
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        for packet in collect(FrameEncoder::<_, 512>::new(id, Encoding::Float, &rows[..]).unwrap())
        {
            assembler.accept(&packet, Millis(0)).expect("taken");
        }
        while assembler.advance(100).expect("within the limits") == Advance::Pending {}
        let frame = reader.read().expect("published");
        assert_eq!(frame.epoch(), Some(epoch));
        readings.push(frame.motion().expect("measured"));
    }
    // At rest a step counts as the least possible one.
    assert!(readings[0] != readings[1] && readings[1] != readings[2], "{readings:?}");
}
