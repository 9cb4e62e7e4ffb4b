//! Bit flips in a validated tree while it is in use: they cause no panic and no hang, and the scrub finds all of them.

// Requirements: M-01, M-02

use std::ops::AddAssign;

use anyhow::Result;
use dibs_build::BuiltTree;
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::{Options, Query, Scrub, Tree};
use dibs_tests::ask;
use dibs_tests::oracle::exhaustive;
use dibs_tests::poses::pose;
use dibs_tests::surfaces::{self, Surface};
use fastrand::Rng;
use rayon::prelude::*;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{DIAGNOSTICS, FAULTS},
    note,
};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "corruption on this computer",
    run: check,
    promises: &[
        note("corruption.cases"),
        note("corruption.errors"),
        note("corruption.right"),
        note("corruption.cautious"),
        Promise {
            id: "corruption.endless",
            says: "Bits that flip in a validated tree cause no panic, no hang and no access out of bounds",
            criterion: FAULTS,
            bound: Bound::Is(0.0),
            unit: "of {corruption.cases} damages, of one bit to a word",
            limits: "{corruption.errors} % end in an error, {corruption.right} % in a right answer, \
         {corruption.cautious} % in one that is too near.",
        },
        Promise {
            id: "corruption.undetected",
            says: "NOT detected by a query: a wrong radius, pin or index gives too great a distance",
            criterion: DIAGNOSTICS,
            bound: Bound::Informs,
            unit: "% of them",
            limits: "What the scrub is for.",
        },
        Promise {
            id: "corruption.unscrubbed",
            says: "`Scrub` finds every damage within two rounds",
            criterion: DIAGNOSTICS,
            bound: Bound::Is(0.0),
            unit: "of {corruption.cases} damages unnoticed",
            limits: "A round takes the tree's bytes over the bytes a call. Of damages beyond what a CRC-32 detects for \
         certain, one in 2^32 passes.",
        },
    ],
};

/// Damages tried on each pose.
const DAMAGES: usize = 100;

#[derive(Clone, Copy, Default)]
struct Tally {
    damages: u64,
    /// The query returned an error.
    errors: u64,
    /// The answer was correct, within its accuracy.
    right: u64,
    /// The stated distance was too small, which is safe.
    cautious: u64,
    /// The stated distance was too large, and the query could not detect it.
    undetected: u64,
    /// The search made more tests than a sound tree needs.
    endless: u64,
    /// The scrub did not find the damage.
    unscrubbed: u64,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.damages += other.damages;
        self.errors += other.errors;
        self.right += other.right;
        self.cautious += other.cautious;
        self.undetected += other.undetected;
        self.endless += other.endless;
        self.unscrubbed += other.unscrubbed;
    }
}

/// Damages sound trees: one bit, two bits anywhere, or a burst.
fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let surfaces = surfaces::all(true);
    let tallies: Vec<Tally> = (0..effort.cases.div_ceil(DAMAGES))
        .into_par_iter()
        .map(|pose| on_one_pose(&surfaces[pose % surfaces.len()], &mut Rng::with_seed(pose as u64)))
        .collect();
    let mut sum = Tally::default();
    tallies.into_iter().for_each(|tally| sum += tally);
    let share = |count: u64| 100.0 * count as f64 / sum.damages as f64;
    figures.note("corruption.cases", sum.damages as f64);
    figures.note("corruption.errors", share(sum.errors));
    figures.note("corruption.right", share(sum.right));
    figures.note("corruption.cautious", share(sum.cautious));
    figures.note("corruption.undetected", share(sum.undetected));
    figures.note("corruption.endless", sum.endless as f64);
    figures.note("corruption.unscrubbed", sum.unscrubbed as f64);
    Ok(Outcome::Passed)
}

fn on_one_pose(surface: &Surface, rng: &mut Rng) -> Tally {
    let built: &BuiltTree = &surface.tree;
    let sound = built.tree::<u16>().expect("16-bit indices");
    let triangles = surfaces::triangles(&sound);
    let rows = built.to_rows(&surface.mesh.positions);
    let tool = pose(&rows, &triangles, rng);
    let truth = exhaustive(&rows, &triangles, &tool).expect("has triangles").separation;
    // Upper bound on the work for a sound tree, with the root's test: an exact test of each triangle counts as eight.
    let most = 3 * sound.node_count() + 9 * (sound.triangle_count() + 1) + 1;
    let mut bytes = built.blob().to_vec();
    let mut tally = Tally::default();
    for _ in 0..DAMAGES {
        let bits = damage(bytes.len(), rng);
        flip(&mut bytes, &bits);
        tally.damages += 1;
        tally.unscrubbed += u64::from(scrub(&bytes).is_ok());
        match damaged(&sound, &bytes).map(|tree| {
            let mut query = Query::<_, MAX_STACK>::new(&tree).expect("enough for any tree");
            ask::closest(&mut query, rows.as_slice(), &tool, &Options::cold())
        }) {
            None | Some(Err(_)) => tally.errors += 1,
            Some(Ok(answer)) => {
                let high = f64::from(answer.separation - answer.accuracy) - truth;
                let low = truth - f64::from(answer.separation + answer.accuracy);
                if !(high <= 0.0) {
                    tally.undetected += 1;
                } else if low <= 0.0 {
                    tally.right += 1;
                } else {
                    tally.cautious += 1;
                }
                tally.endless += u64::from(answer.work() > most);
            }
        }
        flip(&mut bytes, &bits);
    }
    tally
}

/// The tree as the firmware uses it: validated earlier, with the section offsets read then.
fn damaged<'b>(sound: &Tree<'_, u16>, bytes: &'b [u8]) -> Option<Tree<'b, u16>> {
    sound.moved_to(bytes).ok()
}

fn scrub(bytes: &[u8]) -> Result<(), dibs_nostd::CorruptTreeError> {
    Scrub::new(bytes).step(bytes.len())
}

/// Bits to flip: one, two anywhere, up to eight anywhere, or a burst within a word.
fn damage(bytes: usize, rng: &mut Rng) -> Vec<usize> {
    let bits = 8 * bytes;
    let mut chosen: Vec<usize> = match rng.u32(..4) {
        0 => vec![rng.usize(..bits)],
        1 => vec![rng.usize(..bits), rng.usize(..bits)],
        2 => (0..rng.usize(3..=8)).map(|_| rng.usize(..bits)).collect(),
        _ => {
            let start = rng.usize(..bits - 32);
            let pattern = rng.u32(1..);
            (0..32).filter(|bit| pattern >> bit & 1 == 1).map(|bit| start + bit).collect()
        }
    };
    chosen.sort_unstable();
    chosen.dedup();
    chosen
}

fn flip(bytes: &mut [u8], bits: &[usize]) {
    for &bit in bits {
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}
