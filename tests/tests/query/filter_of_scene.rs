//! A filter of a chain in a scene: the pairs of two tools and two surfaces.

// Requirements: C-05, C-06

use dibs_build::{Builder, Mesh};
use dibs_nostd::filter::{Filter, Reason, RigidMotion, Uncertainty};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Capsule, Odometer, Tracker};
use dibs_tests::deform::unit;
use dibs_tests::oracle::least_distance;
use dibs_tests::surfaces::{ball, moved, sheet};
use fastrand::Rng;
use glam::{DVec3, Vec3};

/// A chain of two tools between a wall and an organ that swings: four pairs, of which none comes nearer than the
/// stand-off.
#[test]
fn two_tools_keep_off_two_surfaces() {
    const STAND_OFF: f64 = 1.0;
    const PERIOD: f64 = 0.001;
    /// Largest shift of the organ (mm), and its rate (1/s).
    const SWING: f64 = 2.0;
    const RATE: f64 = 15.0;
    let meshes = [sheet(10, 80.0, |_, _| 0.0), moved(&ball(2), Vec3::Z * 54.0)];
    let built = meshes.each_ref().map(|mesh| Builder::new().build(mesh).expect("a valid mesh"));
    let trees = built.each_ref().map(|built| built.tree::<u16>().expect("16-bit indices"));
    let shift = |surface: usize, time: f64| {
        DVec3::new(0.6, 0.0, 0.8) * SWING * (RATE * time).sin() * surface as f64
    };
    let frames = |surface: usize, time: f64| -> Vec<Vec3> {
        let by = shift(surface, time).as_vec3();
        built[surface].to_rows(&meshes[surface].positions).iter().map(|&at| at + by).collect()
    };
    let mut trackers =
        [0, 0, 1, 1].map(|at| Tracker::<_, MAX_STACK, 256>::new(&trees[at]).expect("deep enough"));
    let mut odometers = trees.each_ref().map(|tree| Odometer::new(tree));
    let filter = Filter::new(STAND_OFF as f32, 200.0).expect("in range");
    let uncertainty = Uncertainty::new((SWING * RATE * 1.001) as f32);
    let mut rng = Rng::with_seed(5);
    let mut joints = [40.0, 50.0, 90.0].map(|x| Vec3::new(x, 0.0, 7.0));
    let mut before = [0, 1].map(|surface| frames(surface, 0.0));
    let (mut goal, mut spin) = (Vec3::ZERO, Vec3::ZERO);
    // Of each pair: ticks within half a millimetre of the stand-off.
    let (mut near, mut least) = ([0_u32; 4], f64::INFINITY);
    for tick in 0..4_000 {
        let time = f64::from(tick) * PERIOD;
        if tick % 50 == 0 {
            let at = |rng: &mut Rng, size: f32| (rng.f32() - 0.5) * size;
            goal = Vec3::new(at(&mut rng, 60.0), at(&mut rng, 60.0), 7.0 + at(&mut rng, 40.0));
            spin = unit(&mut rng) * 0.004;
        }
        let after = [0, 1].map(|surface| frames(surface, time));
        let [one, other] = &mut odometers;
        let [wall, organ] = [(one, 0), (other, 1)].map(|(odometer, at)| {
            odometer.step(before[at].as_slice(), after[at].as_slice()).after()
        });
        let tools = [0, 1].map(|at| Capsule::new(joints[at], joints[at + 1], 1.0).expect("finite"));
        let [a, b, c, d] = &mut trackers;
        let [tip, shaft] = &tools;
        let mut pairs = [(a, &wall, tip), (b, &wall, shaft), (c, &organ, tip), (d, &organ, shaft)];
        let command = RigidMotion::new(joints[0], (goal - joints[0]).clamp_length_max(0.2), spin);
        let admitted = filter.admit(&mut pairs, &command, PERIOD as f32, &uncertainty, &[]);
        let admitted = admitted.expect("an answer");
        // Four trackers that start anew have no answer yet in the first tick, and then nothing moves.
        let is_safe = admitted.reason != Reason::NoSafeMotion;
        let is_at_rest = admitted.motion.translation == Vec3::ZERO;
        assert!(is_safe || tick == 0 && is_at_rest, "{tick}: {admitted:?}");
        let ends = joints.map(|joint| admitted.motion.apply(joint));
        for (pair, near) in near.iter_mut().enumerate() {
            let (surface, tool) = (pair / 2, pair % 2);
            let mut nearest = f64::INFINITY;
            for instant in 0..=5 {
                let share = f64::from(instant) / 5.0;
                let by = shift(surface, time + share * PERIOD);
                let Mesh { positions, triangles, .. } = &meshes[surface];
                let corners = triangles
                    .iter()
                    .map(|rows| rows.map(|row| positions[row as usize].as_dvec3() + by));
                let [start, end] = [tool, tool + 1]
                    .map(|at| joints[at].as_dvec3().lerp(ends[at].as_dvec3(), share));
                nearest = nearest.min(least_distance(start, end, corners) - 1.0);
            }
            assert!(nearest > STAND_OFF - 0.02, "{tick}, pair {pair}: {nearest} {admitted:?}");
            assert!(nearest > f64::from(admitted.least_separation) - 1e-3, "{tick}, pair {pair}");
            *near += u32::from(nearest < STAND_OFF + 0.5);
            least = least.min(nearest);
        }
        (joints, before) = (ends, after);
    }
    println!("{near:?} ticks near, {least} mm");
    assert!(near.iter().all(|&ticks| ticks > 100), "{near:?}");
}
