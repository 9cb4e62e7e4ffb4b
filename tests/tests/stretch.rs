//! The measured stretch against f64, and the gate that it is.

use dibs_build::{Builder, Paths, generate};
use dibs_nostd::glam::Vec3;
use dibs_nostd::wire::{Encoding, FrameEncoder, FrameId};
use dibs_nostd::{Assembler, Frames, Rejection, StretchError, Tree, measure_stretch};
use dibs_tests::deform::Deformation;
use dibs_tests::stretch;
use fastrand::Rng;

/// Never below the truth, and above it by no more than the rounding that is added.
#[test]
fn the_measured_stretch_is_the_true_one_rounded_up() {
    let (mesh, _) = generate::heart(600).expect("a valid size");
    let mut rng = Rng::with_seed(21);
    for paths in [Paths::Edges, Paths::Surface { crossings: 2 }] {
        let built = Builder::new().stretch(4.0).paths(paths).build(&mesh).expect("a valid mesh");
        let tree = built.tree::<u16>().expect("valid");
        for round in 0..200 {
            let deformation = Deformation::ALL[round % Deformation::ALL.len()];
            let limit = 1.0 + 2.9 * rng.f32();
            let moved = deformation.apply(&mesh, tree.paths(), limit, &mut rng);
            let truth = stretch::largest(&mesh, &moved, tree.paths());
            let rows = built.to_rows(&moved);
            let measured = measure_stretch(&tree, rows.as_slice()).expect("below 4");
            let sigma = f64::from(measured.sigma());
            assert!(sigma >= truth, "{deformation:?}: {sigma} is below {truth}");
            assert!(sigma <= truth * 1.0001 + 1e-6, "{deformation:?}: {sigma} for {truth}");
        }
    }
}

#[test]
fn what_cannot_be_measured_is_named() {
    let (mesh, _) = generate::heart(320).expect("a valid size");
    let built = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let tree = built.tree::<u16>().expect("valid");
    let mut rows = built.to_rows(&mesh.positions);
    assert!(measure_stretch(&tree, rows.as_slice()).is_ok());
    let short = measure_stretch(&tree, &rows[1..]);
    assert!(matches!(short, Err(StretchError::VertexCount { expected: 162, found: 161 })));
    for wrong in [f32::NAN, f32::INFINITY, 1e30] {
        let right = std::mem::replace(&mut rows[40].z, wrong);
        let refused = measure_stretch(&tree, rows.as_slice()).expect_err("is wrong");
        let StretchError::Exceeded { triangle, .. } = refused else { panic!("{refused}") };
        assert!(tree.triangle(triangle).expect("named").contains(&40), "{refused}");
        rows[40].z = right;
    }
    let without = Builder::new().with_rest_shape(false).build(&mesh).expect("a valid mesh");
    let tree = without.tree::<u16>().expect("valid");
    let refused = measure_stretch(&tree, rows.as_slice());
    assert!(matches!(refused, Err(StretchError::NoRestShape)));
}

/// With a tree as the gate, a frame beyond the stretch limit is refused and the triangle named.
#[test]
fn a_surface_beyond_the_stretch_limit_is_refused() {
    let (mesh, _) = generate::heart(320).expect("a valid size");
    let built = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let bytes: &'static [u8] = built.blob().to_vec().leak();
    let tree: &'static Tree<'static, u16> =
        Box::leak(Box::new(Tree::from_bytes(bytes).expect("valid")));
    let rest = built.to_rows(&mesh.positions);
    const VERTICES: usize = 162;
    let frames: &'static Frames<VERTICES> = Box::leak(Box::new(Frames::new()));
    let (writer, mut reader) = frames.split().expect("new");
    let mut assembler = Assembler::new(writer, tree, tree.mesh_id(), 1e4);
    let mut send = |epoch: u32, scale: f32| {
        let moved: Vec<Vec3> = rest.iter().map(|p| *p * scale).collect();
        let id = FrameId { mesh_id: tree.mesh_id(), session: 1, epoch };
        let mut encoder =
            FrameEncoder::<_, 512>::new(id, Encoding::Float, &moved[..]).expect("can be sent");
        let mut buffer = [0; 512];
        let mut last = None;
        while let Some(packet) = encoder.next_packet(&mut buffer) {
            last = Some(assembler.accept(packet, epoch));
        }
        last.expect("at least one packet")
    };
    assert!(send(1, 1.15).is_ok());
    let refused = send(2, 1.25).expect_err("beyond 1.2");
    assert!(matches!(refused, Rejection::Stretch(_)), "{refused:?}");
    let frame = reader.read().expect("the good one stays");
    assert_eq!(frame.label().epoch, 1);
    let sigma = frame.label().stretch.expect("measured").sigma();
    assert!((1.15..1.1501).contains(&sigma), "{sigma}");
}
