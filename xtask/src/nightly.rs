//! Fuzzers, sanitizers and Miri, which need the nightly compiler.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::process::{quiet, run, shown};
use crate::workspace;

const HOST: &str = "x86_64-unknown-linux-gnu";
const MOMENT: Duration = Duration::from_secs(20);
const DOWNLOAD: Duration = Duration::from_secs(300);

/// The fuzz targets in `tests/fuzz/`.
pub const TARGETS: [&str; 5] = ["tree", "packets", "poses", "mesh", "query"];

/// A target that runs only if it is requested by name: its readers take long to compile.
const FORMATS: &str = "formats";

/// Runs every fuzz target, two at a time.
#[derive(clap::Args)]
pub struct FuzzOptions {
    /// Seconds that each target runs.
    #[arg(long, default_value_t = 60)]
    pub seconds: u32,
    /// Only this target.
    #[arg(long)]
    pub target: Option<String>,
}

/// The outcome of a fuzz target.
pub struct Fuzzed {
    /// Its name.
    pub target: &'static str,
    /// Inputs that it ran.
    pub inputs: u64,
    /// Its output, if it found something.
    pub finding: Option<String>,
}

/// The outcome of the tests under a sanitizer.
pub struct Sanitized {
    /// Tests that passed.
    pub tests: u64,
    /// Reports of the sanitizer.
    pub findings: u64,
}

/// Why neither fuzzers nor sanitizers can run, or `None`. Tries to install the nightly compiler first.
pub fn missing() -> Option<String> {
    let found = || quiet(Command::new("cargo").args(["+nightly", "--version"]), MOMENT).is_ok();
    if found() {
        return None;
    }
    eprintln!("installing the nightly compiler ...");
    let install = ["toolchain", "install", "nightly", "--profile", "minimal"];
    let said = quiet(Command::new("rustup").args(install), DOWNLOAD);
    if found() {
        return None;
    }
    let why = said.err().map_or_else(String::new, |error| format!(": {error:#}"));
    Some(format!("no nightly compiler here (rustup toolchain install nightly{why})"))
}

/// `cargo +nightly SUBCOMMAND`.
fn nightly(arguments: &[&str]) -> Command {
    let mut cargo = Command::new("cargo");
    cargo.arg("+nightly").args(arguments).current_dir(workspace::root());
    cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
    cargo
}

/// Runs the fuzz targets. The caller evaluates their findings.
pub fn fuzz(options: &FuzzOptions) -> Result<Vec<Fuzzed>> {
    if quiet(Command::new("cargo").args(["fuzz", "--version"]), MOMENT).is_err() {
        let mut cargo = Command::new("cargo");
        run(cargo.args(["install", "--quiet", "cargo-fuzz", "--locked"]))
            .context("no cargo-fuzz")?;
    }
    let folder = workspace::root().join("tests/fuzz");
    let built = workspace::target().join("fuzz");
    let mut build =
        nightly(&["fuzz", "build", "--release", "--fuzz-dir", "tests/fuzz", "--target-dir"]);
    build.arg(&built);
    if options.target.as_deref() == Some(FORMATS) {
        build.args(["--features", FORMATS]);
    }
    run(&mut build).context("the fuzz targets do not build")?;
    let wanted = |target: &&str| match &options.target {
        Some(only) => only == target,
        None => *target != FORMATS,
    };
    let all = TARGETS.into_iter().chain([FORMATS]);
    let targets: Vec<&'static str> = all.filter(|target| wanted(target)).collect();
    ensure!(!targets.is_empty(), "the targets are {} and {FORMATS}", TARGETS.join(", "));
    let mut fuzzed = Vec::new();
    for pair in targets.chunks(2) {
        let started = pair.iter().map(|&target| {
            // New inputs go to a separate folder, so that the committed corpus does not change.
            let found: PathBuf = built.join("found").join(target);
            let artifacts = built.join("artifacts").join(target);
            fs::create_dir_all(&found)?;
            fs::create_dir_all(&artifacts)?;
            let log = built.join(format!("{target}.log"));
            let mut fuzzer = Command::new(built.join(HOST).join("release").join(target));
            fuzzer.arg(format!("-max_total_time={}", options.seconds)).arg("-timeout=10");
            fuzzer.arg("-print_final_stats=1").arg("-rss_limit_mb=3000");
            fuzzer.arg(format!("-artifact_prefix={}/", artifacts.display()));
            fuzzer.arg(&found).arg(folder.join("corpus").join(target));
            fuzzer.stdout(Stdio::null()).stderr(fs::File::create(&log)?);
            Ok((target, log, fuzzer.spawn()?))
        });
        for (target, log, mut fuzzer) in started.collect::<Result<Vec<_>>>()? {
            let status = fuzzer.wait()?;
            let text = fs::read(&log)?;
            let text = String::from_utf8_lossy(&text);
            let inputs = text.lines().rev().find_map(|line| {
                line.strip_prefix("stat::number_of_executed_units:")?.trim().parse().ok()
            });
            let finding = (!status.success())
                .then(|| format!("{target}: see {}\n{}", log.display(), end(&text)));
            if finding.is_none() {
                ensure!(inputs.is_some(), "{target} tells no count, see {}", log.display());
            }
            fuzzed.push(Fuzzed { target, inputs: inputs.unwrap_or_default(), finding });
        }
    }
    Ok(fuzzed)
}

/// Runs the fuzz targets on request: a finding is an error.
pub fn fuzz_by_hand(options: &FuzzOptions) -> Result<()> {
    for Fuzzed { target, inputs, finding } in fuzz(options)? {
        println!("{target}: {inputs} inputs in {} s", options.seconds);
        if let Some(finding) = finding {
            anyhow::bail!("{finding}");
        }
    }
    Ok(())
}

fn end(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(20)..].join("\n")
}

/// Runs the tests of frames and bus under a sanitizer, `address` or `thread`, and the tests of the format under the
/// address sanitizer. First the sanitizer must find a planted fault.
pub fn sanitize(sanitizer: &str) -> Result<Sanitized> {
    let (tests, planted) = match sanitizer {
        "address" => (&["frames", "bus", "format"][..], "an_access_out_of_bounds"),
        _ => (&["frames", "bus"][..], "a_race"),
    };
    let test = |names: &[&str], arguments: &[&str]| {
        let mut cargo = nightly(&["test", "--package", "dibs-soundness", "--target", HOST]);
        for name in names {
            cargo.args(["--test", name]);
        }
        cargo.arg("--target-dir").arg(workspace::target().join(sanitizer));
        // The tests build a few small trees: a builder with little optimisation compiles faster.
        cargo.args(["--config", "profile.dev.package.dibs-build.opt-level=1"]);
        // One test at a time, because parallel tests with two threads each wait long for each other.
        cargo.args(["--", "--test-threads=1"]).args(arguments);
        let flags = format!("-Zsanitizer={sanitizer} -Cunsafe-allow-abi-mismatch=sanitizer");
        cargo.env("RUSTFLAGS", flags).env("CARGO_PROFILE_DEV_DEBUG", "line-tables-only");
        // A test leaks its frames intentionally.
        cargo.env("ASAN_OPTIONS", "detect_leaks=0");
        let suppressions = workspace::root().join("tests/soundness/tsan.txt");
        cargo.env("TSAN_OPTIONS", format!("suppressions={}", suppressions.display()));
        cargo
    };
    let reports = |text: &str| {
        let marks = ["ERROR: AddressSanitizer:", "WARNING: ThreadSanitizer:"];
        text.lines().filter(|line| marks.iter().any(|mark| line.contains(mark))).count() as u64
    };
    let found = test(&["planted"], &["--ignored", planted]).output()?;
    let text = [&found.stderr[..], &found.stdout].concat();
    let text = String::from_utf8_lossy(&text);
    ensure!(
        !found.status.success() && reports(&text) > 0 && text.contains(planted),
        "the {sanitizer} sanitizer does not find the planted fault:\n{}",
        end(&text)
    );

    let mut cargo = test(tests, &[]);
    let output = cargo.output()?;
    let text = [&output.stdout[..], &output.stderr].concat();
    let text = String::from_utf8_lossy(&text);
    print!("{text}");
    let findings = reports(&text);
    let passed = text.lines().filter_map(|line| {
        line.strip_prefix("test result: ok. ")?.split(' ').next()?.parse::<u64>().ok()
    });
    ensure!(findings > 0 || output.status.success(), "`{}` failed", shown(&cargo));
    Ok(Sanitized { tests: passed.sum(), findings })
}

/// Runs both sanitizers on request: a finding is an error.
pub fn sanitize_by_hand() -> Result<()> {
    for sanitizer in ["address", "thread"] {
        let Sanitized { tests, findings } = sanitize(sanitizer)?;
        println!("{sanitizer} sanitizer: {tests} tests, {findings} findings");
        ensure!(findings == 0, "{findings} findings of the {sanitizer} sanitizer");
    }
    Ok(())
}

/// Why Miri cannot run, or `None`.
pub fn miri_missing() -> Option<String> {
    let found = quiet(&mut nightly(&["miri", "--version"]), MOMENT).is_ok();
    (!found).then(|| {
        "Miri is not installed here (rustup +nightly component add miri rust-src)".to_owned()
    })
}

/// Runs the tests of the frames under Miri.
pub fn miri() -> Result<()> {
    let mut cargo = nightly(&["miri", "test", "--package", "dibs-soundness", "--test", "frames"]);
    run(cargo.arg("--target-dir").arg(workspace::target().join("miri")))
}

/// Tries every interleaving of the frames' two ends. Returns their number.
pub fn interleavings() -> Result<u64> {
    let mut cargo = Command::new("cargo");
    cargo.args(["test", "--quiet", "--release", "--package", "dibs-soundness", "--test"]);
    cargo.args(["interleavings", "--target-dir"]).arg(workspace::target().join("loom"));
    cargo.args(["--", "--nocapture"]).env("RUSTFLAGS", "--cfg loom");
    let output = cargo.current_dir(workspace::root()).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "an interleaving breaks the frames:\n{text}\n{}", end(&said));
    let count_in = |line: &str| line.split("interleavings: ").nth(1)?.parse::<u64>().ok();
    let count = text.lines().filter_map(count_in).sum();
    ensure!(count > 0, "the model checker tells no count");
    Ok(count)
}
