//! The smallest loops, in RTIC and in Embassy, on the emulated board.

// Requirements: P-05, P-11

use std::net::Shutdown;
use std::os::unix::net::UnixListener;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};
use std::{fs, thread};

use anyhow::{Context, Result, ensure};
use dibs_build::{Builder, generate};
use dibs_nostd::constraint::{ForbiddenRegion, SpringDamper};
use dibs_nostd::{Capsule, Options, Query, Tree, measure_stretch};
use dibs_stream::transport::Line;
use dibs_stream::{SendError, Sender, Settings, SurfaceOrder};
use glam::Vec3;
use xtask::process::run;
use xtask::qemu;
use xtask::steps::Outcome;
use xtask::toolchain::Cross;

use crate::demo::session::accept;
use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::FLOW, note};
use crate::harness::{Check, Effort};
use crate::probe::board;

pub const CHECK: Check = Check {
    name: "examples on the board",
    run: check,
    promises: &[
        note("examples.run"),
        Promise {
            id: "examples.different",
            says: "The smallest loops, in RTIC and in Embassy, answer a received frame on the board as the host does, digit for \
         digit",
            criterion: FLOW,
            bound: Bound::Is(0.0),
            unit: "of {examples.run} examples (separation and force)",
            limits: "An emulated processor; one frame. The force counts with the age of the surface.",
        },
    ],
};

const EXAMPLES: [&str; 2] = ["example-rtic", "example-embassy"];

/// The sent frame: it differs from the rest shape, which proves that it was received.
const FRAME: usize = 16;

/// Time between two frames, in which the board checks one.
const PAUSE: Duration = Duration::from_millis(50);

/// The examples' largest force, in N.
const MAX_FORCE: f32 = 5.0;

/// Longest time until an answer; the examples end earlier.
const LIMIT: Duration = Duration::from_secs(60);

fn check(_: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let cross = board()?;
    let mut cargo = cross.cargo("build");
    cargo.args(["--quiet", "--profile", "firmware"]);
    for name in EXAMPLES {
        cargo.args(["--package", name, "--features", &format!("{name}/board")]);
    }
    run(&mut cargo)?;
    let heart = generate::heart(500)?;
    let tree = Builder::new().build(&heart.mesh)?;
    let tree = tree.tree::<u16>()?;
    let order = SurfaceOrder::of(&tree);
    let positions = heart.motion.frames.get(FRAME).context("a frame of the motion")?;
    let expected = on_host(&tree, &order, positions)?;
    let mut different = 0;
    for name in EXAMPLES {
        let said = on_board(&cross, name, &order, positions).with_context(|| name.to_owned())?;
        println!("{name}: {said}; here {expected}");
        different += u32::from(!is_same(&said, &expected).context("no line")?);
    }
    figures.note("examples.run", EXAMPLES.len() as f64);
    figures.note("examples.different", f64::from(different));
    Ok(Outcome::Passed)
}

/// Whether an example found the same separation, and a force that is at least as large: the surface's age increases it.
fn is_same(said: &str, expected: &str) -> Option<bool> {
    let [said, expected] = [said, expected].map(|line| line.split_once(" mm, "));
    let newtons = |force: &str| force.strip_suffix(" N")?.parse::<f32>().ok();
    let ((here, force), (there, least)) = (said?, expected?);
    let range = newtons(least)?..=MAX_FORCE;
    Some(here == there && range.contains(&newtons(force)?))
}

/// The line that an example would print for this frame at once, from the same calls.
fn on_host(tree: &Tree<'_, u16>, order: &SurfaceOrder, positions: &[Vec3]) -> Result<String> {
    let rows = order.to_rows(positions)?;
    let stretch = measure_stretch(tree, rows.as_slice())?;
    let tool = Capsule::new(Vec3::new(32.0, 0.0, 60.0), Vec3::new(32.0, 0.0, 150.0), 2.5)?;
    let spring = SpringDamper::stiffness(1.0).damping(0.002).max_force(MAX_FORCE);
    let wall = ForbiddenRegion::new(spring, 5.0)?;
    let options = Options::new().stretch(stretch);
    let closest = Query::<_, 64>::new(tree)?.closest(rows.as_slice(), &tool, &options)?;
    let force = wall.force(&Ok(closest), Vec3::ZERO).force;
    Ok(format!("{} mm, {} N", closest.separation, force.length()))
}

/// Boots an example, sends it the frame repeatedly, and returns the line that it prints.
fn on_board(cross: &Cross, name: &str, order: &SurfaceOrder, positions: &[Vec3]) -> Result<String> {
    let folder = tempfile::tempdir()?;
    let (bus, said) = (folder.path().join("bus"), folder.path().join("said"));
    let listener = UnixListener::bind(&bus)?;
    let mut emulator = qemu::with_serial(&cross.program("firmware", name), &bus)
        .stdin(Stdio::null())
        .stdout(fs::File::create(&said)?)
        .spawn()?;
    let ended = accept(&listener, &mut emulator).and_then(|socket| {
        let (reader, handle) = (socket.try_clone()?, socket.try_clone()?);
        let hang_up = move || drop(handle.shutdown(Shutdown::Both));
        let line = Line::stream(socket, reader, hang_up);
        // The host uses unrounded positions, so they must not be quantised.
        let settings = Settings { quantised: false, ..Settings::default() };
        let mut sender = Sender::<_, 1024>::new(line, order.clone(), settings);
        send(&mut emulator, || sender.send(positions).map(drop))
    });
    if ended.is_err() {
        // It may have ended already.
        let _ = emulator.kill();
        emulator.wait()?;
    }
    ended?;
    Ok(fs::read_to_string(&said)?.trim().to_owned())
}

/// Sends until the board ends, which must be with success.
fn send(board: &mut Child, mut frame: impl FnMut() -> Result<(), SendError>) -> Result<()> {
    let start = Instant::now();
    loop {
        // An error of the line: it breaks when the board ends.
        let _broken = frame();
        thread::sleep(PAUSE);
        if let Some(status) = board.try_wait()? {
            ensure!(status.success(), "no answer: {status}");
            return Ok(());
        }
        ensure!(start.elapsed() < LIMIT, "no answer within {} s", LIMIT.as_secs());
    }
}
