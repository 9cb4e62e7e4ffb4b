//! Surfaces that a volume's nodes move: coverage, stretch and motion.
//!
//! One file, because all tests need the same trees.

// Requirement: F-07

use dibs_build::{Builder, Mesh, Volume, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::{NodeMonitor, Nodes};
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, QuantisedBox};
use dibs_nostd::{
    Admission, AdmissionCheck, Advance, Assembler, Coverage, Fallback, FrameExtent, Frames,
    IncomingSurface, Millis, MovingSurface, Options, Query, ReceiveError, Sphere, StretchError,
    SurfaceLimits, Tracker, VertexTable,
};
use dibs_tests::bus::collect;
use dibs_tests::climb::climb;
use dibs_tests::embedded::{
    Carried, NodeMotion, Section, all, exact, gradient, largest_stretch, rest, rows, sections,
    stretch_of,
};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::{sample, surfaces};
use fastrand::Rng;
use glam::{DVec3, Vec3};

/// Every vertex is within its spheres' radii times the measured stretch, in f64, and where queries read it up to the
/// stated rounding, whatever the motion.
#[test]
fn coverage_holds_in_every_admitted_frame() {
    let mut rng = Rng::with_seed(1);
    for Carried { built, .. } in all(&mut rng) {
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let sections = sections(&tree);
        for trial in 0..sample(60) {
            let kind = NodeMotion::ALL[trial % NodeMotion::ALL.len()];
            let frame = kind.apply(&nodes, &mut rng);
            let sigma = f64::from(nodes.measure(frame.as_slice()).expect("weakened").sigma());
            let now: Vec<DVec3> =
                (0..nodes.vertex_count()).map(|row| exact(&nodes, &frame, row)).collect();
            for Section { pin, radius, covered } in &sections {
                let away =
                    covered.iter().map(|&row| now[row as usize].distance(now[*pin as usize]));
                let away = away.fold(0.0, f64::max);
                assert!(away <= sigma * radius + 1e-9, "{kind:?}: {away} {sigma} {radius}");
            }
            let surface = nodes.surface(frame.as_slice());
            let stated = surface.position_error();
            for (exact, position) in now.iter().zip(rows(&surface)) {
                let away = exact.distance(position.as_dvec3());
                assert!(away <= f64::from(stated) / 2.0, "{away} {stated}");
            }
        }
    }
}

/// Climbs, over the shape of an element and its deformation, towards a stretch above the measured one: there is none.
/// Shapes include needles, plates and slivers; the measured stretch is hardly above the true one.
#[test]
fn no_admitted_element_is_stretched_further_than_measured() {
    let mut rng = Rng::with_seed(2);
    let (mut tested, mut highest, mut loosest) = (0, 0.0_f64, 0.0_f64);
    while tested < sample(400) {
        let scale = 10.0_f32.powf(rng.f32() * 3.0 - 1.0);
        let squash = Vec3::from([(); 3].map(|()| 10.0_f32.powf(-2.0 * rng.f32()))) * scale;
        let far = Vec3::splat(if rng.bool() { 0.0 } else { 300.0 });
        let mut corners = [(); 4].map(|()| Vec3::from([(); 3].map(|()| rng.f32())) * squash + far);
        let volume = |[a, b, c, d]: [Vec3; 4]| (b - a).dot((c - a).cross(d - a));
        if volume(corners) < 0.0 {
            corners.swap(0, 1);
        }
        let middle = corners.iter().sum::<Vec3>() / 4.0;
        let triangle: Vec<Vec3> =
            corners[..3].iter().map(|&corner| corner + (middle - corner) * 0.3).collect();
        let mesh = Mesh { positions: triangle, triangles: vec![[0, 1, 2]], origin: DVec3::ZERO };
        let nodes = corners.map(Vec3::as_dvec3).to_vec();
        let Ok(volume) = Volume::new(nodes, vec![[0, 1, 2, 3]]) else { continue };
        let limit = 1.0 + rng.f32();
        let Ok(built) = Builder::new().stretch(limit).nodes(&volume).build(&mesh) else { continue };
        tested += 1;
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let now = |frame: &[Vec3]| {
            let order = nodes.element(0).expect("one");
            let rest = order.map(|node| nodes.rest_position(node).expect("of it"));
            stretch_of(rest, order.map(|node| frame[node as usize]))
        };
        let excess = |frame: &[Vec3]| {
            let measured = nodes.measure(frame).ok()?;
            let (stretch, determinant) = now(frame);
            let part = stretch / f64::from(measured.sigma());
            assert!(part <= 1.0 && stretch <= f64::from(tree.stretch()), "{part} {stretch}");
            assert!(determinant > 0.0, "{determinant}");
            Some(part)
        };
        let mut step = 0;
        let change = |frame: &Vec<Vec3>| {
            let mut next = frame.clone();
            if step % 3 == 0 {
                let by = gradient(&mut rng, if step < 100 { 0.4 } else { 0.01 });
                next.iter_mut().for_each(|at| *at = by * (*at - middle) + middle);
            } else {
                let node = rng.usize(..4);
                let by = Vec3::from([(); 3].map(|()| rng.f32() - 0.5));
                next[node] += by * scale * 10.0_f32.powf(-1.0 - 5.0 * rng.f32());
            }
            step += 1;
            next
        };
        let (_, best) = climb(corners.to_vec(), 600, change, |frame| excess(frame));
        highest = highest.max(best);
        loosest = loosest.max(1.0 / best - 1.0);
    }
    assert!(highest > 1.0 - 3e-5 && loosest < 0.02, "{highest} {loosest}");
}

/// Frames beyond the limit, inside out, flat or not finite are refused, and the error states the element's number.
#[test]
fn frames_beyond_the_limit_are_refused() {
    let mut rng = Rng::with_seed(3);
    let built = &all(&mut rng)[2].built;
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let rest = rest(&nodes);
    let refusal = |change: &dyn Fn(Vec3) -> Vec3| {
        let frame: Vec<Vec3> = rest.iter().map(|&at| change(at)).collect();
        nodes.measure(frame.as_slice()).err()
    };
    assert_eq!(refusal(&|at| at), None);
    let long = refusal(&|at| at * Vec3::new(1.0, 1.0, 1.31));
    let Some(StretchError::ElementExceeded { stretch, limit, .. }) = long else {
        panic!("{long:?}");
    };
    assert!((stretch - 1.31).abs() < 1e-3 && limit == tree.stretch());
    let inverted = Some(StretchError::Inverted { element: 0 });
    assert_eq!(refusal(&|at| at * Vec3::new(1.0, 1.0, -1.0)), inverted);
    assert_eq!(refusal(&|at| at * Vec3::new(1.0, 1.0, 0.0)), inverted);
    assert_eq!(refusal(&|_| Vec3::ZERO), inverted);
    for wrong in [f32::NAN, f32::INFINITY, -f32::INFINITY] {
        let beyond = refusal(&|at| Vec3::new(at.x, wrong, at.z));
        assert!(matches!(beyond, Some(StretchError::ElementExceeded { element: 0, .. })));
    }
    for found in [0, 4, nodes.count() - 1, nodes.count() + 1] {
        let table = vec![Vec3::ZERO; found as usize];
        let expected = nodes.count();
        let error = nodes.measure(table.as_slice()).err();
        assert_eq!(error, Some(StretchError::VertexCount { expected, found }));
        let surface = nodes.surface(table.as_slice());
        assert_eq!((surface.table(), surface.len()), (table.as_slice(), 0));
    }
}

/// The batched query, the side and a tracker give the same answers as on the same vertices in a table.
#[test]
fn every_query_takes_embedded_surfaces() {
    let mut rng = Rng::with_seed(5);
    for Carried { built, .. } in all(&mut rng) {
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(&tree).expect("deep enough");
        let mut odometer = nodes.odometer();
        let mut before = NodeMotion::Waves.apply(&nodes, &mut rng);
        let _ = odometer.start(before.as_slice());
        let mut centre = tree.rest_position(0).expect("there") + Vec3::splat(10.0);
        for _ in 0..sample(200) {
            let mut after = before.clone();
            after.iter_mut().for_each(|at| *at += Vec3::from([(); 3].map(|()| 0.02 * rng.f32())));
            let Ok(measured) = nodes.measure(after.as_slice()) else { continue };
            let step = odometer.step(before.as_slice(), after.as_slice());
            let moved = step.after();
            let surface = nodes.surface(&moved);
            assert!(surface.motion().is_some());
            centre += Vec3::from([(); 3].map(|()| rng.f32() - 0.5));
            let tool = Sphere::new(centre, 2.0).expect("finite");
            let options = Options::new().stretch(measured);
            let tracked = tracker.closest(&surface, &tool, &options).expect("sound");
            let table = rows(&surface);
            let plain = query.closest(table.as_slice(), &tool, &options).expect("sound");
            let batched = query.closest_batched(&surface, &tool, &options).expect("sound");
            assert_eq!(batched.separation.to_bits(), plain.separation.to_bits());
            let tracked = tracked.closest;
            let error = (tracked.separation - plain.separation).abs();
            assert!(error <= tracked.accuracy + plain.accuracy, "{tracked:?} {plain:?}");
            assert_eq!(tracked.side, plain.side);
            before = after;
        }
    }
}

/// Largest number of nodes in the frames below.
const NODES: usize = 120;

/// Frames of nodes over the bus: published with the stretch of a complete measurement whatever the slices of work;
/// wrong frames are refused while the last good one stays; the surface is interpolated and extrapolated. The tracker's
/// answers on all of these surfaces equal those of exhaustive search.
#[test]
fn nodes_come_over_the_bus() {
    let mut rng = Rng::with_seed(6);
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let lattice = Volume::lattice(&mesh, [3, 4, 5]).expect("a lattice");
    assert_eq!(lattice.nodes().len(), NODES);
    let built = Builder::new().stretch(1.2).nodes(&lattice).build(&mesh).expect("held");
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let triangles = surfaces::triangles(&tree);
    let frames: &'static Frames<NODES, 3> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let limits = SurfaceLimits::reach_mm(500.0).speed(4.0).recovery_mm(150.0);
    let admission_check = NodeMonitor::continuous(&nodes).limits(limits);
    let mut assembler = Assembler::new(writer, admission_check, tree.mesh_id(), 500.0);
    let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(&tree).expect("deep enough");
    let rest = rest(&nodes);
    let (mut good, mut held) = (rest.clone(), rest.clone());
    let (mut published, mut refused, mut unknown, mut moving) = (0, [0; 4], 0, 0);
    for epoch in 1..sample(600) as u32 {
        let time = epoch as f32 * 0.1;
        let mut next: Vec<Vec3> = rest
            .iter()
            .map(|&at| {
                at + 3.0
                    * Vec3::new((time + at.y / 30.0).sin(), (time * 0.7 + at.z / 25.0).cos(), 0.0)
            })
            .collect();
        let wrong = if epoch > 3 { rng.usize(..12) } else { 12 };
        match wrong {
            0 => next[rng.usize(..NODES)] += Vec3::X * 9.0,
            1 => next.iter_mut().for_each(|at| *at += Vec3::Y * 200.0),
            2 => next.iter_mut().for_each(|at| at.x = good[0].x),
            3 => next.iter_mut().for_each(|at| *at *= 0.2),
            _ => (),
        }
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let grid = QuantisedBox::covering(&next).expect("finite");
        let encoding = if rng.bool() { Encoding::Quantised(grid) } else { Encoding::Float };
        let sender = FrameEncoder::<_, 256>::new(id, encoding, &next[..]).expect("valid");
        let mut outcome = None;
        let work = rng.u32(1..200);
        for packet in collect(sender) {
            let _ = assembler.accept(&packet, Millis(40 * epoch)).expect("taken");
            match assembler.advance(work) {
                Ok(Advance::Published { .. }) => outcome = Some(Ok(())),
                Ok(_) => (),
                Err(error) => {
                    outcome = Some(Err(error));
                    break;
                }
            }
        }
        while outcome.is_none() {
            outcome = match assembler.advance(work) {
                Ok(Advance::Published { .. }) => Some(Ok(())),
                Ok(_) => None,
                Err(error) => Some(Err(error)),
            };
        }
        match outcome.expect("decided") {
            Ok(()) => {
                assert!(wrong > 3, "{wrong}");
                published += 1;
                held = (0..NODES as u32)
                    .filter_map(|row| assembler.surface().and_then(|now| now.position(row)))
                    .collect();
                good.clone_from(&next);
            }
            Err(ReceiveError::Stretch(error)) => {
                assert!(wrong <= 3, "{error}");
                let of = match error {
                    StretchError::ElementExceeded { .. } => 0,
                    StretchError::TooFast { .. } => 1,
                    StretchError::Inverted { .. } => 2,
                    StretchError::ElementsShrunk { .. } => 3,
                    other => panic!("{other}"),
                };
                refused[of] += 1;
            }
            Err(other) => panic!("{other}"),
        }
        let frame = reader.latest(Millis(40 * epoch + rng.u32(..90)));
        let frame = frame.within(Millis(1_000)).expect("published");
        let label = frame.label().stretch.expect("measured");
        let whole = nodes.measure(held.as_slice()).expect("admitted");
        assert_eq!(label.sigma().to_bits(), whole.sigma().to_bits());
        assert_eq!(nodes.surface(&frame).stretch().map(|s| s.coverage()), Some(Coverage::Measured));
        let tool = Sphere::new(Vec3::new(60.0 + 5.0 * time.sin(), 0.0, 20.0), 2.5).expect("finite");
        let (between, beyond) = (frame.interpolated(), frame.extrapolated());
        for table in [&between, &beyond] {
            let surface = nodes.surface(table);
            let at: Vec<Vec3> = (0..nodes.count()).filter_map(|row| table.position(row)).collect();
            let sigma = surface.stretch().expect("bounded").sigma();
            assert!(largest_stretch(&nodes, &at) <= f64::from(sigma) * (1.0 + 1e-6));
            let answer = tracker.closest(&surface, &tool, &Options::new()).expect("sound");
            unknown += u32::from(answer.fallback == Some(Fallback::Surface));
            moving += u32::from(table.residual().is_some());
            let truth =
                exhaustive(&rows(&surface), &triangles, &Instrument::sphere(tool.centre(), 2.5));
            let truth = truth.expect("has triangles").separation;
            let error = (truth - f64::from(answer.closest.separation)).abs();
            assert!(error <= f64::from(answer.closest.accuracy), "{error}");
        }
    }
    println!(
        "published {published}, refused {refused:?}, unknown {unknown}, extrapolated {moving}"
    );
    assert!(published > 90 && refused.iter().all(|&count| count > 3) && moving > 60);
    assert!(unknown < 3, "{unknown}");
}

/// The monitor in slices has the result of a complete measurement, even without the assembler; and it reports a node
/// that moves too fast.
#[test]
fn the_monitor_compares_frames_itself() {
    let mut rng = Rng::with_seed(7);
    let built = &all(&mut rng)[0].built;
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let rest = rest(&nodes);
    let limits = SurfaceLimits::reach_mm(500.0).speed(0.1);
    let mut monitor = NodeMonitor::new(&nodes).limits(limits);
    let mut moved = rest.clone();
    moved[57] += Vec3::Z;
    let mut decide = |now: &[Vec3], elapsed| {
        monitor.begin(FrameExtent::Whole);
        let mut slices = 0;
        loop {
            slices += 1;
            let incoming = IncomingSurface::new(now, nodes.count());
            let incoming = IncomingSurface { before: Some((&rest[..], elapsed)), ..incoming };
            match monitor.advance(incoming, 25) {
                Ok(Admission::Pending) => (),
                Ok(Admission::Admitted(stretch)) => return Ok((stretch, slices)),
                Err(error) => return Err(error),
            }
        }
    };
    let (stretch, slices) = decide(&moved, Millis(20)).expect("slow enough");
    assert_eq!(stretch, nodes.measure(moved.as_slice()).ok());
    let work = nodes.count() + nodes.element_count();
    assert!(slices >= work / 25 && slices <= work / 25 + 2, "{slices} {work}");
    let too_fast = decide(&moved, Millis(2));
    assert!(matches!(too_fast, Err(StretchError::TooFast { vertex: 57, .. })), "{too_fast:?}");
    // Of a frame that changes some rows the others are there before it: it is not judged earlier.
    monitor.begin(FrameExtent::Partial);
    for (ready, is_pending) in [(0, true), (nodes.count() - 1, true), (nodes.count(), false)] {
        let incoming = IncomingSurface::new(&moved[..], ready);
        let admission = monitor.advance(incoming, u32::MAX).expect("no speed is known");
        assert_eq!(admission == Admission::Pending, is_pending, "{ready}");
    }
    assert_eq!(monitor.nodes().count(), nodes.count());
    assert_eq!(monitor.whole_work(), work);
}
