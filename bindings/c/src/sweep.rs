//! Between ticks: when a moving tool and surface first come closer than a margin.

use bytemuck::AnyBitPattern;
use dibs_nostd::{Capsule, Options, QueryError, Sweep, SweepAnswer};

use crate::border::{Handle, Input, Output};
use crate::code::dibs_code;
use crate::query::{dibs_options, dibs_proximity};
use crate::tool::dibs_tool;
use crate::tracker::dibs_tracker;

/// The motion of tool and surface from one tick to the next: the ends of the tool's axis and the surface's vertices
/// each move linearly.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_sweep {
    /// The tool at the start.
    pub from: dibs_tool,
    /// The tool at the end. Between them it has the larger of their radii.
    pub to: dibs_tool,
    /// The surface at the start and at the end: 0 is the tracker's surface before the last `dibs_tracker_set_frame`, 1
    /// the one since then.
    pub t: [f32; 2],
    /// In mm, not negative.
    pub margin: f32,
    /// Largest number of queries; at least 1 is made, which is usually enough.
    pub samples: u32,
}

/// The result of a sweep. Times are fractions of the sweep: 0 is its start, 1 its end.
#[repr(C)]
pub struct dibs_swept {
    /// Before this time they are certainly not closer than the margin; 1 or more: during the whole sweep.
    pub clear_until: f32,
    /// The first time at which they were found within the margin, or farther by no more than the accuracy; -1 for none.
    /// With none and `clear_until` below 1 the samples were too few to decide.
    pub contact: f32,
    /// The closest pair at the end.
    pub at_end: dibs_proximity,
    /// Queries made.
    pub samples: u32,
}

impl From<SweepAnswer> for dibs_swept {
    fn from(swept: SweepAnswer) -> Self {
        Self {
            clear_until: swept.clear_until,
            contact: swept.contact.unwrap_or(-1.0),
            at_end: swept.at_end.into(),
            samples: swept.samples,
        }
    }
}

/// Whether tool and surface come closer than a margin between two ticks, and when first, by conservative advancement:
/// no time is skipped at any speed. The distance is that to the surface itself, from either side.
///
/// Cost: that of `dibs_tracker_closest` for each sample; the budget is for each.
///
/// @param tracker  The tracker, which has a surface.
/// @param sweep    The motion.
/// @param options  Options, or null.
/// @param swept    Receives the result.
/// @return As `dibs_tracker_closest`; `DIBS_CODE_MARGIN` and `DIBS_CODE_ARGUMENT` for a margin and a `t` out of
///         range.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_sweep(
    tracker: *mut dibs_tracker,
    sweep: *const dibs_sweep,
    options: *const dibs_options,
    swept: *mut dibs_swept,
) -> dibs_code {
    dibs_code::of(|| {
        let (swept, sweep) = (swept.check()?, sweep.get()?);
        let (options, mut tracker) = (dibs_options::of(options)?, tracker.open()?);
        swept.set(answer(&mut tracker, &sweep, &options)?.into());
        Ok(())
    })
}

fn answer(
    tracker: &mut dibs_tracker,
    sweep: &dibs_sweep,
    options: &Options,
) -> Result<SweepAnswer, dibs_code> {
    let (tracker, step) = tracker.step()?;
    let dibs_sweep { from, to, t, margin, samples } = *sweep;
    let capsule = |tool: dibs_tool| Capsule::new(tool.start.into(), tool.end.into(), tool.radius);
    // A sphere is a capsule without length.
    let tools = [capsule(from)?, capsule(to)?];
    let found = tracker.sweep(&Sweep { step, t, tools }, margin, samples, options);
    found.map_err(|error| match error {
        QueryError::BlendTime { .. } => dibs_code::Argument,
        error => error.into(),
    })
}
