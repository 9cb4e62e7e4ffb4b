//! A tracker's front: every triangle is below exactly one of its nodes, at every tick.

// Requirement: T-01

use dibs_build::{Builder, generate};
use dibs_nostd::format::{MAX_STACK, NodeLink};
use dibs_nostd::{Odometer, Options, Sphere, Tracker, Tree};
use glam::Vec3;

/// How many of the front's nodes are above each triangle.
fn covers(tree: &Tree<'_, u16>, front: &[u32]) -> Vec<u32> {
    let mut covers = vec![0; tree.triangle_count() as usize];
    let mut below = front.to_vec();
    while let Some(row) = below.pop() {
        match tree.node(row).expect("a node").2 {
            NodeLink::Children { first, count } => below.extend(first..first + count),
            NodeLink::Leaf { first, count } => {
                (first..first + count).for_each(|triangle| covers[triangle as usize] += 1);
            }
        }
    }
    covers
}

#[test]
fn every_triangle_is_below_one_node_of_the_front() {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let rows = built.to_rows(&mesh.positions);
    let mut tracker = Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough");
    assert_eq!((tracker.tree().checksum(), tracker.front().count()), (tree.checksum(), 0));
    let mut odometer = Odometer::new(&tree);
    let (mut before, mut sizes) = (rows.clone(), Vec::new());
    for tick in 0..120_u16 {
        let t = f32::from(tick);
        let now: Vec<Vec3> =
            rows.iter().map(|&row| row + Vec3::X * (t * 0.05).sin() * 0.5).collect();
        let surface = match tick {
            0 => odometer.start(now.as_slice()),
            _ => odometer.step(before.as_slice(), now.as_slice()).after(),
        };
        let tool = Sphere::new(Vec3::new(60.0, t * 0.2 - 10.0, 5.0), 2.0).expect("valid");
        tracker.closest(&surface, &tool, &Options::new()).expect("an answer");
        let front: Vec<u32> = tracker.front().collect();
        assert!(covers(&tree, &front).iter().all(|&above| above == 1), "tick {tick}: {front:?}");
        sizes.push(front.len());
        before = now;
    }
    // It reaches leaves, and changes with the motion.
    let leaves = tracker
        .front()
        .filter(|&row| matches!(tree.node(row).expect("a node").2, NodeLink::Leaf { .. }));
    assert!(leaves.count() > 0 && sizes.iter().any(|&size| size != sizes[0]), "{sizes:?}");
    // A tree of one leaf.
    let small = generate::heart(320).expect("a valid size").mesh;
    let one = dibs_build::Mesh {
        positions: small.triangles[0].map(|vertex| small.positions[vertex as usize]).to_vec(),
        triangles: vec![[0, 1, 2]],
        ..dibs_build::Mesh::default()
    };
    let built = Builder::new().build(&one).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let mut tracker = Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let rows = built.to_rows(&one.positions);
    let mut odometer = Odometer::new(&tree);
    let tool = Sphere::new(Vec3::new(60.0, 0.0, 5.0), 2.0).expect("valid");
    tracker.closest(&odometer.start(rows.as_slice()), &tool, &Options::new()).expect("an answer");
    assert_eq!(tracker.front().collect::<Vec<u32>>(), [0]);
}
