//! A controller detects that its tree has changed in flash.

// Requirements: C-01, M-02

use std::path::Path;
use std::process::Stdio;

use anyhow::{Context, Result, bail, ensure};
use controller::telemetry::{Tick, cause_code};
use dibs_nostd::Unavailable;
use dibs_nostd::failsafe::State;
use object::{Object, ObjectSegment};
use xtask::qemu;
use xtask::steps::Outcome;

use crate::demo::debugger::Bits;
use crate::demo::machine::Machine;
use crate::demo::scene::Scene;
use crate::demo::session::Harm;
use crate::demo::{Options, session};
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::DIAGNOSTICS, note};
use crate::harness::{Check, Effort};

pub const CHECK: Check = Check {
    name: "demo with a tree that rots",
    run: check,
    promises: &[
        note("demo.rot.ticks"),
        note("demo.rot.found-after"),
        Promise {
            id: "demo.rot",
            says: "A bit of the tree that flips in flash while the controller searches it is found, and the output is \
         safe from then on",
            criterion: DIAGNOSTICS,
            bound: Bound::Is(0.0),
            unit: "of {demo.rot.ticks} ticks acted afterwards; found within {demo.rot.found-after} ms",
            limits: "The bit is flipped by a debugger on the emulator. Until the scrub comes by, answers may be wrong. \
         With a bit that is flipped before the start the controller does not start.",
        },
    ],
};

/// Seconds of the controller's time.
const SECONDS: u32 = 3;

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let options = Options { board_only: true, script: true, ..Options::default() };
    let scene = Scene::load(&options)?;
    let machine = Machine::prepare(&options, &scene)?;
    let Machine::Board { program, .. } = &machine else { bail!("no board") };
    let image = std::fs::read(program)?;
    let tree = scene.tree.blob();
    let place = image.windows(tree.len()).position(|part| part == tree);
    let middle = place.context("the firmware does not contain the tree")? + tree.len() / 2;
    let folder = tempfile::tempdir()?;

    let bits = Bits { address: address(&image, middle)?, mask: 1 << 4 };
    let outcome = session::run(&scene, &machine, SECONDS, &Harm::Memory(bits), folder.path())?;
    let flipped = outcome.flipped_at.context("no frame was published")?;
    let is_found = |tick: &&Tick| tick.cause == cause_code(&Unavailable::CorruptTree);
    let found = outcome.ticks.iter().find(is_found).context("the flipped bit was not found")?;
    let after = outcome.ticks.iter().filter(|tick| tick.tick >= found.tick);
    let acted = after.clone().filter(|tick| tick.state != State::Safe as u32).count();
    figures.note("demo.rot.ticks", after.count() as f64);
    figures.note("demo.rot.found-after", f64::from(found.tick - flipped));
    figures.note("demo.rot", acted as f64);
    does_not_start(&image, middle, folder.path()).map(|()| Outcome::Passed)
}

/// The board's address of an offset in the linked program's file.
fn address(image: &[u8], place: usize) -> Result<u32> {
    let file = object::File::parse(image)?;
    let place = place as u64;
    let found = file.segments().find_map(|segment| {
        let (start, length) = segment.file_range();
        let offset = place.checked_sub(start).filter(|offset| *offset < length)?;
        Some(segment.address() + offset)
    });
    Ok(u32::try_from(found.context("the tree is in no segment")?)?)
}

/// Checks that a controller whose tree is damaged from the start ends at once.
fn does_not_start(image: &[u8], place: usize, folder: &Path) -> Result<()> {
    let mut damaged = image.to_vec();
    damaged[place] ^= 1 << 4;
    let program = folder.join("board");
    std::fs::write(&program, damaged)?;
    let mut board = qemu::alone(&program, qemu::BOARD, &["board", "1000"]);
    let ended = board.stdout(Stdio::null()).status()?;
    ensure!(!ended.success(), "a controller whose tree is damaged has started");
    Ok(())
}
