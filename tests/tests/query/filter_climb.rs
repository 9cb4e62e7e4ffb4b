//! Climbs towards a tool nearer than its stand-off, over what a filter is told and what it is asked.

// Requirement: C-05

use dibs_tests::climb::climb;
use dibs_tests::filter::{Episode, Scene, scenes, walk};
use dibs_tests::sample;
use fastrand::Rng;
use rayon::prelude::*;

/// Ticks of a walk, and walks of a climb.
const TICKS: u32 = 100;
const STEPS: usize = 12;

#[derive(Clone, Debug)]
struct Walk {
    episode: Episode,
    /// Of the tissue's and the hand's motion.
    seed: u64,
}

impl Walk {
    fn any(rng: &mut Rng) -> Self {
        Self { episode: Episode { ticks: TICKS, ..Episode::any(rng) }, seed: rng.u64(..) }
    }

    fn changed(&self, rng: &mut Rng) -> Self {
        let mut next = self.clone();
        let Episode { period, stand_off, robot, tissue, frames, .. } = &mut next.episode;
        let by = 0.5 + rng.f32();
        match rng.u32(..9) {
            0 => *period = (*period * f64::from(by)).clamp(0.0005, 0.004),
            1 => *stand_off = (*stand_off * by).min(3.0),
            2 => *robot = (*robot * by).clamp(50.0, 1_000.0),
            3 => *tissue = (*tissue * by + 10.0 * rng.f32()).min(300.0),
            4 => *frames = rng.u32(1..=33),
            5 => next.episode.registration = 0.5 * rng.f32(),
            6 => {
                let instructions = next.episode.instructions as f32 * by;
                next.episode.instructions = instructions.clamp(25_000.0, 200_000.0) as u32;
            }
            7 => next.episode.approach = 0.05 * rng.f32().powi(2),
            _ => next.seed = rng.u64(..),
        }
        next
    }

    /// The largest shortfall (mm) from the stand-off in ticks that promise it.
    fn shortfall(&self, scene: &Scene, judged: &mut [u64; 2]) -> Option<f64> {
        let tally = walk(scene, &self.episode, self.seed);
        let wrong = (tally.violations, tally.uncertain, tally.too_fast);
        assert_eq!(wrong, (0, 0, 0), "{self:?}: {tally:?}");
        assert!(tally.most_instructions <= self.episode.instructions, "{self:?}: {tally:?}");
        judged[0] += tally.ticks;
        judged[1] += tally.near;
        tally.worst
    }
}

#[test]
fn no_climb_brings_a_tool_nearer_than_its_stand_off() {
    let scenes = scenes();
    let climbs = (0..sample(240) as u64).into_par_iter().map(|seed| {
        let scene = &scenes[seed as usize % scenes.len()];
        let mut rng = Rng::with_seed(seed);
        let start = Walk::any(&mut rng);
        let mut judged = [0; 2];
        let first = start.shortfall(scene, &mut judged).unwrap_or(f64::NEG_INFINITY);
        let change = |state: &Walk| state.changed(&mut rng);
        let (_, best) = climb(start, STEPS, change, |one| one.shortfall(scene, &mut judged));
        (judged, best > first, best)
    });
    let (mut ticks, mut near, mut climbed, mut worst) = (0, 0, 0, f64::NEG_INFINITY);
    for (judged, is_higher, best) in climbs.collect::<Vec<_>>() {
        ticks += judged[0];
        near += judged[1];
        climbed += u32::from(is_higher);
        worst = worst.max(best);
    }
    println!("{ticks} ticks, {near} near, {climbed} climbs, the worst {worst} mm");
    assert!(near > 10_000 && climbed > 20 && worst > 1e-4, "{ticks} {near} {climbed} {worst}");
}
