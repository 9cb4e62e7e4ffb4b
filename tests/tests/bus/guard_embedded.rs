//! The guard of a surface that a volume's nodes move: the same loop, with frames of nodes.

// Requirements: C-07, F-07

use dibs_build::{Builder, Volume, generate};
use dibs_nostd::filter::{Filter, Reason, RigidMotion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{GuardLimits, Rows, Surface, Vertices};
use dibs_nostd::nodes::{Nodes, NodesError};
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId, Freshness};
use dibs_nostd::{
    Advance, Capsule, Error, Millis, QueryError, ReceiveError, StretchError, Tree, TreeBytes,
    VertexTable,
};
use dibs_tests::bus::collect;
use dibs_tests::embedded::rows;
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::surfaces;
use fastrand::Rng;

dibs_nostd::include_tree!("embedded_heart");

/// Ticks between two frames.
const PERIOD: u32 = 30;

/// The tissue's velocity, in mm/s.
const FLOW: Vec3 = Vec3::new(12.0, -5.0, 9.0);

/// The packets of a frame.
fn packets(mesh_id: u32, now: u32, table: &[Vec3]) -> Vec<Vec<u8>> {
    let id = FrameId { mesh_id, session: 1, epoch: now };
    let fresh = Freshness { age_ms: 0, echo: Some(now) };
    let sender = FrameEncoder::<_, 256>::new(id, Encoding::Float, table).expect("valid");
    collect(sender.with_freshness(fresh))
}

/// The loop of a controller, with the generated module: answers are correct for the true surface at each tick,
/// velocities are its vertices', admitted motions keep the stand-off, and after a refused frame the last one stays.
#[test]
fn a_controller_runs_on_nodes() {
    static HEART: embedded_heart::Surface = embedded_heart::Surface::new();
    let limits = GuardLimits::new(300.0, Millis(200)).automatic();
    let (mut bus, mut guard) = embedded_heart::start(&HEART, limits).expect("valid");
    let tree = embedded_heart::TREE.validate().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let triangles = surfaces::triangles(&tree);
    let rest: Vec<Vec3> = (0..nodes.count()).filter_map(|at| nodes.rest_position(at)).collect();
    assert_eq!(rest.len(), embedded_heart::NODES);
    let at = |now: u32| -> Vec<Vec3> {
        // The surface grows, so that vertices move apart.
        let time = (now - 1_000) as f32 * 1e-3;
        rest.iter().map(|&node| node * (1.0 + 0.03 * time) + FLOW * time).collect()
    };
    let filter = Filter::new(1.0, 400.0).expect("in range");
    let (mut checked, mut refused, mut admitted) = (0, 0, 0);
    let start = Vec3::new(95.0, 3.0, 20.0);
    let mut tool_at = start;
    for tick in 0..3_000 {
        let now = 1_000 + tick;
        if tick % PERIOD == 0 {
            let mut frame = at(now);
            let is_bad = tick % (7 * PERIOD) == 5 * PERIOD;
            if is_bad {
                // An element turned inside out, or too long.
                frame[57] += Vec3::splat(80.0);
            }
            let good = bus.surface().map(|frame| frame.epoch());
            for packet in packets(tree.mesh_id(), now, &frame) {
                bus.packet(&packet, Millis(now)).expect("a good packet");
            }
            let outcome = loop {
                match bus.work(100) {
                    Ok(Advance::Pending) => (),
                    other => break other,
                }
            };
            assert_eq!(matches!(outcome, Err(ReceiveError::Stretch(_))), is_bad, "{outcome:?}");
            if is_bad {
                assert_eq!(bus.surface().map(|frame| frame.epoch()), good);
                refused += 1;
            }
        }
        let towards = (FLOW * (tick as f32 * 1e-3) - tool_at).normalize_or_zero() * 0.1;
        let end = tool_at + Vec3::new(30.0, 4.0, 10.0);
        let tool = Capsule::new(tool_at, end, 2.0).expect("valid");
        let command = RigidMotion::new(tool_at, towards, Vec3::ZERO);
        let (answer, motion) = guard.admit(&filter, &tool, &command, Millis(now));
        let next = motion.map_or(Vec3::ZERO, |admitted| admitted.motion.apply(tool_at) - tool_at);
        if let Ok(closest) = answer.closest
            && tick > 4 * PERIOD
        {
            let nodes_now = at(now);
            let truth = rows(&nodes.surface(nodes_now.as_slice()));
            let found = exhaustive(&truth, &triangles, &Instrument::capsule(tool_at, end, 2.0));
            let found = found.expect("has triangles").separation;
            let error = (found - f64::from(closest.separation)).abs();
            assert!(error <= f64::from(closest.accuracy), "tick {tick}: {error} {closest:?}");
            assert!(closest.accuracy < 1.0, "tick {tick}: {closest:?}");
            let growth = closest.corners.map(|row| {
                let vertex = nodes.surface(rest.as_slice()).position(row).expect("a vertex");
                FLOW + 0.03 * vertex
            });
            let [u, v, w] = closest.barycentric;
            let flow = growth[0] * u + growth[1] * v + growth[2] * w;
            let searched = answer.searched.expect("a surface");
            assert!((searched.velocity - flow).length() < 0.05, "{} {flow}", searched.velocity);
            checked += 1;
            if let Ok(motion) = &motion {
                admitted += u32::from(next.length() > 0.01);
                assert!(motion.reason != Reason::NoSafeMotion, "tick {tick}: {motion:?}");
                assert!(found > 0.9 || start == tool_at, "tick {tick}: {found}");
            }
        }
        tool_at += next;
    }
    println!("checked {checked}, refused {refused}, moved {admitted}");
    assert!(checked > 1_900 && refused > 10 && admitted > 1_000);
}

/// The start reports a tree without nodes, a tree with nodes where vertices are expected, and a number of rows that
/// differs from the number of nodes.
#[test]
fn a_start_names_the_wrong_kind_of_rows() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let plain = Builder::new().build(&heart).expect("a valid mesh");
    // As many nodes as vertices.
    let volume = Volume::lattice(&heart, [5, 2, 8]).expect("a lattice");
    let embedded = Builder::new().nodes(&volume).build(&heart).expect("held");
    let limits = GuardLimits::new(20.0, Millis(100));
    let nodes: &Surface<162, Nodes<'static>> = Box::leak(Box::new(Surface::new()));
    let vertices: &Surface<162> = Box::leak(Box::new(Surface::new()));
    let start = |blob| nodes.start::<u16, 64, 96>(TreeBytes::new(blob), limits).err();
    assert_eq!(start(plain.blob()), Some(Error::Nodes(NodesError::Absent)));
    let mistaken = vertices.start::<u16, 64, 96>(TreeBytes::new(embedded.blob()), limits).err();
    assert_eq!(mistaken, Some(Error::Stretch(StretchError::NoMetric)));
    let other: &Surface<161, Nodes<'static>> = Box::leak(Box::new(Surface::new()));
    let other = other.start::<u16, 64, 96>(TreeBytes::new(embedded.blob()), limits).err();
    let expected = QueryError::VertexCount { expected: 162, found: 161 };
    assert_eq!(other, Some(Error::Query(expected)));
    assert_eq!(start(embedded.blob()), None);
}

/// Frames of vertices are not accepted as frames of nodes, nor the reverse: the number of rows differs, or, if it is
/// equal, the shapes of elements and triangles do. Each is counted by its cause, and the next good frame is published.
#[test]
fn frames_of_the_other_kind_are_refused_and_counted() {
    let mut rng = Rng::with_seed(3);
    let heart = generate::heart(320).expect("a valid size").mesh;
    let plain = Builder::new().stretch(3.0).build(&heart).expect("a valid mesh");
    let vertices = plain.to_rows(&heart.positions);
    for cells in [[5, 2, 8], [3, 4, 5]] {
        let volume = Volume::lattice(&heart, cells).expect("a lattice");
        let embedded = Builder::new().stretch(3.0).nodes(&volume).build(&heart).expect("held");
        let rows = embedded.to_rows(&heart.positions);
        let nodes: Vec<Vec3> = volume.nodes().iter().map(|node| node.as_vec3()).collect();
        for scale in (0..40).map(|_| 0.1 + 2.0 * rng.f32()) {
            let scaled =
                |rows: &[Vec3]| -> Vec<Vec3> { rows.iter().map(|&at| at * scale).collect() };
            let ([on_nodes, on_vertices], is_counted) = match nodes.len() {
                162 => (
                    [
                        refusal::<162, Nodes<'static>>(embedded.blob(), &scaled(&rows), &nodes),
                        refusal::<162, Vertices>(plain.blob(), &scaled(&nodes), &vertices),
                    ],
                    false,
                ),
                120 => (
                    [
                        refusal::<120, Nodes<'static>>(embedded.blob(), &scaled(&rows), &nodes),
                        refusal::<162, Vertices>(plain.blob(), &scaled(&nodes), &vertices),
                    ],
                    true,
                ),
                other => unreachable!("{other} nodes"),
            };
            if is_counted {
                assert_eq!(on_nodes, ReceiveError::RowCount { rows: 162 });
                assert_eq!(on_vertices, ReceiveError::RowCount { rows: 120 });
            } else {
                assert!(matches!(on_nodes, ReceiveError::Stretch(_)), "{on_nodes:?}");
                assert!(matches!(on_vertices, ReceiveError::Stretch(_)), "{on_vertices:?}");
            }
        }
    }
}

/// A node beyond the reach is refused by its row, even if no element has it.
#[test]
fn a_node_beyond_the_reach_is_refused_and_counted() {
    let heart = generate::heart(320).expect("a valid size").mesh;
    let lattice = Volume::lattice(&heart, [4, 4, 4]).expect("a lattice");
    let more = [lattice.nodes(), &[lattice.nodes()[0]]].concat();
    let volume = Volume::new(more, lattice.tetrahedra().to_vec()).expect("valid");
    let embedded = Builder::new().stretch(3.0).nodes(&volume).build(&heart).expect("held");
    let nodes: Vec<Vec3> = volume.nodes().iter().map(|node| node.as_vec3()).collect();
    for row in [57, 125] {
        let mut far = nodes.clone();
        far[row].y = 1e6;
        let refused = refusal::<126, Nodes<'static>>(embedded.blob(), &far, &nodes);
        assert_eq!(refused, ReceiveError::TooFar { row: row as u32 });
    }
}

/// The refusal of a frame, which is counted, and after which a good one is published.
fn refusal<const N: usize, R: Rows>(blob: &[u8], frame: &[Vec3], good: &[Vec3]) -> ReceiveError {
    let surface: &Surface<N, R> = Box::leak(Box::new(Surface::new()));
    let limits = GuardLimits::new(20.0, Millis(100));
    let (mut bus, _) = surface.start::<u16, 64, 96>(TreeBytes::new(blob), limits).expect("valid");
    let mesh_id = Tree::<u16>::from_bytes(blob).expect("valid").mesh_id();
    let mut refused = None;
    for (now, rows) in [(1_000, frame), (1_001, good)] {
        let packets = packets(mesh_id, now, rows);
        let sent =
            packets.iter().try_for_each(|packet| bus.packet(packet, Millis(now)).map(|_| ()));
        let outcome = sent.and_then(|()| {
            loop {
                match bus.work(100) {
                    Ok(Advance::Pending) => (),
                    other => return other,
                }
            }
        });
        match outcome {
            Ok(advance) => assert_eq!(advance, Advance::Published { epoch: 1_001 }),
            Err(error) => {
                let counters = bus.counters();
                assert_eq!((counters.of(error.event()), counters.rejected()), (1, 1), "{error:?}");
                refused = Some(error);
            }
        }
    }
    assert_eq!(bus.surface().map(|frame| frame.epoch()), Some(Some(1_001)));
    refused.expect("another kind")
}
