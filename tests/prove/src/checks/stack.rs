//! The firmware's stack: a bound from the binary, and the detection of an overflow.

// Requirement: P-02

use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use xtask::firmware::{self, Surface};
use xtask::qemu;
use xtask::steps::Outcome;
use xtask::toolchain::Cross;

use crate::binary::Binary;
use crate::harness::figures::Figures;
use crate::harness::promise::{
    Bound, Promise,
    criteria::{FLOW, MEMORY, TIMING},
    note,
};
use crate::harness::{Check, Effort};
use crate::probe::board;

pub const CHECK: Check = Check {
    name: "stack of the firmware",
    run: check,
    promises: &[
        note("stack.idle"),
        note("stack.bus"),
        note("stack.control"),
        Promise {
            id: "stack.bound",
            says: "Stack at the worst, from the binary: idle loop, bus and control tick on top of each other, and a fault",
            criterion: MEMORY,
            bound: Bound::NotAbove("stack.room"),
            unit: "bytes: idle {stack.idle}, bus {stack.bus}, control {stack.control}, and what exceptions put between",
            limits: "Frames by the compiler and by the instructions, calls by the branches; no recursion.",
        },
        Promise {
            id: "stack.room",
            says: "Stack that the linker gives",
            criterion: MEMORY,
            bound: Bound::Informs,
            unit: "bytes",
            limits: "At the bottom of RAM: below it is nothing.",
        },
        Promise {
            id: "stack.indirect",
            says: "Calls through a register",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "in the firmware",
            limits: "",
        },
        Promise {
            id: "stack.overflow-unnoticed",
            says: "A stack that overflows stops the firmware, and overwrites nothing",
            criterion: MEMORY,
            bound: Bound::Is(0.0),
            unit: "of one recursion put in on purpose",
            limits: "Needs memory.x's layout: the address below the stack must be a fault on your part too.",
        },
        Promise {
            id: "interrupts.masking",
            says: "Functions in the firmware that mask interrupts",
            criterion: TIMING,
            bound: Bound::AtMost(2.0),
            unit: "found by their instructions",
            limits: "Start-up takes the peripherals; neither interrupt masks anything.",
        },
    ],
};

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let cross = board()?;
    let program = firmware::build(&cross, &Surface::default())?;
    let binary = Binary::read(&program)?;
    let worst = binary.worst()?;
    figures.note("stack.idle", f64::from(worst.idle));
    figures.note("stack.bus", f64::from(worst.bus));
    figures.note("stack.control", f64::from(worst.control));
    figures.note("stack.bound", f64::from(worst.total));
    figures.note("stack.room", f64::from(binary.stack_room));
    let indirect = binary.indirect_when_idle();
    figures.note("stack.indirect", indirect.len() as f64);
    ensure!(indirect.is_empty(), "start-up calls through a register: {}", indirect.join(", "));
    figures.note("interrupts.masking", binary.masking.len() as f64);
    if !binary.masking.is_empty() {
        println!("functions that mask interrupts: {}", binary.masking.join(", "));
    }
    let noticed = overflow_is_noticed(&cross)?;
    figures.note("stack.overflow-unnoticed", f64::from(!noticed));
    Ok(Outcome::Passed)
}

/// A stack that overflows stops the firmware at once, through its fault handler.
fn overflow_is_noticed(cross: &Cross) -> Result<bool> {
    let mut cargo = firmware::command(cross, &Surface::default());
    xtask::process::run(cargo.args(["--features", "planted-overflow"]))?;
    let program = cross.program("firmware", "board");
    let mut qemu = qemu::alone(&program, qemu::Time::Real, &["board", "100"]);
    qemu.stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = qemu.spawn()?;
    let start = Instant::now();
    let code = loop {
        match child.try_wait()? {
            Some(status) => break status.code(),
            None if start.elapsed() > Duration::from_secs(20) => {
                child.kill()?;
                child.wait()?;
                break None;
            }
            None => thread::sleep(Duration::from_millis(20)),
        }
    };
    // Restores the program for the next check.
    firmware::build(cross, &Surface::default())?;
    Ok(code == Some(1))
}
