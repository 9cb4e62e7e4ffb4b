//! `dibs filter`: filters a tool's commanded path, and shows the motions that are admitted.

use std::io::Write;
use std::path::PathBuf;

use anyhow::{Result, anyhow, bail};
use dibs_build::glam::DVec3;
use dibs_nostd::filter::{AdmittedMotion, Filter, Reason, RigidMotion, Uncertainty};
use dibs_nostd::{Capsule, Index, MovingSurface, Odometer, Options, Tracker, Tree};

use crate::query::STACK;
use crate::recorded::{MovingArgs, RecordedFrames};
use crate::stand_off::{self, StandOff};
use crate::tool::{self, ToolSpec};
use crate::tree_file::{self, AnyTree};
use crate::{output, overwrite};

/// Opened nodes that are remembered: more than any tool needs.
const OPENED: usize = 4_096;

/// Bytes of output that are buffered.
const BUFFER: usize = 1 << 16;

/// Least default of the robot's speed (mm/s).
const ROBOT: f64 = 1_000.0;

/// Allowed rounding of commanded lengths, relative to the length.
const ROUNDING: f64 = 1e-3;

/// Allowed rounding (mm) of an admitted pose.
const ROUNDED: f64 = 1e-4;

#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  dibs filter heart.dibs --motion heart.pc2 --path commands.csv --stand-off 1 --json
  dibs filter heart.dibs --motion heart.pc2 --path commands.csv --stand-off 1 --age 40 --registration 0.5
  dibs filter heart.dibs --motion heart.pc2 --path commands.csv --stand-off 1 --stand-off 2=3

The tool begins at the first line's pose. Each line is the pose that is commanded for the end of its tick; what is
admitted is where the next tick begins. The motion is the tissue's, straight from frame to frame, played over and over.
A filter sees it at the start of each tick, as old as --age allows. The reasons: commanded, nearest, shortened, stopped,
retreating, and 'no safe motion', after which the stand-off is not kept; least_separation is null where nothing is
certain.")]
pub struct Args {
    #[command(flatten)]
    moving: MovingArgs,
    /// The tool's pose commanded for the end of each tick, a line each, as for `dibs query --tool`; `-` is standard
    /// input
    #[arg(long, value_name = "TOOLS")]
    path: PathBuf,
    /// Least separation of tool and tissue; a further `LABEL=MM` is a larger one from the triangles of a label
    #[arg(long, value_name = "[LABEL=]MM", required = true)]
    stand_off: Vec<StandOff>,
    /// Largest speed of the tissue; by default its largest speed in the motion
    #[arg(long, value_name = "MM/S")]
    tissue_speed: Option<f32>,
    /// Largest speed of the robot; by default 1,000, or the speed of the fastest command if that is larger
    #[arg(long, value_name = "MM/S")]
    robot_speed: Option<f32>,
    /// Largest age of the surface; by default a tick
    #[arg(long, value_name = "MS")]
    age: Option<f64>,
    /// Error of the registration between robot and surface
    #[arg(long, value_name = "MM", default_value_t = 0.0)]
    registration: f32,
    /// Time constant of the approach to the stand-off, which avoids jumps; 0 for none
    #[arg(long, value_name = "MS", default_value_t = 0.0)]
    approach: f32,
    /// Instructions of a Cortex-M7 that a tick may take
    #[arg(long, value_name = "N", default_value_t = 200_000)]
    budget: u32,
    /// Print a JSON object a line, and one with the totals on standard error
    #[arg(long)]
    json: bool,
}

pub fn run(args: &Args) -> Result<()> {
    let tree = &args.moving.tree;
    overwrite::check([tree, args.moving.motion()?, &args.path], [])?;
    let bytes = tree_file::load(tree)?;
    match tree_file::validate(&bytes, tree)? {
        AnyTree::Narrow(tree) => filter(args, &tree),
        AnyTree::Wide(tree) => filter(args, &tree),
    }
}

/// The axis of a rigid tool, in the tree's coordinates.
#[derive(Clone, Copy)]
struct Axis {
    start: DVec3,
    end: DVec3,
}

impl Axis {
    fn of(tool: &ToolSpec, origin: DVec3) -> (Self, f32, bool) {
        match *tool {
            ToolSpec::Sphere { centre, radius } => {
                (Self { start: centre - origin, end: centre - origin }, radius, true)
            }
            ToolSpec::Capsule { start, end, radius } => {
                (Self { start: start - origin, end: end - origin }, radius, false)
            }
        }
    }

    fn length(&self) -> f64 {
        self.start.distance(self.end)
    }

    /// The motion to another pose: the smallest rotation of the axis, about its start.
    fn motion_to(&self, to: &Self) -> RigidMotion {
        let (from, onto) = (self.end - self.start, to.end - to.start);
        let across = from.cross(onto);
        let angle = across.length().atan2(from.dot(onto));
        // The axis of a half turn is not unique.
        let axis = across.try_normalize().unwrap_or_else(|| {
            from.try_normalize().map_or(DVec3::ZERO, DVec3::any_orthonormal_vector)
        });
        let translation = (to.start - self.start).as_vec3();
        RigidMotion::new(self.start.as_vec3(), translation, (axis * angle).as_vec3())
    }

    /// The pose after a motion; its length is kept.
    fn after(&self, motion: &RigidMotion) -> Self {
        let moved = |point: DVec3| motion.apply(point.as_vec3()).as_dvec3();
        let (start, end) = (moved(self.start), moved(self.end));
        let direction = (end - start).normalize_or_zero();
        Self { start, end: start + direction * self.length() }
    }

    /// The largest displacement of a point of the axis to another pose.
    fn moved(&self, to: &Self) -> f64 {
        self.start.distance(to.start).max(self.end.distance(to.end))
    }
}

/// The commanded poses of one rigid tool.
struct Commands {
    axes: Vec<Axis>,
    radius: f32,
    is_sphere: bool,
}

impl Commands {
    fn read(args: &Args, origin: DVec3) -> Result<Self> {
        let tools = tool::path(&args.path, |tool| tool.local(origin).map(|_| tool))?;
        let (first, radius, is_sphere) = Axis::of(&tools[0], origin);
        let mut axes = Vec::with_capacity(tools.len());
        for (number, tool) in (1..).zip(&tools) {
            let (axis, own, sphere) = Axis::of(tool, origin);
            let change = (axis.length() - first.length()).abs();
            let is_rigid = change <= ROUNDING * (first.length() + 1.0);
            if !is_rigid || own != radius || sphere != is_sphere {
                bail!(
                    "{}, tool {number}: is another tool than the first; a rigid tool keeps its shape, length and radius",
                    args.path.display()
                );
            }
            axes.push(axis);
        }
        Ok(Self { axes, radius, is_sphere })
    }

    /// The speed of the fastest command (mm/s).
    fn speed(&self, rate: f64) -> f64 {
        let steps = self.axes.iter().zip(self.axes.iter().skip(1));
        steps.map(|(from, to)| from.moved(to)).fold(0.0, f64::max) * rate
    }

    /// A pose as text, in the coordinates of the mesh's file.
    fn words(&self, axis: &Axis, origin: DVec3) -> String {
        let DVec3 { x, y, z } = axis.start + origin;
        let end = axis.end + origin;
        let radius = self.radius;
        if self.is_sphere {
            format!("sphere:{x},{y},{z},{radius}")
        } else {
            format!("capsule:{x},{y},{z},{},{},{},{radius}", end.x, end.y, end.z)
        }
    }
}

/// The largest speed (mm/s) of a vertex from frame to frame, rounded up.
fn fastest(recorded: &RecordedFrames) -> f32 {
    let next = recorded.frames.iter().cycle().skip(1);
    let pairs = recorded.frames.iter().zip(next).flat_map(|(a, b)| a.iter().zip(b));
    let farthest = pairs.map(|(a, b)| a.as_dvec3().distance(b.as_dvec3())).fold(0.0, f64::max);
    ((farthest * recorded.rate) as f32).next_up()
}

fn filter<I: Index>(args: &Args, tree: &Tree<'_, I>) -> Result<()> {
    let origin: DVec3 = tree.origin().into();
    let rate = args.moving.rate()?;
    let commands = Commands::read(args, origin)?;
    let recorded = args.moving.read(tree)?;
    let period = (1.0 / rate) as f32;
    let robot = args.robot_speed.unwrap_or(commands.speed(rate).max(ROBOT) as f32 * 1.001);
    let tissue = args.tissue_speed.unwrap_or_else(|| fastest(&recorded));
    let age = args.age.unwrap_or(1_000.0 / rate);
    for (name, value) in [
        ("--tissue-speed", tissue),
        ("--age", age as f32),
        ("--registration", args.registration),
        ("--approach", args.approach),
    ] {
        if !(value >= 0.0 && value.is_finite()) {
            bail!("{name} is {value}: give a number of at least 0");
        }
    }
    let filter = stand_off::filter(&args.stand_off, robot, (tree, &args.moving.tree))?
        .approach(args.approach / 1_000.0)?
        .budget(args.budget);
    // Rounded up.
    let behind = (f64::from(tissue) * age / 1_000.0 * (1.0 + 2e-7)) as f32;
    let uncertainty = Uncertainty::new(tissue).error(behind).error(args.registration);
    let mut session = Session {
        tracker: Tracker::new(tree)?,
        filter,
        uncertainty,
        period,
        at: commands.axes[0],
        sums: Sums::default(),
    };
    let mut out = Vec::new();
    let mut odometer = Odometer::new(tree);
    let mut last = 0;
    let mut ticks = (0..).zip(&commands.axes).peekable();
    while let Some(&(first, _)) = ticks.peek() {
        // The ticks between this frame and the next.
        let (number, _) = recorded.at(first as f64 / rate);
        let [current, next] = [number, number + 1].map(|at| at % recorded.frames.len());
        // The odometer must see every frame.
        let _ =
            odometer.step(recorded.frames[last].as_slice(), recorded.frames[current].as_slice());
        let [from, to] = [current, next].map(|at| recorded.frames[at].as_slice());
        let step = odometer.step(from, to);
        let [from, to] = [current, next].map(|at| recorded.stretches[at]);
        let both = from.or_larger(to).ok_or_else(|| anyhow!("measured with another tree"))?;
        let is_here = |&(tick, _): &(usize, &Axis)| recorded.at(tick as f64 / rate).0 == number;
        while let Some((tick, command)) = ticks.next_if(is_here) {
            let (_, share) = recorded.at(tick as f64 / rate);
            let surface = step.at(share as f32);
            let options = Options::new().stretch(both);
            let admitted = session.tick(&surface, command, &commands, options)?;
            let pose = commands.words(&session.at, origin);
            let (least, reason) = (admitted.least_separation, admitted.reason.words());
            if args.json {
                let line = serde_json::json!({
                    "tick": tick, "admitted": pose, "least_separation": least, "reason": reason,
                    "queries": admitted.queries, "instructions": admitted.instructions,
                });
                writeln!(out, "{line}")?;
            } else {
                writeln!(out, "{tick:6} {least:12.5} {reason:14} {pose}")?;
            }
            if out.len() >= BUFFER {
                if !output::write(&out) {
                    return Ok(());
                }
                out.clear();
            }
        }
        last = next;
    }
    if output::write(&out) {
        session.sums.print(args.json, tissue, &uncertainty, period);
    }
    Ok(())
}

#[derive(Default)]
struct Sums {
    ticks: u64,
    commanded: u64,
    unsafe_ticks: u64,
    instructions: u64,
    most: u32,
}

impl Sums {
    fn print(&self, is_json: bool, tissue: f32, uncertainty: &Uncertainty, period: f32) {
        let Self { ticks, commanded, unsafe_ticks, .. } = *self;
        let mean = self.instructions as f64 / ticks as f64;
        let beyond = uncertainty.stand_off(period);
        if is_json {
            let summary = serde_json::json!({
                "ticks": ticks, "commanded": commanded, "no_safe_motion": unsafe_ticks, "uncertainty": beyond,
                "tissue_speed": tissue, "instructions": mean, "most_instructions": self.most,
            });
            eprintln!("{summary}");
        } else {
            eprintln!(
                "{ticks} ticks: {commanded} as commanded, {unsafe_ticks} without a safe motion; tissue of {tissue} mm/s, \
                 {beyond} mm of uncertainty; {mean:.0} instructions each, {} at most",
                self.most
            );
        }
    }
}

struct Session<'t, I> {
    tracker: Tracker<'t, I, STACK, OPENED>,
    filter: Filter<{ stand_off::LABELS }>,
    uncertainty: Uncertainty,
    period: f32,
    at: Axis,
    sums: Sums,
}

impl<I: Index> Session<'_, I> {
    fn tick(
        &mut self,
        surface: &impl MovingSurface,
        command: &Axis,
        commands: &Commands,
        options: Options,
    ) -> Result<AdmittedMotion> {
        let Axis { start, end } = self.at;
        let tool = Capsule::new(start.as_vec3(), end.as_vec3(), commands.radius)?;
        let motion = self.at.motion_to(command);
        let filter = self.filter.options(options);
        let mut pairs = [(&mut self.tracker, surface, &tool)];
        let admitted = filter.admit(&mut pairs, &motion, self.period, &self.uncertainty, &[])?;
        let after = self.at.after(&admitted.motion);
        // Equal up to the rounding of a motion.
        let is_whole = admitted.reason == Reason::Commanded && after.moved(command) < ROUNDED;
        self.at = if is_whole { *command } else { after };
        self.sums.ticks += 1;
        self.sums.commanded += u64::from(admitted.reason == Reason::Commanded);
        self.sums.unsafe_ticks += u64::from(admitted.reason == Reason::NoSafeMotion);
        self.sums.instructions += u64::from(admitted.instructions);
        self.sums.most = self.sums.most.max(admitted.instructions);
        Ok(admitted)
    }
}
