//! `dibs track`: a tool on its path about a moving surface, tick by tick.

use crate::mesh_file::Lengths;
use crate::query::{LocalTool, STACK, ToolSpec, parse_tool, side_name};
use crate::recorded::{Recorded, checked_rate};
use crate::tree_file::{self, AnyTree};
use crate::{output, overwrite};
use anyhow::{Context, Result, anyhow, bail};
use dibs_build::glam::Vec3;
use dibs_nostd::{
    Fallback, Index, MeasuredStretch, MovingSurface, Odometer, Options, Proximity, Query, Step,
    Tool, Tracker, Tree, measure_stretch,
};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Opened nodes that are remembered: more than any tool needs.
const OPENED: usize = 4_096;

/// Bytes that are printed at once.
const BUFFER: usize = 1 << 16;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs track heart.dibs --motion heart.pc2 --path tools.csv --json
  dibs track heart.dibs --motion heart.pc2 --path tools.csv --surface extrapolated --full

A frame arrives when its time has come; the motion is played over and over. SurfaceBlend frames the surface is that
of the last frame (held), on its way there from the one before (interpolated: late by a frame), or beyond it as
it moved before (extrapolated). One line a tick on standard output, and what it took on standard error.")]
pub struct Args {
    /// A tree file that `dibs build` wrote
    tree: PathBuf,
    /// The surface's motion: .pc2, .npy or a series (heart_%03d.vtp) of the built mesh
    #[arg(long)]
    motion: PathBuf,
    /// Frames a second of the motion; by default the number in its file
    #[arg(long, value_name = "HZ")]
    motion_rate: Option<f32>,
    /// Ticks a second
    #[arg(long, default_value_t = 1_000.0)]
    rate: f64,
    /// The tool at each tick: a line is what `dibs query --tool` takes
    #[arg(long)]
    path: PathBuf,
    /// The surface between frames
    #[arg(long, value_enum, default_value_t = Surface::Interpolated)]
    surface: Surface,
    /// Ask every tick anew, remembering nothing
    #[arg(long)]
    full: bool,
    #[command(flatten)]
    lengths: Lengths,
    /// Print a JSON object a line, and another one of the means on standard error
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Surface {
    Held,
    Interpolated,
    Extrapolated,
}

pub fn run(args: &Args) -> Result<()> {
    overwrite::check([&args.tree, &args.motion, &args.path], [])?;
    let bytes = tree_file::load(&args.tree)?;
    match tree_file::validate(&bytes, &args.tree)? {
        AnyTree::Narrow(tree) => track(args, &tree),
        AnyTree::Wide(tree) => track(args, &tree),
    }
}

/// The tool at each tick, as `each` has it.
pub fn tools<T>(path: &Path, each: impl Fn(ToolSpec) -> Result<T>) -> Result<Vec<T>> {
    let name = path.display();
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}: cannot be read"))?;
    let tools: Vec<T> = (1..)
        .zip(text.lines())
        .filter(|(_, line)| !line.trim().is_empty())
        .map(|(number, line)| {
            parse_tool(line.trim())
                .and_then(&each)
                .map_err(|error| anyhow!("{name}, line {number}: {error}"))
        })
        .collect::<Result<_>>()?;
    if tools.is_empty() {
        bail!("{name}: no line, and so no tick; give a tool for each tick");
    }
    Ok(tools)
}

fn track<I: Index>(args: &Args, tree: &Tree<'_, I>) -> Result<()> {
    let origin = tree.origin().into();
    let tools = tools(&args.path, |tool| tool.local(origin))?;
    let rate = checked_rate(args.rate)?;
    let recorded = Recorded::read(tree, &args.motion, &args.lengths, args.motion_rate)?;
    let Recorded { frames, stretches, .. } = &recorded;
    let mut session = Session {
        tree,
        query: Query::new(tree)?,
        tracker: (!args.full).then(|| Tracker::new(tree)).transpose()?,
        out: Vec::new(),
        json: args.json,
        sums: [0; 2],
        fallbacks: 0,
        full: 0,
    };
    let mut odometer = Odometer::new(tree);
    let frame_at = |tick: usize| recorded.at(tick as f64 / rate);
    let mut ticks = (0..).zip(&tools).peekable();
    let mut last = 0;
    while let Some(&(first, _)) = ticks.peek() {
        // The ticks from one frame to the next.
        let (number, _) = frame_at(first);
        let current = number % frames.len();
        let step = odometer.step(frames[last].as_slice(), frames[current].as_slice());
        let both =
            stretches[last].or_larger(stretches[current]).context("measured with one tree")?;
        while let Some((tick, tool)) = ticks.next_if(|&(tick, _)| frame_at(tick).0 == number) {
            let share = frame_at(tick).1 as f32;
            let stretch =
                if args.surface == Surface::Interpolated { both } else { stretches[current] };
            session.tick(tick, &step, args.surface, share, stretch, tool)?;
            if session.out.len() >= BUFFER && !session.print() {
                return Ok(());
            }
        }
        last = current;
    }
    session.finish(tools.len())
}

struct Session<'t, I> {
    tree: &'t Tree<'t, I>,
    query: Query<'t, I, STACK>,
    /// `None` with `--full`.
    tracker: Option<Tracker<'t, I, STACK, OPENED>>,
    /// Lines that are not printed yet.
    out: Vec<u8>,
    json: bool,
    /// Node and triangle tests.
    sums: [u64; 2],
    fallbacks: usize,
    /// Of these, those for want of places.
    full: usize,
}

impl<I: Index> Session<'_, I> {
    fn tick(
        &mut self,
        tick: usize,
        step: &Step<'_, [Vec3], [Vec3]>,
        surface: Surface,
        share: f32,
        stretch: MeasuredStretch,
        tool: &LocalTool,
    ) -> Result<()> {
        let (proximity, fallback) = match surface {
            Surface::Held => self.ask(&step.after(), stretch, tool)?,
            Surface::Interpolated => self.ask(&step.at(share), stretch, tool)?,
            // An extrapolated surface beyond the tree's stretch limit is not searched: the last frame is held.
            Surface::Extrapolated => match measure_stretch(self.tree, &step.beyond(share)) {
                Ok(stretch) => self.ask(&step.beyond(share), stretch, tool)?,
                Err(_) => self.ask(&step.after(), stretch, tool)?,
            },
        };
        self.sums[0] += u64::from(proximity.node_tests);
        self.sums[1] += u64::from(proximity.triangle_tests);
        self.fallbacks += usize::from(fallback.is_some());
        self.full += usize::from(fallback == Some(Fallback::Full));
        let (separation, lower) = (proximity.separation, proximity.lower);
        let (nodes, triangles) = (proximity.node_tests, proximity.triangle_tests);
        let (side, _) = side_name(proximity.side);
        if self.json {
            let line = serde_json::json!({
                "tick": tick,
                "separation": separation,
                "lower": lower,
                "side": side,
                "node_tests": nodes,
                "triangle_tests": triangles,
                "fallback": fallback.map(word),
            });
            writeln!(self.out, "{line}")?;
        } else {
            let fallback = fallback.map_or("", word);
            writeln!(
                self.out,
                "{tick:6} {separation:12.5} {side:9} {nodes:6} {triangles:5} {fallback}"
            )?;
        }
        Ok(())
    }

    fn ask(
        &mut self,
        surface: &impl MovingSurface,
        stretch: MeasuredStretch,
        tool: &LocalTool,
    ) -> Result<(Proximity, Option<Fallback>)> {
        match tool {
            LocalTool::Sphere(sphere) => self.closest(surface, sphere, stretch),
            LocalTool::Capsule(capsule) => self.closest(surface, capsule, stretch),
        }
    }

    fn closest(
        &mut self,
        surface: &impl MovingSurface,
        tool: &impl Tool,
        stretch: MeasuredStretch,
    ) -> Result<(Proximity, Option<Fallback>)> {
        let options = Options::cold().stretch(stretch);
        Ok(match &mut self.tracker {
            Some(tracker) => {
                let found = tracker.closest(surface, tool, &options)?;
                (found.closest, found.fallback)
            }
            None => (self.query.closest(surface, tool, &options)?, None),
        })
    }

    /// Prints the lines that wait. Returns whether more are wanted.
    fn print(&mut self) -> bool {
        let wants_more = output::write(&self.out);
        self.out.clear();
        wants_more
    }

    fn finish(mut self, ticks: usize) -> Result<()> {
        if !self.print() {
            return Ok(());
        }
        let [nodes, triangles] = self.sums.map(|sum| sum as f64 / ticks as f64);
        let (fallbacks, full) = (self.fallbacks, self.full);
        if full > 0 {
            eprintln!(
                "warning: {full} of {ticks} ticks were whole queries: too many triangles are about as close as the closest \
                 for the tracker's {OPENED} places"
            );
        }
        if self.json {
            let summary = serde_json::json!({
                "ticks": ticks, "node_tests": nodes, "triangle_tests": triangles, "fallbacks": fallbacks,
                "full": full,
            });
            eprintln!("{summary}");
        } else {
            eprintln!(
                "{ticks} ticks: {nodes:.1} node tests and {triangles:.1} triangle tests each, {fallbacks} fallbacks"
            );
        }
        Ok(())
    }
}

fn word(fallback: Fallback) -> &'static str {
    match fallback {
        Fallback::Start => "start",
        Fallback::Surface => "surface",
        Fallback::Jump => "jump",
        _ => "full",
    }
}
