//! Between ticks: the first time at which a moving tool and surface come closer than a margin.

// Requirement: A-10

use super::tracker::{Tracker, TrackerAnswer};
use super::{Options, Proximity, Side};
use crate::math::order::larger;
use crate::math::round::U;
use crate::math::sqrt::sqrt;
use crate::unavailable::QueryError;
use crate::{Index, Step, Tool, VertexTable};

/// The result of a sweep. Times are fractions of the sweep: 0 at its start, 1 at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct SweepAnswer {
    /// Until this time they are certainly not closer than the margin; 1 or more: during the whole sweep.
    pub clear_until: f32,
    /// The first time at which they were found within the margin, or farther by at most the
    /// [accuracy](Proximity::accuracy) and the rounding of positions at that time. If this is `None` and `clear_until`
    /// is less than 1, there were too few samples to decide.
    pub contact: Option<f32>,
    /// The closest pair at the end.
    pub at_end: Proximity,
    /// The number of queries made.
    pub samples: u32,
}

/// The motion of tool and surface from one tick to the next: the ends of the tool's axis and the surface's vertices
/// each move in a straight line at constant speed.
///
/// A surface that nodes move has its step from [`EmbeddedSurface::step`](crate::nodes::EmbeddedSurface::step).
///
/// If the mesh also turns and shifts as a whole, give the tools in mesh coordinates, each by its own pose
/// ([`RigidPose::apply_inverse`](crate::RigidPose::apply_inverse)): so the angle counts times its lever, as motion of the
/// tool. There a point of the tool follows an arc. While the mesh turns by `angle` about a centre that moves in a straight
/// line, the arc is off its chord by at most `angle * (angle * lever + 2 * shift) / 8`, with the largest distance of the
/// tool's ends from the centre as `lever` and their largest motion relative to it as `shift`. Add that to the margin.
/// ([`Guard::admit`](crate::guard::Guard::admit) of frames with poses needs none of this.)
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::{Odometer, Options, Sphere, Sweep, SweepAnswer, Tracker, Tree, glam::Vec3};
///
/// let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
/// let built = Builder::new().stretch(1.5).build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let [first, second] = [0, 1].map(|frame: usize| built.to_rows(&motion.frames[frame]));
/// let step = Odometer::new(&tree).step(first.as_slice(), second.as_slice());
/// let mut tracker = Tracker::<_, 32, 256>::new(&tree)?;
///
/// // From 50 mm beside the heart into it, while it moves by half a step.
/// let beside = Sphere::new(Vec3::new(90.0, 0.0, 0.0), 2.0)?;
/// let sweep = Sweep { step: &step, t: [0.5, 1.0], tools: [beside, Sphere::new(Vec3::ZERO, 2.0)?] };
/// let SweepAnswer { clear_until, contact, .. } = tracker.sweep(&sweep, 1.0, 32, &Options::new())?;
/// assert!((0.1..1.0).contains(&clear_until), "apart at least until this time");
/// assert!(contact.is_none_or(|first| first >= clear_until));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Sweep<'s, 'v, W: ?Sized, V: ?Sized, T> {
    /// The surface's frames.
    pub step: &'s Step<'v, W, V>,
    /// The surface at the start and at the end: `t` of [`Step::at`](crate::Step::at), in 0..=1.
    pub t: [f32; 2],
    /// The tool at the start and at the end. Between them it has the larger of their radii.
    pub tools: [T; 2],
}

impl<W: VertexTable + ?Sized, V: VertexTable + ?Sized, T: Tool> Sweep<'_, '_, W, V, T> {
    fn check(&self, margin: f32) -> Result<(), QueryError> {
        // No range contains a NaN.
        if !(0.0..f32::INFINITY).contains(&margin) {
            return Err(QueryError::Margin { bits: margin.to_bits() });
        }
        match self.t.into_iter().find(|t| !(0.0..=1.0).contains(t)) {
            Some(t) => Err(QueryError::BlendTime { bits: t.to_bits() }),
            None => Ok(()),
        }
    }

    /// An upper bound on the change of any distance from start to end, rounded up.
    fn most(&self) -> f32 {
        let [from, to] = &self.tools;
        let start = to.axis_start() - from.axis_start();
        let end = start + (to.axis_span() - from.axis_span());
        let (start, end) = (start.length_squared(), end.length_squared());
        let tool = sqrt(larger(end, start));
        let [first, last] = self.t;
        let lengths = from.axis_length() + to.axis_length();
        (tool + (last - first).abs() * self.step.length()) * (1.0 + 16.0 * U) + 8.0 * U * lengths
    }

    /// The size of the coordinates from which an instant is computed.
    fn size(&self) -> f32 {
        let of = |tool: &T| tool.axis_start().abs().max_element() + tool.axis_length();
        let [from, to] = &self.tools;
        of(from) + of(to) + self.step.length()
    }
}

impl<I: Index, const STACK: usize, const OPENED: usize, const RANGE: usize>
    Tracker<'_, I, STACK, OPENED, RANGE>
{
    /// Whether tool and surface come closer than `margin` (mm, not negative) in a sweep, and when first.
    ///
    /// By conservative advancement (Mirtich 1996): a distance changes by no more than tool and surface move, so a pair
    /// at one instant clears the time before and after in which the motion cannot use up its distance. Usually the pair
    /// at the end, which a tick needs anyway, clears the whole sweep. If not, the sweep advances from the start, with
    /// at most `samples` queries in all. No time is skipped at any speed: `clear_until` ends where the proof does. The
    /// distance is unsigned, to the surface from either side.
    ///
    /// The stretch in the options must hold during the whole sweep: that of both frames, by
    /// [`MeasuredStretch::or_larger`](crate::MeasuredStretch::or_larger). The budget applies to each sample.
    ///
    /// Cost: `samples` times that of [`closest`](Self::closest), at least once.
    ///
    /// # Errors
    /// [`QueryError::Margin`] and [`QueryError::BlendTime`] for arguments out of range; otherwise same as
    /// [`closest`](Self::closest).
    pub fn sweep<W: VertexTable + ?Sized, V: VertexTable + ?Sized, T: Tool>(
        &mut self,
        sweep: &Sweep<'_, '_, W, V, T>,
        margin: f32,
        samples: u32,
        options: &Options,
    ) -> Result<SweepAnswer, QueryError> {
        sweep.check(margin)?;
        let (most, size) = (sweep.most(), sweep.size());
        let ([from, to], [first, last]) = (&sweep.tools, sweep.t);
        let mut sample = |time: f32, options: &Options| {
            let tool = from.towards(to, time);
            let surface = sweep.step.at(first + time * (last - first));
            let TrackerAnswer { closest: found, is_kept, .. } =
                self.closest(&surface, &tool, options)?;
            let rounding = ROUNDING * (size + found.axis_distance);
            Ok(Sample::new(found, is_kept, margin, rounding, tool.radius()))
        };
        let at_end = sample(1.0, options)?;
        let mut swept =
            SweepAnswer { clear_until: 0.0, contact: None, at_end: at_end.found, samples: 1 };
        // A distance clears a part of the sweep; without motion any distance clears all of it.
        let part = |spare: f32| match most {
            _ if !(spare > 0.0) => 0.0,
            0.0 => ALWAYS,
            most => spare / most * ROUND_DOWN,
        };
        // The pair at the end clears the time from `end` on, which is at most 1.
        let end = 1.0 - part(at_end.spare);
        if at_end.touches {
            swept.contact = Some(1.0);
        }
        let unsigned = options.unsigned();
        let mut time = 0.0;
        while swept.samples < samples && !(time > end) {
            let now = sample(time, &unsigned)?;
            swept.samples += 1;
            if now.touches {
                swept.contact = Some(time);
                break;
            }
            let next = time + part(now.spare);
            // The step rounds to zero.
            if !(next > time) {
                break;
            }
            time = next;
        }
        swept.clear_until = if time > end { ALWAYS } else { time };
        Ok(swept)
    }
}

/// The pair at an instant.
struct Sample {
    found: Proximity,
    /// Certified separation above the margin; 0 if there is none.
    spare: f32,
    /// Whether they are within the margin, up to the errors.
    touches: bool,
}

impl Sample {
    fn new(found: Proximity, is_kept: bool, margin: f32, rounding: f32, radius: f32) -> Self {
        let separation = found.axis_distance - radius;
        // Signed separations are exact; unsigned ones bound the distance to the surface.
        let lower = match found.side {
            Side::Undefined(_) => found.lower,
            _ if is_kept => found.lower,
            _ => separation,
        };
        let error = found.accuracy + rounding;
        // Written so that a NaN gives 0.
        let spare = if lower > margin + error { lower - margin - error } else { 0.0 };
        Self { found, spare, touches: spare <= 0.0 && separation <= margin + error }
    }
}

const ALWAYS: f32 = 2.0;
/// Factor on a time that covers the rounding of its quotient.
const ROUND_DOWN: f32 = 1.0 - 8.0 / 16_777_216.0;
/// Rounding of tool, surface and time at an instant, relative to [`Sweep::size`].
const ROUNDING: f32 = 48.0 / 16_777_216.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_errors_are_no_part_of_the_spare_distance() {
        let found = Proximity {
            axis_distance: 3.0,
            separation: 2.0,
            lower: 2.0,
            accuracy: 0.25,
            side: Side::Outside,
            ..Proximity::NOWHERE
        };
        let spare = |margin| Sample::new(found, false, margin, 0.125, 1.0).spare;
        assert_eq!([spare(1.0), spare(1.625), spare(1.75), spare(2.0)], [0.625, 0.0, 0.0, 0.0]);
    }
}
