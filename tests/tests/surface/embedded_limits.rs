//! Limits of stretch for each tetrahedron, learned from a motion of the nodes.

// Requirement: F-07

use dibs_build::{Builder, BuiltTree, Mesh, Motion, MotionStretch, Volume, generate};
use dibs_nostd::nodes::Nodes;
use dibs_tests::embedded::{cover, hull, rest, sections, shrunk, stretch_of};
use dibs_tests::sample;
use fastrand::Rng;
use glam::Vec3;

/// A heart in a lattice and in two volumes that are not boxes, one of them with vertices outside.
fn hearts(rng: &mut Rng) -> (Mesh, Vec<Volume>) {
    let mesh = generate::heart(1_000).expect("a valid size").mesh;
    let hull = hull(&mesh, [7, 6, 5], rng);
    let lattice = Volume::lattice(&mesh, [4, 4, 4]).expect("a lattice");
    let volumes = vec![lattice, shrunk(&hull, 0.9, 20.0), hull];
    (mesh, volumes)
}

/// A motion that stretches only one side.
fn motion(volume: &Volume) -> Motion {
    let frame = |number: usize| {
        let by = 0.4 * (number as f64 * 0.7).sin();
        let at = |at: &glam::DVec3| {
            let along = (at.x - 10.0).max(0.0);
            (*at + glam::DVec3::X * along * by.max(-0.1)).as_vec3()
        };
        volume.nodes().iter().map(at).collect::<Vec<Vec3>>()
    };
    Motion { frames: (0..9).map(frame).collect(), rate: 30.0, ..Motion::default() }
}

fn limits(volume: &Volume) -> Vec<f32> {
    MotionStretch::of_nodes(volume, &motion(volume), &|_| ()).expect("fits").limits(0.02)
}

fn built(mesh: &Mesh, volume: &Volume, limits: Vec<f32>) -> BuiltTree {
    Builder::new().limits(limits).nodes(volume).build(mesh).expect("bound")
}

/// The stretch in f64 equals that of an independent computation, and a tree with the learned limits admits every frame
/// of the motion, with smaller spheres than with one limit for all.
#[test]
fn limits_are_learned_from_nodes() {
    let mut rng = Rng::with_seed(80);
    let (mesh, volumes) = hearts(&mut rng);
    for volume in &volumes {
        let motion = motion(volume);
        let needed = MotionStretch::of_nodes(volume, &motion, &|_| ()).expect("fits");
        for needed in needed.triangles() {
            let corners = volume.tetrahedra()[needed.triangle];
            let rest = corners.map(|node| volume.nodes()[node as usize].as_vec3());
            let now = corners.map(|node| motion.frames[needed.frame][node as usize]);
            let (stretch, _) = stretch_of(rest, now);
            assert!((stretch - needed.stretch).abs() < 1e-5, "{stretch} {needed:?}");
        }
        // Even without a margin, because the limits include the check's rounding.
        let learned = built(&mesh, volume, needed.limits(0.0));
        let tree = learned.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        for frame in &motion.frames {
            assert!(nodes.measure(frame.as_slice()).is_ok());
        }
        assert!(tree.stretch() > 1.35 && tree.stretch() < 1.42, "{}", tree.stretch());
        let uniform = Builder::new().stretch(tree.stretch()).nodes(volume).build(&mesh);
        let uniform = uniform.expect("bound");
        let sum = |tree: &BuiltTree| -> f64 {
            let tree = tree.tree::<u16>().expect("valid");
            sections(&tree).iter().map(|section| section.radius).sum()
        };
        let part = sum(&learned) / sum(&uniform);
        assert!(part < 0.9, "{part}");
    }
    let other = motion(&volumes[0]);
    assert!(MotionStretch::of_nodes(&volumes[1], &other, &|_| ()).is_err());
}

/// Climbs towards a vertex outside its sphere, where neighbours have different limits.
#[test]
fn coverage_holds_with_limits_of_each() {
    let mut rng = Rng::with_seed(81);
    let (mesh, volumes) = hearts(&mut rng);
    let mut highest = [0.0_f64; 3];
    for (volume, highest) in volumes.iter().zip(&mut highest) {
        let all = volume.tetrahedra().len();
        let random = (0..all).map(|_| 1.05 + rng.f32() * rng.f32()).collect();
        for limits in [limits(volume), random] {
            let built = built(&mesh, volume, limits);
            let tree = built.tree::<u16>().expect("valid");
            let nodes = Nodes::of(&tree).expect("valid");
            let sections = sections(&tree);
            for _ in 0..sample(80) {
                let section = &sections[rng.usize(..sections.len())];
                let share = cover(&nodes, section, 300, &mut rng);
                assert!(share <= 1.0, "{share} {}", section.radius);
                *highest = highest.max(share);
            }
        }
    }
    assert!(highest.iter().all(|part| *part > 0.9), "{highest:?}");
}

/// No admitted frame stretches an element beyond its own limit, in f64, and frames are refused only there.
#[test]
fn no_element_goes_beyond_its_own_limit() {
    let mut rng = Rng::with_seed(82);
    let (mesh, volumes) = hearts(&mut rng);
    let (mut closest, mut refused) = (0.0_f64, 0);
    for volume in &volumes {
        let all = volume.tetrahedra().len();
        let limits: Vec<f32> = (0..all).map(|_| 1.05 + rng.f32() * rng.f32()).collect();
        let built = built(&mesh, volume, limits.clone());
        let tree = built.tree::<u16>().expect("valid");
        let nodes = Nodes::of(&tree).expect("valid");
        let rest = rest(&nodes);
        // The tree's limits are below the builder's by the check's rounding.
        let sorted = |mut limits: Vec<f32>| {
            limits.sort_by(f32::total_cmp);
            limits
        };
        let told = (0..nodes.element_count()).filter_map(|element| nodes.element_limit(element));
        let (told, given) = (sorted(told.collect()), sorted(limits.clone()));
        assert!(
            told.iter().zip(&given).all(|(told, given)| (0.999..1.00001).contains(&(told / given)))
        );
        let least = built.summary().least_stretch_limit;
        assert!((least - given[0]).abs() < 2e-5, "{least} {}", given[0]);
        for _ in 0..sample(1_200) {
            let mut next = rest.clone();
            let by = Vec3::from([(); 3].map(|()| rng.f32() - 0.5)) * 30.0 * rng.f32();
            next[rng.usize(..rest.len())] += by;
            let part = |(corners, limit): (&[u32; 4], &f32)| {
                let [rest, now] =
                    [&rest, &next].map(|frame| corners.map(|node| frame[node as usize]));
                let (stretch, determinant) = stretch_of(rest, now);
                (stretch / f64::from(*limit), determinant > 0.0)
            };
            let parts: Vec<_> = volume.tetrahedra().iter().zip(&limits).map(part).collect();
            let most = parts.iter().map(|(part, _)| *part).fold(0.0, f64::max);
            if nodes.measure(next.as_slice()).is_ok() {
                assert!(most <= 1.0 && parts.iter().all(|(_, is_upright)| *is_upright), "{most}");
                closest = closest.max(most);
            } else {
                refused += 1;
                let is_bad = most > 1.0 - 1e-4 || parts.iter().any(|(_, upright)| !upright);
                assert!(is_bad, "{most}");
            }
        }
    }
    assert!(closest > 0.99 && refused > 30, "{closest} {refused}");
}
