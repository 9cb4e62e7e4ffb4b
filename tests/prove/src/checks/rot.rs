//! A tree that has rotted in flash, and a controller that finds out.

use anyhow::{Context, Result, bail, ensure};
use controller::telemetry::{Tick, cause_code};
use dibs_nostd::Unavailable;
use dibs_nostd::failsafe::State;
use xtask::steps::Outcome;

use crate::demo::machine::Machine;
use crate::demo::scene::Scene;
use crate::demo::{Options, session};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::DIAGNOSTICS, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "demo with a tree that rots",
    run: check,
    promises: &[
        note("demo.rot.ticks"),
        Promise {
            id: "demo.rot",
            says: "With one bit of the tree flipped in flash the output is safe from the first round of the scrub on",
            criterion: DIAGNOSTICS,
            bound: Bound::Is(0.0),
            unit: "of {demo.rot.ticks} ticks acted",
            limits: "The bit is flipped in the firmware's image, after the compiler has validated the tree.",
        },
    ],
};

/// Seconds of the controller's time.
const SECONDS: u32 = 3;

/// Flips the middle bit of the tree in the firmware's image, after the build that validated it, and runs
/// that on the board while frames come.
fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let options = Options { board_only: true, ..Options::default() };
    let scene = Scene::load(&options)?;
    let mut machine = Machine::prepare(&options, &scene)?;
    let Machine::Board { program, .. } = &mut machine else { bail!("no board") };
    let mut image = std::fs::read(&program)?;
    let tree = scene.tree.blob();
    let place = image.windows(tree.len()).position(|part| part == tree);
    let place = place.context("the firmware does not contain the tree")?;
    image[place + tree.len() / 2] ^= 1 << 4;
    let folder = tempfile::tempdir()?;
    *program = folder.path().join("board");
    std::fs::write(&program, image)?;

    let outcome = session::run(&scene, &machine, SECONDS, None, folder.path())?;
    let last = outcome.ticks.last().context("the controller ran no tick")?;
    ensure!(last.frames_published > 0, "no frame was published");
    let is_found = |tick: &Tick| tick.cause == cause_code(&Unavailable::Rot);
    ensure!(is_found(last), "the flipped bit was not found");
    let acted = outcome.ticks.iter().filter(|tick| tick.state != State::Safe as u32).count();
    figures.note("demo.rot.ticks", outcome.ticks.len() as f64);
    figures.note("demo.rot", acted as f64);
    Ok(Outcome::Passed)
}
