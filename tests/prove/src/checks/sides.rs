//! The side of a tool, compared with f64.

// Requirement: S-01

use anyhow::Result;
use dibs_tests::side_poses::{POSES_OF_A_FRAME, Tally, closed, judge};
use rayon::prelude::*;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::EDGES, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "sides on this computer",
    run: check,
    promises: &[
        Promise {
            id: "sides.wrong",
            says: "No side and no signed separation is wrong, on closed surfaces that bend",
            criterion: EDGES,
            bound: Bound::Is(0.0),
            unit: "of {sides.poses} poses at vertices, edges, slivers and in folds, {sides.inside} of them inside",
            limits: "Sides by winding numbers in f64, distances by exhaustive search. At {sides.self-cut} poses the surface is \
                     shown to cut itself, and the side is that of the nearest sheet, by the pseudonormal in f64.",
        },
        Promise {
            id: "sides.undefined",
            says: "Sides that are undefined away from contact are rare",
            criterion: EDGES,
            bound: Bound::AtMost(0.1),
            unit: "% of {sides.away} poses at least 0.01 mm away; of all poses {sides.undefined.all} are undefined",
            limits: "Half of the poses were put within 0.1 mm of the surface.",
        },
        note("sides.poses"),
        note("sides.inside"),
        note("sides.self-cut"),
        note("sides.away"),
        note("sides.undefined.all"),
    ],
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let surfaces = closed();
    let shares: usize = surfaces.iter().map(|surface| surface.share).sum();
    let frames: Vec<(usize, u64)> = surfaces
        .iter()
        .enumerate()
        .flat_map(|(row, surface)| {
            let poses = effort.sides * surface.share;
            (0..poses.div_ceil(shares * POSES_OF_A_FRAME) as u64).map(move |seed| (row, seed))
        })
        .collect();
    let tallies: Vec<Tally> =
        frames.into_par_iter().map(|(row, seed)| judge(&surfaces[row], seed)).collect();
    let mut sum = Tally::default();
    tallies.into_iter().for_each(|tally| sum += tally);
    figures.note("sides.poses", sum.poses as f64);
    figures.note("sides.inside", sum.inside as f64);
    figures.note("sides.self-cut", sum.self_cut as f64);
    figures.note("sides.away", sum.away as f64);
    figures.note("sides.undefined.all", sum.undefined as f64);
    let share = sum.undefined_away as f64 / sum.away as f64 * 100.0;
    figures.note("sides.undefined", (share * 1e4).round() / 1e4);
    figures.note("sides.wrong", sum.wrong as f64);
    Ok(Outcome::Passed)
}
