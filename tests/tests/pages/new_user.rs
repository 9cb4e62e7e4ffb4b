//! A new user copies the blocks of `docs/guide.md` into an empty crate outside the repository, and gets an answer.
//!
//! `cargo test --release -p dibs-tests --test pages new_user -- --ignored --nocapture` shows each command and its
//! output.

// Requirement: P-11

use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use dibs_build::generate;

const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

#[test]
#[ignore = "compiles for the board and runs in QEMU: a step of `cargo xtask test --whole`"]
fn the_guide_leads_to_an_answer_on_a_host_and_on_the_board() {
    let folder = tempfile::tempdir().expect("a folder outside the repository");
    let guard = User { root: folder.path().join("guard") };
    fs::create_dir_all(guard.root.join(".cargo")).expect("a folder");
    fs::create_dir_all(guard.root.join("src")).expect("a folder");
    let guide = fs::read_to_string(format!("{REPOSITORY}/docs/guide.md")).expect("the guide");
    let section = |number: usize| guide.split("\n## ").nth(number).expect("a section");

    // 1. On a host.
    let manifest = block(section(1), "`Cargo.toml`");
    guard.write("Cargo.toml", &with_paths(&manifest));
    guard.write("build.rs", &block(section(1), "`build.rs`"));
    guard.write("src/main.rs", &block(section(1), "`src/main.rs`"));
    let heart = generate::heart(1_000).expect("a size").mesh;
    heart.write_ply(guard.root.join("heart.ply")).expect("writable");
    let on_host = distance(&guard.cargo("run --release", true));

    // An edit of a source does not run the build script again; a change of the mesh does, and its error names the file.
    let source = block(section(1), "`src/main.rs`");
    guard.write("src/main.rs", &format!("{source}// An edit.\n"));
    // The bytes in flash, without their validation.
    guard.write("src/main.rs", &source.replace("::new(&tree)", "::new(&heart::TREE)"));
    let log = guard.cargo("build --release", false);
    for part in ["call `.validate()` first", "at start-up `let tree = heart::TREE.validate()?;`"] {
        assert!(log.contains(part), "{log}");
    }
    guard.write("src/main.rs", &source);
    let ran = |log: &str| log.contains("build-script-build`");
    assert!(!ran(&guard.cargo("build --release -vv", true)));
    guard.write("heart.ply", "no mesh");
    let log = guard.cargo("build --release -vv", false);
    assert!(ran(&log) && log.contains("error: guard@0.0.0: heart.ply: "), "{log}");
    heart.write_ply(guard.root.join("heart.ply")).expect("writable");

    // 2. On the board.
    let more = block(section(3), "`Cargo.toml` besides");
    let manifest = manifest.replace("[build-dep", &format!("{more}\n[build-dep"));
    guard.write("Cargo.toml", &with_paths(&manifest));
    guard.write(".cargo/config.toml", &block(section(3), "`.cargo/config.toml`"));
    guard.write("memory.x", &block(section(3), "`memory.x`"));
    guard.write("src/main.rs", &block(section(3), "`src/main.rs`"));
    let on_board = distance(&guard.cargo("run --release", true));
    assert!((on_board - on_host).abs() < 1e-3, "{on_board} on the board, {on_host} here");

    // 3. The loop in RTIC, with a minimal device.
    let rtic = "rtic = { version = \"2\", features = [\"thumbv7-backend\"] }\n";
    let manifest = manifest.replace("[build-dep", &format!("{rtic}\n[build-dep"));
    guard.write("Cargo.toml", &with_paths(&manifest));
    guard.write("src/main.rs", &format!("{DEVICE}\n{}", block(section(3), "RTIC application")));
    guard.cargo("build --release", true);
}

/// The items that the guide's RTIC application needs from its board.
const DEVICE: &str = r#"
#![no_std]
#![no_main]

use dibs_nostd::{Capsule, Millis};
use dibs_nostd::constraint::ConstraintForce;
use dibs_nostd::glam::Vec3;

dibs_nostd::include_tree!("heart");
static HEART: heart::Surface = heart::Surface::new();

fn apply(_: ConstraintForce) {}
fn receive() -> (&'static [u8], Millis) { (&[], Millis(0)) }
fn send(_: Option<&[u8]>) {}
fn pose() -> (Capsule, Millis) {
    match Capsule::new(Vec3::ZERO, Vec3::X, 2.5) {
        Ok(tool) => (tool, Millis(0)),
        Err(_) => loop {},
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! { loop {} }

mod device {
    pub const NVIC_PRIO_BITS: u8 = 3;
    #[derive(Clone, Copy)]
    pub enum Interrupt { UART0 }
    pub use self::Interrupt as interrupt;
    use cortex_m_rt as _;
    unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
        fn number(self) -> u16 { self as u16 }
    }
}
"#;

struct User {
    root: PathBuf,
}

impl User {
    fn write(&self, file: &str, content: &str) {
        fs::write(self.root.join(file), content).expect("writable");
    }

    /// Runs a command of cargo, which must succeed or fail as stated. Returns both of its output streams.
    fn cargo(&self, line: &str, succeeds: bool) -> String {
        println!("$ cargo {line}");
        let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.args(line.split_whitespace()).current_dir(&self.root);
        cargo.env("CARGO_TARGET_DIR", Path::new(env!("CARGO_TARGET_TMPDIR")).join("new-user"));
        let output = cargo.output().expect("cargo runs");
        let text = [output.stderr, output.stdout].concat();
        let text = String::from_utf8_lossy(&text).into_owned();
        let is_news = |line: &&str| !line.trim_start().starts_with("Compiling");
        let shown: Vec<&str> = text.lines().filter(is_news).collect();
        println!("{}", shown[shown.len().saturating_sub(4)..].join("\n"));
        assert_eq!(output.status.success(), succeeds, "cargo {line}: {text}");
        text
    }
}

/// The content of the first code block after a text.
fn block(section: &str, after: &str) -> String {
    let (_, rest) = section.split_once(after).unwrap_or_else(|| panic!("{after} in the guide"));
    let (_, rest) = rest.split_once("```").expect("a block");
    let (code, _) = rest.split_once("\n```").expect("the block's end");
    code.split_once('\n').expect("the block's language").1.to_owned() + "\n"
}

/// The manifest with this checkout's crates instead of the published ones.
fn with_paths(manifest: &str) -> String {
    let path = |name: &str| Path::new(REPOSITORY).join(name).canonicalize().expect("a crate");
    let [core, build] = ["dibs-nostd", "dibs-build"].map(path);
    let here = manifest
        .replace("dibs-nostd = \"0.1\"", &format!("dibs-nostd = {{ path = {core:?} }}"))
        .replace("dibs-build = \"0.1\"", &format!("dibs-build = {{ path = {build:?} }}"));
    assert_eq!(here.matches("path = ").count(), 2, "{here}");
    here
}

/// The distance that a program printed.
fn distance(output: &str) -> f64 {
    let line = output.lines().find(|line| line.contains(" mm, certain from "));
    let text = line.and_then(|line| line.split_once(" mm")).expect("an answer").0;
    text.parse().expect("a number")
}
