//! Weights on a bus: they are received, bounded or measured, refused and counted.

// Requirement: F-06

use dibs_build::Builder;
use dibs_build::modes::ModalFit;
use dibs_nostd::guard::{GuardLimits, PosedRows, Surface};
use dibs_nostd::modes::{Memo, ModalAdmissionCheck, ModalReader, Modes};
use dibs_nostd::wire::{self, Encoding, Event, FrameEncoder, FrameId, WeightsEncoder};
use dibs_nostd::{
    Admission, AdmissionCheck, Advance, Assembler, FrameExtent, Frames, IncomingSurface, Millis,
    Options, Progress, Query, ReceiveError, Sphere, StretchError, Tree, TreeBytes, VertexTable,
    measure_stretch,
};
use dibs_tests::bus::{collect, reseal};
use dibs_tests::modal::{anywhere, positions, small};
use dibs_tests::motions::trembling;
use fastrand::Rng;
use glam::{Quat, Vec3};

/// A receiver of weights, and the modes of its tree.
struct Bus {
    tree: Tree<'static, u16>,
    modes: Modes<'static>,
    assembler: Assembler<'static, ModalAdmissionCheck<'static, &'static Tree<'static, u16>, 4>>,
    reader: ModalReader<'static, 'static, 4>,
    recorded: Vec<Vec<f32>>,
}

fn bus() -> Bus {
    let (built, _) = small(4);
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let tree: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(bytes).expect("valid")));
    let modes = Modes::of(tree).expect("valid");
    let frames: &'static Frames<4> = Box::leak(Box::new(Frames::new()));
    let (writer, reader) = frames.split().expect("new");
    let admission_check = ModalAdmissionCheck::new(&modes, tree).expect("four modes");
    Bus {
        tree: *tree,
        modes,
        assembler: Assembler::new(writer, admission_check, tree.mesh_id(), 1e4),
        reader: ModalReader::new(reader, &modes).expect("four modes"),
        recorded: built.modal_motion().expect("has modes").weights.clone(),
    }
}

impl Bus {
    fn packets(&self, epoch: u32, weights: &[f32]) -> Vec<Vec<u8>> {
        let id = FrameId { mesh_id: self.tree.mesh_id(), session: 1, epoch };
        let mut encoder = WeightsEncoder::<64>::new(id, weights).expect("can be sent");
        let mut buffer = [0; 64];
        let mut packets = Vec::new();
        while let Some(packet) = encoder.next_packet(&mut buffer) {
            packets.push(packet.to_vec());
        }
        packets
    }

    /// Sends a frame of weights. Returns the outcome of its last packet, or the first rejection.
    fn send(&mut self, epoch: u32, weights: &[f32]) -> Result<Advance, ReceiveError> {
        let packets = self.packets(epoch, weights);
        packets.iter().try_fold(Advance::Idle, |_, packet| {
            self.assembler.accept(packet, Millis(7 * epoch))?;
            self.assembler.advance(u32::MAX)
        })
    }
}

/// A frame of weights becomes its surface, with label, age and a bound on the stretch.
#[test]
fn weights_come_over_the_bus() {
    let mut bus = bus();
    assert!(bus.reader.read().is_none());
    for (epoch, weights) in (1..).zip(bus.recorded.clone()) {
        assert_eq!(bus.send(epoch, &weights), Ok(Advance::Published { epoch }));
        let frame = bus.reader.latest(Millis(7 * epoch + 3));
        let age = frame.frame().expect("published").age;
        let frame = frame.within(Millis(3)).expect("published");
        let surface = bus.modes.surface::<4>(&weights).expect("recorded");
        assert_eq!(positions(&frame), positions(&surface));
        let label = frame.label();
        assert_eq!((label.epoch, label.received, age), (epoch, Millis(7 * epoch), Millis(3)));
        assert_eq!(label.position_error, bus.modes.position_error());
        let bound = bus.modes.stretch_bound(&weights).expect("recorded");
        assert_eq!(label.stretch.expect("bounded").sigma(), bound.sigma());
        let mut query = Query::<u16, 32>::new(&bus.tree).expect("deep enough");
        let tool = Sphere::new(Vec3::new(0.0, 0.0, 120.0), 3.0).expect("a tool");
        let options = Options::cold().stretch(label.stretch.expect("bounded"));
        let found = query.closest(&frame, &tool, &options).expect("sound");
        let memo = Memo::<_, 64>::new(&frame);
        let remembered = query.closest(&memo, &tool, &options).expect("sound");
        assert_eq!(format!("{found:?}"), format!("{remembered:?}"));
    }
}

/// Weights out of range, frames of vertices, and mixed frames are refused and counted, and the last good surface stays.
#[test]
fn hostile_frames_of_weights_are_rejected_and_counted() {
    let mut bus = bus();
    let good = bus.recorded[5].clone();
    assert!(bus.send(1, &good).is_ok());
    let published = positions(&bus.reader.read().expect("published"));
    let mut epoch = 1;
    for mode in 0..4 {
        let [low, high] = bus.modes.range(mode).expect("there");
        let row = mode as u32;
        for weight in [low.next_down(), high.next_up(), f32::MAX] {
            let mut weights = good.clone();
            weights[mode] = weight;
            epoch += 1;
            assert_eq!(bus.send(epoch, &weights), Err(ReceiveError::TooFar { row }));
        }
        for weight in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            // An encoder refuses to send these.
            epoch += 1;
            let mut packets = bus.packets(epoch, &good);
            let at = wire::HEADER_BYTES + 4 * mode;
            packets[1][at..at + 4].copy_from_slice(&weight.to_le_bytes());
            let hostile = reseal(packets[1].clone());
            assert!(bus.assembler.accept(&packets[0], Millis(0)).is_ok());
            let outcome = bus.assembler.accept(&hostile, Millis(0));
            assert_eq!(outcome, Err(ReceiveError::NotFinite { row }));
        }
    }
    let counted = |bus: &Bus, event| bus.assembler.counters().of(event);
    assert_eq!(counted(&bus, Event::TooFar), 12);
    assert_eq!(counted(&bus, Event::NotFinite), 12);
    assert!(bus.send(97, &good[1..]).is_err());
    assert_eq!(counted(&bus, Event::RowCount), 1);
    let id = FrameId { mesh_id: bus.tree.mesh_id(), session: 1, epoch: 98 };
    let mut vertices = FrameEncoder::<_, 64>::new(id, Encoding::Float, &[Vec3::ZERO; 4][..]);
    let mut buffer = [0; 64];
    let begin = vertices.as_mut().expect("can be sent").next_packet(&mut buffer).expect("begins");
    assert_eq!(bus.assembler.accept(begin, Millis(0)), Err(ReceiveError::Encoding));
    // Two frames' packets under one number.
    let mixed = [bus.packets(99, &good), bus.packets(99, &bus.recorded[8])];
    assert!(bus.assembler.accept(&mixed[0][0], Millis(0)).is_ok());
    assert!(bus.assembler.accept(&mixed[1][1], Millis(0)).is_ok());
    let outcome = bus.assembler.accept(&mixed[0][2], Millis(0));
    assert!(matches!(outcome, Err(ReceiveError::Digest { .. })), "{outcome:?}");
    assert_eq!(positions(&bus.reader.read().expect("stays")), published);
    assert_eq!(bus.reader.read().expect("stays").label().epoch, 1);
    assert!(bus.send(100, &bus.recorded[8].clone()).is_ok());
}

/// In a frame of weights a packet of vertices is refused, and weights that come twice are ignored: the frame continues.
#[test]
fn a_frame_of_weights_takes_only_weights_and_each_once() {
    let mut bus = bus();
    let weights = bus.recorded[5].clone();
    let packets = bus.packets(1, &weights);
    let [begin, values, commit] = &packets[..] else { panic!("{} packets", packets.len()) };
    let id = FrameId { mesh_id: bus.tree.mesh_id(), session: 1, epoch: 1 };
    let vertices = FrameEncoder::<_, 64>::new(id, Encoding::Float, &[Vec3::ZERO; 4][..]);
    let vertices = collect(vertices.expect("can be sent")).swap_remove(1);
    let mut take = |packet: &[u8]| bus.assembler.accept(packet, Millis(0));
    assert_eq!(take(begin), Ok(Progress::Begun { epoch: 1 }));
    assert_eq!(take(&vertices), Err(ReceiveError::Encoding));
    assert_eq!(take(values), Ok(Progress::Stored));
    assert_eq!(take(values), Ok(Progress::Duplicate));
    assert_eq!(take(commit), Ok(Progress::Complete { epoch: 1 }));
    assert_eq!(bus.assembler.advance(u32::MAX), Ok(Advance::Published { epoch: 1 }));
    let counted = |event| bus.assembler.counters().of(event);
    assert_eq!([Event::Encoding, Event::Duplicate].map(counted), [1, 1]);
    let surface = bus.modes.surface::<4>(&weights).expect("recorded");
    assert_eq!(positions(&bus.reader.read().expect("published")), positions(&surface));
}

/// A receiver of vertices accepts no weights.
#[test]
fn a_receiver_of_vertices_refuses_weights() {
    let (mut assembler, _) = dibs_tests::bus::bus();
    let id = FrameId { mesh_id: dibs_tests::bus::MESH, session: 1, epoch: 1 };
    let weights = [0.0; dibs_tests::bus::N];
    let mut encoder = WeightsEncoder::<64>::new(id, &weights).expect("can be sent");
    let mut buffer = [0; 64];
    let begin = encoder.next_packet(&mut buffer).expect("begins");
    assert_eq!(assembler.accept(begin, Millis(0)), Err(ReceiveError::Encoding));
}

/// A surface whose bound exceeds the limit is measured. Those within the limit are admitted, whatever the bound.
#[test]
fn the_gate_is_exact_whatever_the_bound() {
    let (mesh, motion) = trembling(320, 3, 6);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let rest = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let built = rest.with_modes(&fit, 4).expect("so many");
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    let mut admission_check = ModalAdmissionCheck::<_, 4>::new(&modes, &tree).expect("four modes");
    let mut rng = Rng::with_seed(11);
    let (mut bounded, mut measured, mut refused) = (0, 0, 0);
    for _ in 0..2_000 {
        let mut weights = anywhere(&modes, &mut rng);
        weights.iter_mut().for_each(|weight| *weight *= 0.8);
        let rows: Vec<Vec3> = weights.iter().map(|w| Vec3::new(*w, 0.0, 0.0)).collect();
        let surface = modes.surface::<4>(&weights).expect("in range");
        let exact = measure_stretch(&tree, &surface);
        let before = admission_check.measured();
        admission_check.begin(FrameExtent::Whole);
        assert_eq!(
            admission_check.advance(IncomingSurface::new(&rows[..], 3), 1),
            Ok(Admission::Pending)
        );
        match (admission_check.advance(IncomingSurface::new(&rows[..], 4), u32::MAX), exact) {
            (Ok(Admission::Admitted(Some(found))), Ok(exact)) => {
                assert!(found.sigma() >= exact.sigma() * 0.9999);
                if admission_check.measured() == before { bounded += 1 } else { measured += 1 }
            }
            (Err(StretchError::Exceeded { .. }), Err(StretchError::Exceeded { .. })) => {
                refused += 1;
            }
            other => panic!("{other:?}"),
        }
    }
    println!("{bounded} admitted by the bound, {measured} by measurement, {refused} refused");
    assert!(bounded > 100 && measured > 20 && refused > 20);
}

/// Weights from this process: the same as in packets to the bit, and refused for the same causes.
#[test]
fn weights_come_by_a_call() {
    let (mut near, mut far) = (bus(), bus());
    for (epoch, weights) in (1..).zip(near.recorded.clone()) {
        let now = Millis(7 * epoch);
        assert!(near.assembler.frame_of_weights(&weights, now, now).is_ok());
        assert_eq!(near.assembler.advance(u32::MAX), Ok(Advance::Published { epoch }));
        assert_eq!(far.send(epoch, &weights), Ok(Advance::Published { epoch }));
        let [near, far] = [&mut near, &mut far].map(|bus| bus.reader.latest(now).of_any_age());
        assert_eq!(positions(&near.expect("published")), positions(&far.expect("published")));
    }
    let good = near.recorded[0].clone();
    let mut refused = |weights: &[f32]| {
        let outcome = near.assembler.frame_of_weights(weights, Millis(900), Millis(900));
        assert_eq!(near.assembler.advance(u32::MAX), Ok(Advance::Idle));
        outcome.expect_err("wrong")
    };
    assert_eq!(refused(&good[1..]), ReceiveError::RowCount { rows: 3 });
    for (wrong, error) in
        [(f32::NAN, ReceiveError::NotFinite { row: 2 }), (1e30, ReceiveError::TooFar { row: 2 })]
    {
        let mut weights = good.clone();
        weights[2] = wrong;
        assert_eq!(refused(&weights), error);
    }
    let positions = [Vec3::ZERO; 4].into_iter();
    let outcome = near.assembler.frame(positions, Millis(900), Millis(900));
    assert_eq!(outcome, Err(ReceiveError::Encoding));
}

/// A guard's bus takes weights by a call: every vertex is the modal surface's to the bit, the answer has the modes' own
/// error, and wrong weights leave the last surface.
#[test]
fn a_guard_takes_weights_by_a_call() {
    let (built, _) = small(4);
    let plain = Builder::new().stretch(3.0).build(&trembling(320, 3, 6).0).expect("valid");
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("has modes");
    let surface = Surface::<162>::new();
    let limits = GuardLimits::new(1e5, Millis(1_000)).automatic();
    let bytes = TreeBytes::<u16>::new(built.blob());
    let (mut bus, mut guard) = surface.start::<_, 64, 96>(bytes, limits).expect("valid");
    let tool = Sphere::new(Vec3::new(0.0, 0.0, 120.0), 3.0).expect("a tool");
    let recorded = &built.modal_motion().expect("has modes").weights;
    for (number, weights) in (0..).zip(recorded) {
        let now = Millis(30 * number);
        bus.frame_of_weights(&modes, weights, now, now).expect("recorded");
        assert!(matches!(bus.work(u32::MAX), Ok(Advance::Published { .. })), "frame {number}");
        let modal = modes.surface::<4>(weights).expect("recorded");
        let frame = bus.surface().expect("published");
        assert_eq!(positions(&frame), positions(&modal), "frame {number}");
        assert_eq!(frame.position_error(), modes.position_error());
        let found = guard.closest(&tool, now).tracked.expect("an answer").closest;
        let stretch = measure_stretch(&tree, &modal).expect("within the limit");
        let mut query = Query::<u16, 64>::new(&tree).expect("deep enough");
        let options = Options::cold().stretch(stretch);
        let asked = query.closest(&modal, &tool, &options).expect("sound");
        assert!(asked.accuracy > modes.position_error() && modes.position_error() > 0.0);
        // From the third frame on the guard extrapolates, here by no time, and rounds.
        if number < 2 {
            assert_eq!(found.separation, asked.separation, "frame {number}");
            // A tracker counts rounding twice, and the modes' error once.
            assert!(found.accuracy < asked.accuracy + 1e-3, "frame {number}");
            assert_eq!(found.point_on_surface, asked.point_on_surface, "frame {number}");
        }
        assert!(found.accuracy >= asked.accuracy, "frame {number}");
        assert!((found.separation - asked.separation).abs() < 1e-3, "frame {number}");
    }
    let good = &recorded[0];
    let with = |mode: usize, weight: f32| {
        let mut weights = good.clone();
        weights[mode] = weight;
        weights
    };
    let [_, high] = modes.range(1).expect("a mode");
    let published = positions(&bus.surface().expect("published"));
    let now = Millis(10_000);
    for (weights, refusal) in [
        (good[1..].to_vec(), ReceiveError::RowCount { rows: 3 }),
        (with(2, f32::NAN), ReceiveError::NotFinite { row: 2 }),
        (with(1, high.next_up()), ReceiveError::TooFar { row: 1 }),
    ] {
        let before = bus.counters().of(refusal.event());
        assert_eq!(bus.frame_of_weights(&modes, &weights, now, now), Err(refusal));
        assert_eq!(bus.counters().of(refusal.event()), before + 1);
        assert_eq!(bus.work(u32::MAX), Ok(Advance::Idle));
    }
    assert_eq!(positions(&bus.surface().expect("published")), published);
    // Another tree of the same mesh.
    let (mesh, motion) = trembling(320, 3, 6);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let other = plain.with_modes(&fit, 3).expect("so many");
    let other = other.tree::<u16>().expect("valid");
    let others = Modes::of(&other).expect("has modes");
    let refused = bus.frame_of_weights(&others, &good[..3], now, now);
    assert_eq!(refused, Err(ReceiveError::WrongMesh { mesh_id: others.mesh_id() }));
}

/// Weights with a pose are the surface of those without, placed; a pose that is none is refused and counted.
#[test]
fn a_guard_takes_weights_with_a_pose() {
    let (built, _) = small(4);
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("has modes");
    let (plain, posed): (Surface<162>, Surface<162, PosedRows>) = (Surface::new(), Surface::new());
    let limits = GuardLimits::new(1e5, Millis(1_000)).automatic();
    let bytes = TreeBytes::<u16>::new(built.blob());
    let (mut bus, mut guard) = plain.start::<_, 64, 96>(bytes, limits).expect("valid");
    let (mut posed_bus, mut posed_guard) = posed.start::<_, 64, 96>(bytes, limits).expect("valid");
    // Half a turn, which f32 holds exactly.
    let (turn, shift) = (Quat::from_xyzw(0.0, 0.0, 1.0, 0.0), Vec3::new(200.0, 0.0, 30.0));
    let placed = |at: Vec3| Vec3::new(-at.x, -at.y, at.z) + shift;
    let at = Vec3::new(9.0, 4.0, 120.0);
    let tool = Sphere::new(at, 3.0).expect("a tool");
    let posed_tool = Sphere::new(placed(at), 3.0).expect("a tool");
    let recorded = &built.modal_motion().expect("has modes").weights;
    for (number, weights) in (0..).zip(recorded) {
        let now = Millis(30 * number);
        bus.frame_of_weights(&modes, weights, now, now).expect("recorded");
        let taken = posed_bus.frame_of_weights_at(&modes, weights, (turn, shift), now, now);
        assert!(taken.is_ok(), "frame {number}: {taken:?}");
        assert!(matches!(bus.work(u32::MAX), Ok(Advance::Published { .. })), "frame {number}");
        let published = posed_bus.work(u32::MAX);
        assert!(matches!(published, Ok(Advance::Published { .. })), "frame {number}");
        let found = guard.closest(&tool, now).tracked.expect("an answer").closest;
        let there = posed_guard.closest(&posed_tool, now).tracked.expect("an answer").closest;
        assert!((found.separation - there.separation).abs() < 1e-3, "frame {number}");
        let away = there.point_on_surface.distance(posed_tool.centre()) - 3.0;
        assert!((found.separation - away).abs() < 1e-3, "frame {number}: {there:?}");
        assert!(there.accuracy > modes.position_error(), "frame {number}: {there:?}");
    }
    let (now, none) = (Millis(10_000), (Quat::from_xyzw(0.0, 0.0, 0.0, 0.5), shift));
    let refused = posed_bus.frame_of_weights_at(&modes, &recorded[0], none, now, now);
    let Err(refusal @ ReceiveError::Pose(_)) = refused else { panic!("{refused:?}") };
    assert_eq!(posed_bus.counters().of(refusal.event()), 1);
    assert_eq!(posed_bus.work(u32::MAX), Ok(Advance::Idle));
}
