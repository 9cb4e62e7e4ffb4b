//! A simulated hand pushes against the constraint: all contacts together hold it, the closest pair alone not always.

// Requirements: C-03, C-04

use anyhow::Result;
use controller::{ACCOUNT, Hand, PERIOD};
use dibs_tests::hand::{Pushed, scenes};
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FLOW, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "a hand on this computer",
    run: check,
    promises: &[
        Promise {
            id: "hand.through",
            says: "A simulated hand does not get through: flat wall, corner, gap, groove, sphere, beating heart",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {hand.scenes} got the instrument's centre through; the least separation of an instrument of 1 mm was \
         {hand.least} mm",
            limits: "200 g, 20 N s/m, pushed with {hand.push} N of 5 for 4 s at 1 kHz; 1 N/mm, 2 N s/m, margin 5 mm.",
        },
        Promise {
            id: "hand.alone",
            says: "The closest pair alone lets it through: in the corner, and in the groove, whose walls lean 12 degrees from upright",
            criterion: FLOW,
            bound: Bound::AtLeast(1.0),
            unit: "of {hand.scenes}",
            limits: "The same hand.",
        },
        note("hand.scenes"),
        note("hand.least"),
        note("hand.push"),
        Promise {
            id: "hand.step",
            says: "The force of all contacts through an account of its energy changes by at most 0.5 N from one tick to the next",
            criterion: FLOW,
            bound: Bound::AtMost(0.5),
            unit: "N; {hand.step.alone} N by the closest pair alone, without an account",
            limits: "The same pushes, the first contact among them.",
        },
        Promise {
            id: "hand.given",
            says: "It gives the hand no more energy than a tank of 1 mJ beyond what the hand gave",
            criterion: FLOW,
            bound: Bound::AtMost(1.0),
            unit: "mJ; {hand.given.alone} mJ by the closest pair alone, without an account",
            limits: "The same pushes, relative to the wall, at any time; every frame is new. Late frames, holds and saturation are \
                     control/constraint/account/tests.rs: at most 1 mJ on 200 random walls, and where a force must fall \
                     {hand.overdraft} mJ more, by no more than 0.5 N a tick.",
        },
        note("hand.given.alone"),
        note("hand.overdraft"),
        note("hand.step.alone"),
    ],
};

/// The account's tank (mJ).
const TANK: f32 = 1.0;

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let scenes = scenes();
    let push = |by_all| scenes.iter().map(|scene| scene.push(by_all)).collect::<Vec<Pushed>>();
    let (all, alone) = (push(true), push(false));
    let through = |pushed: &[Pushed]| pushed.iter().filter(|one| one.is_through()).count() as f64;
    let rounded = |x: f32| (f64::from(x) * 1e3).round() / 1e3;
    let step = |pushed: &[Pushed]| rounded(pushed.iter().fold(0.0, |most, one| one.step.max(most)));
    figures.note("hand.through", through(&all));
    figures.note("hand.alone", through(&alone));
    figures.note("hand.scenes", scenes.len() as f64);
    figures.note("hand.least", rounded(all.iter().fold(f32::INFINITY, |a, b| a.min(b.least))));
    figures.note("hand.push", rounded(Hand::PUSH));
    let given =
        |pushed: &[Pushed]| rounded(pushed.iter().fold(0.0, |most, one| one.given.max(most)));
    figures.note("hand.given", given(&all));
    figures.note("hand.given.alone", given(&alone));
    figures.note("hand.overdraft", rounded(ACCOUNT.most(PERIOD) - TANK));
    figures.note("hand.step", step(&all));
    figures.note("hand.step.alone", step(&alone));
    Ok(Outcome::Passed)
}
