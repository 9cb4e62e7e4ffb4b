//! Surfaces that nodes carry, searched for failures by climbing, and compared with f64.

// Requirement: F-07

use anyhow::Result;
use dibs_tests::embedded::{Tally, all, judge};
use fastrand::Rng;
use rayon::prelude::*;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{EDGES, FLOW},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "surfaces that nodes carry on this computer",
    run: check,
    promises: &[
        Promise {
            id: "carried.wrong",
            says: "No answer on a surface that nodes carry is off by more than its accuracy",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {carried.queries} queries, {carried.signed} of them with the side; the largest error without it was {carried.off} of \
                   the accuracy",
            limits: "Spheres and capsules, with the built and the measured stretch, batched, with the side, and tracked. Truth in f64, \
                     from the mesh's own vertices, without the rounding of weights, by exhaustive search and winding numbers. \
                     Climbed over tools and nodes in {carried.shapes} volumes: lattices, hulls, needles, flat elements, a rolled \
                     sheet, several surfaces, limits of each element, vertices outside, on the border, on faces, edges and nodes.",
        },
        Promise {
            id: "carried.uncovered",
            says: "No vertex leaves the sphere of its section",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {carried.climbs} climbs, the farthest at {carried.farthest} of the radius",
            limits: "The same volumes, at the measured stretch, over all frames that the check admits.",
        },
        Promise {
            id: "carried.beyond",
            says: "No frame of nodes is admitted with an element stretched beyond its limit, or inverted",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {carried.admitted} admitted frames, the most stretched at {carried.most} of the limit; \
                   {carried.refused} were refused",
            limits: "Climbed over frames sent as packets, quantised and in floats, and checked in slices. Largest singular values \
                     and determinants in f64 of the nodes that the receiver has.",
        },
        note("carried.queries"),
        note("carried.signed"),
        note("carried.off"),
        note("carried.shapes"),
        note("carried.climbs"),
        note("carried.farthest"),
        note("carried.admitted"),
        note("carried.refused"),
        note("carried.most"),
    ],
};

/// Climbs on each shape between two looks at the number of queries.
const SEEDS: u64 = 2;

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let shapes = all(&mut Rng::with_seed(0));
    let (mut sum, mut first) = (Tally::default(), 0);
    while sum.queries < effort.carried {
        let climbs: Vec<_> = (first..first + SEEDS)
            .flat_map(|seed| shapes.iter().map(move |shape| (shape, seed)))
            .collect();
        let tallies: Vec<Tally> =
            climbs.into_par_iter().map(|(shape, seed)| judge(shape, seed)).collect();
        tallies.into_iter().for_each(|tally| sum += tally);
        first += SEEDS;
    }
    // Rounded down: a climb that comes near to a limit has not reached it.
    let rounded = |part: f64| (part * 1e6).floor() / 1e6;
    figures.note("carried.wrong", sum.wrong as f64);
    figures.note("carried.queries", sum.queries as f64);
    figures.note("carried.signed", sum.sides.poses as f64);
    figures.note("carried.off", rounded(sum.off));
    figures.note("carried.shapes", shapes.len() as f64);
    figures.note("carried.uncovered", sum.uncovered as f64);
    figures.note("carried.climbs", sum.climbs as f64);
    figures.note("carried.farthest", rounded(sum.farthest));
    figures.note("carried.beyond", sum.beyond as f64);
    figures.note("carried.admitted", sum.admitted as f64);
    figures.note("carried.refused", sum.refused as f64);
    figures.note("carried.most", rounded(sum.most));
    Ok(Outcome::Passed)
}
