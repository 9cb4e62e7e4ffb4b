//! Modal surfaces: their positions, their distance from the recorded motion, and their refusals.
//!
//! One file, because all tests need the same fit.

// Requirement: F-06

use std::cell::RefCell;
use std::collections::HashSet;
use std::path::Path;

use dibs_build::modes::{FitError, MARGIN, ModalFit, Projector};
use dibs_build::{Builder, IndexWidth, Motion, MotionStretch, Paths, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::modes::{
    self, MAX_MODES, ModalAdmissionCheck, ModalReader, ModalSurface, Modes, WeightsError,
};
use dibs_nostd::{Frames, Index, Options, Query, StretchError, Tree, VertexTable, measure_stretch};
use dibs_tests::modal::{anywhere, positions, small};
use dibs_tests::motions::trembling;
use dibs_tests::oracle::exhaustive;
use dibs_tests::poses::pose;
use dibs_tests::tree_bytes::{reseal as reseal_tree, row_of_section, section, with_words};
use dibs_tests::{ask, surfaces};
use fastrand::Rng;
use glam::Vec3;

/// The stated errors hold at all vertices of all frames, and are reached. Positions are a sum in f64 up to rounding.
#[test]
fn every_frame_is_within_the_stated_error() {
    let (mesh, motion) = trembling(2_000, 5, 1);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    assert_eq!(fit.available(), 10);
    let tree = Builder::new().stretch(2.0).build(&mesh).expect("a valid mesh");
    for count in [1, 2, 5, 10] {
        let built = tree.with_modes(&fit, count).expect("so many there are");
        let tree = built.tree::<u16>().expect("valid");
        let modes = Modes::of(&tree).expect("valid");
        let stated = fit.errors()[count - 1];
        let (mut largest, mut sum) = (0.0_f64, 0.0);
        let recorded = built.modal_motion().expect("has modes");
        assert_eq!(recorded.beyond_limit, [0; 0]);
        for (weights, frame) in recorded.weights.iter().zip(&motion.frames) {
            let surface = modes.surface::<10>(weights).expect("recorded");
            for (row, exact) in (0..).zip(built.to_rows(frame)) {
                let now = surface.position(row).expect("in the table").as_dvec3();
                let rest = modes.rest_position(row).expect("in the table").as_dvec3();
                let plain = weights.iter().enumerate().fold(rest, |sum, (mode, weight)| {
                    let steps = modes.displacement(mode, row).expect("there").map(f64::from);
                    let step = f64::from(modes.step(mode).expect("there"));
                    sum + glam::DVec3::from(steps) * step * f64::from(*weight)
                });
                assert!(now.distance(plain) < 3e-5, "{now} {plain}");
                let away = now.distance(exact.as_dvec3());
                (largest, sum) = (largest.max(away), sum + away * away);
            }
        }
        let rms = (sum / (motion.frames.len() * mesh.positions.len()) as f64).sqrt();
        for (stated, found, before) in
            [(modes.position_error(), largest, stated.max), (modes.rms_error(), rms, stated.rms)]
        {
            assert!(f64::from(stated) >= found && f64::from(stated) <= found * 1.001 + 1e-9);
            // Rounding the modes to 16 bits adds little to the fit's error.
            assert!((found - before).abs() < 0.01 * before + 1e-3, "{count}: {found} {before}");
        }
    }
}

/// A vertex table that records which rows are read.
struct Watched<'a, T> {
    table: &'a T,
    asked: RefCell<Vec<u32>>,
}

impl<T: VertexTable> VertexTable for Watched<'_, T> {
    fn len(&self) -> usize {
        self.table.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.asked.borrow_mut().push(vertex);
        self.table.position(vertex)
    }
}

/// A query that computes vertices when it reads them gives the same bits as one on a table computed in advance. The
/// answer agrees with exhaustive search, and most vertices are never computed.
#[test]
fn lazy_is_eager_bit_for_bit_and_right() {
    let (mesh, motion) = trembling(2_000, 5, 2);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    for width in [IndexWidth::Bits16, IndexWidth::Bits32] {
        let builder = Builder::new().stretch(2.5).index(width);
        let built = builder.build(&mesh).expect("valid").with_modes(&fit, 10).expect("so many");
        match width {
            IndexWidth::Bits16 => lazy_is_eager(&built.tree::<u16>().expect("valid")),
            _ => lazy_is_eager(&built.tree::<u32>().expect("valid")),
        }
    }
}

fn lazy_is_eager<I: Index>(tree: &Tree<'_, I>) {
    let mut rng = Rng::with_seed(3);
    let modes = Modes::of(tree).expect("valid");
    let triangles = surfaces::triangles(tree);
    let mut query = Query::<I, MAX_STACK>::new(tree).expect("deep enough");
    let (mut queries, mut computed) = (0, 0);
    while queries < 400 {
        let weights = anywhere(&modes, &mut rng);
        let surface = modes.surface::<10>(&weights).expect("in range");
        let eager = positions(&surface);
        let Ok(measured) = measure_stretch(tree, eager.as_slice()) else { continue };
        assert_eq!(measure_stretch(tree, &surface), Ok(measured));
        let watched = Watched { table: &surface, asked: RefCell::default() };
        for _ in 0..8 {
            let tool = pose(&eager, &triangles, &mut rng);
            for options in [Options::cold(), Options::cold().stretch(measured)] {
                watched.asked.borrow_mut().clear();
                let lazily = ask::closest(&mut query, &watched, &tool, &options).expect("sound");
                let eagerly =
                    ask::closest(&mut query, eager.as_slice(), &tool, &options).expect("sound");
                assert_eq!(format!("{lazily:?}"), format!("{eagerly:?}"));
                let truth = exhaustive(&eager, &triangles, &tool).expect("has triangles");
                let error = (truth.separation - f64::from(lazily.separation)).abs();
                assert!(error <= f64::from(lazily.accuracy), "{tool:?} {lazily:?} {truth:?}");
                let distinct: HashSet<u32> = watched.asked.borrow().iter().copied().collect();
                (queries, computed) = (queries + 1, computed + distinct.len());
            }
        }
    }
    let share = computed as f64 / f64::from(queries * tree.vertex_count());
    assert!(share < 0.5, "{share} of the vertices were computed");
}

#[test]
fn weights_that_make_no_surface_are_refused() {
    let (built, _) = small(4);
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    let good = &built.modal_motion().expect("has modes").weights[7];
    assert!(modes.surface::<4>(good).is_ok() && modes.surface::<64>(good).is_ok());
    let refused = modes.surface::<3>(good).expect_err("no room");
    assert_eq!(refused, WeightsError::Capacity { needed: 4, available: 3 });
    for length in [0, 3, 5] {
        let weights = vec![0.0; length];
        let refused = modes.surface::<8>(&weights).expect_err("another number");
        assert_eq!(refused, WeightsError::Count { expected: 4, found: length as u32 });
    }
    let frames = Frames::<3>::new();
    let (_, reader) = frames.split().expect("once");
    let refused = ModalReader::<4>::new(reader, &modes).expect_err("a row is missing");
    assert_eq!(refused, WeightsError::Count { expected: 4, found: 3 });
    let refused = ModalAdmissionCheck::<_, 3>::new(&modes, &tree).err();
    assert_eq!(refused, Some(WeightsError::Count { expected: 4, found: 3 }));
    for mode in 0..4 {
        let [low, high] = modes.range(mode).expect("there");
        let with = |weight: f32| {
            let mut weights = good.clone();
            weights[mode] = weight;
            [modes.check(&weights), modes.stretch_bound(&weights).map(|_| ())]
        };
        for weight in [low, high, 0.0, -0.0, f32::MIN_POSITIVE] {
            assert_eq!(with(weight), [Ok(()); 2]);
        }
        let mode = mode as u32;
        for weight in [low.next_down(), high.next_up(), -1e30, f32::MAX] {
            assert_eq!(with(weight), [Err(WeightsError::OutOfRange { mode, weight }); 2]);
        }
        for weight in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(with(weight), [Err(WeightsError::NotFinite { mode }); 2]);
        }
    }
    assert_eq!((modes.range(4), modes.step(4), modes.displacement(4, 0)), (None, None, None));
}

/// The admitted range of a weight is its recorded range with the stated margin.
#[test]
fn the_ranges_are_the_recorded_ones_with_the_margin() {
    let (built, _) = small(4);
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    assert_eq!(modes.margin(), MARGIN);
    for mode in 0..4 {
        let weights = built.modal_motion().expect("has modes").weights.iter().map(|w| w[mode]);
        let (low, high) = weights.fold((0.0_f32, 0.0_f32), |(l, h), w| (l.min(w), h.max(w)));
        let margin = MARGIN * (high - low);
        assert_eq!(modes.range(mode), Some([low - margin, high + margin]));
    }
}

/// The same input gives the same bytes, and a sender that has only the tree finds the same weights.
#[test]
fn fits_are_reproducible() {
    let (first, second) = (small(5).0, small(5).0);
    assert_eq!(first.blob(), second.blob());
    let (_, motion) = trembling(320, 3, 6);
    let tree = first.tree::<u16>().expect("valid");
    let projector = Projector::new(&Modes::of(&tree).expect("valid")).expect("independent");
    for (frame, weights) in motion.frames.iter().zip(&first.modal_motion().expect("has").weights) {
        assert_eq!(&projector.weights(&first.to_rows(frame)), weights);
    }
}

#[test]
fn what_cannot_be_fitted_is_named() {
    let generate::MovingMesh { mesh, motion } = generate::heart(320).expect("a valid size");
    let tree = Builder::new().build(&mesh).expect("a valid mesh");
    let fit =
        |frames: Vec<Vec<Vec3>>| ModalFit::new(&mesh, &Motion { frames, ..Motion::default() });
    assert!(matches!(fit(vec![]), Err(FitError::Frames { frames: 0 })));
    let still = fit(vec![mesh.positions.clone(); 3]);
    assert!(matches!(still, Err(FitError::Still)));
    let short = fit(vec![mesh.positions[1..].to_vec()]);
    assert!(matches!(short, Err(FitError::Mismatch(_))));
    let mut wrong = motion.frames.clone();
    wrong[3][7].y = f32::NAN;
    let wrong = fit(wrong);
    assert!(matches!(wrong, Err(FitError::Coordinate { frame: 3, vertex: 7 })));
    let good = fit(motion.frames).expect("a motion");
    for asked in [0, 3, 100] {
        let refused = tree.with_modes(&good, asked);
        assert!(matches!(refused, Err(FitError::Count { available: 2, .. })), "{asked}");
    }
    let bare = Builder::new().with_rest_shape(false).build(&mesh).expect("a valid mesh");
    assert!(matches!(bare.with_modes(&good, 2), Err(FitError::NoRestShape)));
    let other = generate::heart(322).expect("a valid size").mesh;
    let other = Builder::new().build(&other).expect("a valid mesh");
    assert!(matches!(other.with_modes(&good, 2), Err(FitError::OtherMesh)));
    let bare = tree.tree::<u16>().expect("valid");
    assert!(matches!(Modes::of(&bare), Err(modes::ModesError::Absent)));
}

/// Frames beyond the limit are listed, and are not anchors of the bound: they stay beyond the limit.
#[test]
fn frames_beyond_the_limit_are_named() {
    let generate::MovingMesh { mesh, motion } = generate::heart(320).expect("a valid size");
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let tree = Builder::new().stretch(1.2).build(&mesh).expect("a valid mesh");
    let built = tree.with_modes(&fit, 2).expect("so many");
    let tree = built.tree::<u16>().expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    let recorded = built.modal_motion().expect("has modes");
    assert!(!recorded.beyond_limit.is_empty());
    assert_eq!(modes.anchor_count(), 1 + recorded.weights.len() - recorded.beyond_limit.len());
    for (frame, weights) in recorded.weights.iter().enumerate() {
        let surface = modes.surface::<2>(weights).expect("in range");
        let is_beyond = recorded.beyond_limit.contains(&frame);
        let measured = measure_stretch(&tree, &surface);
        assert_eq!(is_beyond, matches!(measured, Err(StretchError::Exceeded { .. })));
        let bound = modes.stretch_bound(weights).expect("in range").sigma();
        assert!(!is_beyond || bound > tree.stretch(), "{frame}: {bound}");
    }
}

/// A wrong field of the section is an error that names it. Random damage is an error, or gives other positions without
/// a panic.
#[test]
fn damaged_modes_do_not_validate() {
    let (built, _) = small(3);
    let blob = built.blob();
    let (start, length) = section(blob, 7);
    let damaged = |at: usize, bytes: &[u8]| {
        let mut blob = blob.to_vec();
        blob[start + at..][..bytes.len()].copy_from_slice(bytes);
        reseal_tree(&mut blob);
        let tree = Tree::<u16>::from_bytes(&blob).expect("the tree itself is sound");
        Modes::of(&tree).map(|modes| {
            let weights = vec![0.0; modes.count()];
            let surface = modes.surface::<MAX_MODES>(&weights).expect("0 is in every range");
            (positions(&surface), modes.stretch_bound(&weights))
        })
    };
    let modes = Modes::of(&built.tree::<u16>().expect("valid")).map(|m| m.anchor_count());
    let anchors = 32 + 16 * 3;
    let anchor_bytes = 4 * 3 + 8;
    assert_eq!(length, anchors + anchor_bytes * modes.expect("valid") + 6 * 3 * 162);

    use modes::ModesError as E;
    for count in [0_u16, 65, u16::MAX] {
        let value = u32::from(count);
        let refused = damaged(0, &count.to_le_bytes()).expect_err("no such number");
        assert_eq!(refused, E::Field { offset: 0, value });
    }
    let refused = damaged(0, &4_u16.to_le_bytes()).expect_err("another length");
    assert!(matches!(refused, E::Length { .. }), "{refused}");
    for count in [0_u16, 66] {
        let refused = damaged(2, &count.to_le_bytes()).expect_err("no such number");
        assert!(matches!(refused, E::Field { offset: 2, .. }), "{refused}");
    }
    for offset in [4, 8, 12, 16, 20] {
        for wrong in [f32::NAN, -1.0, f32::INFINITY, 1e19] {
            let value = wrong.to_bits();
            let refused = damaged(offset, &wrong.to_le_bytes()).expect_err("not a length");
            assert_eq!(refused, E::Field { offset: offset as u8, value });
        }
    }
    for offset in [24, 28] {
        let refused = damaged(offset, &[0, 0, 1, 0]).expect_err("reserved");
        assert_eq!(refused, E::Field { offset: offset as u8, value: 0x1_0000 });
    }
    for mode in 0..3 {
        for (field, wrong) in [
            (0, 0.5),
            (1, -0.5),
            (2, -1.0),
            (3, -1.0),
            (0, -1e9),
            (1, f32::NAN),
            (2, 1e17),
            (3, 1e19),
        ] {
            let refused = damaged(32 + 16 * mode + 4 * field, &f32::to_le_bytes(wrong));
            let expected = E::Mode { mode: mode as u32 };
            assert_eq!(refused.expect_err("is wrong"), expected, "{field} {wrong}");
        }
    }
    let anchor = anchors + 2 * anchor_bytes;
    for (at, wrong) in [(4, f32::NAN.to_bits()), (12, (-1.0_f32).to_bits()), (16, 320)] {
        let refused = damaged(anchor + at, &wrong.to_le_bytes()).expect_err("is wrong");
        assert_eq!(refused, E::Anchor { anchor: 2 });
    }

    // A section shorter than its header, and modes without the shape that they move.
    let modes_of = |blob: &[u8]| Modes::of(&Tree::<u16>::from_bytes(blob).expect("sound")).err();
    let short = with_words(blob, &[(row_of_section(blob, 7) + 8, 31)]);
    assert_eq!(modes_of(&short), Some(E::Length { expected: 32, found: 31 }));
    let bare = with_words(blob, &[(row_of_section(blob, 4), 1 << 31)]);
    assert_eq!(modes_of(&bare), Some(E::NoRestShape));

    let mut rng = Rng::with_seed(8);
    for _ in 0..2_000 {
        let at = rng.usize(..length - 4);
        let _ = damaged(at, &rng.u32(..).to_le_bytes());
    }
}

dibs_nostd::include_tree!("modal_heart");

/// The generated module contains the builder's modes.
#[test]
fn the_generated_module_holds_the_modes() {
    let generate::MovingMesh { mesh, motion } = generate::heart(1_000).expect("a valid size");
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let tree = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let built = tree.with_modes(&fit, 2).expect("so many");
    let weights = &built.modal_motion().expect("has modes").weights[9];
    let tree_of_module = modal_heart::TREE.validate().expect("valid");
    let of_module = Modes::of(&tree_of_module).expect("valid");
    let modes = [of_module, Modes::of(&built.tree::<u16>().expect("valid")).expect("valid")];
    let [generated, built] = modes.map(|modes| {
        let surface = modes.surface::<{ modal_heart::MODES }>(weights).expect("in range");
        (positions(&surface), modes.stretch_bound(weights))
    });
    assert_eq!(generated, built);
    assert_eq!(generated.0.len(), modal_heart::VERTICES);
    assert_eq!(modal_heart::STACK, tree_of_module.stack() as usize);
}

/// All modes of the real heart's motion together reproduce its recorded frames; fewer modes do so less exactly. Prints
/// errors, positions read and the bound's excess.
#[test]
#[cfg_attr(not(real_meshes), ignore = "../shared/data is absent")]
fn the_real_heart_is_driven_by_its_modes() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let mesh = dibs_build::read(folder.join("heart_10272.ply")).expect("a mesh").mesh;
    let motion = Motion::read_pc2(folder.join("heart_10272.pc2")).expect("a motion");
    let fit = ModalFit::new(&mesh, &motion).expect("fits");
    assert_eq!(fit.available(), 24);
    let needed = MotionStretch::new(&mesh, &motion, Paths::default(), &|_| ()).expect("fits");
    let builder = Builder::new().limits(needed.limits(0.1));
    let tree = builder.build(&mesh).expect("a valid mesh");
    let mut rng = Rng::with_seed(9);
    for count in [8, 16, 24] {
        let built = tree.with_modes(&fit, count).expect("so many");
        let tree = built.tree::<u16>().expect("valid");
        let modes = Modes::of(&tree).expect("valid");
        let recorded = built.modal_motion().expect("has modes");
        assert!(count < 24 || recorded.beyond_limit.is_empty());
        assert!(count < 24 || modes.position_error() < 0.002);
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<u16, MAX_STACK>::new(&tree).expect("deep enough");
        let (mut queries, mut asked, mut distinct) = (0, 0, 0);
        let mut above: [Vec<f32>; 3] = Default::default();
        for (frame, weights) in recorded.weights.iter().enumerate() {
            let next = &recorded.weights[(frame + 1) % recorded.weights.len()];
            for (ratios, noise) in above.iter_mut().zip([0.0, 0.02, 0.1]) {
                let of_mode = |(a, b): (&f32, &f32)| 0.5 * (a + b) + noise * (rng.f32() - 0.5);
                let between: Vec<f32> = weights.iter().zip(next).map(of_mode).collect();
                let surface: ModalSurface<'_, 24> = modes.surface(&between).expect("in range");
                let bound = modes.stretch_bound(&between).expect("in range");
                let Ok(exact) = measure_stretch(&tree, &surface) else { continue };
                let ratio: f32 = bound.sigma() / exact.sigma();
                assert!(ratio > 0.9999, "{ratio}");
                ratios.push(ratio);
            }
            let surface: ModalSurface<'_, 24> = modes.surface(weights).expect("recorded");
            let bound = modes.stretch_bound(weights).expect("recorded");
            assert!(bound.sigma() <= tree.stretch() || recorded.beyond_limit.contains(&frame));
            if bound.sigma() > tree.stretch() {
                continue;
            }
            let eager = positions(&surface);
            let watched = Watched { table: &surface, asked: RefCell::default() };
            for _ in 0..20 {
                let tool = pose(&eager, &triangles, &mut rng);
                watched.asked.borrow_mut().clear();
                let options = Options::cold().stretch(bound);
                let found = ask::closest(&mut query, &watched, &tool, &options).expect("sound");
                let truth = exhaustive(&eager, &triangles, &tool).expect("has triangles");
                let error = (truth.separation - f64::from(found.separation)).abs();
                assert!(error <= f64::from(found.accuracy));
                let asked_for = watched.asked.borrow();
                (queries, asked) = (queries + 1, asked + asked_for.len());
                distinct += asked_for.iter().collect::<HashSet<_>>().len();
            }
        }
        println!(
            "{count} modes: position error {:.4}, rms {:.4}, {:.1} bytes of flash a vertex; a query \
             asks for {} positions of {} vertices, of {}",
            modes.position_error(),
            modes.rms_error(),
            modes.flash_bytes() as f64 / f64::from(tree.vertex_count()),
            asked / queries,
            distinct / queries,
            tree.vertex_count(),
        );
        for (ratios, noise) in above.iter().zip([0.0, 0.02, 0.1]) {
            assert!(2 * ratios.len() > recorded.weights.len(), "{} shapes compared", ratios.len());
            let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
            let most = ratios.iter().copied().fold(0.0, f32::max);
            println!(
                "  half-way between frames, with noise {noise}: the bound is {mean:.3} times the \
                 stretch, at most {most:.3}, in {} shapes within the limits",
                ratios.len()
            );
        }
    }
}
