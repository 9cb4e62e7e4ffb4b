//! The longest control tick: the firmware's receiver and tick on the emulated board, with admitted frames that a search
//! has chosen to make the tick long.

// Requirement: P-03

use anyhow::{Context, Result, ensure};
use controller::surface::{self, CENTRE, REACH};
use controller::{MTU, TICK_INSTRUCTIONS, instructions, instrument};
use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::MAX_STACK;
use dibs_nostd::wire::{
    Encoding, FrameEncoder, FrameId, Freshness, NoMac, encode_heartbeat, enframe, framed_bytes,
};
use dibs_nostd::{
    Admission, AdmissionCheck, Budget, Cost, FrameExtent, IncomingSurface, MeasuredStretch,
    Options, Query, StretchMonitor, SurfaceLimits,
};
use dibs_tests::deform::{Deformation, unit};
use fastrand::Rng;
use glam::{Quat, Vec3};
use probe::tick::{ANSWER_WORDS, BYTES, END, REGISTER, SKIP, TICK};
use rayon::prelude::*;
use xtask::firmware::{HEART_STRETCH, Surface};
use xtask::process::run;
use xtask::steps::Outcome;

use crate::harness::figures::Figures;
use crate::harness::promise::{Bound, Promise, criteria::TIMING, note};
use crate::harness::{Check, Effort};
use crate::probe::{COUNTING, board, padded, run_on_board};

pub const CHECK: Check = Check {
    name: "ticks on adversarial frames",
    run: check,
    promises: &[
        note("ticks.frames"),
        note("ticks.ticks"),
        note("ticks.mean"),
        note("ticks.cut-short"),
        note("ticks.unlimited"),
        Promise {
            id: "ticks.longest",
            says: "The longest control tick of the firmware on frames that it admits and that were chosen to make the tick \
                   dear: folded, crumpled, flattened, shrunk to the limit, wrapped around the tool; published right before it",
            criterion: TIMING,
            bound: Bound::AtMost(120_000.0),
            unit: "instructions, of 480,000 in 1 ms at 480 MHz; {ticks.mean} in the mean of {ticks.ticks} ticks on \
                   {ticks.frames} frames, {ticks.cut-short} of them cut short by their budget",
            limits: "The dearest that a search found, not a proof. By the cost model, the dearest of these queries would \
                     take {ticks.unlimited} instructions without the budget and without contacts. With the wall's force and a list \
                     of the contacts within its margin, in one budget; without the filter. Instructions, not cycles.",
        },
    ],
};

/// Poses tried on each shape, and hill climbing steps from the most expensive one.
const TRIES: usize = 40;
const STEPS: usize = 40;

/// Ticks between two frames. The interval exceeds any recovery, so each frame is a registration.
const PAUSE: u32 = 1 << 20;

/// Ticks on each published frame; the first starts from the last answer on the previous frame.
const TICKS: u32 = 3;

/// Limit on the coordinates, relative to the size of the rest shape: less than the firmware allows.
const ROOM: f32 = 3.5;

fn check(effort: &Effort, figures: &mut Figures) -> Result<Outcome> {
    let cross = board()?;
    let mut cargo = cross.cargo("build");
    cargo.args(["--quiet", "--package", "dibs-probe", "--features", "tick", "--bin", "tick"]);
    cargo.args(["--profile", "firmware"]);
    Surface::default().describe_to(&mut cargo);
    run(&mut cargo).context("the firmware's control path does not build")?;
    let program = cross.program("firmware", "tick");

    let mesh = generate::heart(10_272)?.mesh;
    let built = Builder::new().stretch(HEART_STRETCH).build(&mesh)?;
    let mesh_id = built.summary().mesh_id;
    let kinds = (0..effort.tick_frames).into_par_iter();
    let frames = kinds
        .map(|number| dearest(&mesh, &built, number, &mut Rng::with_seed(number as u64)))
        .collect::<Result<Vec<_>>>()?;

    let mut script = Script::default();
    for (epoch, frame) in (1..).zip(&frames) {
        script.frame(FrameId { mesh_id, session: 1, epoch }, frame)?;
    }
    script.words.push(END);
    let answers = run_on_board(&program, &script.bytes(), COUNTING)?;
    let (answers, _) = answers.as_chunks::<ANSWER_WORDS>();
    let expected = frames.len() * (1 + TICKS as usize);
    ensure!(answers.len() == expected, "{} ticks answered, not {expected}", answers.len());

    let budget = Budget::for_instructions(instructions(false), &Cost::M7_TICK);
    let (mut sum, mut longest, mut cut_short) = (0.0, 0.0_f64, 0);
    for (number, ticks) in answers.chunks(1 + TICKS as usize).enumerate() {
        for (place, &[took, nodes, triangles, epoch]) in ticks.iter().enumerate() {
            // The first tick runs between the frame's packets.
            let is_new = place > 0;
            let of = number as u32 + u32::from(is_new);
            ensure!(epoch == of, "a tick about frame {epoch}, not {of}: the firmware refused it");
            // The clock counts 1.6 for each instruction.
            let instructions = f64::from(took) * 0.625;
            (sum, longest) = (sum + instructions, longest.max(instructions));
            let work = nodes + triangles * Budget::TRIANGLE;
            // What is left of the budget must be less than a triangle's test and its plane's, or the tests of a node's
            // children.
            cut_short += u32::from(work + 2 * Budget::TRIANGLE > budget.tests());
        }
    }
    let unlimited = frames.iter().map(|frame| frame.cost).max().unwrap_or_default();
    figures.note("ticks.frames", frames.len() as f64);
    figures.note("ticks.ticks", answers.len() as f64);
    figures.note("ticks.mean", (sum / answers.len() as f64).round());
    figures.note("ticks.longest", longest.round());
    figures.note("ticks.cut-short", f64::from(cut_short));
    figures.note("ticks.unlimited", unlimited as f64);
    // Otherwise the search has found no frame that needs a budget.
    ensure!(cut_short > 0 && unlimited > TICK_INSTRUCTIONS, "no frame is dear: {unlimited}");
    Ok(Outcome::Passed)
}

/// A frame, and the tick that it is made for.
struct Frame {
    rows: Vec<Vec3>,
    /// Number of ticks after its publication, counted from a multiple of [`PAUSE`].
    tick: u32,
    /// Instructions of the query at that tick without a budget, by the cost model.
    cost: u64,
}

/// The most expensive frame of one kind that the search finds.
fn dearest(mesh: &Mesh, built: &BuiltTree, number: usize, rng: &mut Rng) -> Result<Frame> {
    let tree = built.tree::<surface::Index>()?;
    let monitor = StretchMonitor::new(&tree)?.limits(SurfaceLimits::reach_mm(f32::INFINITY));
    let admitted = |rows: &[Vec3]| -> Option<MeasuredStretch> {
        let mut monitor = monitor.clone();
        monitor.begin(FrameExtent::Whole);
        match monitor.advance(IncomingSurface::new(rows, rows.len() as u32), u32::MAX) {
            Ok(Admission::Admitted(stretch)) => stretch,
            _ => None,
        }
    };
    let is_fit = |moved: &[Vec3]| admitted(&built.to_rows(moved)).is_some();
    let kinds = Deformation::ALL.len() + 1;
    let shape = match Deformation::ALL.get(number % kinds) {
        Some(deformation) => deformation.apply_while(mesh, is_fit, rng),
        None => round(mesh, is_fit),
    };
    let shape = built.to_rows(&shape);
    let middle = shape.iter().sum::<Vec3>() / shape.len() as f32;

    let mut query = Query::<_, MAX_STACK>::new(&tree)?;
    let base = (number as u32 + 1) * PAUSE;
    let mut cost = |placed: &Placed| -> Option<(Vec<Vec3>, u64)> {
        let rows: Vec<Vec3> = shape.iter().map(|&p| placed.turn * p + placed.shift).collect();
        let reach = CENTRE.abs().max_element() + ROOM * REACH;
        if rows.iter().any(|p| p.abs().max_element() > reach) {
            return None;
        }
        // Rounding in a rotation may move a shape beyond its limit.
        let measured = admitted(&rows)?;
        let tool = instrument(base + placed.tick).ok()?;
        let found = query.closest(&rows[..], &tool, &Options::cold().stretch(measured)).ok()?;
        Some((rows, Cost::M7_CAPSULE.instructions(found.node_tests, found.triangle_tests)))
    };
    let mut best: Option<(Placed, Frame)> = None;
    for step in 0..TRIES + STEPS {
        let placed = match &best {
            Some((best, _)) if step >= TRIES => best.nudged(rng),
            _ => Placed::around(&shape, middle, base, rng)?,
        };
        let Some((rows, cost)) = cost(&placed) else { continue };
        if best.as_ref().is_none_or(|(_, best)| cost > best.cost) {
            let frame = Frame { rows, tick: placed.tick, cost };
            best = Some((placed, frame));
        }
    }
    best.map(|(_, frame)| frame).context("no place for a shape")
}

/// The surface deformed towards a sphere, as far as admitted: a sphere's points are equally far from its centre.
fn round(mesh: &Mesh, is_fit: impl Fn(&[Vec3]) -> bool) -> Vec<Vec3> {
    let middle = mesh.positions.iter().sum::<Vec3>() / mesh.positions.len() as f32;
    let at = |share: f32, size: f32| -> Vec<Vec3> {
        let on_sphere = |p: Vec3| (p - middle).normalize_or(Vec3::X) * REACH;
        let moved = mesh.positions.iter().map(|&p| (p - middle).lerp(on_sphere(p), share) * size);
        moved.collect()
    };
    // The largest round shape; if none is admitted, the roundest.
    let sizes = || (1..=40).rev().map(|size| size as f32 / 40.0);
    let shares = (0..=20).rev().map(|share| share as f32 / 20.0);
    let mut all = shares.flat_map(|share| sizes().map(move |size| at(share, size)));
    all.find(|moved| is_fit(moved)).unwrap_or_else(|| at(0.0, 1.0))
}

/// A placed shape, and its tick.
struct Placed {
    turn: Quat,
    shift: Vec3,
    tick: u32,
}

impl Placed {
    /// A random placement at a tick's instrument: around it, on it or next to it.
    fn around(shape: &[Vec3], middle: Vec3, base: u32, rng: &mut Rng) -> Result<Self> {
        let tick = rng.u32(..PAUSE / 2);
        let tool = instrument(base + tick)?;
        let on_tool = tool.start().lerp(tool.end(), rng.f32());
        let turn = Quat::from_axis_angle(unit(rng), rng.f32() * 3.0);
        let anchor = if rng.bool() { middle } else { shape[rng.usize(..shape.len())] };
        let away = unit(rng) * rng.f32() * REACH * [0.0, 0.1, 0.5][rng.usize(..3)];
        Ok(Self { turn, shift: on_tool - turn * anchor + away, tick })
    }

    /// The same, with a small random displacement and rotation.
    fn nudged(&self, rng: &mut Rng) -> Self {
        let size = 0.3 * rng.f32().powi(3);
        let turn = Quat::from_axis_angle(unit(rng), size) * self.turn;
        Self { turn, shift: self.shift + unit(rng) * size * REACH, tick: self.tick }
    }
}

/// The board's input.
#[derive(Default)]
struct Script {
    words: Vec<u32>,
    now: u32,
}

impl Script {
    /// Adds a frame that is published just before its tick, and a tick between its packets.
    fn frame(&mut self, id: FrameId, frame: &Frame) -> Result<()> {
        let begins = id.epoch * PAUSE + frame.tick - 1;
        self.words.extend([SKIP, begins - self.now, REGISTER]);
        let (mut packet, mut line) = ([0; MTU], [0; framed_bytes(MTU)]);
        let mut lines = Vec::new();
        let mut beat = [0; 64];
        let beat = encode_heartbeat(&id, id.epoch, None, &NoMac, &mut beat);
        lines.push(enframe(beat, &mut line).context("no room")?.to_vec());
        let freshness = Freshness { age_ms: 0, echo: Some(begins) };
        let encoder = FrameEncoder::<_, MTU>::new(id, Encoding::Float, &frame.rows[..])?;
        let mut encoder = encoder.with_freshness(freshness);
        while let Some(packet) = encoder.next_packet(&mut packet) {
            lines.push(enframe(packet, &mut line).context("no room")?.to_vec());
        }
        let (first, rest) = lines.split_at(lines.len() / 2);
        self.bytes_of(first);
        self.words.extend([TICK, 1]);
        self.bytes_of(rest);
        self.words.extend([TICK, TICKS]);
        self.now = begins + 1 + TICKS;
        Ok(())
    }

    fn bytes_of(&mut self, lines: &[Vec<u8>]) {
        let bytes = lines.concat();
        self.words.extend([BYTES, bytes.len() as u32]);
        self.words.extend(padded(&bytes));
    }

    fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}
