//! Implausible surfaces are not published, and counted by their cause: collapsed, in another unit, mirrored, rotated or
//! displaced too far. Plausible ones are accepted.

// Requirement: F-03

use std::path::Path;

use dibs_build::{Builder, BuiltTree, Motion, generate};
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::wire::{Encoding, Event, FrameEncoder, FrameId};
use dibs_nostd::{
    Admission, AdmissionCheck, Advance, Assembler, FrameExtent, FrameReader, Frames,
    IncomingSurface, Millis, ReceiveError, StretchError, StretchMonitor, SurfaceLimits, Tree,
    VertexTable,
};
use dibs_tests::bus::collect;

/// Vertices of the generated heart of 1,000 triangles.
const N: usize = 502;
/// Speed limit in mm a tick, for a heart of one beat a second at ticks of a millisecond.
const SPEED: f32 = 0.3;

struct Bus {
    assembler: Assembler<'static, StretchMonitor<'static, u16>>,
    reader: FrameReader<'static>,
    tree: &'static Tree<'static, u16>,
    epoch: u32,
}

impl Bus {
    fn new(built: &'static BuiltTree, limits: SurfaceLimits) -> Self {
        let tree: &Tree<'_, u16> = Box::leak(Box::new(built.tree().unwrap()));
        let frames: &'static Frames<N> = Box::leak(Box::new(Frames::new()));
        let (writer, reader) = frames.split().unwrap();
        let monitor = StretchMonitor::new(tree).unwrap().limits(limits);
        let assembler = Assembler::new(writer, monitor, tree.mesh_id(), 1e3);
        Self { assembler, reader, tree, epoch: 0 }
    }

    /// Sends a frame whose first packet arrives at `now`, with `work` done after every packet.
    fn send(&mut self, rows: &[Vec3], now: u32, work: u32) -> Result<(), ReceiveError> {
        self.send_on(None, rows, now, work)
    }

    /// The same, as a partial frame based on the rows `base`.
    fn send_on(
        &mut self,
        base: Option<&[Vec3]>,
        rows: &[Vec3],
        now: u32,
        work: u32,
    ) -> Result<(), ReceiveError> {
        let published = self.epoch;
        self.epoch += 1;
        let id = FrameId { mesh_id: self.tree.mesh_id(), session: 1, epoch: self.epoch };
        let encoder = match base {
            Some(base) => {
                while self.assembler.advance(1_000)? != Advance::Idle {}
                FrameEncoder::<_, 256>::partial(id, Encoding::Float, rows, published, base)
            }
            None => FrameEncoder::<_, 256>::new(id, Encoding::Float, rows),
        };
        let encoder = encoder.unwrap();
        for packet in collect(encoder) {
            self.assembler.accept(&packet, Millis(now))?;
            self.assembler.advance(work)?;
        }
        while self.assembler.advance(work)? == Advance::Pending {}
        assert_eq!(self.assembler.published().map(|id| id.epoch), Some(self.epoch));
        assert_eq!(self.reader.read().unwrap().position(7), Some(rows[7]));
        Ok(())
    }

    fn counted(&self, event: Event) -> u32 {
        self.assembler.counters().of(event)
    }
}

fn heart() -> (&'static BuiltTree, Motion) {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).unwrap();
    (Box::leak(Box::new(Builder::new().stretch(1.5).build(&mesh).unwrap())), motion)
}

/// Collapsed shapes, which a first frame must not have.
fn collapsed(rest: &[Vec3]) -> Vec<(&'static str, Vec<Vec3>)> {
    let of = |f: &dyn Fn(Vec3) -> Vec3| rest.iter().map(|&p| f(p)).collect();
    vec![
        ("all positions 0", of(&|_| Vec3::ZERO)),
        ("a point", of(&|_| Vec3::new(10.0, 20.0, 30.0))),
        ("metres for millimetres", of(&|p| p / 1_000.0)),
        ("a hundredth", of(&|p| p * 0.01)),
        ("a fifth", of(&|p| p * 0.2)),
        ("a line", of(&|p| Vec3::new(p.x * 0.2, 0.0, 0.0))),
    ]
}

#[test]
fn a_collapsed_surface_is_refused_from_the_first_frame_on() {
    let (built, motion) = heart();
    let rest = built.to_rows(&motion.frames[0]);
    for work in [1, 7, 50, 10_000] {
        for (name, rows) in collapsed(&rest) {
            let mut bus = Bus::new(built, SurfaceLimits::reach_mm(1e3));
            let refused = bus.send(&rows, 0, work);
            let is_shrunk =
                matches!(refused, Err(ReceiveError::Stretch(StretchError::Shrunk { .. })));
            assert!(is_shrunk, "{name}, {work}: {refused:?}");
            assert_eq!(bus.counted(Event::Shrunk), 1, "{name}");
            assert_eq!(bus.assembler.counters().rejected(), 1, "{name}: nothing else");
            assert!(bus.reader.read().is_none());
            // A good frame is accepted afterwards.
            assert_eq!(bus.send(&rest, 0, work), Ok(()));
        }
    }
}

#[test]
fn a_surface_that_is_mirrored_turned_or_jumped_is_too_fast() {
    let (built, motion) = heart();
    let rest = built.to_rows(&motion.frames[0]);
    let of = |f: &dyn Fn(Vec3) -> Vec3| rest.iter().map(|&p| f(p)).collect::<Vec<_>>();
    let one = |row: usize| {
        let mut rows = rest.clone();
        rows[row] += Vec3::new(0.0, 0.0, 4.0);
        rows
    };
    let wrong = [
        ("mirrored", of(&|p| p * Vec3::new(-1.0, 1.0, 1.0))),
        ("turned", of(&|p| Quat::from_rotation_z(0.5) * p)),
        ("jumped by 200 mm", of(&|p| p + Vec3::new(200.0, 0.0, 0.0))),
        ("the first vertex", one(0)),
        ("the last vertex", one(N - 1)),
        ("one in the middle", one(333)),
    ];
    let limits = SurfaceLimits::reach_mm(1e3).speed(0.1);
    for work in [1, 7, 50, 10_000] {
        for (name, rows) in &wrong {
            let mut bus = Bus::new(built, limits);
            bus.send(&rest, u32::MAX - 5, work).unwrap();
            // 30 ticks later, after the wrap of the clock; one more counts because of rounding, so 3.1 mm are allowed.
            let refused = bus.send(rows, 24, work);
            let is_fast = matches!(
                refused,
                Err(ReceiveError::Stretch(StretchError::TooFast { limit, step, .. }))
                    if step > limit && (limit - 3.1).abs() < 1e-5
            );
            assert!(is_fast, "{name}, {work}: {refused:?}");
            assert_eq!(
                (bus.counted(Event::TooFast), bus.counted(Event::Stretch)),
                (1, 0),
                "{name}"
            );
            assert_eq!(bus.assembler.counters().rejected(), 1, "{name}: nothing else");
        }
        // As first frames these are accepted, except the mirrored one: without an earlier frame there is no speed.
        for (name, rows) in &wrong[1..3] {
            assert_eq!(Bus::new(built, limits).send(rows, 0, work), Ok(()), "{name}");
        }
        let mirrored = Bus::new(built, limits).send(&wrong[0].1, 0, work);
        assert!(is_inside_out(&mirrored), "{mirrored:?}");
        // After enough time the jump is accepted, without a limit on recovery: 200 mm in two seconds are 0.1 mm a tick.
        let mut bus = Bus::new(built, limits.recovery_mm(f32::INFINITY));
        bus.send(&rest, 0, work).unwrap();
        assert!(bus.send(&wrong[2].1, 1_990, work).is_err());
        assert_eq!(bus.send(&wrong[2].1, 2_000, work), Ok(()));
    }
}

const fn is_inside_out(outcome: &Result<(), ReceiveError>) -> bool {
    matches!(outcome, Err(ReceiveError::Stretch(StretchError::InsideOut { .. })))
}

/// Even if all packets arrive before the checks, the refusal states a vertex that moved too far, and the distance.
#[test]
fn a_refusal_names_the_vertex_that_was_too_fast() {
    let (built, motion) = heart();
    let rest = built.to_rows(&motion.frames[0]);
    for work in [1, 7, 50, 100, 10_000] {
        for row in [0, 99, 100, 333, N - 1] {
            let mut bus = Bus::new(built, SurfaceLimits::reach_mm(1e3).speed(0.1));
            bus.send(&rest, 0, work).unwrap();
            let mut rows = rest.clone();
            rows[row] += Vec3::new(0.0, 0.0, 4.0);
            let id = FrameId { mesh_id: bus.tree.mesh_id(), session: 1, epoch: 2 };
            let encoder = FrameEncoder::<_, 256>::new(id, Encoding::Float, &rows[..]).unwrap();
            for packet in collect(encoder) {
                bus.assembler.accept(&packet, Millis(30)).unwrap();
            }
            let refused = loop {
                match bus.assembler.advance(work) {
                    Ok(Advance::Pending) => {}
                    other => break other,
                }
            };
            let Err(ReceiveError::Stretch(StretchError::TooFast { vertex, step, .. })) = refused
            else {
                panic!("{work}, {row}: {refused:?}");
            };
            assert_eq!(vertex as usize, row, "{work}");
            assert!((step - 4.0).abs() < 1e-3, "{work}, {row}: {step}");
        }
    }
}

/// After any silence a surface must be near its last trusted pose, or an operator registers it again.
#[test]
fn a_silence_admits_no_other_surface() {
    let (built, motion) = heart();
    let rest = built.to_rows(&motion.frames[0]);
    let centre = rest.iter().copied().sum::<Vec3>() / N as f32;
    let of = |f: &dyn Fn(Vec3) -> Vec3| rest.iter().map(|&p| f(p)).collect::<Vec<_>>();
    let turned = |axis, angle| of(&|p| centre + Quat::from_axis_angle(axis, angle) * (p - centre));
    let moved = of(&|p| p + Vec3::X * 56.0);
    let wrong = [
        ("mirrored", of(&|p| (p - centre) * Vec3::new(-1.0, 1.0, 1.0) + centre)),
        ("inside out", of(&|p| centre * 2.0 - p)),
        ("half a turn", turned(Vec3::X, std::f32::consts::PI)),
        ("a quarter turn", turned(Vec3::Y, std::f32::consts::FRAC_PI_2)),
        ("moved", moved.clone()),
    ];
    // With the default, a tenth of the reach; with another value; and without a speed limit.
    let reach = SurfaceLimits::reach_mm(250.0);
    let all = [reach.speed(SPEED), reach.speed(SPEED).recovery_mm(40.0), reach];
    for (limits, most) in all.into_iter().zip([25.0, 40.0, 25.0]) {
        for silence in [2_000, 600_000, 1 << 31, u32::MAX - 200_000] {
            for (name, rows) in &wrong {
                let mut bus = Bus::new(built, limits);
                bus.send(&rest, 1_000, 64).unwrap();
                let later = 1_000_u32.wrapping_add(silence);
                let refused = bus.send(rows, later, 64);
                let is_far = matches!(
                    refused,
                    Err(ReceiveError::Stretch(StretchError::TooFast { limit, .. }))
                        if limit == most
                );
                assert!(is_far, "{name} after {silence}: {refused:?}");
                // The unchanged surface is accepted, and one as far away as the limit allows.
                let near = of(&|p| p + Vec3::X * (most - 1.0));
                assert_eq!(bus.send(&near, later, 64), Ok(()), "{silence}");
            }
        }
    }
    // A registration admits one surface elsewhere, but not an inside-out one; after that the limits hold again.
    let mut bus = Bus::new(built, reach);
    bus.send(&rest, 0, 64).unwrap();
    bus.assembler.register();
    assert!(is_inside_out(&bus.send(&wrong[0].1, 20, 64)));
    assert_eq!(bus.send(&moved, 40, 64), Ok(()));
    assert!(bus.send(&rest, 60, 64).is_err());
    assert_eq!(bus.send(&moved, 80, 64), Ok(()));
    // A partial frame is not used for the registration, and does not end it.
    let mut bus = Bus::new(built, reach);
    bus.send(&rest, 0, 64).unwrap();
    bus.assembler.register();
    let near = of(&|p| p + Vec3::X);
    bus.send_on(Some(&rest), &near, 20, 64).unwrap();
    assert_eq!(bus.send(&moved, 40, 64), Ok(()));
    assert!(bus.send(&rest, 60, 64).is_err());
}

/// A closed surface is turned inside out through a plane, in small steps within all other limits: by whole frames, and
/// by partial ones. It is refused once its volume has the other sign.
#[test]
fn a_surface_is_not_turned_inside_out_however_slowly() {
    let (built, motion) = heart();
    let rest = built.to_rows(&motion.frames[0]);
    let centre = rest.iter().copied().sum::<Vec3>() / N as f32;
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for is_partial in [false, true] {
            let mut bus = Bus::new(built, SurfaceLimits::reach_mm(1e3).shrinkage(0.0));
            bus.send(&rest, 0, 64).unwrap();
            let (mut held, mut scale, mut refused) = (rest.clone(), 1.0_f32, None);
            for number in 1..400 {
                scale -= 0.005;
                let at = |p: &Vec3| centre + (*p - centre) * (Vec3::ONE - axis * (1.0 - scale));
                let rows: Vec<Vec3> = rest.iter().map(at).collect();
                let base = is_partial.then_some(held.as_slice());
                if let Err(error) = bus.send_on(base, &rows, 20 * number, 64) {
                    refused = Some((scale, error));
                    break;
                }
                held = rows;
            }
            let (scale, error) = refused.expect("refused");
            assert!(is_inside_out(&Err(error)), "{error}");
            assert!(scale < 0.0 && scale > -0.03, "{axis}, {is_partial}: at {scale}");
        }
    }
}

/// The generated heart's motion is accepted at its own speed, and so are strongly compressed shapes as first frames.
#[test]
fn the_motion_of_a_heart_is_plausible() {
    let (built, motion) = heart();
    let mut bus = Bus::new(built, SurfaceLimits::reach_mm(1e3).speed(SPEED));
    let interval = 1_000 / motion.frames.len() as u32;
    for (number, frame) in (0..).zip(motion.frames.iter().cycle().take(3 * motion.frames.len())) {
        bus.send(&built.to_rows(frame), number * interval, 64).unwrap();
    }
    // Shapes of half the size, or compressed along one or two axes, are still plausible.
    let rest = built.to_rows(&motion.frames[0]);
    for scale in [Vec3::splat(0.5), Vec3::new(0.3, 1.0, 1.0), Vec3::new(1.2, 0.5, 0.4)] {
        let rows: Vec<_> = rest.iter().map(|&p| p * scale).collect();
        let mut bus = Bus::new(built, SurfaceLimits::reach_mm(1e3));
        assert_eq!(bus.send(&rows, 0, 64), Ok(()), "{scale}");
    }
}

/// The default limit on shrinkage leaves a margin on a recorded heart: no region shrinks to less than half.
#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn a_recorded_heart_shrinks_far_less_than_the_limit() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let mesh = dibs_build::read(data.join("heart_10272.ply")).unwrap().mesh;
    let motion = Motion::read_pc2(data.join("heart_10272.pc2")).unwrap();
    let built = Builder::new().stretch(2.5).build(&mesh).unwrap();
    let tree: Tree<'_, u16> = built.tree().unwrap();
    for part in [0.25, 0.5] {
        let mut monitor = StretchMonitor::new(&tree)
            .unwrap()
            .limits(SurfaceLimits::reach_mm(1e3).shrinkage(part));
        for (number, frame) in motion.frames.iter().enumerate() {
            let rows = built.to_rows(frame);
            monitor.begin(FrameExtent::Whole);
            let arriving = IncomingSurface::new(rows.as_slice(), rows.len() as u32);
            let verdict = monitor.advance(arriving, u32::MAX);
            assert!(matches!(verdict, Ok(Admission::Admitted(_))), "{number}: {verdict:?}");
        }
    }
}

#[test]
fn a_limit_that_is_no_number_refuses_frames() {
    let (built, motion) = heart();
    let rest = built.to_rows(&motion.frames[0]);
    assert!(
        Bus::new(built, SurfaceLimits::reach_mm(1e3).shrinkage(f32::NAN))
            .send(&rest, 0, 64)
            .is_err()
    );
    let limits = SurfaceLimits::reach_mm(1e3);
    let below = [-1e-3, -1.0, -1e30, f32::NEG_INFINITY];
    let speeds = [f32::NAN].into_iter().chain(below).map(|speed| limits.speed(speed));
    for limits in speeds.chain(below.map(|way| limits.recovery_mm(way))) {
        let mut bus = Bus::new(built, limits);
        assert!(bus.send(&rest, 0, 64).is_ok(), "nothing to compare with");
        assert!(bus.send(&rest, 5, 64).is_err(), "{limits:?}");
    }
}
