//! The speed limit holds for modal surfaces as for surfaces of vertices, whether a frame is measured or not.

// Requirement: F-06

use dibs_build::modes::ModalFit;
use dibs_build::{Builder, BuiltTree};
use dibs_nostd::modes::{ModalAdmissionCheck, ModalReader, Modes};
use dibs_nostd::wire::{Event, FrameId, WeightsEncoder};
use dibs_nostd::{
    AdmissionCheck, Advance, Assembler, FrameExtent, Frames, IncomingSurface, Millis, ReceiveError,
    StretchError, StretchMonitor, SurfaceLimits, Tree, VertexTable,
};
use dibs_tests::motions::trembling;
use fastrand::Rng;
use glam::Vec3;

const MODES: usize = 4;

/// A surface that four weights move.
fn surface() -> BuiltTree {
    let (mesh, motion) = trembling(320, 3, 6);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let tree = Builder::new().stretch(3.0).build(&mesh).expect("a valid mesh");
    tree.with_modes(&fit, MODES).expect("so many")
}

/// The largest distance that any vertex moves from one frame to the other.
fn largest_step(modes: &Modes<'_>, before: &[f32], now: &[f32]) -> f32 {
    let rows = |weights| {
        let surface = modes.surface::<MODES>(weights).expect("in range");
        (0..modes.vertex_count()).map(move |row| surface.position(row).expect("in the table"))
    };
    rows(before).zip(rows(now)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max)
}

/// A recorded motion satisfies a limit equal to its fastest vertex's speed. A jump is refused and counted as too fast,
/// and is accepted after enough time.
#[test]
fn a_modal_surface_that_jumps_is_too_fast() {
    let built = surface();
    let recorded = &built.modal_motion().expect("has modes").weights;
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let tree = Tree::<u16>::from_bytes(bytes).expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    // A frame comes every 7 ticks; the receiver adds one, because the clock counts whole ticks.
    let steps = recorded.windows(2).map(|pair| largest_step(&modes, &pair[0], &pair[1]));
    let speed = steps.fold(0.0, f32::max) / 8.0 * 1.0001;
    let limits = SurfaceLimits::reach_mm(1e4).speed(speed);

    let frames: &'static Frames<MODES> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().expect("new");
    let monitor = StretchMonitor::new(&tree).expect("measurable").limits(limits);
    let admission_check =
        ModalAdmissionCheck::<_, MODES>::new(&modes, monitor).expect("four modes");
    let mut assembler = Assembler::new(writer, admission_check, tree.mesh_id(), 1e4);
    let mut reader = ModalReader::<MODES>::new(reader, &modes).expect("four modes");
    let mut send = |epoch: u32, weights: &[f32]| {
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let mut encoder = WeightsEncoder::<64>::new(id, weights).expect("can be sent");
        let (mut buffer, mut outcome) = ([0; 64], Ok(Advance::Idle));
        // A frame may be refused before its last packet.
        while let Some(packet) = encoder.next_packet(&mut buffer) {
            assembler.accept(packet, Millis(7 * epoch)).expect("well formed");
            outcome = assembler.advance(u32::MAX);
            if outcome.is_err() {
                break;
            }
        }
        let counted = [Event::TooFast, Event::Stretch].map(|event| assembler.counters().of(event));
        (outcome, counted, assembler.admission_check().measured())
    };
    let mut measured = 0;
    for (epoch, weights) in (1..).zip(recorded) {
        let outcome;
        (outcome, _, measured) = send(epoch, weights);
        assert_eq!(outcome, Ok(Advance::Published { epoch }));
    }
    println!("{measured} of {} frames measured", recorded.len());

    let (last, epoch) = (recorded.last().expect("frames"), recorded.len() as u32 + 1);
    let far = |weights: &&Vec<f32>| (largest_step(&modes, last, weights) * 1e6) as u64;
    let far = recorded.iter().max_by_key(far).expect("frames");
    let step = largest_step(&modes, last, far);
    assert!(step > 2.0 * 8.0 * speed, "{step} is no jump");
    let (refused, counted, _) = send(epoch, far);
    let Err(ReceiveError::Stretch(StretchError::TooFast { step: found, limit, .. })) = refused
    else {
        panic!("{refused:?}")
    };
    assert!(found > limit && found <= step * 1.0001, "{found}, {limit}, {step}");
    assert_eq!(counted, [1, 0]);
    assert_eq!(reader.read().expect("stays").label().epoch, epoch - 1);
    let epoch = epoch + (step / speed / 7.0) as u32 + 1;
    assert_eq!(send(epoch, far).0, Ok(Advance::Published { epoch }));
}

/// For any weights, a step slightly beyond the limit is refused, a step slightly within it is accepted, and a step far
/// within it is accepted, often without a measurement.
#[test]
fn the_limit_on_the_speed_of_modes_is_exact() {
    let built = surface();
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    let monitor = StretchMonitor::new(&tree).expect("measurable");
    let mut rng = Rng::with_seed(12);
    let rows = |weights: &[f32]| -> Vec<Vec3> {
        weights.iter().map(|weight| Vec3::new(*weight, 0.0, 0.0)).collect()
    };
    let mut anywhere = || -> Vec<f32> {
        let range = |mode| modes.range(mode).expect("there is one");
        (0..MODES).map(range).map(|[low, high]| 0.7 * (low + (high - low) * rng.f32())).collect()
    };
    let (mut refused, mut unmeasured) = (0, 0);
    for _ in 0..300 {
        let (before, now) = (anywhere(), anywhere());
        let step = largest_step(&modes, &before, &now);
        let (before, now) = (rows(&before), rows(&now));
        for (share, may_pass) in [(0.999, false), (1.001, true), (9.0, true)] {
            let limits = SurfaceLimits::reach_mm(1e4).speed(step * share / 5.0);
            let exact = monitor.clone().limits(limits);
            let farthest = exact.farthest(Millis(4));
            let mut admission_check =
                ModalAdmissionCheck::<_, MODES>::new(&modes, exact).expect("four modes");
            // An admission check around it would ask it for the limit.
            assert!(farthest < f32::INFINITY && admission_check.farthest(Millis(4)) == farthest);
            admission_check.begin(FrameExtent::Whole);
            let before = Some((&before[..], Millis(4)));
            let verdict = admission_check
                .advance(IncomingSurface { before, ..IncomingSurface::new(&now[..], 4) }, u32::MAX);
            let is_fast = matches!(verdict, Err(StretchError::TooFast { .. }));
            assert_eq!(is_fast, !may_pass, "{share} of {step}: {verdict:?}");
            refused += u32::from(is_fast);
            unmeasured += u32::from(admission_check.measured() == 0);
        }
    }
    println!("{refused} refused, {unmeasured} not measured");
    assert!(refused == 300 && unmeasured > 100, "{refused} {unmeasured}");
}
