//! Measures parts, each kept in a folder of its own.

use std::any::Any;
use std::collections::BTreeMap;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread;
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, anyhow, bail, ensure};
use serde::{Deserialize, Serialize};
use xtask::steps::Outcome;

use super::ensure_clean;
use crate::harness::run::Run;

/// Where a part runs. Two run beside each other, one of either lane.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Place {
    /// In the lane of those that build and boot the same programs.
    Emulator,
    /// In the other lane.
    Beside,
    /// In the lane that is idle first.
    Either,
    /// After both, with nothing beside it: it measures time.
    Alone,
}

/// A part of the run.
pub struct Part {
    pub name: String,
    pub place: Place,
    pub measure: Box<Measure>,
}

/// Measures into a folder. What goes to `docs/evidence` goes to [`FILES`] in it.
pub type Measure = dyn Fn(&Path) -> Result<Outcome> + Send + Sync;

/// The folder of a part's pages and records.
pub const FILES: &str = "files";
/// The folder of the parts.
pub const PARTS: &str = "parts";
const DONE: &str = "done.json";
const TIMES: &str = "times.json";

impl Part {
    pub fn new(
        name: &str,
        place: Place,
        measure: impl Fn(&Path) -> Result<Outcome> + Send + Sync + 'static,
    ) -> Self {
        Self { name: name.to_owned(), place, measure: Box::new(measure) }
    }

    /// The folder of its output, inside the run's.
    pub fn folder(&self, folder: &Path) -> PathBuf {
        folder.join(PARTS).join(self.name.replace(' ', "-"))
    }

    /// Its result, if it was measured by this run: at the same commit, on the same machine.
    pub fn done(&self, folder: &Path, run: &Run) -> Option<Done> {
        let text = fs::read_to_string(self.folder(folder).join(DONE)).ok()?;
        let done: Done = serde_json::from_str(&text).ok()?;
        done.run.is_of_the_same(run).then_some(done)
    }
}

/// What is kept of a part that succeeded.
#[derive(Serialize, Deserialize)]
pub struct Done {
    pub run: Run,
    /// Seconds since 1970.
    pub start: f64,
    pub seconds: f64,
    /// Why it could not run, which is no failure if no figure is missing.
    pub skipped: Option<String>,
}

/// Seconds that each part took last.
pub fn times(folder: &Path) -> BTreeMap<String, f64> {
    let text = fs::read_to_string(folder.join(TIMES)).unwrap_or_default();
    serde_json::from_str(&text).unwrap_or_default()
}

/// Parts that wait, and how it went with the others.
struct Queue<'a> {
    due: Vec<&'a Part>,
    begun: usize,
    failed: Vec<String>,
    times: BTreeMap<String, f64>,
}

/// Measures the parts that were not measured at this commit. A part that fails does not end the run; the error names all.
///
/// # Errors
/// If the checkout is not clean, or a part fails.
pub fn measure(parts: &[Part], folder: &Path, now: &(dyn Fn() -> Run + Sync)) -> Result<()> {
    let run = now();
    ensure_clean(&run)?;
    let due: Vec<_> = parts.iter().filter(|part| part.done(folder, &run).is_none()).collect();
    let total = due.len();
    println!("{total} of {} parts are to be measured at commit {}", parts.len(), run.commit);
    let queue = Queue { due, begun: 0, failed: Vec::new(), times: times(folder) };
    let queue = Mutex::new(queue);
    let work = |places: &[Place]| {
        while let Some((part, number, last)) = next(&queue, places) {
            let name = &part.name;
            println!("[{number}/{total}] {name} ...{last}");
            let start = Instant::now();
            let result = one(part, folder, &run, now);
            let seconds = start.elapsed().as_secs_f64();
            let Ok(mut queue) = queue.lock() else { return };
            match result {
                Ok(None) => println!("[{number}/{total}] {name}: {seconds:.0} s"),
                Ok(Some(why)) => println!("[{number}/{total}] {name}: {seconds:.0} s, {why}"),
                Err(error) => {
                    println!("[{number}/{total}] {name}: FAILED after {seconds:.0} s: {error:#}");
                    queue.failed.push(format!("{name}: {error:#}"));
                }
            }
            queue.times.insert(name.clone(), seconds.round());
            // Only for the next run's progress.
            let _ =
                serde_json::to_string(&queue.times).map(|text| fs::write(folder.join(TIMES), text));
        }
    };
    let work = &work;
    thread::scope(|scope| {
        for place in [Place::Emulator, Place::Beside] {
            scope.spawn(move || work(&[place, Place::Either]));
        }
    });
    work(&[Place::Alone]);
    let failed = queue.into_inner().map_err(|_| anyhow!("a lane panicked"))?.failed;
    ensure!(
        failed.is_empty(),
        "{} of {} parts failed; the others are kept:\n{}",
        failed.len(),
        parts.len(),
        failed.join("\n")
    );
    Ok(())
}

/// The next part of the first of these places that has one, its number, and a note of the time that it took last.
fn next<'a>(queue: &Mutex<Queue<'a>>, places: &[Place]) -> Option<(&'a Part, usize, String)> {
    let mut queue = queue.lock().ok()?;
    let due = |place: &Place| queue.due.iter().position(|part| part.place == *place);
    let found = places.iter().find_map(due)?;
    let part = queue.due.remove(found);
    queue.begun += 1;
    let last = queue.times.get(&part.name);
    let last = last.map_or_else(String::new, |last| format!(" ({last:.0} s last time)"));
    Some((part, queue.begun, last))
}

/// Measures a part. Returns why it was skipped.
fn one(part: &Part, folder: &Path, run: &Run, now: &dyn Fn() -> Run) -> Result<Option<String>> {
    let place = part.folder(folder);
    if place.exists() {
        fs::remove_dir_all(&place)?;
    }
    fs::create_dir_all(place.join(FILES))?;
    let since = SystemTime::now().duration_since(UNIX_EPOCH)?.as_secs_f64();
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| (part.measure)(&place)));
    let skipped = match outcome.map_err(|panic| anyhow!("panicked: {}", text_of(&*panic)))?? {
        Outcome::Passed => None,
        Outcome::Skipped(reason) => Some(reason),
    };
    let run_after = now();
    if !run_after.is_of_the_same(run) {
        bail!("the checkout or the machine changed meanwhile: {run:?}, then {run_after:?}");
    }
    let seconds = start.elapsed().as_secs_f64();
    let done = Done { run: run_after, start: since, seconds, skipped: skipped.clone() };
    // Last: a folder without it is not whole.
    fs::write(place.join(DONE), serde_json::to_string_pretty(&done)?)
        .with_context(|| format!("cannot write to {}", place.display()))?;
    Ok(skipped)
}

fn text_of(panic: &dyn Any) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).unwrap_or("no message")
}
