//! The surface between received frames, and its extrapolation beyond the last one.

// Requirement: F-05

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
use dibs_nostd::{
    AdmissionCheck, Advance, Assembler, FrameLabel, FrameReader, Frames, Millis, MovingSurface,
    NoAdmissionCheck, Options, Query, Sphere, SurfaceLimits, Tracker, Tree, VertexTable,
};
use dibs_tests::bus::collect;
use dibs_tests::deform::unit;
use dibs_tests::stretch;
use fastrand::Rng;

/// Vertices of the heart of 320 triangles.
const ROWS: usize = 162;

/// Three buffers, which extrapolation needs.
type Continuous = Frames<ROWS, 3>;
type Reader = FrameReader<'static>;
type Bus<G> = Assembler<'static, G>;

fn heart() -> (Mesh, Vec<Vec<Vec3>>, BuiltTree) {
    let generate::MovingMesh { mesh, motion } = generate::heart(320).expect("a valid size");
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let frames = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    (mesh, frames, built)
}

/// Sends a frame, either whole or based on the published one; true if it was published.
fn send<G: AdmissionCheck>(
    bus: &mut Bus<G>,
    mesh_id: u32,
    epoch: u32,
    rows: &[Vec3],
    base: Option<(u32, &[Vec3])>,
    now: u32,
    rng: &mut Rng,
) -> bool {
    let id = FrameId { mesh_id, session: 1, epoch };
    let mut packets = collect(match base {
        Some((base, held)) => {
            FrameEncoder::<_, 256>::partial(id, Encoding::Float, rows, base, held).expect("valid")
        }
        None => FrameEncoder::<_, 256>::new(id, Encoding::Float, rows).expect("valid"),
    });
    if packets.len() > 4 && rng.bool() {
        packets.swap(1, 2);
    }
    let work = rng.u32(1..60);
    for packet in packets {
        let _ = bus.accept(&packet, Millis(now));
        let _ = bus.advance(work);
    }
    let is_pending = |_: &u32| bus.advance(work) == Ok(Advance::Pending);
    let slices = (0..10_000).take_while(is_pending).count();
    assert!(slices < 10_000, "the check does not come to an end");
    bus.published() == Some(id)
}

fn positions(surface: &impl VertexTable) -> Vec<Vec3> {
    (0..ROWS as u32).map(|row| surface.position(row).expect("a row")).collect()
}

/// The largest distance of a row from its true position between two frames or beyond.
fn off(rows: &[Vec3], before: &[Vec3], after: &[Vec3], share: f32) -> f64 {
    let of = |((row, a), b): ((&Vec3, &Vec3), &Vec3)| {
        a.as_dvec3().lerp(b.as_dvec3(), f64::from(share)).distance(row.as_dvec3())
    };
    rows.iter().zip(before).zip(after).map(of).fold(0.0, f64::max)
}

/// The largest stretch in f64.
fn truth(mesh: &Mesh, built: &BuiltTree, tree: &Tree<'_, u16>, rows: &[Vec3]) -> f64 {
    let mut moved = mesh.positions.clone();
    for (row, &vertex) in rows.iter().zip(built.vertex_order()) {
        moved[vertex as usize] = *row;
    }
    stretch::largest(mesh, &moved, tree.paths())
}

/// Frames of a beating, drifting heart, some of them partial, refused or skipped. At every tick the interpolated and
/// the extrapolated surface have the positions that follow from two frames, no triangle is stretched more than they
/// state, and the tracker's answer equals that of a whole query.
#[test]
fn the_surface_between_frames_is_where_the_frames_put_it() {
    let mut rng = Rng::with_seed(7);
    let (mesh, motion, built) = heart();
    let tree = built.tree::<u16>().expect("16-bit indices");
    let frames: &'static Continuous = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let leaked: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(built.blob().to_vec().leak()).expect("valid")));
    let limits = SurfaceLimits::reach_mm(1_000.0);
    let mut bus = Assembler::continuous(writer, leaked, limits).expect("a metric");
    let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
    let mut trackers = [(); 2].map(|()| Tracker::<u16, MAX_STACK, 96>::new(&tree).expect("deep"));
    let (mut shift, mut tool) = (Vec3::ZERO, Vec3::X * 90.0);
    // The published frames, with epoch and time.
    let mut known = Vec::<(u32, u32, Vec<Vec3>)>::new();
    let mut now = 5_u32.wrapping_neg();
    // The residuals: errors of the extrapolation when the last frames arrived.
    let mut errors = [0.0; 2];
    let mut told = 0;
    let (mut moving, mut held, mut refused, mut tightest, mut kept) = (0, 0, 0, 0.0_f64, 0);
    for epoch in 1..400_u32 {
        let still = rng.u32(4..40);
        for tick in 0..still {
            now = now.wrapping_add(1);
            let Some((_, received, last)) = known.last() else { break };
            if tick % 3 != 0 {
                continue;
            }
            tool += unit(&mut rng) * 0.3;
            let tool = Sphere::new(tool + shift, 2.0).expect("valid");
            let frame = reader.latest(Millis(now)).of_any_age().expect("published");
            let age = now.wrapping_sub(*received) as f32;
            let surfaces = [frame.interpolated(), frame.extrapolated()];
            for (number, (surface, tracker)) in surfaces.iter().zip(&mut trackers).enumerate() {
                let rows = positions(surface);
                let two = known.len().checked_sub(2).map(|at| &known[at]);
                let is_held = surface.t() == 1.0;
                match two {
                    Some((before, earlier, old)) if !is_held => {
                        let share = age / received.wrapping_sub(*earlier) as f32;
                        let share = if number == 1 { 1.0 + share.min(2.0) } else { share.min(1.0) };
                        assert_eq!(surface.t(), share, "{epoch}");
                        assert_eq!(surface.before().epoch(), Some(*before));
                        let off = off(&rows, old, last, share);
                        assert!(off < 1e-4, "{epoch}: {off}");
                        moving += 1;
                    }
                    _ => {
                        assert!(off(&rows, last, last, 1.0) < 1e-4, "{epoch}");
                        held += 1;
                    }
                }
                let exact = truth(&mesh, &built, &tree, &rows);
                let stated = f64::from(surface.stretch().expect("measured").sigma());
                assert!(stated >= exact, "{epoch}, {number}: {stated} for {exact}");
                tightest = tightest.max(stated - exact);
                let options = Options::cold().unsigned();
                let whole = query.closest(rows.as_slice(), &tool, &options).expect("an answer");
                let found = tracker.closest(surface, &tool, &options).expect("an answer");
                let apart = (found.closest.separation - whole.separation).abs();
                assert!(apart <= found.closest.accuracy + whole.accuracy, "{epoch}: {found:?}");
                kept += usize::from(found.fallback.is_none());
            }
        }
        shift += unit(&mut rng) * 0.4;
        let mut rows = motion[epoch as usize / 3 % motion.len()].clone();
        rows.iter_mut().for_each(|row| *row += shift);
        let base = match known.last() {
            Some((base, _, held)) if rng.u32(..4) == 0 => {
                rows.clone_from(held);
                (0..30).for_each(|_| rows[rng.usize(..ROWS)] += unit(&mut rng) * 0.3);
                Some((*base, held.as_slice()))
            }
            _ => None,
        };
        if rng.u32(..6) == 0 {
            rows[rng.usize(..ROWS)] += Vec3::splat(300.0);
        }
        if send(&mut bus, tree.mesh_id(), epoch, &rows, base, now, &mut rng) {
            let shown = reader.latest(Millis(now)).of_any_age().expect("published");
            let shown = shown.extrapolated().residual();
            let mut exact = errors;
            if let [.., (_, t0, a), (_, t1, b)] = known.as_slice() {
                let share = now.wrapping_sub(*t1) as f32 / t1.wrapping_sub(*t0) as f32;
                let share = share.min(2.0);
                // After another interval of the same length.
                let growth = f64::from(2.0 * share / (1.0 + share)).max(1.0);
                exact[1] = off(&rows, a, b, 1.0 + share) * growth;
            }
            // A held surface states no residual.
            if let Some(shown) = shown {
                let larger = exact[0].max(exact[1]);
                assert!((f64::from(shown) - larger).abs() < 1e-3, "{epoch}: {shown} for {larger}");
                told += 1;
            }
            errors = [exact[1], 0.0];
            known.push((epoch, now, rows));
        } else {
            refused += 1;
        }
    }
    println!(
        "{moving} moving, {held} held, {refused} refused, {tightest:.3} above the true stretch at most, {kept} by the front"
    );
    assert!(told > 150 && moving > 2_000 && held > 100 && refused > 30 && kept > 1_000);
    assert!(tightest < 0.4, "the stated stretch is {tightest} above the true one");
}

/// An extrapolation that would exceed the tree's stretch limit is not used, and the next one is measured again.
#[test]
fn a_surface_is_held_where_its_extrapolation_would_tear() {
    let mut rng = Rng::with_seed(8);
    let (_, motion, built) = heart();
    let tree: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(built.blob().to_vec().leak()).expect("valid")));
    let frames: &'static Continuous = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let mut bus =
        Assembler::continuous(writer, tree, SurfaceLimits::reach_mm(1e3)).expect("a metric");
    let rest = &motion[0];
    let longer = |by: f32| -> Vec<Vec3> { rest.iter().map(|row| *row * (1.0 + by)).collect() };
    // The first step has no known residual; among the others, the one to 1.3 would continue beyond the limit of 1.5,
    // and so would the last.
    let steps =
        [(0.0, false), (0.05, false), (0.1, true), (0.3, false), (0.25, true), (0.4, false)];
    for (epoch, (by, is_moving)) in (1..).zip(steps) {
        assert!(send(&mut bus, tree.mesh_id(), epoch, &longer(by), None, 20 * epoch, &mut rng));
        let frame = reader.latest(Millis(20 * epoch + 10)).of_any_age().expect("published");
        let surface = frame.extrapolated();
        assert_eq!(surface.t(), if is_moving { 1.5 } else { 1.0 }, "{epoch}");
        assert!(surface.stretch().expect("measured").sigma() <= 1.5001);
        // Interpolation between the frames is still possible.
        assert_eq!(frame.interpolated().t(), if epoch == 1 { 1.0 } else { 0.5 });
    }
}

/// If motion or extrapolation was not measured, or two frames have one time, the surface is held at the last frame.
#[test]
fn a_surface_of_unknown_motion_is_held() {
    let mut rng = Rng::with_seed(9);
    let (_, motion, built) = heart();
    let tree = built.tree::<u16>().expect("16-bit indices");
    let is_held = |reader: &mut Reader, now| {
        let frame = reader.latest(Millis(now)).of_any_age().expect("published");
        let surfaces = [frame.interpolated(), frame.extrapolated()];
        surfaces.map(|surface| surface.t() == 1.0 && surface.residual().is_none())
    };
    // Frames written directly.
    let frames: &'static Continuous = Box::leak(Box::new(Frames::new()));
    let (mut writer, mut reader) = frames.split().expect("once");
    for epoch in 0..4 {
        writer.begin();
        motion[epoch as usize].iter().for_each(|&row| writer.push(row).expect("in the table"));
        let label =
            FrameLabel { epoch, received: Millis(20 * epoch), position_error: 0.0, stretch: None };
        writer.publish(label).expect("complete");
        assert_eq!(is_held(&mut reader, 20 * epoch + 5), [true; 2]);
    }
    // With an admission check that measures nothing.
    let mut bus = Assembler::new(writer, NoAdmissionCheck, tree.mesh_id(), 1_000.0);
    for epoch in 10..14 {
        let rows = &motion[epoch as usize];
        assert!(send(&mut bus, tree.mesh_id(), epoch, rows, None, 20 * epoch, &mut rng));
        assert_eq!(is_held(&mut reader, 20 * epoch + 5), [true; 2]);
    }
    // With an admission check that measures each frame but not the motion from it, and a frame of the same time.
    let frames: &'static Continuous = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let leaked: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(built.blob().to_vec().leak()).expect("valid")));
    let mut bus = Assembler::new(writer, leaked, tree.mesh_id(), 1_000.0);
    for (epoch, (now, expected)) in
        (20..).zip([(400, [true; 2]), (420, [false, true]), (420, [true; 2])])
    {
        let rows = &motion[epoch as usize];
        assert!(send(&mut bus, tree.mesh_id(), epoch, rows, None, now, &mut rng));
        assert_eq!(is_held(&mut reader, now + 5), expected, "{epoch}");
    }
}

/// A frame that is read without a time is not extrapolated.
#[test]
fn without_the_time_nothing_moves_on() {
    let mut rng = Rng::with_seed(10);
    let (_, motion, built) = heart();
    let tree: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(built.blob().to_vec().leak()).expect("valid")));
    let frames: &'static Continuous = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let mut bus =
        Assembler::continuous(writer, tree, SurfaceLimits::reach_mm(1e3)).expect("a metric");
    for epoch in 1..4 {
        let rows = &motion[epoch as usize];
        assert!(send(&mut bus, tree.mesh_id(), epoch, rows, None, 20 * epoch, &mut rng));
    }
    let frame = reader.read().expect("published");
    let surface = frame.extrapolated();
    assert!(off(&positions(&surface), &motion[3], &motion[3], 1.0) < 1e-4);
    assert_eq!(surface.motion(), frame.motion());
    assert_eq!(frame.interpolated().t(), 0.0);
    drop(frame);
    // Two frames of the same time define no velocity.
    assert!(send(&mut bus, tree.mesh_id(), 4, &motion[4], None, 60, &mut rng));
    let frame = reader.latest(Millis(70)).of_any_age().expect("published");
    assert_eq!((frame.extrapolated().t(), frame.interpolated().t()), (1.0, 1.0));
    drop(frame);
    // Nor do two in the wrong order, because of a clock's jitter.
    assert!(send(&mut bus, tree.mesh_id(), 5, &motion[5], None, 55, &mut rng));
    let frame = reader.latest(Millis(70)).of_any_age().expect("published");
    assert_eq!((frame.extrapolated().t(), frame.interpolated().t()), (1.0, 1.0));
    assert!(off(&positions(&frame.interpolated()), &motion[5], &motion[5], 1.0) < 1e-4);
}
