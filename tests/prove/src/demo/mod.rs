//! `cargo xtask demo`: a beating heart streamed to the controller, while a simulated hand pushes the instrument against it.

mod bridge;
pub mod bridged;
mod bus;
pub mod check;
mod contacts;
pub mod debugger;
mod faults;
pub mod flood;
mod forces;
pub mod freshness;
pub mod hand;
mod hand_plot;
pub mod machine;
mod plot;
mod push;
mod replay;
mod report;
pub mod robot;
pub mod scene;
mod sender;
pub mod session;
mod steps;
mod surface;
mod timeline;
mod transition;

use std::path::PathBuf;

use anyhow::{Context, Result};
use faults::Plan;
use machine::Machine;
use report::Report;
use robot::Robot;
use scene::{Cells, Scene};
use session::Harm;
use xtask::steps::Outcome;
use xtask::workspace;

/// The lattice of 720 nodes.
pub const LATTICE: &str = "lattice:9,8,7";

/// Streams a beating heart to the firmware while a simulated hand pushes its instrument against it, by force and by
/// commands, without penetrating it. Every answer is checked against an exhaustive search.
#[derive(clap::Args, Default)]
pub struct Options {
    /// The mesh at rest, in any format that `dibs build` reads; the generated heart of 10,272 triangles if absent.
    #[arg(long, requires = "motion")]
    pub mesh: Option<PathBuf>,
    /// Its motion: .pc2, .npy or a series (heart_%03d.vtp), with a position for each of the mesh's vertices in every frame.
    #[arg(long, requires = "mesh")]
    pub motion: Option<PathBuf>,
    /// Frames a second of the motion; by default the number in its file, or 25 without one.
    #[arg(long, value_name = "HZ", requires = "motion", allow_negative_numbers = true)]
    pub motion_rate: Option<f32>,
    /// Stretch limit of every triangle. By default 1.5 for the generated heart; for a mesh of your own, limits learned
    /// from its motion with a margin of a tenth.
    #[arg(long, allow_negative_numbers = true)]
    pub stretch: Option<f32>,
    /// The nodes of a lattice, `lattice:NX,NY,NZ`, move the surface, a generated heart of 50,000 triangles, and frames
    /// hold their positions; 9 x 8 x 7 cells if none are given.
    #[arg(long, value_name = "VOLUME", num_args = 0..=1, default_missing_value = LATTICE, value_parser = scene::cells)]
    #[arg(conflicts_with_all = ["mesh", "c"])]
    pub nodes: Option<Cells>,
    /// A script moves the instrument instead of the hand, around the surface and through it: nothing stops it, so every
    /// force is tested. This is the default with `--c` and `--faults`.
    #[arg(long, visible_alias = "path")]
    pub script: bool,
    /// Seconds of the controller's time to run.
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=3600))]
    pub seconds: u32,
    /// Runs the controller as a program on this computer, without cross toolchain and QEMU.
    #[arg(long)]
    pub host: bool,
    /// Runs the controller in C, `examples/c/firmware`, compiled by Debian's `arm-none-eabi-gcc`.
    #[arg(long, conflicts_with = "host")]
    pub c: bool,
    /// Uses a serial line as the bus instead of Ethernet: the heart beats in slow motion. The controllers on this
    /// computer and in C support no other bus.
    #[arg(long)]
    pub serial: bool,
    /// Takes the frames from an OpenIGTLink source through `dibs bridge`, 60 per second of the board's time.
    #[arg(long, conflicts_with_all = ["host", "c", "serial", "faults"])]
    pub bridge: bool,
    /// Injects faults of every kind into the bus, and cuts it once for a while.
    #[arg(long)]
    pub faults: bool,
    /// The faults' seed.
    #[arg(long, default_value_t = 1, requires = "faults")]
    pub seed: u64,
    /// Folder for the report and the pictures; `demo` in Cargo's target folder if absent.
    #[arg(short, long)]
    pub output: Option<PathBuf>,
    /// Whether the host must not replace the board if the board is unavailable.
    #[arg(skip)]
    pub board_only: bool,
    /// Whether the host's controller has been built beside this program.
    #[arg(skip)]
    pub is_built: bool,
}

impl Options {
    /// What moves the instrument.
    pub const fn robot(&self) -> Robot {
        if self.script || self.c || self.faults { Robot::Script } else { Robot::Hand }
    }
}

/// Runs the demo and writes its report and pictures; an error names each broken promise.
pub fn run(options: &Options) -> Result<()> {
    let scene = Scene::load(options)?;
    println!("surface: {}", scene.describe());
    eprintln!("building the controller ...");
    let machine = Machine::prepare(options, &scene)?;
    println!("controller: {}", machine.describe());

    let folder = options.output.clone().unwrap_or_else(|| workspace::target().join("demo"));
    std::fs::create_dir_all(&folder)
        .with_context(|| format!("cannot make the folder {}", folder.display()))?;
    let harm = if options.faults {
        Harm::Bus(Plan::new(options.seed, options.seconds))
    } else {
        Harm::Nothing
    };
    let outcome = session::run(&scene, &machine, options.seconds, &harm, &folder)?;
    // Made before anything is written, because it states the commit, and whether the checkout is clean.
    let report = Report::new(&scene, &machine, &outcome)?;
    plot::draw(&outcome, &folder)?;
    hand_plot::draw(&outcome, &folder)?;
    if options.faults {
        timeline::draw(&outcome, &folder)?;
    }
    report.write(&folder)?;
    replay::write(&scene, &outcome.ticks, outcome.hand.as_ref(), &folder)?;
    report.print(&folder);
    report.verdict()
}

/// The demo of `cargo xtask test` on this computer, with the script.
pub fn on_host(seconds: u32) -> Result<Outcome> {
    run(&Options { seconds, host: true, script: true, is_built: true, ..Options::default() })
        .map(|()| Outcome::Passed)
}
