//! The filter of commands: the motion closest to a commanded one that keeps a chain of tools out of the tissue.

use bytemuck::{AnyBitPattern, Pod, Zeroable};
use dibs_nostd::filter::{AdmittedMotion, Filter, MotionRow, Reason, RigidMotion, Uncertainty};
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Capsule, Cost, MovingSurface, Options};
use heapless::Vec;

use crate::border::{Handle, Handles, Input, Output, some_of};
use crate::code::dibs_code;
use crate::frame::{Table, dibs_frame};
use crate::query::{cost_of, dibs_cost};
use crate::tool::{chain, dibs_tool, dibs_vec3};
use crate::tracker::{TheTracker, dibs_tracker};

/// Most tools of a filter's chain.
pub const DIBS_FILTER_TOOLS: usize = 8;

/// Most rows that a caller may add.
pub const DIBS_FILTER_ROWS: usize = 8;

/// Most labels with a stand-off of their own.
pub const DIBS_FILTER_LABELS: usize = 4;

/// A larger stand-off, from the triangles of a label.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct dibs_stand_off_of {
    /// At most 255.
    pub label: u32,
    /// Least separation (mm) of every tool from these triangles; at least the filter's.
    pub stand_off: f32,
}

/// A filter of commands. `dibs_filter_of` makes one from two numbers.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_filter {
    /// Least separation (mm) of every tool from the tissue, at least 0.
    pub stand_off: f32,
    /// Largest speed (mm/s) of the robot's reference point, and of the lever arm's end in a rotation; above 0.
    pub speed: f32,
    /// Lever arm: a rotation by one radian counts as a translation by this length (mm), at least 1; 0 for the distance
    /// from the reference point to the farthest end of a tool's axis.
    pub lever: f32,
    /// A tool approaches its stand-off no faster than its distance from it divided by this time (s), at least 0; 0 for
    /// no such limit.
    pub approach: f32,
    /// Most instructions of a tick, searches, rows and all, by `cost`.
    pub instructions: u32,
    /// `DIBS_COST_M7_TICK`, which is `DIBS_COST_M7_NODES_TICK` for a tree with nodes; not a query's.
    pub cost: u32,
    /// As in `dibs_options`.
    pub depth_tolerance: f32,
    /// Labels with a stand-off of their own: at most `DIBS_FILTER_LABELS`. Each stand-off above the filter's counts as one
    /// more tool for every tool, up to `DIBS_FILTER_TOOLS` in all, and a triangle must have that label.
    pub label_count: u32,
    /// Those labels.
    pub labels: [dibs_stand_off_of; DIBS_FILTER_LABELS],
}

impl dibs_filter {
    /// Converts it to the core's filter.
    pub(crate) fn read(self) -> Result<Filter<DIBS_FILTER_LABELS>, dibs_code> {
        if !(self.depth_tolerance >= 0.0) {
            return Err(dibs_code::Argument);
        }
        let options = if self.depth_tolerance > 0.0 {
            Options::new().depth_tolerance(self.depth_tolerance)
        } else {
            Options::new()
        };
        let filter = Filter::new(self.stand_off, self.speed)?;
        let filter = if self.lever == 0.0 { filter } else { filter.lever(self.lever)? };
        let filter = filter.approach(self.approach)?;
        let mut labels = [(0, self.stand_off); DIBS_FILTER_LABELS];
        if self.label_count as usize > labels.len() {
            return Err(dibs_code::Argument);
        }
        let given = self.labels.iter().take(self.label_count as usize);
        for (slot, &dibs_stand_off_of { label, stand_off }) in labels.iter_mut().zip(given) {
            *slot = (u8::try_from(label).map_err(|_| dibs_code::Argument)?, stand_off);
        }
        let filter = filter.stand_off_of(labels)?;
        let filter = filter.budget(self.instructions).options(options);
        // Its searches are ticks, whose costs are not a plain query's.
        match *cost_of(self.cost)? {
            Cost::M7_TICK => Ok(filter),
            cost if cost == Cost::M7_NODES_TICK => Ok(filter.cost(cost)),
            _ => Err(dibs_code::Argument),
        }
    }
}

/// A filter with 200,000 instructions of a Cortex-M7 a tick.
///
/// @param stand_off  Least separation (mm) from the tissue.
/// @param speed      Largest speed (mm/s) of the robot.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_filter_of(stand_off: f32, speed: f32) -> dibs_filter {
    let (instructions, cost) = (200_000, dibs_cost::M7Tick as u32);
    let (lever, approach, depth_tolerance) = (0.0, 0.0, 0.0);
    let labels = [dibs_stand_off_of { label: 0, stand_off: 0.0 }; DIBS_FILTER_LABELS];
    let label_count = 0;
    dibs_filter {
        stand_off,
        speed,
        lever,
        approach,
        instructions,
        cost,
        depth_tolerance,
        label_count,
        labels,
    }
}

/// The motion of a rigid instrument in a period: its reference point moves in a straight line, and the instrument
/// rotates about it.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_rigid_motion {
    /// The reference point before the motion (mm).
    pub about: dibs_vec3,
    /// The reference point's displacement (mm).
    pub translation: dibs_vec3,
    /// The rotation vector: the axis, times the angle in radians. A filter admits half a radian at most.
    pub rotation: dibs_vec3,
}

impl From<dibs_rigid_motion> for RigidMotion {
    fn from(dibs_rigid_motion { about, translation, rotation }: dibs_rigid_motion) -> Self {
        Self::new(about.into(), translation.into(), rotation.into())
    }
}

impl From<RigidMotion> for dibs_rigid_motion {
    fn from(RigidMotion { about, translation, rotation }: RigidMotion) -> Self {
        Self { about: about.into(), translation: translation.into(), rotation: rotation.into() }
    }
}

/// How far the tissue may be from the searched surface, in addition to that surface's own position error.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_uncertainty {
    /// At the start of the period (mm, at least 0): the tissue's speed times age and transit time, plus the error of
    /// registration.
    pub now: f32,
    /// Largest speed (mm/s, at least 0) of the tissue in the period.
    pub speed: f32,
}

/// An inequality on the motion: `linear . translation + angular . rotation >= least`. For limits that only the caller
/// knows: joints, a remote centre of motion, a guide. They take precedence over the walls.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_motion_row {
    /// Factors of the translation.
    pub linear: [f32; 3],
    /// Factors (mm) of the rotation.
    pub angular: [f32; 3],
    /// Lower bound of the sum (mm).
    pub least: f32,
}

/// Why a motion was admitted. All but the last are safe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_reason {
    /// It is the commanded motion.
    Commanded = 0,
    /// It is the closest motion that walls, the caller's rows and the robot's speed allow.
    Nearest = 1,
    /// It is half of that motion, or less: no more could be verified.
    Shortened = 2,
    /// No motion could be verified: it is zero.
    Stopped = 3,
    /// The surface approaches: it is the smallest motion that keeps the stand-off.
    Retreating = 4,
    /// No motion was found that certainly keeps the stand-off. It is the best known one.
    NoSafeMotion = 5,
}

impl From<Reason> for dibs_reason {
    fn from(reason: Reason) -> Self {
        match reason {
            Reason::Commanded => Self::Commanded,
            Reason::Nearest => Self::Nearest,
            Reason::Shortened => Self::Shortened,
            Reason::Stopped => Self::Stopped,
            Reason::Retreating => Self::Retreating,
            _ => Self::NoSafeMotion,
        }
    }
}

/// The motion that a filter admits.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_admitted_motion {
    /// The motion to execute.
    pub motion: dibs_rigid_motion,
    /// At no instant of the period the separation (mm) of any tool is less, as long as the tissue is within its
    /// uncertainty.
    pub least_separation: f32,
    /// Why this motion was chosen.
    pub reason: dibs_reason,
    /// Number of queries.
    pub queries: u32,
    /// Instructions of the tick, by the filter's cost model.
    pub instructions: u32,
}

impl From<AdmittedMotion> for dibs_admitted_motion {
    fn from(admitted: AdmittedMotion) -> Self {
        Self {
            motion: admitted.motion.into(),
            least_separation: admitted.least_separation,
            reason: admitted.reason.into(),
            queries: admitted.queries,
            instructions: admitted.instructions,
        }
    }
}

/// The arguments of a filter's tick, except its tools.
struct Command<'r> {
    filter: Filter<DIBS_FILTER_LABELS>,
    motion: RigidMotion,
    period: f32,
    uncertainty: Uncertainty,
    rows: &'r [MotionRow],
}

impl Command<'_> {
    fn admit<S: MovingSurface>(
        &self,
        tools: &mut [(&mut TheTracker, &S, &Capsule)],
    ) -> Result<AdmittedMotion, dibs_code> {
        let Self { filter, motion, period, uncertainty, rows } = self;
        Ok(filter.admit(tools, motion, *period, uncertainty, rows)?)
    }
}

/// The motion closest to a commanded one that keeps every tool of a rigid chain out of the tissue at every instant of
/// the period. After an error nothing is admitted: the tool must rest.
///
/// The promise is that of the core's module `filter`, provided that the robot executes the motion, the tissue is within
/// its uncertainty and no faster than stated, and the surface is within its stretch limit. If the budget ends a search,
/// its tracker continues in the next tick.
///
/// Cost: at most the filter's instructions, by `cost`.
///
/// @param filter       The filter.
/// @param trackers     Addresses of the trackers, one for each tool. No tracker may be listed twice.
/// @param frame        A reader's frame, used for all tools without copying it; null for the trackers' own surfaces.
/// @param tools        The tools as they are now, in the same order.
/// @param count        Number of tools: 1 to `DIBS_FILTER_TOOLS`.
/// @param command      The commanded motion.
/// @param period       The period, in s: above 0.
/// @param uncertainty  That of the tissue.
/// @param rows         The caller's rows; null for none.
/// @param row_count    Their number: at most `DIBS_FILTER_ROWS`.
/// @param admitted     Receives the motion to execute, and its reason; nothing is written after an error.
/// @return `DIBS_CODE_OK`, whatever the reason; `DIBS_CODE_FILTER` for a number out of its range;
///         `DIBS_CODE_NOT_FINITE` for a command or a row that is not finite; `DIBS_CODE_ARGUMENT` for no tool or too
///         many, too many rows or labels, a label's stand-off for a tree without labels, or a frame of the caller's
///         vertices; the errors of `dibs_tracker_closest`; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_filter_admit(
    filter: *const dibs_filter,
    trackers: *const *mut dibs_tracker,
    frame: *mut dibs_frame,
    tools: *const dibs_tool,
    count: u32,
    command: *const dibs_rigid_motion,
    period: f32,
    uncertainty: *const dibs_uncertainty,
    rows: *const dibs_motion_row,
    row_count: u32,
    admitted: *mut dibs_admitted_motion,
) -> dibs_code {
    dibs_code::of(|| {
        let admitted = admitted.check()?;
        let rows = read_rows(rows, row_count)?;
        some_of::<DIBS_FILTER_TOOLS>(count)?;
        let dibs_uncertainty { now, speed } = uncertainty.get()?;
        let command = Command {
            filter: filter.get()?.read()?,
            motion: command.get()?.into(),
            period,
            uncertainty: Uncertainty::new(speed).error(now),
            rows: &rows,
        };
        let tools = chain(tools, count)?;
        let mut trackers = trackers.open_all::<DIBS_FILTER_TOOLS>(count)?;
        let found = if frame.is_null() {
            let mut all = Vec::<_, DIBS_FILTER_TOOLS>::new();
            for (tracker, tool) in trackers.iter_mut().zip(&tools) {
                let (tracker, surface) = tracker.parts()?;
                all.push((tracker, surface, tool)).map_err(|_| dibs_code::Argument)?;
            }
            command.admit(&mut all)
        } else {
            let frame = frame.open()?;
            let surface = match &frame.table {
                Table::Empty => return Err(dibs_code::NoSurface),
                // The motion of a caller's vertices is not measured.
                Table::Vertices(_) => return Err(dibs_code::Argument),
                Table::Held(held) => held.moving(),
            };
            let mut all = Vec::<_, DIBS_FILTER_TOOLS>::new();
            for (tracker, tool) in trackers.iter_mut().zip(&tools) {
                all.push((tracker.core(), surface, tool)).map_err(|_| dibs_code::Argument)?;
            }
            command.admit(&mut all)
        };
        admitted.set(found?.into());
        Ok(())
    })
}

fn read_rows(
    rows: *const dibs_motion_row,
    count: u32,
) -> Result<Vec<MotionRow, DIBS_FILTER_ROWS>, dibs_code> {
    let mut all = Vec::new();
    if count == 0 {
        return Ok(all);
    }
    if count as usize > DIBS_FILTER_ROWS {
        return Err(dibs_code::Argument);
    }
    for &dibs_motion_row { linear, angular, least } in rows.slice(count as usize)? {
        all.push(MotionRow { linear, angular, least }).map_err(|_| dibs_code::Argument)?;
    }
    Ok(all)
}

/// A tool after a motion of up to half a radian: each point of the axis is rotated and displaced.
///
/// @param motion  The motion.
/// @param tool    The tool before.
/// @param moved   Receives the tool after; may be the same.
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_rigid_motion_apply(
    motion: *const dibs_rigid_motion,
    tool: *const dibs_tool,
    moved: *mut dibs_tool,
) -> dibs_code {
    dibs_code::of(|| {
        let (place, motion) = (moved.check()?, RigidMotion::from(motion.get()?));
        let dibs_tool { start, end, radius } = tool.get()?;
        let [start, end] = [start, end].map(|end| motion.apply(Vec3::from(end)).into());
        place.set(dibs_tool { start, end, radius });
        Ok(())
    })
}

/// The distance (mm) between tool and searched surface at which a period can begin without a risk of contact: the
/// uncertainty at its end. A filter adds its stand-off to this.
///
/// @param uncertainty  The uncertainty at the start.
/// @param period       The period, in s.
/// @param distance     Receives the distance.
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_uncertainty_stand_off(
    uncertainty: *const dibs_uncertainty,
    period: f32,
    distance: *mut f32,
) -> dibs_code {
    dibs_code::of(|| {
        let (place, dibs_uncertainty { now, speed }) = (distance.check()?, uncertainty.get()?);
        place.set(Uncertainty::new(speed).error(now).stand_off(period));
        Ok(())
    })
}
