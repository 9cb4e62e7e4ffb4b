//! The report: `report.json`, the readable summary, and the verdict.
//!
//! One file, because a figure and its line in the summary belong together.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, Result, bail};
use controller::telemetry::{Summary, Tick, cause_code, fallback_code};
use controller::{SPEED, TICK_RATE};
use dibs_nostd::failsafe::State;
use dibs_nostd::wire::Event;
use dibs_nostd::{Fallback, QueryError, Unavailable};
use serde::Serialize;
use serde_json::Value;
use xtask::{qemu, workspace};

use super::bridged::Bridged;
use super::check;
use super::faults::{Faults, Silence};
use super::forces::Forces;
use super::freshness::Freshness;
use super::hand::Hand;
use super::machine::Machine;
use super::scene::Scene;
use super::session::Outcome;
use super::transition::Transition;
use crate::harness::run::Run;

/// Instructions a second of the emulated processor's time.
const INSTRUCTION_RATE: f64 = 25e6 * qemu::INSTRUCTIONS_A_COUNT as f64;

/// The result of a run, for machines and people. Figures that a run on the host cannot measure are `null`.
#[derive(Serialize)]
pub struct Report {
    frames_sent: u32,
    frames_published: u32,
    frames_rejected: u32,
    #[serde(flatten)]
    freshness: Freshness,
    /// The faults on the bus.
    faults: Option<Faults>,
    /// The totals of `dibs bridge`, if frames came through it.
    bridge: Option<Value>,
    /// The states caused by a silent line.
    silence: Option<Silence>,
    /// Events on the bus, by their names in the wire protocol.
    bus_events: BTreeMap<&'static str, u32>,
    ticks: u32,
    queries: usize,
    /// Answers whose error exceeds their stated accuracy.
    mismatches: usize,
    /// Largest error of an answer, in units of its stated accuracy.
    largest_error: f64,
    /// Largest stated accuracy without the vertices' position error, in mm.
    accuracy_mm: f32,
    /// Largest distance between a vertex and its quantised position on the bus, in mm.
    position_error_mm: f32,
    separation_min_mm: f32,
    separation_max_mm: f32,
    force_max_n: f32,
    /// Results of a scripted instrument.
    #[serde(flatten)]
    forces: Option<Forces>,
    /// Results of an instrument that a hand pushes.
    #[serde(flatten)]
    hand: Option<Hand>,
    /// Ticks before the first frame, when the output is safe.
    ticks_waiting: usize,
    ticks_nominal: usize,
    ticks_degraded: usize,
    /// Ticks with the safe output after the first frame.
    ticks_safe: usize,
    /// Every change of the fail-safe machine's state.
    transitions: Vec<Transition>,
    instructions_mean: Option<f64>,
    /// For answers whose axis is outside, so that no depth was searched.
    instructions_outside_mean: Option<f64>,
    instructions_max: Option<u64>,
    node_tests_mean: f64,
    triangle_tests_mean: f64,
    /// Largest number of nodes that the tracker had open.
    front_max: u32,
    /// Answered ticks that were whole queries, including the first one.
    fallbacks: usize,
    /// Whole queries because the tracker was full.
    fallbacks_full: usize,
    deadline_misses: Option<u32>,
    /// Longest time from a tick's due time to its first instruction, in microseconds.
    latency_max_us: Option<f64>,
    /// Longest time from a tick's due time to its end, in microseconds.
    tick_max_us: Option<f64>,
    flash_bytes: Option<u64>,
    /// Flash of the tree only.
    tree_bytes_per_triangle: f64,
    /// Variables and the deepest stack.
    ram_bytes: Option<u64>,
    stack_bytes: Option<u32>,
    /// Longest section with all interrupts disabled, in microseconds, rounded up to the clock's next
    /// count: 0.04 us.
    masked_max_us: Option<f64>,
    /// Longest section with the bus interrupt disabled, without the control ticks during it.
    bus_masked_max_us: Option<f64>,
    /// Completed rounds of the background check of the tree in flash.
    scrub_rounds: Option<u32>,
    /// Frames whose vertices in the controller's memory were all compared with the sent ones after publication.
    frames_compared: usize,
    /// Compared frames that differed.
    frames_published_wrong: usize,
    records_lost: u32,
    real_seconds: f64,
    surface: String,
    stretch_limit: f32,
    controller: String,
    run: Run,
    command: String,
    controller_command: String,
    broken_promises: Vec<String>,
}

impl Report {
    /// Sums up a run.
    pub fn new(scene: &Scene, machine: &Machine, outcome: &Outcome) -> Result<Self> {
        let last = outcome.ticks.last().context("the controller ran no tick")?;
        let answered: Vec<&Tick> = outcome.ticks.iter().filter(|t| t.is_answered()).collect();
        let count = |state: State| outcome.ticks.iter().filter(|t| t.state == state as u32).count();
        let because = |cause: Unavailable| {
            let is_so = |t: &&Tick| t.state == State::Safe as u32 && t.cause == cause_code(&cause);
            outcome.ticks.iter().filter(is_so).count()
        };
        let waiting = because(Unavailable::NoSurface);
        let mean_of = |ticks: &[&Tick], value: fn(&Tick) -> u32| {
            let sum: f64 = ticks.iter().map(|tick| f64::from(value(tick))).sum();
            sum / ticks.len().max(1) as f64
        };
        let mean = |value| mean_of(&answered, value);
        let is_outside = |tick: &&&Tick| tick.separation > -tick.tool_radius;
        let outside: Vec<&Tick> = answered.iter().filter(is_outside).copied().collect();
        let least = |value: fn(&Tick) -> f32| {
            answered.iter().map(|tick| value(tick)).fold(f32::INFINITY, f32::min)
        };
        let largest =
            |value: fn(&Tick) -> f32| answered.iter().map(|tick| value(tick)).fold(0.0, f32::max);
        let summary = outcome.summary;
        let footprint = match machine {
            Machine::Board { footprint, .. } => Some(footprint),
            Machine::Host { .. } => None,
        };
        let on_board = footprint.is_some();
        let scale = u64::from(qemu::INSTRUCTIONS_A_COUNT);
        let microseconds = |counts: u32| f64::from(counts) / 25.0;
        let counts_max = answered.iter().map(|tick| tick.query_counts).max().unwrap_or(0);
        let expected = outcome.ticks_asked.saturating_sub(outcome.ticks.len() as u32);
        let mut report = Self {
            frames_sent: outcome.frames_sent,
            frames_published: last.frames_published,
            frames_rejected: last.rejected,
            freshness: Freshness::of(outcome),
            faults: outcome.faults.clone(),
            bridge: outcome.bridge.clone(),
            silence: Silence::of(outcome),
            bus_events: events(&summary),
            ticks: summary.ticks,
            queries: answered.len(),
            mismatches: outcome.checked.iter().filter(|c| c.is_wrong()).count(),
            largest_error: outcome.checked.iter().map(|c| c.error).fold(0.0, f64::max),
            accuracy_mm: largest(|tick| check::accuracy_of(tick) as f32),
            position_error_mm: largest(|tick| tick.position_error),
            separation_min_mm: least(|tick| tick.separation),
            separation_max_mm: largest(|tick| tick.separation),
            force_max_n: largest(force),
            forces: Forces::of(outcome),
            hand: outcome.hand.clone(),
            ticks_waiting: waiting,
            ticks_nominal: count(State::Nominal),
            ticks_degraded: count(State::Degraded),
            ticks_safe: count(State::Safe) - waiting,
            transitions: Transition::all(&outcome.ticks),
            instructions_mean: on_board.then(|| mean(|tick| tick.query_counts) * scale as f64),
            instructions_outside_mean: on_board
                .then(|| mean_of(&outside, |tick| tick.query_counts) * scale as f64),
            instructions_max: on_board.then_some(u64::from(counts_max) * scale),
            node_tests_mean: mean(|tick| tick.node_tests),
            triangle_tests_mean: mean(|tick| tick.triangle_tests),
            front_max: outcome.ticks.iter().map(|tick| tick.front).max().unwrap_or_default(),
            fallbacks: outcome.ticks.iter().filter(|tick| tick.fallback != 0).count(),
            fallbacks_full: outcome
                .ticks
                .iter()
                .filter(|tick| tick.fallback == fallback_code(Some(Fallback::Full)))
                .count(),
            deadline_misses: on_board.then_some(summary.deadline_misses),
            latency_max_us: on_board.then(|| microseconds(summary.latency_counts)),
            tick_max_us: on_board.then(|| microseconds(summary.tick_counts)),
            flash_bytes: footprint.map(|f| f.flash),
            tree_bytes_per_triangle: scene.tree.blob().len() as f64 / scene.triangles.len() as f64,
            ram_bytes: footprint.map(|f| f.ram + u64::from(summary.stack_bytes)),
            stack_bytes: on_board.then_some(summary.stack_bytes),
            masked_max_us: on_board.then(|| microseconds(summary.masked_counts + 1)),
            bus_masked_max_us: on_board.then(|| microseconds(summary.bus_masked_counts + 1)),
            scrub_rounds: on_board.then_some(summary.scrub_rounds),
            frames_compared: outcome.compared.len(),
            frames_published_wrong: outcome.compared.iter().filter(|c| !c.is_same).count(),
            records_lost: summary.records_dropped.max(expected),
            real_seconds: outcome.took.as_secs_f64(),
            surface: scene.describe(),
            stretch_limit: scene.tree.summary().stretch,
            controller: machine.describe(),
            run: Run::now(format!("{} s", outcome.ticks_asked / TICK_RATE)),
            command: command_line(),
            controller_command: outcome.command.clone(),
            broken_promises: Vec::new(),
        };
        report.broken_promises = report.broken(
            machine,
            outcome,
            because(Unavailable::Query(QueryError::Corrupt { row: 0 })),
        );
        Ok(report)
    }

    /// The promises that this run broke.
    fn broken(&self, machine: &Machine, outcome: &Outcome, faults: usize) -> Vec<String> {
        let mut broken = self.forces.as_ref().map_or_else(Vec::new, Forces::broken);
        let seconds = outcome.ticks_asked / TICK_RATE;
        broken.extend(self.hand.iter().flat_map(|hand| hand.broken(seconds)));
        let mut promise = |kept: bool, sentence: String| {
            if !kept {
                broken.push(sentence);
            }
        };
        let (asked, ran) = (outcome.ticks_asked, self.ticks);
        promise(ran >= asked, format!("{ran} of {asked} ticks ran"));
        promise(self.queries > 0, "no query was answered".to_owned());
        promise(self.queries == outcome.checked.len(), "not every answer was checked".to_owned());
        let wrong = self.mismatches;
        let first = outcome.checked.iter().find(|checked| checked.is_wrong());
        let of = |tick: &&Tick| first.is_some_and(|checked| checked.tick == tick.tick);
        let found = outcome.ticks.iter().find(of).map_or_else(String::new, |tick| {
            let Tick { tick, separation, lower, triangle, node_tests, triangle_tests, .. } = tick;
            format!(
                ", the first at tick {tick}: {separation} mm, certain from {lower} mm on, triangle {triangle}, {node_tests} node and \
                 {triangle_tests} triangle tests"
            )
        });
        promise(wrong == 0, format!("{wrong} answers differ from exhaustive search{found}"));
        let wrong = self.frames_published_wrong;
        promise(wrong == 0, format!("{wrong} published frames differ from what was sent"));
        // The last frame may have been published too late to be read completely.
        let (compared, published) = (self.frames_compared, self.frames_published);
        promise(
            compared + 1 >= published as usize,
            format!("{compared} of {published} published frames were compared"),
        );
        promise(faults == 0, format!("{faults} queries returned an error"));
        let rejected = self.frames_rejected;
        let (sent, published) = (self.frames_sent, self.frames_published);
        promise(published > 0, "no frame was published".to_owned());
        if let Some(faults) = &self.faults {
            promise(faults.total() > 0, "no fault happened".to_owned());
            promise(rejected > 0, "nothing was rejected, whatever the faults".to_owned());
            let recovered = self.silence.as_ref().and_then(|silence| silence.recovered_after);
            promise(self.silence.is_some(), "the silent line did not make it safe".to_owned());
            promise(recovered.is_some(), "it did not recover from the silence".to_owned());
        } else if let Some(bridge) = &self.bridge {
            let received = outcome.network.as_ref().map_or(0, |network| network.packets);
            let (ticks, events) = (self.ticks, &self.bus_events);
            let bridged = Bridged { sent, received, ticks, events, totals: bridge };
            bridged.broken().into_iter().for_each(|sentence| promise(false, sentence));
        } else {
            promise(rejected == 0, format!("{rejected} packets or frames were rejected"));
            let fast = self.bus_events.get(Event::TooFast.name()).copied().unwrap_or(0);
            promise(
                fast == 0,
                format!(
                    "{fast} frames moved faster than the controller's {SPEED} mm/s: give a lower --motion-rate"
                ),
            );
            // The last frame may have been in flight when the run ended.
            promise(published + 1 >= sent, format!("{published} of {sent} frames were published"));
        }
        // The frame rate depends on the host; the promise is that without frames the output is safe.
        let trust = outcome.bus.trust();
        let acting = || outcome.ticks.iter().filter(|tick| tick.state != State::Safe as u32);
        let too_old = acting().filter(|tick| tick.age > trust.age.1).count();
        promise(too_old == 0, format!("{too_old} ticks acted on a surface that was too old"));
        let silent = acting().filter(|tick| tick.silence > trust.silence.1).count();
        promise(silent == 0, format!("{silent} ticks acted after the link was lost"));
        let lost = self.records_lost;
        promise(lost == 0, format!("{lost} telemetry records were lost"));
        let missed = self.deadline_misses.unwrap_or(0);
        promise(missed == 0, format!("{missed} deadlines were missed"));
        promise(outcome.summary.bus_overrun == 0, "the bus lost bytes".to_owned());
        promise(outcome.exited_well, "the controller ended with an error".to_owned());
        if let Machine::Board { footprint, .. } = machine {
            let found = footprint.allocators.join(", ");
            promise(found.is_empty(), format!("the firmware has an allocator: {found}"));
        }
        broken
    }

    /// Writes `report.json`.
    pub fn write(&self, folder: &Path) -> Result<()> {
        let path = folder.join("report.json");
        let json = serde_json::to_string_pretty(self)? + "\n";
        std::fs::write(&path, json).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Prints the run.
    pub fn print(&self, folder: &Path) {
        let row = |name: &str, value: String| println!("  {name:<22}{value}");
        println!();
        row(
            "frames",
            format!(
                "{} sent, {} published, {} packets or frames rejected",
                self.frames_sent, self.frames_published, self.frames_rejected
            ),
        );
        for (name, value) in self.freshness.rows() {
            row(name, value);
        }
        let events: Vec<String> =
            self.bus_events.iter().map(|(name, count)| format!("{name} {count}")).collect();
        row("", events.join(", "));
        if let Some(faults) = &self.faults {
            let list: Vec<String> =
                faults.injected.iter().map(|(name, count)| format!("{name} {count}")).collect();
            row("faults", format!("{}: {}", faults.total(), list.join(", ")));
        }
        if let Some(silence) = &self.silence {
            let Silence { since_packet, since_frame, age, recovered_after, .. } = silence;
            row(
                "line cut",
                format!(
                    "safe {since_packet} ms after the last good packet, {since_frame} after the last \
                     good frame, surface {age} ms old"
                ),
            );
            if let Some(recovered) = recovered_after {
                row("", format!("nominal again {recovered} ms later"));
            }
        }
        row("control ticks", format!("{} at {TICK_RATE} Hz", self.ticks));
        row(
            "surface trusted",
            format!(
                "{} ticks nominal, {} degraded, {} safe, {} before the first frame",
                self.ticks_nominal, self.ticks_degraded, self.ticks_safe, self.ticks_waiting
            ),
        );
        for change in &self.transitions {
            row("", change.to_string());
        }
        row(
            "answers",
            format!(
                "{}, {} differ from exhaustive f64 search (largest error {:.2} of the stated {:.1e} mm)",
                self.queries, self.mismatches, self.largest_error, self.accuracy_mm
            ),
        );
        row(
            "frames read back",
            format!(
                "{}, {} differ from what was sent",
                self.frames_compared, self.frames_published_wrong
            ),
        );
        row(
            "separation",
            format!("{:.2} to {:.2} mm", self.separation_min_mm, self.separation_max_mm),
        );
        row("largest force", format!("{:.2} N", self.force_max_n));
        for (name, value) in self.forces.iter().flat_map(Forces::rows) {
            row(name, value);
        }
        for (name, value) in self.hand.iter().flat_map(Hand::rows) {
            row(name, value);
        }
        row(
            "tests a query",
            format!("{:.0} nodes, {:.0} triangles", self.node_tests_mean, self.triangle_tests_mean),
        );
        row("front", format!("{} nodes at most, {} fallbacks", self.front_max, self.fallbacks));
        if self.fallbacks_full > 0 {
            row("", format!("{} of them: too few places for the mesh", self.fallbacks_full));
        }
        if let (Some(mean), Some(outside), Some(max)) =
            (self.instructions_mean, self.instructions_outside_mean, self.instructions_max)
        {
            row(
                "instructions a query",
                format!("{mean:.0} mean, {outside:.0} with the axis outside, {max} max"),
            );
            row(
                "",
                format!(
                    "{:.1} kHz mean, {:.1} kHz worst at {:.0} MHz and one instruction a cycle",
                    INSTRUCTION_RATE / mean / 1e3,
                    INSTRUCTION_RATE / max as f64 / 1e3,
                    INSTRUCTION_RATE / 1e6
                ),
            );
        }
        if let (Some(missed), Some(latency), Some(longest)) =
            (self.deadline_misses, self.latency_max_us, self.tick_max_us)
        {
            row(
                "deadlines missed",
                format!("{missed}; latest start {latency:.1} us, latest end {longest:.0} us"),
            );
        }
        if let (Some(flash), Some(ram), Some(stack)) =
            (self.flash_bytes, self.ram_bytes, self.stack_bytes)
        {
            row("memory", format!("{flash} bytes flash, {ram} RAM, {stack} of them stack"));
            row("", format!("tree of {:.2} bytes a triangle", self.tree_bytes_per_triangle));
        }
        if let (Some(masked), Some(bus), Some(rounds)) =
            (self.masked_max_us, self.bus_masked_max_us, self.scrub_rounds)
        {
            row(
                "interrupts off",
                format!("{masked:.2} us at most, once; the bus's alone {bus:.2} us at most"),
            );
            row("tree in flash", format!("checked {rounds} times"));
        }
        if let Some(bridge) = &self.bridge {
            row("bridge", format!("{} frames; {}", bridge["frames"], bridge["timing"]));
        }
        let time = f64::from(self.ticks) / f64::from(TICK_RATE);
        row(
            "took",
            format!("{:.1} s, {:.2} of real time", self.real_seconds, time / self.real_seconds),
        );
        row("report and pictures", folder.display().to_string());
        println!();
    }

    /// An error that names the broken promises, if any.
    pub fn verdict(&self) -> Result<()> {
        if !self.broken_promises.is_empty() {
            bail!("broken promises:\n  {}", self.broken_promises.join("\n  "));
        }
        println!("every promise kept");
        Ok(())
    }
}

/// The bus's events that were counted.
fn events(summary: &Summary) -> BTreeMap<&'static str, u32> {
    let counted = Event::ALL.into_iter().zip(summary.events);
    counted.filter(|&(_, count)| count > 0).map(|(event, count)| (event.name(), count)).collect()
}

/// Magnitude of a tick's force, in N.
pub fn force(tick: &Tick) -> f32 {
    glam::Vec3::from(tick.force).length()
}

/// The command that started this, as typed in a shell.
fn command_line() -> String {
    if std::env::var_os(workspace::EVIDENCE).is_some() {
        return "cargo xtask evidence".to_owned();
    }
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    format!("cargo xtask {}", arguments.join(" "))
}
