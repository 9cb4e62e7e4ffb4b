//! A filter of commands whose stand-off differs by label.

// Requirements: C-05, C-06

use dibs_build::{Builder, BuiltTree, Mesh};
use dibs_nostd::filter::{AdmittedMotion, Filter, FilterError, Reason, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Odometer, Tracker};
use dibs_tests::filter::{Episode, Tally, labelled_scenes, walk_by_label};
use dibs_tests::sample;
use dibs_tests::surfaces::sheet;
use fastrand::Rng;
use glam::Vec3;
use rayon::prelude::*;

/// Muscle has no stand-off of its own.
const MUSCLE: u8 = 0;
const NERVE: u8 = 1;
const VESSEL: u8 = 2;
/// A label that no triangle has.
const ABSENT: u8 = 5;

/// A vessel beside the region's middle, and a nerve across.
fn tissue(from_middle: Vec3) -> u8 {
    if from_middle.x > 2.0 {
        VESSEL
    } else if from_middle.y.abs() < 2.0 {
        NERVE
    } else {
        MUSCLE
    }
}

#[test]
fn no_walk_comes_nearer_than_a_label_s_stand_off() {
    let scenes = labelled_scenes(tissue);
    let tallies: Vec<Tally> = (0..sample(60) as u64)
        .into_par_iter()
        .map(|seed| {
            let scene = &scenes[seed as usize % scenes.len()];
            let mut rng = Rng::with_seed(seed);
            let episode = Episode { ticks: 80, ..Episode::any(&mut rng) };
            let labels = [(NERVE, 0.5), (VESSEL, rng.choice([1.0, 2.0, 4.0]).expect("three"))];
            let tally = walk_by_label(scene, &episode, labels, seed, &mut ());
            if tally.violations + tally.uncertain + tally.too_fast > 0 {
                println!("{seed} {}: {episode:?} {labels:?} {tally:?}", scene.name);
            }
            tally
        })
        .collect();
    let mut all = Tally::default();
    tallies.into_iter().for_each(|one| all += one);
    println!("{all:?}");
    assert_eq!((all.violations, all.uncertain, all.too_fast), (0, 0, 0));
    assert_eq!(all.over_budget, 0);
    let admitted: u64 = all.reasons.iter().sum();
    assert!(all.near_label > all.ticks / 5 && admitted > all.ticks / 3);
}

/// A surface at rest.
struct Surface {
    built: BuiltTree,
    rows: Vec<Vec3>,
}

impl Surface {
    fn new(builder: &Builder, mesh: &Mesh) -> Self {
        let built = builder.build(mesh).expect("a valid mesh");
        let rows = built.to_rows(&mesh.positions);
        Self { built, rows }
    }
}

/// A wall whose right side is a vessel from `x = 10` on.
fn wall() -> Surface {
    let mesh = sheet(48, 60.0, |_, _| 0.0);
    let is_right = |rows: &[u32; 3]| rows.iter().all(|&row| mesh.positions[row as usize].x > 9.9);
    let labels = mesh.triangles.iter().map(|rows| if is_right(rows) { VESSEL } else { MUSCLE });
    Surface::new(&Builder::new().labels(labels.collect()), &mesh)
}

fn upright(tip: Vec3) -> Capsule {
    Capsule::new(tip, tip + Vec3::Z * 40.0, 1.0).expect("finite")
}

fn ask<const LABELS: usize>(
    Surface { built, rows }: &Surface,
    filter: &Filter<LABELS>,
    tools: &[Capsule],
    step: Vec3,
) -> Result<AdmittedMotion, FilterError> {
    let tree = built.tree::<u16>().expect("16-bit indices");
    let mut odometer = Odometer::new(&tree);
    let surface = odometer.start(rows.as_slice());
    let tracker = |_| Tracker::<_, MAX_STACK, 256>::new(&tree).expect("deep enough");
    let mut trackers: Vec<_> = tools.iter().map(tracker).collect();
    let mut pairs: Vec<_> =
        trackers.iter_mut().zip(tools).map(|(tracker, tool)| (tracker, &surface, tool)).collect();
    filter.admit(&mut pairs, &RigidMotion::translation(step), 0.001, &Uncertainty::NONE, &[])
}

/// Near a lesion the tool moves as if there were no vessel, and before the vessel it stops.
#[test]
fn a_larger_stand_off_elsewhere_takes_no_speed() {
    let wall = wall();
    let filter = Filter::new(1.0, 200.0).expect("in range");
    // Enough for trackers that start anew at each tick.
    let by_label = filter.stand_off_of([(VESSEL, 3.0)]).expect("in range").budget(400_000);
    let for_all = Filter::new(3.0, 200.0).expect("in range");
    let mut rng = Rng::with_seed(37);
    for _ in 0..200 {
        // 1 to 1.5 mm above the muscle, and at least 3.5 from the vessel.
        let tip = Vec3::new(-15.0 + 20.0 * rng.f32(), 30.0 * (rng.f32() - 0.5), 2.0);
        let tool = upright(tip + Vec3::Z * (0.01 + 0.5 * rng.f32()));
        let angle = rng.f32() * std::f32::consts::TAU;
        let along = Vec3::new(angle.cos(), angle.sin(), 0.0) * 0.2;
        let admitted = ask(&wall, &by_label, &[tool], along).expect("an answer");
        assert_eq!((admitted.reason, admitted.motion.translation), (Reason::Commanded, along));
        let (own, other) = (admitted.least_separation, ask(&wall, &filter, &[tool], along));
        assert_eq!(own.to_bits(), other.expect("an answer").least_separation.to_bits());
        let admitted = ask(&wall, &for_all, &[tool], along).expect("an answer");
        assert_eq!(admitted.reason, Reason::NoSafeMotion);
    }
    // Towards the vessel, over the muscle.
    let mut tip = Vec3::new(4.0, 0.3, 2.1);
    for _ in 0..100 {
        let admitted = ask(&wall, &by_label, &[upright(tip)], Vec3::X * 0.2).expect("an answer");
        assert_ne!(admitted.reason, Reason::NoSafeMotion, "{tip}");
        tip = admitted.motion.apply(tip);
    }
    let from_vessel = tip.distance(Vec3::new(10.0_f32.max(tip.x), tip.y, 0.0)) - 1.0;
    println!("{tip}: {from_vessel} mm from the vessel");
    assert!((2.99..3.05).contains(&from_vessel), "{tip} {from_vessel}");
}

/// A tool that begins nearer to a label than its stand-off leaves, and the reason says so until it is out.
#[test]
fn a_start_too_near_leads_out_and_is_no_pass() {
    let wall = wall();
    let filter = Filter::new(1.0, 200.0).and_then(|filter| filter.stand_off_of([(VESSEL, 3.0)]));
    let filter = filter.expect("in range");
    for height in [1.5, 2.5, 3.4] {
        let (mut tip, mut ticks) = (Vec3::new(15.0, 0.3, height), 0);
        while tip.z < 3.98 {
            let down = Vec3::new(0.1, 0.0, -0.1);
            let admitted = ask(&wall, &filter, &[upright(tip)], down).expect("an answer");
            assert_eq!(admitted.reason, Reason::NoSafeMotion, "{tip}");
            assert!(admitted.motion.translation.z >= 0.0, "{tip} {admitted:?}");
            tip = admitted.motion.apply(tip);
            ticks += 1;
            assert!(ticks < 200, "it stays at {tip}");
        }
    }
}

#[test]
fn bad_input_is_named() {
    let filter = Filter::new(1.0, 200.0).expect("in range");
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 0.999] {
        let error = filter.stand_off_of([(NERVE, 1.0), (VESSEL, bad)]).unwrap_err();
        let FilterError::Parameter { parameter, value } = error else { panic!("{error:?}") };
        assert_eq!((parameter, value.to_bits()), ("stand_off_of", bad.to_bits()));
    }
    let wall = wall();
    let tools = [0.0, 1.0, 2.0, 3.0, 4.0].map(|x| upright(Vec3::new(x, 0.0, 9.0)));
    let by_label = filter.stand_off_of([(NERVE, 1.0), (VESSEL, 3.0)]).expect("in range");
    // That of the nerve is the filter's own.
    let error = ask(&wall, &by_label, &tools, Vec3::X * 0.1).unwrap_err();
    assert_eq!(error, FilterError::Pairs { found: 10, most: 8 });
    assert!(ask(&wall, &by_label, &tools[..4], Vec3::X * 0.1).is_ok());
    let bare = Surface::new(&Builder::new(), &sheet(20, 60.0, |_, _| 0.0));
    let error = ask(&bare, &by_label, &tools[..1], Vec3::X * 0.1).unwrap_err();
    assert_eq!(error, FilterError::Unlabelled { label: VESSEL });
    let absent = filter.stand_off_of([(VESSEL, 3.0), (ABSENT, 2.0)]).expect("in range");
    let error = ask(&wall, &absent, &tools[..1], Vec3::X * 0.1).unwrap_err();
    assert_eq!(error, FilterError::Unlabelled { label: ABSENT });
    let own = filter.stand_off_of([(NERVE, 1.0)]).expect("in range");
    assert!(ask(&bare, &own, &tools[..1], Vec3::X * 0.1).is_ok());
}
