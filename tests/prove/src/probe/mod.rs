//! The probe: a program that executes a script, on the emulated board and on the host.

pub mod filter;
pub mod script;
pub mod ticks;

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use probe::ANSWER_WORDS;
use xtask::process::run;
use xtask::qemu::Time;
use xtask::toolchain::Cross;
use xtask::{qemu, valgrind, workspace};

use self::script::{Record, Script};

/// One answer: its words, the first of which is its duration on the clock.
pub struct Answer<'a> {
    /// The question.
    pub record: Record,
    /// The answers.
    pub words: &'a [u32],
    /// Its instructions, if counted.
    pub instructions: u32,
}

impl Answer<'_> {
    /// Node tests that the budget counts, and triangle tests.
    pub fn tests(&self) -> [u32; 2] {
        [self.words[1].saturating_sub(1), self.words[2]]
    }

    /// The bits that must be the same on every machine.
    pub fn bits(&self) -> &[u32] {
        &self.words[1..]
    }
}

/// The answers to a script.
pub struct Answers {
    words: Vec<u32>,
    records: Vec<Record>,
    /// Instructions of each query, if callgrind counted them.
    counts: Option<Vec<u32>>,
}

impl Answers {
    fn new(words: Vec<u32>, script: &Script) -> Result<Self> {
        let expected: usize = script.records.iter().map(|&record| length(record)).sum();
        ensure!(words.len() == expected, "{} words answered, not {expected}", words.len());
        Ok(Self { words, records: script.records.clone(), counts: None })
    }

    /// All answers, in order.
    pub fn iter(&self) -> impl Iterator<Item = Answer<'_>> {
        let mut rest = self.words.as_slice();
        let mut counts = self.counts.as_ref().map(|counts| counts.iter());
        self.records.iter().map(move |&record| {
            let (words, after) = rest.split_at(length(record));
            rest = after;
            let instructions = match (&mut counts, record) {
                (Some(counts), Record::Query { .. }) => counts.next().copied().unwrap_or_default(),
                // The board's clock counts 1.6 for each instruction.
                _ => (u64::from(words[0]) * 5 / 8) as u32,
            };
            Answer { record, words, instructions }
        })
    }
}

fn length(record: Record) -> usize {
    match record {
        Record::Stretch(_) | Record::Bound | Record::Positions(_) => 2,
        Record::Query { .. } => ANSWER_WORDS,
    }
}

/// The board's toolchain, if there is an emulator as well.
pub fn board() -> Result<Cross> {
    let cross = Cross::find()?;
    qemu::find()?;
    Ok(cross)
}

/// The probe for the board.
pub fn build_for_board(cross: &Cross, name: &str) -> Result<PathBuf> {
    let mut cargo = cross.cargo("build");
    cargo.args(["--quiet", "--package", "dibs-probe", "--features", "board"]);
    run(cargo.args(["--profile", "firmware", "--bin", name]))?;
    Ok(cross.program("firmware", name))
}

/// Answers from the emulated board; with `count`, its clock counts instructions.
pub fn on_board(program: &Path, script: &Script, count: bool) -> Result<Answers> {
    let time = if count { COUNTING } else { Time::Real };
    Answers::new(run_on_board(program, &script.bytes(), time)?, script)
}

/// The board's clock counts 1.6 for each instruction.
pub const COUNTING: Time = Time::Counted(6);

/// Runs a program that executes a script on the emulated board, and returns the words that it answers.
pub fn run_on_board(program: &Path, script: &[u8], time: Time) -> Result<Vec<u32>> {
    run_emulated(&mut qemu::alone(program, time, &[]), script)
}

pub fn on_machine(emulator: &mut Command, script: &Script) -> Result<Answers> {
    Answers::new(run_emulated(emulator, &script.bytes())?, script)
}

/// Runs a script on an emulated machine, and returns the words that its program answers.
pub fn run_emulated(emulator: &mut Command, script: &[u8]) -> Result<Vec<u32>> {
    let folder = tempfile::tempdir()?;
    fs::write(folder.path().join("script.bin"), script)?;
    run(emulator.current_dir(folder.path()).stdin(Stdio::null()))?;
    words(&folder.path().join("answers.bin"))
}

/// The little-endian words of a file.
fn words(file: &Path) -> Result<Vec<u32>> {
    let bytes = fs::read(file).with_context(|| format!("no answers in {}", file.display()))?;
    let (words, rest) = bytes.as_chunks();
    ensure!(rest.is_empty(), "{}: not whole words", file.display());
    Ok(words.iter().copied().map(u32::from_le_bytes).collect())
}

/// Bytes as little-endian words, padded with zeros.
pub fn padded(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.chunks(4).map(|part| {
        let mut word = [0; 4];
        word[..part.len()].copy_from_slice(part);
        u32::from_le_bytes(word)
    })
}

/// The number of executions of each instruction between these addresses while a script is answered.
pub fn executions(
    program: &Path,
    script: &Script,
    ranges: &[Range<u64>],
) -> Result<BTreeMap<u64, u64>> {
    let mut counts = BTreeMap::new();
    traced(program, script, ranges, |address| {
        *counts.entry(address).or_insert(0) += 1;
        Ok(())
    })?;
    Ok(counts)
}

/// Answers from the emulated board; see [`traced_words`].
pub fn traced(
    program: &Path,
    script: &Script,
    ranges: &[Range<u64>],
    visit: impl FnMut(u64) -> Result<()>,
) -> Result<Answers> {
    Answers::new(traced_words(program, &script.bytes(), ranges, visit)?, script)
}

/// Runs a program that executes a script on the emulated board, and calls `visit` with the address of each executed
/// instruction in some ranges: QEMU executes one instruction at a time, and logs it. Returns the words that it answers.
pub fn traced_words(
    program: &Path,
    script: &[u8],
    ranges: &[Range<u64>],
    mut visit: impl FnMut(u64) -> Result<()>,
) -> Result<Vec<u32>> {
    let folder = tempfile::tempdir()?;
    fs::write(folder.path().join("script.bin"), script)?;
    let filter: Vec<String> = ranges
        .iter()
        .map(|range| format!("0x{:x}..0x{:x}", range.start, range.end.saturating_sub(1)))
        .collect();
    let mut qemu = qemu::alone(program, Time::Real, &[]);
    // QEMU 8.1 renamed the option, and 9 removed the old name.
    if qemu_major()? >= 9 {
        qemu.args(["-accel", "tcg,one-insn-per-tb=on"]);
    } else {
        qemu.arg("-singlestep");
    }
    // The log is long, so it is read through a pipe.
    qemu.args(["-d", "exec,nochain", "-dfilter", &filter.join(",")]);
    qemu.current_dir(folder.path()).stdin(Stdio::null()).stderr(Stdio::piped());
    let mut emulator = qemu.spawn().context("cannot start the emulator")?;
    let log = emulator.stderr.take().context("no log")?;
    let visited = each_address(BufReader::with_capacity(1 << 16, log), &mut visit);
    if visited.is_err() {
        emulator.kill()?;
    }
    let status = emulator.wait()?;
    ensure!(visited? > 0, "QEMU logged no instruction");
    ensure!(status.success(), "the emulator ended with {status}");
    words(&folder.path().join("answers.bin"))
}

/// Visits the addresses of a log, whose lines are `Trace 0: HOST [flags/ADDRESS/...] name`. Returns their number.
fn each_address(mut log: impl BufRead, visit: &mut impl FnMut(u64) -> Result<()>) -> Result<u64> {
    let (mut line, mut count) = (Vec::new(), 0);
    while log.read_until(b'\n', &mut line)? > 0 {
        let field = line.split(|&byte| byte == b'/').nth(1);
        let text = field.and_then(|field| std::str::from_utf8(field).ok());
        if let Some(address) = text.and_then(|text| u64::from_str_radix(text, 16).ok()) {
            visit(address)?;
            count += 1;
        }
        line.clear();
    }
    Ok(count)
}

/// The first number of `QEMU emulator version 7.2.22 (...)`.
fn qemu_major() -> Result<u32> {
    let version = qemu::find()?;
    let number = version.split_whitespace().find_map(|word| word.split('.').next()?.parse().ok());
    number.with_context(|| format!("no version in `{version}`"))
}

/// One way to build the probe for the host.
#[derive(Clone, Copy)]
pub enum Build {
    Debug,
    Release,
    /// For the host's processor, with all of its instructions.
    Native,
}

impl Build {
    pub fn name(self) -> &'static str {
        match self {
            Self::Debug => "debug",
            Self::Release => "release",
            Self::Native => "target-cpu=native",
        }
    }

    /// Answers from the host.
    pub fn answers(self, script: &Script) -> Result<Answers> {
        let program = self.program()?;
        let files = tempfile::tempdir()?;
        answer(&mut Command::new(program), files.path(), script)
    }

    /// Answers from the host, under callgrind, which counts the instructions of each query.
    pub fn counted(self, script: &Script) -> Result<Answers> {
        valgrind::find()?;
        let program = self.program()?;
        let files = tempfile::tempdir()?;
        let profile = files.path().join("profile");
        let mut valgrind = Command::new("valgrind");
        valgrind.args(["--quiet", "--tool=callgrind", "--dump-line=no", "--combine-dumps=yes"]);
        // Counts the functions below `clocked`; each call of it starts a part of the profile.
        valgrind.args(["--collect-atstart=no", "--toggle-collect=probe::clocked"]);
        valgrind.arg("--dump-before=probe::clocked");
        valgrind.arg(format!("--callgrind-out-file={}", profile.display()));
        let mut answers = answer(valgrind.arg(program), files.path(), script)?;
        let mut counts = Vec::new();
        for line in BufReader::new(fs::File::open(&profile)?).lines() {
            if let Some(count) = line?.strip_prefix("totals: ") {
                counts.push(count.trim().parse()?);
            }
        }
        let queries = script.queries();
        ensure!(counts.len() == queries + 1, "{} counts of {queries} queries", counts.len());
        // The first part is before the first query.
        answers.counts = Some(counts.split_off(1));
        Ok(answers)
    }

    /// Builds the program.
    fn program(self) -> Result<PathBuf> {
        if matches!(self, Self::Release) && workspace::is_built() {
            return Ok(workspace::target().join("release/answer"));
        }
        let target = match self {
            Self::Native => workspace::target().join("native"),
            Self::Debug | Self::Release => workspace::target(),
        };
        let mut cargo = Command::new("cargo");
        cargo.args(["build", "--quiet", "--package", "dibs-probe", "--bin", "answer"]);
        cargo.arg("--target-dir").arg(&target).current_dir(workspace::root());
        let folder = match self {
            Self::Debug => "debug",
            Self::Release | Self::Native => {
                cargo.arg("--release");
                "release"
            }
        };
        if matches!(self, Self::Native) {
            cargo.env("RUSTFLAGS", "-C target-cpu=native");
        }
        run(&mut cargo)?;
        Ok(target.join(folder).join("answer"))
    }
}

/// Runs a program of the host on a script.
fn answer(program: &mut Command, folder: &Path, script: &Script) -> Result<Answers> {
    let (script_file, answers) = (folder.join("script"), folder.join("answers"));
    fs::write(&script_file, script.bytes())?;
    run(program.arg(&script_file).arg(&answers))?;
    Answers::new(words(&answers)?, script)
}
