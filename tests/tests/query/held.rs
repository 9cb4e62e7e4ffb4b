//! Frames that are held: the answers are the same whether the odometer measures their motion or starts again.

// Requirement: T-01

use dibs_build::{Builder, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{
    Capsule, Fallback, MovingSurface, Odometer, Options, Query, Tracker, measure_stretch,
};
use dibs_tests::deform::{Deformation, unit};
use dibs_tests::oracle::{Instrument, exhaustive};
use dibs_tests::poses::pose;
use dibs_tests::surfaces;
use fastrand::Rng;

const FRAMES: usize = 60;
const TICKS: usize = 8;

#[test]
fn a_held_frame_has_the_same_answers_measured_or_not() {
    let meshes = [
        (generate::heart(1_280).expect("a valid size").mesh, false),
        (generate::brain(1_200).expect("a valid size"), false),
        (surfaces::ball(3), false),
        // So few vertices that measuring them costs less than a query.
        (surfaces::slivers(12), true),
        (surfaces::ball(1), true),
    ];
    for (seed, (mesh, is_measured)) in (1..).zip(&meshes) {
        let mut rng = Rng::with_seed(seed);
        let built = Builder::new().stretch(1.5).build(mesh).expect("builds");
        let tree = built.tree::<u16>().expect("16-bit indices");
        let triangles = surfaces::triangles(&tree);
        let mut query = Query::<_, MAX_STACK>::new(&tree).expect("enough");
        let [mut held, mut stepped] =
            [(); 2].map(|()| Tracker::<_, MAX_STACK, 512>::new(&tree).expect("enough"));
        let [mut holding, mut stepping] = [(); 2].map(|()| Odometer::new(&tree));
        let mut before = built.to_rows(&mesh.positions);
        let (mut tool, mut anew, mut kept) = (pose(&before, &triangles, &mut rng), 0, 0);
        let mut last = holding.start(before.as_slice()).motion();
        stepping.start(before.as_slice());
        for _ in 0..FRAMES {
            let deformation = Deformation::ALL[rng.usize(..Deformation::ALL.len())];
            let after = built.to_rows(&deformation.apply(mesh, tree.paths(), 1.4, &mut rng));
            let stretch = measure_stretch(&tree, after.as_slice()).expect("within the limit");
            let options = Options::cold().unsigned().stretch(stretch);
            let surface = holding.hold(before.as_slice(), after.as_slice());
            let step = stepping.step(before.as_slice(), after.as_slice());
            assert_ne!(surface.motion(), last, "a new frame has another reading");
            last = surface.motion();
            for tick in 0..TICKS {
                tool.start += unit(&mut rng) * rng.f32() * 0.3;
                tool.end += unit(&mut rng) * rng.f32() * 0.3;
                let tool = Capsule::new(tool.start, tool.end, tool.radius).expect("valid");
                let ours = held.closest(&surface, &tool, &options).expect("an answer");
                let theirs = stepped.closest(&step.after(), &tool, &options).expect("an answer");
                let whole = query.closest(after.as_slice(), &tool, &options).expect("an answer");
                let instrument =
                    Instrument::capsule(tool.start(), tool.end(), dibs_nostd::Tool::radius(&tool));
                let truth = exhaustive(&after, &triangles, &instrument).expect("triangles");
                for found in [&ours.closest, &theirs.closest, &whole] {
                    let off = (f64::from(found.separation) - truth.separation).abs();
                    assert!(
                        off <= f64::from(found.accuracy) && found.lower == found.separation,
                        "{} triangles, tick {tick}: {found:?} {truth:?}",
                        triangles.len()
                    );
                }
                if *is_measured {
                    assert_eq!(ours.moved, theirs.moved);
                    assert_eq!(ours.closest, theirs.closest);
                } else {
                    anew += usize::from(ours.fallback == Some(Fallback::Surface));
                    assert!(tick > 0 || ours.fallback.is_some(), "{ours:?}");
                }
                kept += usize::from(ours.fallback.is_none());
            }
            before = after;
        }
        println!("{} triangles: {anew} ticks anew, {kept} not", triangles.len());
        assert_eq!(anew, if *is_measured { 0 } else { FRAMES - 1 });
        assert!(kept > FRAMES * TICKS / 2);
    }
}
