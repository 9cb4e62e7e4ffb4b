//! Vertices outside of the volume that moves them, bound to the nearest tetrahedron.

// Requirement: F-07

use dibs_build::{BuildError, Builder, BuiltTree, Mesh, Volume, VolumeError, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::{NodeMonitor, Nodes, NodesError};
use dibs_nostd::{
    Admission, AdmissionCheck, FrameExtent, IncomingSurface, Millis, MovingSurface, Options,
    Sphere, StretchError, SurfaceLimits, Tracker, Tree, VertexTable,
};
use dibs_tests::embedded::{cover, exact, hull, rest, rows, sections, shrunk};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::tree_bytes::{reseal, section};
use dibs_tests::{sample, surfaces};
use fastrand::Rng;
use glam::Vec3;

fn heart() -> (Mesh, Volume) {
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let volume = hull(&mesh, [5, 4, 4], &mut Rng::with_seed(70));
    (mesh, volume)
}

fn built() -> BuiltTree {
    let (mesh, volume) = heart();
    let smaller = shrunk(&volume, 0.85, 20.0);
    Builder::new().stretch(1.4).nodes(&smaller).build(&mesh).expect("bound")
}

/// The vertex with the largest sum of the weights' magnitudes.
fn farthest_out(nodes: &Nodes<'_>) -> (u32, i32) {
    let sizes = |row| {
        let weights = nodes.weights(row).expect("in the table");
        weights.iter().map(|(_, weight)| weight.abs()).sum()
    };
    let all = (0..nodes.vertex_count()).map(|row| (row, sizes(row)));
    all.max_by_key(|&(_, sizes)| sizes).expect("not empty")
}

/// Nodes moved by this step each, in the directions that move a vertex farthest.
fn levered(nodes: &Nodes<'_>, frame: &[Vec3], vertex: u32, step: Vec3) -> Vec<Vec3> {
    let mut next = frame.to_vec();
    for (node, weight) in nodes.weights(vertex).expect("in the table") {
        next[node as usize] += if weight < 0 { -step } else { step };
    }
    next
}

/// At rest a vertex is at its position in the mesh, up to the rounding of its weights, and the tree states by what
/// factor it can move farther than the nodes.
#[test]
fn weights_carry_vertices_outside() {
    let (mesh, _) = heart();
    let built = built();
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let rest = rest(&nodes);
    let mut outside = 0;
    for row in 0..nodes.vertex_count() {
        let weights = nodes.weights(row).expect("in the table");
        assert_eq!(weights.iter().map(|(_, weight)| weight).sum::<i32>(), 65_536);
        outside += u32::from(weights.iter().any(|(_, weight)| *weight < 0));
        let number = tree.vertex_number(row).expect("ordered").0;
        let away = exact(&nodes, &rest, row).distance(mesh.positions[number as usize].as_dvec3());
        assert!(away * f64::from(tree.stretch()) <= f64::from(tree.position_error()), "{away}");
    }
    let stated = f64::from(nodes.amplification());
    let most = f64::from(farthest_out(&nodes).1) / 65_536.0;
    assert!(most <= stated && stated < most * 1.0001 && most > 1.3, "{most} {stated}");
    assert!(outside > 100 && outside < nodes.vertex_count() - 100, "{outside}");
    assert!(tree.position_error() < 5e-3, "{}", tree.position_error());
}

/// Climbs, over the positions of the nodes that move a section, towards a vertex outside the sphere: there is none,
/// although lines between vertices outside are seldom paths through the volume.
#[test]
fn coverage_holds_outside() {
    let mut rng = Rng::with_seed(72);
    let mut highest = 0.0_f64;
    for (cells, part) in [([5, 4, 4], 0.85), ([3, 3, 3], 0.75)] {
        let mesh = generate::heart(1_000).expect("a valid size").mesh;
        let volume = shrunk(&hull(&mesh, cells, &mut rng), part, 40.0);
        let built = Builder::new().stretch(2.0).nodes(&volume).build(&mesh).expect("bound");
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let sections = sections(&tree);
        let is_outside = |row: u32| {
            nodes.weights(row).expect("in the table").iter().any(|(_, weight)| *weight < 0)
        };
        let outside: Vec<_> = sections.iter().filter(|section| is_outside(section.pin)).collect();
        for _ in 0..sample(200) {
            let section = outside[rng.usize(..outside.len())];
            let share = cover(&nodes, section, 300, &mut rng);
            assert!(share <= 1.0, "{share} {}", section.radius);
            highest = highest.max(share);
        }
    }
    assert!(highest > 0.98, "{highest}");
}

/// A vertex outside moves towards the tool as fast as possible, and the tracker's answer stays correct.
#[test]
fn a_tracker_counts_the_lever() {
    let built = built();
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let triangles = surfaces::triangles(&tree);
    let rest = rest(&nodes);
    let (vertex, _) = farthest_out(&nodes);
    let mut rng = Rng::with_seed(71);
    for _ in 0..sample(24) {
        let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(&tree).expect("deep enough");
        let mut odometer = nodes.odometer();
        let at = exact(&nodes, &rest, vertex).as_vec3();
        let outwards = (at - rest.iter().sum::<Vec3>() / rest.len() as f32).normalize();
        let aside = Vec3::from([(); 3].map(|()| rng.f32() - 0.5));
        let centre = at + (outwards + aside).normalize() * (5.0 + 10.0 * rng.f32());
        let tool = Sphere::new(centre, 1.0).expect("finite");
        let mut frame = rest.clone();
        let _ = odometer.start(frame.as_slice());
        let step = (centre - at).normalize() * (0.01 + 0.05 * rng.f32());
        for number in 0..120 {
            let step = if number % 40 < 30 { step } else { -step };
            let next = levered(&nodes, &frame, vertex, step);
            let Ok(measured) = nodes.measure(next.as_slice()) else { break };
            let moved = odometer.step(frame.as_slice(), next.as_slice());
            let moved = moved.after();
            let surface = nodes.surface(&moved);
            assert!(surface.motion().is_some());
            let options = Options::new().stretch(measured);
            let answer = tracker.closest(&surface, &tool, &options).expect("sound").closest;
            let truth = exhaustive(&rows(&surface), &triangles, &Instrument::sphere(centre, 1.0));
            let error = truth.expect("has triangles").separation - f64::from(answer.separation);
            assert!(error.abs() <= f64::from(answer.accuracy), "{error} {answer:?}");
            frame = next;
        }
    }
}

/// No vertex of an admitted frame moved faster than the limit, however far outside it is; and its error is stated.
#[test]
fn limits_are_those_of_vertices() {
    let built = built();
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let rest = rest(&nodes);
    let (vertex, _) = farthest_out(&nodes);
    let limits = SurfaceLimits::reach_mm(500.0).speed(0.1);
    let mut monitor = NodeMonitor::new(&nodes).limits(limits);
    let (mut admitted, mut refused) = (0.0_f64, f64::INFINITY);
    for number in 1..200 {
        let next = levered(&nodes, &rest, vertex, Vec3::X * 0.01 * number as f32);
        monitor.begin(FrameExtent::Whole);
        let incoming = IncomingSurface::new(&next[..], nodes.count());
        let incoming = IncomingSurface { before: Some((&rest[..], Millis(9))), ..incoming };
        let way = exact(&nodes, &next, vertex).distance(exact(&nodes, &rest, vertex));
        match monitor.advance(incoming, u32::MAX) {
            Ok(Admission::Admitted(_)) => admitted = admitted.max(way),
            Err(StretchError::TooFast { .. }) => refused = refused.min(way),
            other => panic!("{other:?}"),
        }
    }
    assert!(admitted <= 1.0 && admitted > 0.97 && refused < 1.03, "{admitted} {refused}");
    // A table's error is amplified like its motion.
    let surface = nodes.surface(rest.as_slice());
    let erroneous = surfaces::Inexact(&rest, 0.25);
    let stated = nodes.surface(&erroneous).position_error() - surface.position_error();
    assert!((stated - 0.25 * nodes.amplification()).abs() < 1e-6, "{stated}");
}

/// Vertices beyond the distance, and those with too large an amplification of the nodes' errors, are refused.
#[test]
fn vertices_too_far_outside_are_refused() {
    let (mesh, volume) = heart();
    let build = |volume: &Volume| match Builder::new().nodes(volume).build(&mesh) {
        Err(BuildError::Volume(error)) => Some(error),
        Err(other) => panic!("{other}"),
        Ok(_) => None,
    };
    let error = build(&shrunk(&volume, 0.85, 0.0));
    let Some(VolumeError::Outside { count, distance, .. }) = error else { panic!("{error:?}") };
    assert!(count > 100 && distance < 20.0, "{count} {distance}");
    assert_eq!(build(&shrunk(&volume, 0.85, distance)), None);
    let fewer = build(&shrunk(&volume, 0.85, distance * 0.9));
    let Some(VolumeError::Outside { count: left, distance: far, .. }) = fewer else {
        panic!("{fewer:?}");
    };
    assert!(left > 0 && left < count && far == distance, "{left} {far}");
    assert_eq!(build(&shrunk(&volume, 0.85, f64::NAN)), error);
    let error = build(&shrunk(&volume, 0.3, 1_000.0));
    assert!(matches!(error, Some(VolumeError::Lever { .. })), "{error:?}");
    // A lattice contains its own surface, but not another one: its lines are then no longer all paths.
    let lattice = Volume::lattice(&mesh, [3, 3, 3]).expect("a lattice").bind_within(5.0);
    let inside = Builder::new().nodes(&lattice).build(&mesh).expect("held");
    let nodes = Nodes::of(&inside.tree::<u16>().expect("valid")).expect("valid").amplification();
    assert_eq!(nodes, 1.0);
    let mut larger = mesh.clone();
    larger.positions.iter_mut().for_each(|at| *at *= 1.05);
    assert!(Builder::new().nodes(&lattice).build(&larger).is_ok());
}

/// Weights of a tree whose vertices are all inside are unsigned, and no amplification exceeds the factor that the
/// limits assume.
#[test]
fn damaged_levers_are_refused() {
    let built = built();
    let defect = |change: &dyn Fn(&mut [u8])| {
        let mut bytes = built.blob().to_vec();
        let (at, length) = section(&bytes, 11);
        change(&mut bytes[at..][..length]);
        reseal(&mut bytes);
        let tree = Tree::<u16>::from_bytes(&bytes).expect("the tree itself is well formed");
        Nodes::of(&tree).err()
    };
    assert_eq!(defect(&|_| ()), None);
    let marks = {
        let tree = built.tree::<u16>().expect("valid");
        Nodes::of(&tree).expect("valid").count().div_ceil(32) as usize
    };
    let of = |row: usize, weights: [u16; 3], length: usize, bytes: &mut [u8]| {
        let vertices = built.vertex_order().len();
        let at = length - 4 * marks - 8 * vertices + 8 * row + 2;
        for (at, weight) in (at..).step_by(2).zip(weights) {
            bytes[at..at + 2].copy_from_slice(&weight.to_le_bytes());
        }
    };
    // 1.5 and -0.5 have an amplification of two; 2 less a unit and -1 of three less two units.
    let (zero, one) = (32_768, 16_384);
    let with = |weights: [u16; 3]| defect(&|bytes| of(3, weights, bytes.len(), bytes));
    assert_eq!(with([zero + one / 2 * 3, zero - one / 2, zero]), None);
    assert_eq!(with([u16::MAX, zero - one + 1, zero]), None);
    let too_long = Some(NodesError::Weights { vertex: 3, sum: 3 * 65_536 });
    assert_eq!(with([u16::MAX, zero - one, zero]), too_long);
    let longest = [0, 0, 0];
    let sum = 4 * (3 * 32_768 + (16_384 + 3 * 32_768));
    assert_eq!(with(longest), Some(NodesError::Weights { vertex: 3, sum }));
    // As unsigned weights their sum exceeds the whole.
    let unsigned = defect(&|bytes| bytes[16..20].copy_from_slice(&[0; 4]));
    assert!(matches!(unsigned, Some(NodesError::Weights { vertex: 0, .. })), "{unsigned:?}");
}
