//! A tree that has rotted in flash, and a controller that finds out.

use anyhow::{Context, Result, bail, ensure};
use controller::telemetry::{Tick, cause_code};
use dibs_nostd::Unavailable;
use dibs_nostd::failsafe::State;

use super::machine::Machine;
use super::scene::Scene;
use super::{Options, session};

/// What became of a controller with one bit of its tree flipped.
pub struct Rotted {
    /// Ticks that it ran.
    pub ticks: usize,
    /// Ticks that were acted on.
    pub acted: usize,
}

/// Flips the middle bit of the tree in the firmware's image, after the build that validated it, and runs
/// that on the board while frames come.
pub fn run(seconds: u32) -> Result<Rotted> {
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

    let outcome = session::run(&scene, &machine, seconds, None, folder.path())?;
    let last = outcome.ticks.last().context("the controller ran no tick")?;
    ensure!(last.frames_published > 0, "no frame was published");
    let is_found = |tick: &Tick| tick.cause == cause_code(&Unavailable::Rot);
    ensure!(is_found(last), "the flipped bit was not found");
    let acted = outcome.ticks.iter().filter(|tick| tick.state != State::Safe as u32).count();
    Ok(Rotted { ticks: outcome.ticks.len(), acted })
}
