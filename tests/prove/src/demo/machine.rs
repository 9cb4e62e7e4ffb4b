//! The controller's machine: the emulated board, or the host.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use xtask::process::run;
use xtask::toolchain::Cross;
use xtask::{c_firmware, firmware, qemu, workspace};

use super::Options;
use super::bus::Bus;
use super::robot::Robot;
use super::scene::Scene;
use crate::footprint::Footprint;

/// A controller that is built and ready to run.
pub enum Machine {
    /// The firmware on QEMU's Cortex-M7.
    Board {
        /// The firmware.
        program: PathBuf,
        log: &'static str,
        /// Its use of the board's memory.
        footprint: Footprint,
        /// The toolchains that built it.
        toolchain: String,
        emulator: String,
        bus: Bus,
        /// What moves its instrument.
        robot: Robot,
    },
    /// The same control logic as a program.
    Host {
        program: PathBuf,
        /// Why it runs here and not on the board.
        reason: String,
        /// What moves its instrument.
        robot: Robot,
    },
}

impl Machine {
    /// Builds the controller, for the board if possible and wanted.
    pub fn prepare(options: &Options, scene: &Scene) -> Result<Self> {
        let robot = options.robot();
        if options.host {
            let reason = "as asked by --host".to_owned();
            if options.is_built {
                let program = std::env::current_exe()?.with_file_name("host");
                return Ok(Self::Host { program, reason, robot });
            }
            return Self::host(scene, reason, robot);
        }
        if options.c {
            return Self::in_c(scene);
        }
        match Cross::find().and_then(|cross| Ok((cross, qemu::find()?))) {
            Ok((cross, emulator)) => {
                let program = firmware::build(&cross, &scene.surface)?;
                let footprint = Footprint::read(&program)?;
                // In defmt's encoding: `defmt-print -e FIRMWARE < log.defmt`.
                let (log, toolchain) = ("log.defmt", cross.describe());
                let bus = match options {
                    Options { serial: true, .. } => Bus::Serial,
                    Options { bridge: true, .. } => Bus::Bridge,
                    _ => Bus::Ethernet,
                };
                Ok(Self::Board { program, log, footprint, toolchain, emulator, bus, robot })
            }
            Err(error) if options.board_only => Err(error),
            Err(error) => {
                let line = "!".repeat(78);
                eprintln!("{line}\n{error:#}\n");
                eprintln!("NO BOARD: running the control logic on this computer instead.");
                eprintln!("Instructions, deadlines, flash, RAM and stack will be missing.\n{line}");
                Self::host(scene, format!("no board: {error:#}"), robot)
            }
        }
    }

    /// The controller in C. If it is unavailable, there is no replacement.
    fn in_c(scene: &Scene) -> Result<Self> {
        ensure!(scene.tree.index_bits() == 16, "the C interface takes at most 65,536 vertices");
        let (cross, emulator, compiler) = (Cross::find()?, qemu::find()?, c_firmware::find()?);
        let vertices = scene.tree.summary().vertices;
        let program = c_firmware::build(&cross, scene.tree.blob(), vertices)?;
        let footprint = Footprint::read(&program)?;
        let toolchain = format!("{compiler}, its library by {}", cross.describe());
        let (log, bus) = ("log.txt", Bus::Serial);
        let robot = Robot::Script;
        Ok(Self::Board { program, log, footprint, toolchain, emulator, bus, robot })
    }

    fn host(scene: &Scene, reason: String, robot: Robot) -> Result<Self> {
        // This build also contains the controller's library. A separate folder for another surface, and the same
        // selection of packages for the default one, keep cargo from building anything twice.
        let folder = if scene.surface.is_default() {
            workspace::target()
        } else {
            workspace::target().join("host-controller")
        };
        let mut cargo = Command::new("cargo");
        cargo.args(["build", "--release", "--package", "dibs-prove"]);
        cargo.args(["--package", "firmware-example", "--bin", "host", "--target-dir"]).arg(&folder);
        cargo.current_dir(workspace::root());
        scene.surface.describe_to(&mut cargo);
        run(&mut cargo).context("the host's controller does not build")?;
        Ok(Self::Host { program: folder.join("release").join("host"), reason, robot })
    }

    pub const fn bus(&self) -> Bus {
        match self {
            Self::Board { bus, .. } => *bus,
            Self::Host { .. } => Bus::Serial,
        }
    }

    /// What moves its instrument.
    pub const fn robot(&self) -> Robot {
        match self {
            Self::Board { robot, .. } | Self::Host { robot, .. } => *robot,
        }
    }

    /// The command that runs the controller for `ticks` ticks, with this end of its bus. It connects to the socket
    /// `telemetry` for its telemetry.
    pub fn command(&self, bus: &qemu::Bus, telemetry: &Path, ticks: u32) -> Command {
        let mut command = match self {
            Self::Board { program, robot, .. } => {
                qemu::command(program, robot.word(), bus, telemetry, ticks)
            }
            Self::Host { program, robot, .. } => {
                let mut command = Command::new(program);
                if let qemu::Bus::Serial(socket) = bus {
                    command.arg(socket);
                }
                command.arg(telemetry).arg(ticks.to_string()).arg(robot.word());
                command
            }
        };
        command.stdin(Stdio::null());
        command
    }

    /// The name of the file for the controller's log.
    pub fn log(&self) -> &'static str {
        match self {
            Self::Board { log, .. } => log,
            Self::Host { .. } => "log.txt",
        }
    }

    /// One line for the user.
    pub fn describe(&self) -> String {
        match self {
            Self::Board { toolchain, emulator, bus, .. } => {
                let bus = match bus {
                    Bus::Serial => "serial line",
                    Bus::Ethernet => "UDP over Ethernet",
                    Bus::Bridge => "UDP over Ethernet by `dibs bridge`",
                };
                format!("Cortex-M7 (mps2-an500) in {emulator}, {bus}; built by {toolchain}")
            }
            Self::Host { reason, .. } => format!("program on this computer, {reason}"),
        }
    }
}
