//! The emulated board.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, anyhow};

use crate::apt;
use crate::process::quiet;

const PROGRAM: &str = "qemu-system-arm";

/// `-icount shift=1`: one instruction takes 2 ns of the board's time. This is about a Cortex-M7 at 480 MHz that always
/// executes one instruction a cycle.
const SHIFT: u32 = 1;

/// Instructions for each count of the board's 25 MHz clock.
pub const INSTRUCTIONS_A_COUNT: u32 = 40 >> SHIFT;

/// Arguments of a machine that only needs semihosting.
pub const HEADLESS: [&str; 8] = [
    "-display",
    "none",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
];

/// Finds QEMU, or installs it. Returns its version line.
pub fn find() -> Result<String> {
    version().or_else(|_| apt::install(&[PROGRAM]).and_then(|()| version())).map_err(|error| {
        anyhow!("no QEMU: {error:#}\nInstall it, then try again:\n  sudo apt-get install {PROGRAM}")
    })
}

fn version() -> Result<String> {
    let text = quiet(Command::new(PROGRAM).arg("--version"), Duration::from_secs(20))?;
    Ok(text.lines().next().unwrap_or_default().to_owned())
}

/// The emulated processor's time.
#[derive(Clone, Copy)]
pub enum Time {
    /// This computer's clock.
    Real,
    /// Every instruction takes 2 to this power nanoseconds.
    Counted(u32),
}

/// The time of a Cortex-M7 at about 480 MHz. While the processor sleeps, counted time jumps to the next interrupt; real
/// time would overshoot by the host's wake-up latency.
pub const BOARD: Time = Time::Counted(SHIFT);

/// The command that boots a program with these arguments, without serial lines: the program needs only semihosting.
pub fn alone(program: &Path, time: Time, arguments: &[&str]) -> Command {
    let mut command = boot(program, time, arguments);
    command.args(["-serial", "none"]);
    command
}

/// The command that boots a program in real time, with its UART 0 connected to this socket.
pub fn with_serial(program: &Path, socket: &Path) -> Command {
    let mut command = boot(program, Time::Real, &[]);
    command.arg("-serial").arg(format!("unix:{}", socket.display()));
    command
}

/// The board's bus.
pub enum Bus {
    /// UART 0, connected to this socket.
    Serial(PathBuf),
    /// The LAN9118, with this backend of the emulator's `-nic`.
    Ethernet(String),
}

/// The command that boots `program` for `ticks` control ticks, with the argument `robot`. Its telemetry is UART 1,
/// connected to the socket `telemetry`.
pub fn command(program: &Path, robot: &str, bus: &Bus, telemetry: &Path, ticks: u32) -> Command {
    // The firmware reads its robot, its bus and its run length from the arguments.
    let (bus_word, serial) = match bus {
        Bus::Serial(socket) => ("serial", format!("unix:{}", socket.display())),
        Bus::Ethernet(_) => ("ethernet", "null".to_owned()),
    };
    let mut command = boot(program, BOARD, &["board", robot, bus_word, &ticks.to_string()]);
    command.args(["-serial", &serial, "-serial"]).arg(format!("unix:{}", telemetry.display()));
    if let Bus::Ethernet(backend) = bus {
        command.args(["-nic", &format!("{backend},model=lan9118")]);
    }
    command
}

fn boot(program: &Path, time: Time, arguments: &[&str]) -> Command {
    let mut command = Command::new(PROGRAM);
    command.args(["-machine", "mps2-an500", "-cpu", "cortex-m7"]);
    command.args(["-display", "none", "-monitor", "none"]);
    if let Time::Counted(shift) = time {
        command.args(["-icount", &format!("shift={shift}")]);
    }
    let arguments: String = arguments.iter().map(|argument| format!(",arg={argument}")).collect();
    command.args(["-semihosting-config", &format!("enable=on,target=native{arguments}")]);
    command.arg("-kernel").arg(program);
    command
}
