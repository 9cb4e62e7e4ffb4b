//! Nodes that carry no vertex do not count towards a surface's motion, and no limit on speed applies to them.

// Requirement: F-07

use dibs_build::{Builder, Volume, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::nodes::{NodeMonitor, Nodes};
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
use dibs_nostd::{
    Advance, Assembler, Frames, Millis, Odometer, Options, ReceiveError, Sphere, StretchError,
    SurfaceLimits, Tracker,
};
use dibs_tests::bus::collect;
use dibs_tests::embedded::rest;
use glam::Vec3;

const NODES: usize = 210;

/// One node at a time moves: counted, and limited in speed, if a vertex has a weight for it, and only then; over the
/// bus and by an odometer.
#[test]
fn only_nodes_that_carry_a_vertex_count() {
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let lattice = Volume::lattice(&mesh, [4, 5, 6]).expect("a lattice");
    let built = Builder::new().stretch(1.5).nodes(&lattice).build(&mesh).expect("held");
    let tree = built.tree::<u16>().expect("valid");
    let nodes = Nodes::of(&tree).expect("valid");
    let mut carries = [false; NODES];
    for (node, weight) in (0..nodes.vertex_count()).filter_map(|row| nodes.weights(row)).flatten() {
        carries[node as usize] |= weight != 0;
    }
    let idle = carries.iter().filter(|&&carries| !carries).count();
    assert!((10..100).contains(&idle), "{idle}");
    let frames: &'static Frames<NODES, 3> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("once");
    let limits = SurfaceLimits::reach_mm(500.0).speed(0.1);
    let admission_check = NodeMonitor::new(&nodes).limits(limits);
    let mut assembler = Assembler::new(writer, admission_check, tree.mesh_id(), 500.0);
    let (rest, mut odometer, mut epoch) = (rest(&nodes), nodes.odometer(), 0);
    let mut tracker = Tracker::<u16, MAX_STACK, 96>::new(&tree).expect("deep enough");
    let mut publish = |positions: &[Vec3]| {
        epoch += 1;
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let sender = FrameEncoder::<_, 512>::new(id, Encoding::Float, positions).expect("valid");
        let mut state = Ok(Advance::Idle);
        for packet in collect(sender) {
            let _ = assembler.accept(&packet, Millis(10 * epoch)).expect("taken");
            state = assembler.advance(u32::MAX);
            if state.is_err() {
                break;
            }
        }
        let frame = reader.read().expect("published");
        let tool = Sphere::new(Vec3::new(60.0, 0.0, 20.0), 2.5).expect("finite");
        let answer = tracker.closest(&nodes.surface(&frame), &tool, &Options::new());
        state.map(|_| answer.expect("sound").moved)
    };
    for (node, carries) in carries.into_iter().enumerate() {
        publish(&rest).expect("good");
        let [near, far] = [0.5, 3.0].map(|by: f32| {
            let mut moved = rest.clone();
            moved[node].z += by;
            moved
        });
        let moved = publish(&near).expect("slow enough").expect("measured");
        assert_eq!(moved > 0.4, carries, "{node} {moved}");
        assert!(carries || moved < 0.01, "{node} {moved}");
        let (from, to) = (nodes.surface(&rest[..]), nodes.surface(&near[..]));
        assert_eq!(from.step(&to, &mut odometer).length() > 0.4, carries, "{node}");
        // An odometer of vertices is replaced.
        let mut other = Odometer::new(&tree);
        assert_eq!(from.step(&to, &mut other).length() > 0.4, carries, "{node}");
        publish(&rest).expect("good");
        match publish(&far) {
            Ok(_) => assert!(!carries, "{node}"),
            Err(ReceiveError::Stretch(StretchError::TooFast { vertex, .. })) => {
                assert!(carries && vertex as usize == node, "{node} {vertex}");
            }
            Err(error) => panic!("{error}"),
        }
        // The last good one stays: the next starts there.
        if !carries {
            publish(&rest).expect("good");
        }
    }
}
