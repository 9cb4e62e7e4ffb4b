//! Limits hold as configured: on size if triangles have their own limits, of exactly 1, and learned from a motion.

// Requirements: F-02, F-03

use dibs_build::modes::ModalFit;
use dibs_build::{Builder, BuiltTree, IndexWidth, Mesh, Motion, MotionStretch, Paths, generate};
use dibs_nostd::modes::Modes;
use dibs_nostd::{
    Admission, AdmissionCheck, FrameExtent, IncomingSurface, StretchError, StretchMonitor,
    SurfaceLimits, measure_stretch,
};
use fastrand::Rng;
use glam::{Mat3, Vec3};

const PATHS: [Paths; 2] = [Paths::Edges, Paths::Surface { crossings: 3 }];

fn heart() -> Mesh {
    generate::heart(1_000).expect("a valid size").mesh
}

/// A mesh flattened along an axis, so that many of its triangles are slivers, and rotated.
fn squashed(mesh: &Mesh, by: f32, turn: f32) -> Mesh {
    let turn = Mat3::from_axis_angle(Vec3::new(0.6, 0.8, 0.0), turn);
    let positions = mesh.positions.iter().map(|p| turn * (*p * Vec3::new(1.0, by, 1.0)));
    Mesh { positions: positions.collect(), ..mesh.clone() }
}

fn admitted(built: &BuiltTree, rows: &[Vec3], shrinkage: f32) -> Result<(), StretchError> {
    let tree = built.tree::<u16>().expect("small");
    let limits = SurfaceLimits::reach_mm(1e4).shrinkage(shrinkage);
    let mut admission_check = StretchMonitor::new(&tree).expect("has a metric").limits(limits);
    admission_check.begin(FrameExtent::Whole);
    match admission_check.advance(IncomingSurface::new(rows, rows.len() as u32), u32::MAX)? {
        Admission::Admitted(_) => Ok(()),
        other => panic!("{other:?}"),
    }
}

/// A region may shrink to the configured fraction of its size, and not below, whatever the triangles' stretch limits.
#[test]
fn shrinkage_is_as_configured_where_triangles_have_their_own_limits() {
    let mesh = heart();
    let mut rng = Rng::with_seed(19);
    for (top, many) in [(1.5, true), (4.0, false), (100.0, false), (1e6, false), (20.0, true)] {
        let limit = |at| if at == 0 || many && rng.bool() { top } else { 1.01 };
        let limits = (0..mesh.triangles.len()).map(limit).collect();
        for paths in PATHS {
            let built = Builder::new().paths(paths).limits(Vec::clone(&limits)).build(&mesh);
            let built = built.expect("a valid mesh");
            let rest = built.to_rows(&mesh.positions);
            for part in [0.25f32, 0.6, 0.99] {
                for (by, is_ok) in [(part * 1.005, true), (part * 0.995, false)] {
                    let rows: Vec<Vec3> = rest.iter().map(|&p| p * by).collect();
                    let found = admitted(&built, &rows, part);
                    assert_eq!(found.is_ok(), is_ok, "limit {top}, {part} of the size: {found:?}");
                }
            }
        }
    }
}

/// A limit of 1 admits the rest shape, also after rigid motions exact in f32, and modes can be built on it.
#[test]
fn a_limit_of_exactly_one_admits_the_rest_shape() {
    let whole = generate::heart(320).expect("a valid size");
    for by in [1.0, 1e-2, 1e-4] {
        let mesh = squashed(&whole.mesh, by, 0.0);
        let alternate = |t: usize| if t.is_multiple_of(2) { 1.0 } else { 1.5 };
        let alternate: Vec<f32> = (0..mesh.triangles.len()).map(alternate).collect();
        for paths in PATHS {
            for builder in [
                Builder::new().stretch(1.0),
                Builder::new().limits(vec![1.0; mesh.triangles.len()]),
                Builder::new().limits(alternate.clone()),
            ] {
                let built = builder.paths(paths).index(IndexWidth::Bits16).build(&mesh);
                let built = built.expect("a valid mesh");
                let rest = built.to_rows(&mesh.positions);
                let tree = built.tree::<u16>().expect("small");
                let measured = measure_stretch(&tree, rest.as_slice());
                assert!(measured.is_ok(), "pressed to {by}: {measured:?}");
                admitted(&built, &rest, 0.25).expect("the rest shape");
                let turned: Vec<Vec3> = rest.iter().map(|p| Vec3::new(-p.y, p.x, p.z)).collect();
                admitted(&built, &turned, 0.25).expect("turned by a quarter");
                // It still limits: at the least triangle's limit plus the rounding.
                let larger: Vec<Vec3> = rest.iter().map(|&p| p * 1.51).collect();
                assert!(measure_stretch(&tree, larger.as_slice()).is_err());
                let limit = tree.stretch();
                assert!((1.0..1.017).contains(&limit) || limit == 1.5, "{limit}");
            }
        }
    }
    let rigid =
        |n: u8| whole.mesh.positions.iter().map(|p| *p + Vec3::X * 8.0 * f32::from(n)).collect();
    let motion = Motion { frames: (0..4).map(rigid).collect(), ..Motion::default() };
    for paths in PATHS {
        let needed = MotionStretch::new(&whole.mesh, &motion, paths, &|_| ()).expect("fits");
        assert!(needed.worst().stretch > 1.0, "nothing is rounded");
        assert_eq!(needed.beyond(&vec![1.0; whole.mesh.triangles.len()]), None);
    }
    let fit = ModalFit::new(&whole.mesh, &motion).expect("fits");
    let built = Builder::new().stretch(1.0).build(&whole.mesh).expect("a valid mesh");
    let built = built.with_modes(&fit, 1).expect("modes of a rigid motion");
    let tree = built.tree::<u16>().expect("small");
    assert!(Modes::of(&tree).expect("has modes").anchor_count() > 0);
}

/// Volume that a closed surface encloses.
fn volume(mesh: &Mesh, positions: &[Vec3]) -> f64 {
    let at = |v: u32| positions[v as usize].as_dvec3() - positions[0].as_dvec3();
    mesh.triangles.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c))) / 6.0).sum()
}

/// Limits learned from a motion admit its frames with a margin of 0, even on flattened meshes. Nothing is learned from a
/// frame that turns the surface inside out; on the flattest meshes a small stretch suffices for that.
#[test]
fn every_frame_that_limits_were_learned_from_is_admitted() {
    let mut rng = Rng::with_seed(191);
    let mut random = |size: f32| Vec3::from_array([0; 3].map(|_| (rng.f32() * 2.0 - 1.0) * size));
    let heart = generate::heart(600).expect("a valid size").mesh;
    let (mut frames_seen, mut refused) = (0, 0);
    for round in 0..24 {
        let mesh = squashed(&heart, [1.0, 0.1, 1e-2, 1e-3][round % 4], round as f32);
        let stirred = |part: f32, bend: Vec3| {
            let at = |&p: &Vec3| p + part * bend * ((p.dot(bend) * 0.05).sin() + random(0.01).x);
            mesh.positions.iter().map(at).collect::<Vec<_>>()
        };
        let bends = [Vec3::X, Vec3::Y, Vec3::new(3.0, -1.0, 8.0), Vec3::ZERO];
        let frames: Vec<_> = bends
            .into_iter()
            .zip([0.3, 4.0, 1.0, 0.0])
            .map({
                let mut stirred = stirred;
                move |(bend, part)| stirred(part, bend)
            })
            .collect();
        let kept = |frame: &Vec<Vec3>| volume(&mesh, frame) / volume(&mesh, &mesh.positions);
        let (frames, inside_out): (Vec<_>, Vec<_>) = frames.into_iter().partition(|frame| {
            let motion = Motion { frames: vec![frame.clone()], ..Motion::default() };
            motion.check_fits(&mesh).is_ok()
        });
        assert!(inside_out.iter().all(|frame| kept(frame) < -1.0 / 65.0), "round {round}");
        (frames_seen, refused) =
            (frames_seen + frames.len() + inside_out.len(), refused + inside_out.len());
        let motion = Motion { frames, ..Motion::default() };
        for paths in PATHS {
            let needed = MotionStretch::new(&mesh, &motion, paths, &|_| ()).expect("fits");
            let limits = needed.limits(0.0);
            assert_eq!(needed.beyond(&limits), None);
            let largest = limits.iter().copied().fold(1.0, f32::max);
            for builder in [Builder::new().limits(limits), Builder::new().stretch(largest)] {
                let built = builder.paths(paths).build(&mesh).expect("a valid mesh");
                for frame in &motion.frames {
                    let found = admitted(&built, &built.to_rows(frame), 0.0);
                    let kept = kept(frame);
                    assert_eq!(found, Ok(()), "round {round}, {kept} of the volume");
                    assert!(kept > -1.0 / 63.0, "round {round}, {kept} of the volume");
                }
            }
        }
    }
    println!("{refused} of {frames_seen} frames are inside out");
    assert!(64 * refused < frames_seen, "{refused} of {frames_seen}");
}

/// The stretch of the worst triangle of a motion is the learned limit of a tree, even if that triangle joins a flat
/// one: their shared edge is rounded for the flat one.
#[test]
fn a_learned_limit_admits_a_triangle_beside_a_flat_one() {
    let mut rng = Rng::with_seed(192);
    for _ in 0..2_000 {
        // Both are measured from the corner at (1, 0): the flat one's angle there is nearly 180 degrees.
        let (open, flat) = (1.2 + rng.f32() * 0.2, 0.1 + rng.f32() * 0.1);
        let corner = |angle: f32| Vec3::new(1.0 + angle.cos(), angle.sin(), 0.0);
        let turn = Mat3::from_axis_angle(Vec3::new(0.6, 0.0, 0.8), rng.f32() * 6.0);
        let positions = [Vec3::ZERO, Vec3::X, corner(open), corner(-flat)].map(|p| turn * p * 50.0);
        let triangles = vec![[0, 1, 2], [1, 0, 3]];
        let mesh = Mesh { positions: positions.to_vec(), triangles, ..Mesh::default() };
        let mut stretched = mesh.positions.clone();
        stretched[2] += turn * Vec3::Y * 10.0 * rng.f32();
        let motion = Motion { frames: vec![stretched], ..Motion::default() };
        let needed = MotionStretch::new(&mesh, &motion, Paths::default(), &|_| ()).expect("fits");
        let largest = needed.limits(0.0).into_iter().fold(1.0, f32::max);
        let built = Builder::new().stretch(largest).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("small");
        let found = measure_stretch(&tree, built.to_rows(&motion.frames[0]).as_slice());
        assert!(found.is_ok(), "{found:?}, limit {largest}, {:?}", needed.worst());
    }
}
