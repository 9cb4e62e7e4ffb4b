//! The same bits on an emulated Cortex-M55 and an emulated RISC-V, and their instructions; frames without compare-and-swap.

// Requirements: A-11, F-01

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use xtask::process::{quiet, run};
use xtask::steps::Outcome;
use xtask::toolchain::add_target;
use xtask::{apt, qemu, workspace};

use super::bits::differences;
use super::torn;
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FLOW, golden, note};
use crate::harness::{Check, Effort, record};
use crate::probe::script::{Asks, Draw, Record, Script, Start};
use crate::probe::{Answers, Build, on_machine, run_emulated};

pub const CHECK: Check = Check {
    name: "the same bits on other processors",
    run: check,
    promises: &[
        note("processors.queries"),
        note("processors.ticks"),
        Promise {
            id: "processors.m55.different",
            says: "The same bits on a Cortex-M55 and on x86-64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {processors.queries} answers, half of them with their side",
            limits: "An emulated processor, without its vector unit.",
        },
        Promise {
            id: "processors.riscv.different",
            says: "The same bits on a RISC-V with F and A and on x86-64",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {processors.queries} answers, half of them with their side",
            limits: "An emulated processor.",
        },
        golden("processors.m55.mean"),
        golden("processors.riscv.mean"),
        Promise {
            id: "processors.m0.mixed",
            says: "No query sees vertices of two frames, published in its midst, on a processor without compare-and-swap",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {processors.m0.queries} queries while {processors.m0.published} frames were published and \
                   {processors.m0.put-off} put off; without the protocol {processors.m0.mixed-without} queries do",
            limits: "The code of a Cortex-M0, with the feature `portable-atomic`, on an emulated Cortex-M3: no emulated M0 has the \
                     memory.",
        },
        note("processors.m0.queries"),
        note("processors.m0.published"),
        note("processors.m0.put-off"),
        note("processors.m0.mixed-without"),
    ],
};

/// Timeout of asking the emulator for its version.
const MOMENT: Duration = Duration::from_secs(20);

/// An emulated machine that answers scripts.
struct Machine {
    /// Its name in the figures.
    name: &'static str,
    target: &'static str,
    feature: &'static str,
    program: &'static str,
    emulator: &'static str,
    package: &'static str,
    arguments: &'static [&'static str],
    /// Converts a difference of its clock to instructions.
    instructions: fn(u32) -> f64,
}

const MACHINES: [Machine; 2] = [
    Machine {
        name: "m55",
        target: "thumbv8m.main-none-eabihf",
        feature: "board",
        program: "probe",
        emulator: "qemu-system-arm",
        package: "qemu-system-arm",
        arguments: &["-machine", "mps3-an547", "-icount", "shift=6"],
        // The upper 24 bits count at 32 MHz, and an instruction takes 64 ns.
        instructions: |clock| f64::from(clock >> 8) / (32e6 * 64e-9),
    },
    Machine {
        name: "riscv",
        target: "riscv32imafc-unknown-none-elf",
        feature: "riscv",
        program: "riscv",
        emulator: "qemu-system-riscv32",
        package: "qemu-system-misc",
        arguments: &["-machine", "virt", "-bios", "none", "-icount", "shift=0"],
        instructions: f64::from,
    },
];

/// Queries without compare-and-swap: without an FPU they take long to emulate.
const NO_SWAP_QUERIES: u32 = 1_000;

/// The code of a processor without compare-and-swap.
const NO_SWAP: Machine = Machine {
    name: "m0",
    target: "thumbv6m-none-eabi",
    feature: "no-swap",
    program: "torn",
    emulator: "qemu-system-arm",
    package: "qemu-system-arm",
    arguments: &["-machine", "mps2-an385", "-icount", "shift=1"],
    // 25 MHz, and an instruction takes 2 ns.
    instructions: |clock| f64::from(clock) * 20.0,
};

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    if let Err(error) = prepare() {
        return Ok(Outcome::Skipped(format!("{error:#}")));
    }
    let script = Script::adversarial(effort.bits, Draw::EitherWay, 2);
    let path = Script::beating(effort.ticks.min(MOST_TICKS), Start::Warm, Asks::Distance);
    let tiny = Script::subnormal();
    let [here, there, near] = [&script, &path, &tiny].map(|script| Build::Release.answers(script));
    let (here, there, near) = (here?, there?, near?);
    figures.note("processors.queries", (script.queries() + tiny.queries()) as f64);
    figures.note("processors.ticks", path.queries() as f64);
    for machine in &MACHINES {
        let program = machine.build()?;
        let name = machine.name;
        let answers = on_machine(&mut machine.boot(&program), &script)?;
        let on_path = on_machine(&mut machine.boot(&program), &path)?;
        let on_tiny = on_machine(&mut machine.boot(&program), &tiny)?;
        let different = differences(&here, &answers, name)
            + differences(&there, &on_path, name)
            + differences(&near, &on_tiny, name);
        figures.note(&format!("processors.{name}.different"), different as f64);
        figures.note(&format!("processors.{name}.mean"), machine.mean(&on_path)?);
    }
    let program = NO_SWAP.build()?;
    let counts = run_emulated(&mut NO_SWAP.boot(&program), &torn::script(NO_SWAP_QUERIES)?)?;
    torn::note_counts("processors.m0", &counts, figures)?;
    Ok(Outcome::Passed)
}

/// Finds or installs compilers and emulators.
pub fn prepare() -> Result<()> {
    for machine in MACHINES.iter().chain([&NO_SWAP]) {
        add_target(machine.target).and_then(|()| machine.find()).context(machine.name)?;
    }
    Ok(())
}

/// Ticks on the path: the same number in every run, because their mean is a golden figure.
const MOST_TICKS: u32 = Effort::TEST.ticks;

impl Machine {
    /// Finds the emulator, or installs it.
    fn find(&self) -> Result<()> {
        let version = || quiet(Command::new(self.emulator).arg("--version"), MOMENT);
        version().or_else(|_| apt::install(&[self.package]).and_then(|()| version())).map(drop)
    }

    fn build(&self) -> Result<PathBuf> {
        let mut cargo = Command::new("cargo");
        cargo.args(["build", "--quiet", "--package", "dibs-probe", "--features", self.feature]);
        cargo.args(["--bin", self.program, "--profile", "firmware", "--target", self.target]);
        cargo.arg("--target-dir").arg(workspace::target()).current_dir(workspace::root());
        run(&mut cargo)?;
        Ok(workspace::target().join(self.target).join("firmware").join(self.program))
    }

    fn boot(&self, program: &Path) -> Command {
        let mut emulator = Command::new(self.emulator);
        emulator.args(self.arguments).args(qemu::HEADLESS).arg("-kernel").arg(program);
        emulator
    }

    /// Mean instructions of a query.
    fn mean(&self, answers: &Answers) -> Result<f64> {
        let queries = answers.iter().filter(|answer| matches!(answer.record, Record::Query { .. }));
        let counts: Vec<f64> = queries.map(|answer| (self.instructions)(answer.words[0])).collect();
        ensure!(!counts.is_empty(), "no query was asked");
        Ok((counts.iter().sum::<f64>() / counts.len() as f64).round())
    }
}

/// The table of docs/processors.md, from the records.
pub fn table() -> Result<String> {
    let figure = |name: &str| record::figure(name);
    let mut text = format!(
        "The emulated processors answer {} adversarial queries with the bits of x86-64, and the {} ticks of table 3's path \
         with a warm start. Their scalar units keep subnormals. Instructions are not cycles.\n\n\
         | emulated processor | answers that differ | instructions a query in the mean |\n|---|---:|---:|\n",
        figure("processors.queries")?,
        figure("processors.ticks")?,
    );
    for (processor, different, mean) in [
        ("Cortex-M7 (`mps2-an500`)", "bits.different", "m7.warm.mean"),
        ("Cortex-M55 (`mps3-an547`)", "processors.m55.different", "processors.m55.mean"),
        ("RISC-V, `riscv32imafc` (`virt`)", "processors.riscv.different", "processors.riscv.mean"),
    ] {
        text += &format!("| {processor} | {} | {} |\n", figure(different)?, figure(mean)?);
    }
    text += &format!(
        "\nCode for a Cortex-M0, on a Cortex-M3 (`mps2-an385`): {} of {} queries saw two frames.\n",
        figure("processors.m0.mixed")?,
        figure("processors.m0.queries")?
    );
    Ok(text)
}
