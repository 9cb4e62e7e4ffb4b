//! The last certain side, for ticks whose answer has none.

use crate::math::sqrt::sqrt;
use crate::query::{NoSide, Proximity, Side};
use crate::unavailable::Unavailable;

/// Remembers the last answer whose side was certain, and gives a constraint an answer to act on where the next ones have
/// none.
///
/// The signed separation changes by no more than tool and surface move. So the last certain answer, its accuracy widened
/// by the motion since, holds whatever has become of the side: its force stays, and grows with the doubt. Where that
/// motion cannot have led inside, the answer at hand is that of a tool outside. A constraint on its own has no past:
/// without a side it damps.
///
/// Keep one for each tool, and give it every tick's answer. RAM: 140 bytes on a 32-bit processor.
///
/// ```
/// use dibs_build::{Builder, generate};
/// use dibs_nostd::constraint::{ForbiddenRegion, LastSide, SpringDamper};
/// use dibs_nostd::{Odometer, Options, Sphere, Tracker, Tree, Unavailable, glam::Vec3};
///
/// let heart = generate::heart(1_000)?.mesh;
/// let built = Builder::new().build(&heart)?;
/// let tree = Tree::<u16>::from_bytes(built.blob())?;
/// let rows = built.to_rows(&heart.positions);
/// let surface = Odometer::new(&tree).start(rows.as_slice());
/// let mut tracker = Tracker::<_, 64, 128>::new(&tree)?;
/// let wall = ForbiddenRegion::new(SpringDamper::stiffness(1.0).max_force(5.0), 3.0)?;
///
/// let mut last_side = LastSide::new();
/// for tick in 0..100 {
///     let tool = Sphere::new(Vec3::new(80.0 - 0.5 * tick as f32, 0.0, 20.0), 2.5)?;
///     let tracked = tracker.closest(&surface, &tool, &Options::new())?;
///     let closest = last_side.settle(Ok(tracked.closest), tracked.moved);
///     let force = wall.force(&closest, Vec3::new(-500.0, 0.0, 0.0));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LastSide {
    /// Widened by the motion since.
    last: Option<Proximity>,
}

impl LastSide {
    /// No past.
    #[must_use]
    pub const fn new() -> Self {
        Self { last: None }
    }

    /// The last answer whose side was certain, widened by the motion since; `None` without a past.
    #[must_use]
    pub const fn last(&self) -> Option<&Proximity> {
        self.last.as_ref()
    }

    /// The answer to act on at this tick, from the query's.
    ///
    /// `moved` (mm) is the most that tool and surface together have moved since the last call, as
    /// [`TrackerAnswer::moved`](crate::TrackerAnswer::moved); `None` if it is not known, which ends the past. An answer without a side
    /// that it cannot settle comes back as it is. An error does, too, and the past goes on.
    ///
    /// Cost: some tens of f32 operations.
    ///
    /// # Errors
    /// That of `answer`.
    pub fn settle(
        &mut self,
        answer: Result<Proximity, Unavailable>,
        moved: Option<f32>,
    ) -> Result<Proximity, Unavailable> {
        // Written so that NaN is unknown.
        let moved = moved.filter(|&moved| moved >= 0.0);
        self.last = self.last.zip(moved).map(|(last, moved)| last.widened(moved));
        let now = answer?;
        match (now.side, self.last) {
            (Side::Undefined(NoSide::NotAsked | NoSide::NoAdjacency), _) => self.last = None,
            (Side::Undefined(_), None) => (),
            (Side::Undefined(_), Some(last)) if now.is_at_surface() => {
                // Its size is certain, and the same on both sides.
                return Ok(Proximity { direction: last.direction, ..now });
            }
            (Side::Undefined(_), Some(last)) => return Ok(self.without_side(now, last)),
            _ => self.last = Some(now),
        }
        Ok(now)
    }

    #[cold]
    #[inline(never)]
    fn without_side(&mut self, now: Proximity, last: Proximity) -> Proximity {
        let radius = now.axis_distance - now.separation;
        let (unsigned, signed) =
            (Proximity { side: Side::Outside, ..now }.interval(), last.interval());
        // Inside, the separation would be at most this.
        let inside = now.accuracy - now.lower - 2.0 * radius;
        if signed.lower > inside {
            if unsigned.lower > signed.upper || unsigned.upper < signed.lower {
                // Neither side is possible: the motion was more than was said.
                self.last = None;
                return now;
            }
            if let Some(outside) = outside(now, radius) {
                self.last = Some(outside);
                return outside;
            }
        }
        Proximity { node_tests: now.node_tests, triangle_tests: now.triangle_tests, ..last }
    }
}

/// The past that [`LastSide::last`] gave.
impl From<Option<Proximity>> for LastSide {
    fn from(last: Option<Proximity>) -> Self {
        Self { last }
    }
}

/// The pair of a tool outside; `None` if its points are too near each other for a direction.
fn outside(pair: Proximity, radius: f32) -> Option<Proximity> {
    let on_axis = pair.point_on_tool + pair.direction * radius;
    let towards = on_axis - pair.point_on_surface;
    let length = sqrt(towards.length_squared());
    let direction = towards / length;
    (length > 8.0 * pair.accuracy).then_some(Proximity {
        side: Side::Outside,
        direction,
        point_on_tool: on_axis - direction * radius,
        ..pair
    })
}
