//! The spheres to draw, against their definition.

// Requirement: P-09

use std::collections::HashSet;

use dibs_build::{Builder, Volume, generate};
use dibs_nostd::Capsule;
use dibs_nostd::format::NodeLink;

use super::*;

/// As `dibs view` packs a motion.
fn pack(frames: &[Vec<Vec3>]) -> Vec<u8> {
    let mut before = vec![[0_u32; 3]; frames[0].len()];
    let mut codes = Vec::new();
    for frame in frames {
        for (before, now) in before.iter_mut().zip(frame) {
            let bits = now.to_array().map(f32::to_bits);
            for (old, new) in before.iter().zip(bits) {
                let change = new.wrapping_sub(*old).cast_signed();
                codes.push(((change << 1) ^ (change >> 31)).to_le_bytes());
            }
            *before = bits;
        }
    }
    (0..4).flat_map(|plane| codes.iter().map(move |code| code[plane])).collect()
}

/// A small heart's session, and its frames.
fn heart() -> (LoadedSession<u16>, Vec<Vec<Vec3>>) {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).unwrap();
    let built = Builder::new().stretch(2.0).build(&mesh).unwrap();
    let frames: Vec<Vec<Vec3>> = motion.frames.iter().map(|frame| built.to_rows(frame)).collect();
    let tree = Tree::from_bytes(built.blob().to_vec().leak()).unwrap();
    (LoadedSession::new(tree, &pack(&frames), 30.0).unwrap(), frames)
}

/// The instrument at a tick: it comes from outside and goes through the wall.
fn pose(tick: u32) -> [f32; 7] {
    let x = 110.0 - 0.6 * tick as f32;
    [x, -10.0, 40.0, x + 60.0, -20.0, 70.0, 2.5]
}

/// From the instrument's axis.
fn distance(tool: &Capsule, point: Vec3) -> f32 {
    let way = tool.end() - tool.start();
    let share = (point - tool.start()).dot(way) / way.length_squared();
    point.distance(tool.start() + way * share.clamp(0.0, 1.0))
}

fn triangles_below(tree: &Tree<'_, u16>, row: u32) -> Vec<u32> {
    match tree.node(row).unwrap().2 {
        NodeLink::Leaf { first, count } => (first..first + count).collect(),
        NodeLink::Children { first, count } => {
            (first..first + count).flat_map(|row| triangles_below(tree, row)).collect()
        }
    }
}

#[test]
fn unpacked_motion_has_the_bits_of_the_packed() {
    let (session, frames) = heart();
    let unpacked = session.motion.frames.iter().map(|frame| frame.positions().to_vec());
    assert_eq!(unpacked.collect::<Vec<_>>(), frames);
}

#[test]
fn every_triangle_is_below_one_node_of_the_front() {
    let (mut session, _) = heart();
    for tick in 0..150 {
        let (before, now) = (f64::from(tick) / 1e3, f64::from(tick + 1) / 1e3);
        session.advance(&pose(tick), &pose(tick + 1), [before, now], 1).unwrap();
        let front: Vec<u32> = session.tracker.front().collect();
        let mut below: Vec<u32> =
            front.iter().flat_map(|&row| triangles_below(&session.tree, row)).collect();
        below.sort_unstable();
        assert_eq!(below, (0..session.tree.triangle_count()).collect::<Vec<_>>(), "tick {tick}");
        assert!(front.len() > 10, "{} nodes", front.len());
    }
}

#[test]
fn tested_spheres_are_those_of_opened_nodes() {
    let (mut session, _) = heart();
    session.settings().search = Search::Cold;
    for tick in (0..150).step_by(10) {
        session.advance(&pose(tick), &pose(tick), [0.2, 0.2], 1).unwrap();
        let Some(Instrument::Capsule(tool)) = session.now.tool else { panic!("a capsule") };
        let recorder = Recorder::new(&session.now.surface);
        let mut query = Query::<u16, STACK>::new(&session.tree).unwrap();
        let options = session.options().unsigned();
        let answer = query.closest(&recorder, &tool, &options).unwrap();
        let tested = spheres::tested(&session.tree, &recorder.into_reads());
        let set: HashSet<u32> = tested.iter().copied().collect();
        assert_eq!(set.len(), tested.len(), "no node twice");
        assert!(tested.len() <= answer.node_tests as usize, "{} {answer:?}", tested.len());
        // A node whose sphere comes nearer than the answer cannot have been left closed.
        for &row in &tested {
            let (pin, radius, link) = session.tree.node(row).unwrap();
            let pin = session.now.surface.position(pin).unwrap();
            let distance = distance(&tool, pin);
            let NodeLink::Children { first, count } = link else { continue };
            let is_open = (first..first + count).all(|child| set.contains(&child));
            let bound = distance - radius * session.now.stretch.sigma();
            assert!(is_open || bound > answer.axis_distance - 1e-3, "node {row}, tick {tick}");
        }
    }
}

#[test]
fn contacts_move_as_the_surface_does() {
    let (mut session, frames) = heart();
    // Beside the wall, in the contraction.
    let pose = [75.0, -10.0, 40.0, 135.0, -20.0, 70.0, 2.5];
    session.settings().margin = 60.0;
    for between in [Interpolation::Interpolated, Interpolation::Extrapolated] {
        session.settings().between = between;
        session.restart();
        let seconds = |tick: u32| f64::from(tick) / 1e3;
        // From the third frame's time to the fourth's, so that both have come.
        session.advance(&pose, &pose, [seconds(100), seconds(110)], 10).unwrap();
        let touching = session.touching().unwrap();
        assert!(!touching.contacts.is_empty());
        for contact in &touching.contacts {
            let at = |surface: &Surface| {
                let corner = |row| surface.position(row).unwrap();
                let corners = contact.corners.map(corner).into_iter().zip(contact.barycentric);
                corners.map(|(corner, weight)| weight * corner).sum::<Vec3>()
            };
            let before = at(&session.now.surface);
            session.advance(&pose, &pose, [seconds(110), seconds(111)], 1).unwrap();
            let moved = (at(&session.now.surface) - before) * 1e3;
            assert!(moved.length() > 1.0, "{between:?}: {moved}");
            assert!(
                moved.distance(contact.velocity) < 0.1 + 0.01 * moved.length(),
                "{between:?}: {moved}"
            );
            session.advance(&pose, &pose, [seconds(110), seconds(110)], 1).unwrap();
            assert!(session.touching().unwrap().contacts.iter().all(|c| c.velocity == Vec3::ZERO));
        }
    }
    session.settings().between = Interpolation::Held;
    session.advance(&pose, &pose, [0.110, 0.111], 1).unwrap();
    assert!(session.touching().unwrap().contacts.iter().all(|c| c.velocity == Vec3::ZERO));
    assert!(frames.len() > 4);
}

/// A lattice moves the heart: the surface is the one that its nodes give, at their frames, between and beyond, and is asked as
/// vertices are.
#[test]
fn nodes_move_the_surface() {
    use dibs_nostd::nodes::Nodes;

    let mesh = generate::heart(1_000).unwrap().mesh;
    let lattice = Volume::lattice(&mesh, [3, 3, 4]).unwrap();
    let built = Builder::new().stretch(1.5).nodes(&lattice).build(&mesh).unwrap();
    let frame = |number: usize| -> Vec<Vec3> {
        let by = 0.02 * (number as f64 * 0.8).sin();
        lattice.nodes().iter().map(|at| (*at * (1.0 + by)).as_vec3()).collect()
    };
    let frames: Vec<Vec<Vec3>> = (0..8).map(frame).collect();
    let tree: Tree<'_, u16> = Tree::from_bytes(built.blob().to_vec().leak()).unwrap();
    let nodes = Nodes::of(&tree).unwrap();
    let mut session = LoadedSession::new(tree, &pack(&frames), 30.0).unwrap();
    for (number, between) in
        [Interpolation::Held, Interpolation::Interpolated, Interpolation::Extrapolated]
            .into_iter()
            .enumerate()
    {
        session.settings().between = between;
        session.restart();
        for tick in 0..250 {
            let (before, now) = (f64::from(tick) / 1e3, f64::from(tick + 1) / 1e3);
            session.advance(&pose(tick), &pose(tick + 1), [before, now], 1).unwrap();
            let [a, b] = [session.before, session.last].map(|frame| &frames[frame]);
            let part = [1.0, session.motion.share(now), 1.0 + session.motion.share(now)][number];
            let at = a.iter().zip(b).map(|(&a, &b)| a + (b - a) * part).collect::<Vec<Vec3>>();
            let shown: Vec<f32> = at.iter().flat_map(Vec3::to_array).collect();
            assert_eq!(session.nodes(), shown, "{between:?}, tick {tick}");
            let stretch = nodes.measure(at.as_slice()).unwrap();
            assert!(session.stretch() >= stretch.sigma() - 1e-5);
            let surface = nodes.surface(at.as_slice());
            for row in (0..nodes.vertex_count()).step_by(17) {
                let [shown, own] =
                    [session.now.surface.position(row), surface.position(row)].map(Option::unwrap);
                assert!(shown.distance(own) < 1e-3, "{between:?}, tick {tick}: {shown} {own}");
            }
            assert!(session.now.surface.position_error() > 0.0);
            let tool = session.now.tool.as_ref().unwrap();
            let Instrument::Capsule(tool) = tool else { panic!("a capsule") };
            let mut query = Query::<u16, STACK>::new(&tree).unwrap();
            let truth = query.closest(&surface, tool, &Options::cold()).unwrap();
            let shown = session.answer().unwrap();
            // A depth is known to its tolerance.
            let (truth, shown) = (truth.interval(), shown.interval());
            let is_apart = truth.lower > shown.upper + 2e-3 || shown.lower > truth.upper + 2e-3;
            assert!(!is_apart, "{between:?}, tick {tick}: {truth:?} {shown:?}");
        }
    }
    assert_eq!(session.positions().len(), 3 * nodes.vertex_count() as usize);
    let rest = LoadedSession::new(tree, &[], 1.0).unwrap();
    assert_eq!(rest.motion.frames.len(), 1);
}

/// A larger limit helps a stretched frame, and never an inverted element.
#[test]
fn a_refused_frame_is_told_with_its_remedy() {
    let mesh = generate::heart(1_000).unwrap().mesh;
    let lattice = Volume::lattice(&mesh, [3, 3, 4]).unwrap();
    let built = Builder::new().stretch(1.5).nodes(&lattice).build(&mesh).unwrap();
    let tree = Tree::<u16>::from_bytes(built.blob()).unwrap();
    let refused = |by: Vec3| {
        let frame = lattice.nodes().iter().map(|at| at.as_vec3() * by).collect();
        Motion::new(&tree, &pack(&[frame]), 30.0).unwrap_err().to_string()
    };
    let inverted = refused(Vec3::new(-1.0, 1.0, 1.0));
    assert!(inverted.ends_with("no stretch limit admits that, mend the frame"), "{inverted}");
    assert!(!inverted.contains("--"), "{inverted}");
    let stretched = refused(Vec3::splat(2.0));
    assert!(stretched.contains("a larger --stretch"), "{stretched}");
}
