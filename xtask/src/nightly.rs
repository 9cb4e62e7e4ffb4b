//! What needs the nightly compiler: fuzzers, sanitizers and Miri. Without one they say so.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::process::{quiet, run};
use crate::workspace;

const HOST: &str = "x86_64-unknown-linux-gnu";
const MOMENT: Duration = Duration::from_secs(20);

/// The fuzz targets in `fuzz/`.
pub const TARGETS: [&str; 4] = ["tree", "packets", "mesh", "query"];

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

/// Why there is nothing to run, or `None`.
pub fn missing() -> Option<String> {
    let found = quiet(Command::new("cargo").args(["+nightly", "--version"]), MOMENT).is_ok();
    (!found).then(|| "no nightly compiler here (rustup toolchain install nightly)".to_owned())
}

/// Inputs that the fuzz targets ran, by target.
pub fn fuzz(options: &FuzzOptions) -> Result<Vec<(&'static str, u64)>> {
    if quiet(Command::new("cargo").args(["fuzz", "--version"]), MOMENT).is_err() {
        let mut cargo = Command::new("cargo");
        run(cargo.args(["install", "--quiet", "cargo-fuzz", "--locked"]))
            .context("no cargo-fuzz")?;
    }
    let folder = workspace::root().join("fuzz");
    let built = workspace::target().join("fuzz");
    let cargo = |arguments: &[&str]| {
        let mut cargo = Command::new("cargo");
        cargo.args(["+nightly", "fuzz"]).args(arguments).arg("--target-dir").arg(&built);
        cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
        cargo.current_dir(workspace::root());
        cargo
    };
    run(&mut cargo(&["build", "--release"])).context("the fuzz targets do not build")?;
    let wanted = |target: &&str| options.target.as_ref().is_none_or(|only| only == target);
    let targets: Vec<&'static str> = TARGETS.into_iter().filter(|target| wanted(target)).collect();
    ensure!(!targets.is_empty(), "the targets are {}", TARGETS.join(", "));
    let mut runs = Vec::new();
    for pair in targets.chunks(2) {
        let started = pair.iter().map(|&target| {
            // New inputs go to a folder of their own: the committed corpus stays as it is.
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
            ensure!(
                status.success(),
                "{target} found something, see {}:\n{}",
                log.display(),
                end(&text)
            );
            let executed = text.lines().rev().find_map(|line| {
                line.strip_prefix("stat::number_of_executed_units:")?.trim().parse().ok()
            });
            let executed = executed.with_context(|| format!("{target} tells no count"))?;
            println!("{target}: {executed} inputs in {} s, no finding", options.seconds);
            runs.push((target, executed));
        }
    }
    Ok(runs)
}

fn end(text: &str) -> String {
    let lines: Vec<&str> = text.lines().collect();
    lines[lines.len().saturating_sub(20)..].join("\n")
}

/// Runs the tests of frames, bus and format under a sanitizer: `address` or `thread`.
pub fn sanitize(sanitizer: &str) -> Result<()> {
    let mut cargo = Command::new("cargo");
    cargo.args(["+nightly", "test", "--quiet", "--package", "dibs-soundness", "--target", HOST]);
    cargo.args(["--test", "frames", "--test", "bus"]);
    if sanitizer == "address" {
        cargo.args(["--test", "format"]);
    }
    cargo.arg("--target-dir");
    cargo.arg(workspace::target().join(sanitizer)).current_dir(workspace::root());
    let flags = format!("-Zsanitizer={sanitizer} -Cunsafe-allow-abi-mismatch=sanitizer");
    cargo.env("RUSTFLAGS", flags);
    // A test's frames live for ever on purpose.
    cargo.env("ASAN_OPTIONS", "detect_leaks=0");
    let suppressions = workspace::root().join("tests/soundness/tsan.txt");
    cargo.env("TSAN_OPTIONS", format!("suppressions={}", suppressions.display()));
    cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
    run(&mut cargo).with_context(|| format!("under the {sanitizer} sanitizer"))
}

/// Why Miri cannot run here, or `None`.
pub fn miri_missing() -> Option<String> {
    let found =
        quiet(Command::new("cargo").args(["+nightly", "miri", "--version"]), MOMENT).is_ok();
    (!found).then(|| {
        "Miri is not installed here (rustup +nightly component add miri rust-src)".to_owned()
    })
}

/// Runs the core crate's own tests and those of the frames under Miri.
pub fn miri() -> Result<()> {
    let mut cargo = Command::new("cargo");
    cargo.args(["+nightly", "miri", "test", "--package", "dibs-soundness", "--test", "frames"]);
    cargo.arg("--target-dir").arg(workspace::target().join("miri"));
    cargo.env_remove("RUSTUP_TOOLCHAIN").env_remove("CARGO").env_remove("RUSTC");
    run(cargo.current_dir(workspace::root()))
}

/// Tries every interleaving of the frames' two ends. Returns how many there were.
pub fn interleavings() -> Result<u64> {
    let mut cargo = Command::new("cargo");
    cargo.args(["test", "--quiet", "--release", "--package", "dibs-soundness", "--test"]);
    cargo.args(["interleavings", "--target-dir"]).arg(workspace::target().join("loom"));
    cargo.args(["--", "--nocapture"]).env("RUSTFLAGS", "--cfg loom");
    let output = cargo.current_dir(workspace::root()).output()?;
    let text = String::from_utf8_lossy(&output.stdout);
    let said = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "an interleaving breaks the frames:\n{text}\n{}", end(&said));
    let count = text.lines().find_map(|line| line.split("interleavings: ").nth(1)?.parse().ok());
    count.context("the model checker tells no count")
}
