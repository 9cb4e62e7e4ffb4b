//! A filter of commands: the motion nearest to a commanded one that keeps an instrument out of the tissue, verified for
//! every instant until the next tick.
//!
//! For robots that are commanded by position or velocity. A force reacts after the tool has moved; a filter changes the
//! command before it is executed.
//!
//! ```
//! use dibs_build::{Builder, generate};
//! use dibs_nostd::filter::{Filter, Reason, RigidMotion, Uncertainty};
//! use dibs_nostd::{Capsule, Odometer, Tracker, Tree, glam::Vec3};
//!
//! let heart = generate::heart(1_000)?.mesh;
//! let built = Builder::new().build(&heart)?;
//! let tree = Tree::<u16>::from_bytes(built.blob())?;
//! let rows = built.to_rows(&heart.positions);
//! let mut odometer = Odometer::new(&tree);
//! let surface = odometer.start(rows.as_slice());
//! let mut tracker = Tracker::<_, 64, 128>::new(&tree)?;
//!
//! let filter = Filter::new(1.0, 200.0)?; // a stand-off of 1 mm; the robot moves with at most 200 mm/s
//! let period = 0.001; // s
//! let push = RigidMotion::translation(Vec3::new(0.1, 0.0, 0.0)); // mm, in a period
//! let (mut tip, mut pushed) = (Vec3::new(-80.0, 0.0, 20.0), 0);
//! for _ in 0..1_000 {
//!     let tool = Capsule::new(tip, tip - Vec3::X * 60.0, 2.5)?;
//!     let mut pairs = [(&mut tracker, &surface, &tool)];
//!     let admitted = filter.admit(&mut pairs, &push, period, &Uncertainty::NONE, &[])?;
//!     assert!(admitted.least_separation > 0.98 && admitted.reason != Reason::NoSafeMotion);
//!     pushed += usize::from(admitted.reason == Reason::Commanded);
//!     tip = admitted.motion.apply(tip);
//! }
//! assert!(pushed > 50 && pushed < 900);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Promise
//!
//! Unless the reason is [`Reason::NoSafeMotion`], no separation is below the stand-off, nor one from a label's triangles
//! below theirs, less 0.01 mm at any instant of the period, and none is below [`AdmittedMotion::least_separation`]; to
//! the accuracy of a query. This requires that
//!
//! - the robot executes the admitted motion: its points move in straight lines, or turn about the reference point;
//! - at the start the tissue is within the surface's position error and the [`Uncertainty`] of the searched surface,
//!   and no point of it moves faster than the stated speed in the period;
//! - the surface stays within its stretch limit, as for every query.
//!
//! A surface that is *held* satisfies the second point by its age and its speed limit, which a receiver checks: then a
//! new frame never invalidates an earlier bound, and a tool at rest at its stand-off stays admitted. An *extrapolated*
//! surface needs less distance; its [residual](crate::SurfaceBlend::residual) is an estimate, so a new frame may be
//! nearer than the last ones predicted, and the reason then says so while the tool leaves.
//!
//! No safe motion exists for a tool that starts nearer than its stand-off, in a gap that closes, or where the surface
//! approaches faster than the robot can leave. Then the motion is the best one known, and the reason is `NoSafeMotion`
//! in every such tick.
//!
//! # Method
//!
//! A query at the start gives each tool's distance. If the command could use it up, the tool's closest pair becomes a
//! row, and the motion nearest to the command is computed. A query at that motion's end bounds the distance on the
//! whole path; if it is too small, its pair becomes a further row, so that corners, gaps and folds are found as the
//! motion reaches them. After four motions the next are shortened towards the smallest one that the rows allow, which
//! is rest unless the surface approaches. So is a motion whose search would take more than is left of the budget: the
//! tracker counts the bounds that would run out. So a budget that covers little more than the start slows the tool down.
//!
//! A label with a [stand-off of its own](Filter::stand_off_of) is searched as a surface of its own.
//!
//! *Nearest* means the least sum of the squares of the translation and of the rotation times a [lever](Filter::lever).

// Requirements: C-05, C-06

mod answer;
mod known;
mod motion;
mod nearest;
mod pair;
mod part;
mod path;
mod proposal;
mod row;
mod session;
mod uncertainty;

use crate::math::sqrt::sqrt;
use crate::{Cost, Index, MovingSurface, Options, Tool, Tracker};
pub use answer::{AdmittedMotion, FilterError, Reason};
pub use motion::RigidMotion;
use part::Part;
pub use row::MotionRow;
use session::Session;
pub use uncertainty::Uncertainty;

const MOST_PAIRS: usize = 8;

/// By how much (mm) a verified separation may be below the stand-off.
const EPSILON: f32 = 0.01;

const LEAST_LEVER: f32 = 1.0;

/// Instructions of a tick by default.
const INSTRUCTIONS: u32 = 200_000;

/// A filter of commands. See the [module](self). `LABELS` is the number of [stand-offs of labels](Self::stand_off_of).
#[derive(Clone, Copy, Debug)]
pub struct Filter<const LABELS: usize = 0> {
    stand_off: f32,
    of_labels: [Part; LABELS],
    /// mm/s.
    speed: f32,
    /// mm; `None` for the size of the tools.
    lever: Option<f32>,
    /// s.
    approach: f32,
    instructions: u32,
    /// The cost of a search; without one [`Cost::of_tick`] of the pairs' trees.
    cost: Option<Cost>,
    options: Options,
}

impl Filter {
    /// Most pairs of tool and surface, and of tool and a label's part of one: each tool and surface is a pair once more
    /// for each label with a stand-off that is larger than the filter's.
    pub const MOST_PAIRS: usize = MOST_PAIRS;

    /// A filter that keeps every tool `stand_off` (mm, at least 0) from the tissue, for a robot whose reference point
    /// moves at most at `speed` (mm/s, above 0), and whose rotation moves the end of the [lever](Self::lever) at most
    /// at that speed. Faster commands are shortened.
    ///
    /// # Errors
    /// [`FilterError::Parameter`] names the number that is out of range.
    pub fn new(stand_off: f32, speed: f32) -> Result<Self, FilterError> {
        Ok(Self {
            stand_off: checked("stand_off", stand_off, stand_off >= 0.0)?,
            of_labels: [],
            speed: checked("speed", speed, speed > 0.0)?,
            lever: None,
            approach: 0.0,
            instructions: INSTRUCTIONS,
            cost: None,
            options: Options::new(),
        })
    }

    /// The same with a stand-off (mm, at least the filter's) from the triangles of each of these
    /// [labels](crate::Tree::label): 3 from a vessel where 1 is enough elsewhere. Every tool keeps the filter's stand-off
    /// from the whole surface. A nearer label with a smaller stand-off does not hide a farther one with a larger.
    ///
    /// Each stand-off that is larger than the filter's counts as a further pair of every tool and surface, and takes a
    /// search of the label's triangles near the tool, wherever the surface is near enough for the label to matter.
    ///
    /// ```
    /// # use dibs_nostd::filter::Filter;
    /// const VESSEL: u8 = 2;
    /// let filter = Filter::new(1.0, 200.0)?.stand_off_of([(VESSEL, 3.0)])?;
    /// # let _: Filter<1> = filter;
    /// # Ok::<(), dibs_nostd::filter::FilterError>(())
    /// ```
    ///
    /// # Errors
    /// [`FilterError::Parameter`] if one is less than the filter's, or not finite. A label that no triangle has is
    /// refused in each tick, as [`FilterError::Unlabelled`], if its stand-off is larger than the filter's.
    pub fn stand_off_of<const LABELS: usize>(
        self,
        labels: [(u8, f32); LABELS],
    ) -> Result<Filter<LABELS>, FilterError> {
        let mut of_labels = [Part { label: 0, more: 0.0 }; LABELS];
        for (slot, (label, stand_off)) in of_labels.iter_mut().zip(labels) {
            checked("stand_off_of", stand_off, stand_off >= self.stand_off)?;
            *slot = Part { label, more: stand_off - self.stand_off };
        }
        let Self { stand_off, speed, lever, approach, instructions, cost, options, .. } = self;
        Ok(Filter { stand_off, of_labels, speed, lever, approach, instructions, cost, options })
    }
}

impl<const LABELS: usize> Filter<LABELS> {
    /// The same with a lever (mm, at least 1): a rotation by one radian counts as much as a translation by this length. By
    /// default it is the distance from the reference point to the farthest end of a tool's axis.
    ///
    /// # Errors
    /// [`FilterError::Parameter`] if it is less than 1, or not finite.
    pub fn lever(self, lever: f32) -> Result<Self, FilterError> {
        Ok(Self { lever: Some(checked("lever", lever, lever >= LEAST_LEVER)?), ..self })
    }

    /// The same with a time constant (s, at least 0) of the approach: a tool approaches its stand-off at most at its
    /// remaining distance divided by this time, so that it does not jump when a new frame recedes a little. The default
    /// is 0: a period may use up the whole distance. Motions along the wall and away from it keep their speed; a
    /// receding wall is followed from its speed times this time. It slows the approach to a tool's closest pair only,
    /// and is no promise. (The discrete control barrier function of Agrawal & Sreenath 2017; their gamma is the period
    /// divided by this.)
    ///
    /// # Errors
    /// [`FilterError::Parameter`] if it is negative or not finite.
    pub fn approach(self, time: f32) -> Result<Self, FilterError> {
        Ok(Self { approach: checked("approach", time, time >= 0.0)?, ..self })
    }

    /// The same with a budget: the instructions of a tick, searches, rows and all, 200,000 by default. If it runs out, motions
    /// that are not verified are not admitted, and the next tick's searches continue where they stopped. It must cover 800,
    /// for each row 64, for each pair, and each label's part of one, 1,400, and for each pair the [cost](Self::cost)'s base
    /// (some 10,000): a pair that is never searched has no answer, and then no motion is admitted. Trackers that start anew may
    /// take some ticks until all pairs are known; those ticks admit no motion, and their reason says so.
    #[must_use]
    pub const fn budget(self, instructions: u32) -> Self {
        Self { instructions, ..self }
    }

    /// The same with another cost of a search, which is a tracker's tick. The default is the largest [`Cost::of_tick`] of the
    /// pairs' trees.
    #[must_use]
    pub const fn cost(self, cost: Cost) -> Self {
        Self { cost: Some(cost), ..self }
    }

    /// The same with options for every query. Their budget is not used, and the side is always asked for.
    #[must_use]
    pub const fn options(self, options: Options) -> Self {
        Self { options, ..self }
    }

    /// The motion nearest to `command` that keeps all tools out, for the next `period` (s).
    ///
    /// The pairs are the current parts of one rigid instrument, each with its own surface and tracker: a chain of two
    /// tools in a scene of two surfaces has four pairs. `rows` are up to 8 additional limits.
    ///
    /// Cost: the [budget](Self::budget) at most, by a [cost](Self::cost) whose constants are typical. No tick of adversarial walks
    /// on the emulated board takes more (`filter.board.over` in the guarantees).
    ///
    /// # Errors
    /// [`FilterError`]: an argument that is not finite or out of range, or a query without an answer. The tool must
    /// then stay at rest.
    pub fn admit<I, S, T, const STACK: usize, const OPENED: usize, const RANGE: usize>(
        &self,
        pairs: &mut [(&mut Tracker<'_, I, STACK, OPENED, RANGE>, &S, &T)],
        command: &RigidMotion,
        period: f32,
        uncertainty: &Uncertainty,
        rows: &[MotionRow],
    ) -> Result<AdmittedMotion, FilterError>
    where
        I: Index,
        S: MovingSurface + ?Sized,
        T: Tool,
    {
        checked("period", period, period > 0.0)?;
        checked("uncertainty", uncertainty.now, uncertainty.now >= 0.0)?;
        checked("tissue speed", uncertainty.speed, uncertainty.speed >= 0.0)?;
        if !command.is_finite() {
            return Err(FilterError::Command);
        }
        let found = pairs.len().saturating_mul(self.layers().count());
        if pairs.is_empty() || found > MOST_PAIRS {
            return Err(FilterError::Pairs { found, most: MOST_PAIRS });
        }
        let mut labels = self.parts().map(|part| part.label);
        if let Some(label) =
            labels.find(|&label| !pairs.iter().any(|(tracker, ..)| tracker.has_label(label)))
        {
            return Err(FilterError::Unlabelled { label });
        }
        let lever = self.lever_of(pairs.iter().map(|(_, _, tool)| *tool), command);
        let costs = pairs.iter().map(|(tracker, ..)| Cost::of_tick(tracker.tree()));
        let dearest = costs.max_by_key(|cost| cost.node_test).unwrap_or(Cost::M7_TICK);
        let cost = self.cost.unwrap_or(dearest);
        Session::new(self, command, period, uncertainty, (rows, lever, cost))?.run(pairs)
    }

    /// The lever, for these tools and the reference point of a motion.
    fn lever_of<'a, T: Tool + 'a>(
        &self,
        tools: impl Iterator<Item = &'a T>,
        motion: &RigidMotion,
    ) -> f32 {
        self.lever.unwrap_or_else(|| {
            let mut longest = LEAST_LEVER;
            for end in tools.flat_map(|tool| [tool.axis_start(), tool.axis_point(1.0)]) {
                let arm = sqrt(end.distance_squared(motion.about));
                if arm > longest {
                    longest = arm;
                }
            }
            longest
        })
    }

    /// Upper bounds on the motion of the reference point (mm) and on the rotation (rad) in a period.
    #[cfg(feature = "bus")]
    pub(crate) fn most<T: Tool>(&self, tool: &T, motion: &RigidMotion, period: f32) -> (f32, f32) {
        let most = self.speed * period;
        let lever = self.lever_of(core::iter::once(tool), motion);
        (most, motion::most_turn(most, lever))
    }
}

fn checked(parameter: &'static str, value: f32, is_in_range: bool) -> Result<f32, FilterError> {
    if is_in_range && value.is_finite() {
        Ok(value)
    } else {
        Err(FilterError::Parameter { parameter, value })
    }
}
