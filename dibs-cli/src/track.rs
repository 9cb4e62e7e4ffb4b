//! `dibs track`: a tool on its path near a moving surface, tick by tick.

use crate::query::{ContactRecord, STACK, Touch, side_name, vector};
use crate::recorded::{MovingArgs, RecordedFrames};
use crate::tool::{self, LocalTool};
use crate::tree_file::{self, AnyTree};
use crate::{output, overwrite};
use anyhow::{Context, Result, bail};
use dibs_build::glam::{DVec3, Vec3};
use dibs_nostd::{
    Budget, Contacts, Cost, Fallback, Index, MeasuredStretch, MovingSurface, NoSide, Odometer,
    Options, Proximity, Query, Side, Step, Tool, Tracker, Tree,
};
use serde::Serialize;
use std::io::Write;
use std::path::PathBuf;

/// Opened nodes that are remembered: more than any tool needs.
const OPENED: usize = 4_096;

/// Bytes of output that are buffered.
const BUFFER: usize = 1 << 16;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs track heart.dibs --motion heart.pc2 --path tools.csv --json
  dibs track heart.dibs --motion heart.pc2 --path tools.csv --surface extrapolated --full
  dibs track heart.dibs --motion heart.pc2 --path tools.csv --budget 60000 --contacts 5 --json

A frame arrives when its time has come; the motion is played over and over. Between frames the surface is that
of the last frame (held), on its way there from the one before (interpolated: late by a frame), or beyond it as
it moved before (extrapolated). One line a tick on standard output, and what it took on standard error.

Where a budget ends the search for the closest pair, is_cut is true and the certified interval is wider: it is that of the
last ticks, less what has moved since. is_kept says that the side is the last tick's. is_cut says nothing of the list of
contacts: contacts_bound says how far that is complete, and is below the margin where the budget ended it; it is null where
nothing is certain. A budget counts by the fit of a tracker's ticks, with contacts or without, on a surface whose frames
have the vertices: one that nodes carry takes several times as much.")]
pub struct Args {
    #[command(flatten)]
    moving: MovingArgs,
    /// The tool at each tick, a line each, as for `dibs query --tool`; `-` is standard input
    #[arg(long, value_name = "TOOLS")]
    path: PathBuf,
    /// The surface between frames
    #[arg(long, value_enum, default_value_t = Surface::Interpolated)]
    surface: Surface,
    /// Search anew at every tick, without memory of earlier ticks
    #[arg(long)]
    full: bool,
    /// Instructions of a Cortex-M7 that a tick may take; unlimited by default
    #[arg(long, value_name = "N")]
    budget: Option<u32>,
    /// Also list all locally closest pairs with a separation of at most this: up to 64
    #[arg(long, value_name = "MM")]
    contacts: Option<f32>,
    /// Print a JSON object a line, and one with the means on standard error
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
    let tree = &args.moving.tree;
    overwrite::check([tree, args.moving.motion()?, &args.path], [])?;
    if let Some(margin) = args.contacts
        && !(margin >= 0.0 && margin.is_finite())
    {
        bail!("--contacts is {margin}: give a margin of at least 0");
    }
    let bytes = tree_file::load(tree)?;
    match tree_file::validate(&bytes, tree)? {
        AnyTree::Narrow(tree) => track(args, &tree),
        AnyTree::Wide(tree) => track(args, &tree),
    }
}

fn track<I: Index>(args: &Args, tree: &Tree<'_, I>) -> Result<()> {
    let origin: DVec3 = tree.origin().into();
    let tools = tool::path(&args.path, |tool| tool.local(origin))?;
    let rate = args.moving.rate()?;
    let recorded = args.moving.read(tree)?;
    let RecordedFrames { frames, stretches, .. } = &recorded;
    let mut session = Session {
        tree,
        query: Query::new(tree)?,
        tracker: (!args.full).then(|| Tracker::with_range(tree)).transpose()?,
        near: args.contacts.map(|margin| (margin, Box::default())),
        budget: args.budget,
        origin,
        name: args.moving.tree.display().to_string(),
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
        // The ticks between this frame and the next.
        let (number, _) = frame_at(first);
        let current = number % frames.len();
        let step = odometer.step(frames[last].as_slice(), frames[current].as_slice());
        let both =
            stretches[last].or_larger(stretches[current]).context("measured with one tree")?;
        while let Some((tick, tool)) = ticks.next_if(|&(tick, _)| frame_at(tick).0 == number) {
            let share = frame_at(tick).1 as f32;
            let stretch =
                if args.surface == Surface::Interpolated { both } else { stretches[current] };
            let beyond = || recorded.stretch_beyond(tree, [last, current], share).ok();
            session.tick(tick, &step, args.surface, share, (stretch, &beyond), tool)?;
            if session.out.len() >= BUFFER && !session.print() {
                return Ok(());
            }
        }
        last = current;
    }
    session.finish(tools.len())
}

/// The answer of a tick, with or without a tracker.
struct Answer {
    closest: Proximity,
    is_kept: bool,
    fallback: Option<Fallback>,
}

struct Session<'t, I> {
    tree: &'t Tree<'t, I>,
    query: Query<'t, I, STACK>,
    /// `None` with `--full`.
    tracker: Option<Tracker<'t, I, STACK, OPENED, OPENED>>,
    /// With `--contacts`: the margin and the list.
    near: Option<(f32, Box<Contacts<64>>)>,
    /// Limit on instructions.
    budget: Option<u32>,
    origin: DVec3,
    /// The tree's file.
    name: String,
    /// Lines that are not written yet.
    out: Vec<u8>,
    json: bool,
    /// Sums of node and triangle tests.
    sums: [u64; 2],
    fallbacks: usize,
    /// Number of these because the tracker was full.
    full: usize,
}

/// A tick in JSON.
#[derive(Serialize)]
struct Line<'a> {
    tick: usize,
    separation: f64,
    lower: f64,
    /// Certified: the bounds include the accuracy. The first is null if the tool may be inside to any depth.
    interval: [f64; 2],
    side: &'static str,
    direction: [f64; 3],
    is_cut: bool,
    is_kept: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts: Option<Vec<ContactRecord<'a>>>,
    /// Every contact with a separation below this is listed.
    #[serde(skip_serializing_if = "Option::is_none")]
    contacts_bound: Option<f64>,
    node_tests: u32,
    triangle_tests: u32,
    fallback: Option<&'static str>,
}

impl<I: Index> Session<'_, I> {
    fn tick(
        &mut self,
        tick: usize,
        step: &Step<'_, [Vec3], [Vec3]>,
        surface: Surface,
        share: f32,
        (stretch, beyond): (MeasuredStretch, &dyn Fn() -> Option<MeasuredStretch>),
        tool: &LocalTool,
    ) -> Result<()> {
        let answer = match surface {
            Surface::Held => self.ask(&step.after(), stretch, tool)?,
            Surface::Interpolated => self.ask(&step.at(share), stretch, tool)?,
            // An extrapolated surface beyond the tree's stretch limit is not searched: the latest frame is used
            // unchanged.
            Surface::Extrapolated => match beyond() {
                Some(stretch) => self.ask(&step.beyond(share), stretch, tool)?,
                None => self.ask(&step.after(), stretch, tool)?,
            },
        };
        let Answer { closest, is_kept, fallback } = answer;
        self.sums[0] += u64::from(closest.node_tests);
        self.sums[1] += u64::from(closest.triangle_tests);
        self.fallbacks += usize::from(fallback.is_some());
        self.full += usize::from(fallback == Some(Fallback::Full));
        let (side, _) = side_name(closest.side);
        let Proximity { separation, node_tests, triangle_tests, .. } = closest;
        if self.json {
            let interval = closest.interval();
            let line = Line {
                tick,
                separation: separation.into(),
                lower: closest.lower.into(),
                interval: [interval.lower.into(), interval.upper.into()],
                side,
                direction: vector(closest.direction),
                is_cut: self.budget.is_some() && is_cut(&closest, tool),
                is_kept,
                contacts: self.touches(),
                contacts_bound: self.near.as_ref().map(|(_, contacts)| contacts.bound().into()),
                node_tests,
                triangle_tests,
                fallback: fallback.map(word),
            };
            let line = serde_json::to_string(&line)?;
            writeln!(self.out, "{line}")?;
        } else {
            let contacts = match &self.near {
                Some((_, contacts)) => format!("{:3} contacts ", contacts.len()),
                None => String::new(),
            };
            let fallback = fallback.map_or("", word);
            writeln!(
                self.out,
                "{tick:6} {separation:12.5} {side:9} {node_tests:6} {triangle_tests:5} {contacts}{fallback}"
            )?;
        }
        Ok(())
    }

    /// The contacts of the tick, with `--contacts`.
    fn touches(&self) -> Option<Vec<ContactRecord<'_>>> {
        let vertex = |row| self.tree.vertex_number(row).map_or(row, |vertex| vertex.0);
        let (_, contacts) = self.near.as_ref()?;
        let touches = contacts.iter().map(|&contact| {
            Touch {
                contact,
                triangle: contact.corners.map(vertex),
                label: self.tree.label(contact.triangle),
                origin: self.origin,
                tree: &self.name,
                tool: 0,
            }
            .record()
        });
        Some(touches.collect())
    }

    fn ask(
        &mut self,
        surface: &impl MovingSurface,
        stretch: MeasuredStretch,
        tool: &LocalTool,
    ) -> Result<Answer> {
        let of_query = match tool {
            LocalTool::Sphere(_) => &Cost::M7_SPHERE,
            LocalTool::Capsule(_) => &Cost::M7_CAPSULE,
        };
        let cost = if self.tracker.is_some() { &Cost::of_tick(self.tree) } else { of_query };
        match tool {
            LocalTool::Sphere(sphere) => self.closest(surface, sphere, stretch, cost),
            LocalTool::Capsule(capsule) => self.closest(surface, capsule, stretch, cost),
        }
    }

    fn closest(
        &mut self,
        surface: &impl MovingSurface,
        tool: &impl Tool,
        stretch: MeasuredStretch,
        cost: &Cost,
    ) -> Result<Answer> {
        let mut options = Options::cold().stretch(stretch);
        if let Some(instructions) = self.budget {
            options = options.budget(Budget::for_instructions(instructions, cost));
        }
        let Some(tracker) = &mut self.tracker else {
            let closest = match &mut self.near {
                Some((margin, list)) => {
                    self.query.contacts(surface, tool, *margin, &options, list)?
                }
                None => self.query.closest(surface, tool, &options)?,
            };
            return Ok(Answer { closest, is_kept: false, fallback: None });
        };
        let found = match &mut self.near {
            Some((margin, list)) => tracker.contacts(surface, tool, *margin, &options, list)?,
            None => tracker.closest(surface, tool, &options)?,
        };
        Ok(Answer { closest: found.closest, is_kept: found.is_kept, fallback: found.fallback })
    }

    /// Writes the buffered lines. Returns whether writing can continue.
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

/// Whether a budget ended the search before the answer was as certain as without a budget.
fn is_cut(closest: &Proximity, tool: &LocalTool) -> bool {
    let length = match tool {
        LocalTool::Sphere(_) => 0.0,
        LocalTool::Capsule(capsule) => capsule.axis_length(),
    };
    let width = closest.separation - closest.lower;
    match closest.side {
        Side::Undefined(NoSide::CutShort) => true,
        side if side.has_depth() => {
            let tolerance = Options::default_depth_tolerance(length, closest.accuracy);
            // The interval's ends are rounded.
            width > tolerance + closest.accuracy
        }
        _ => !(width <= 0.0),
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
