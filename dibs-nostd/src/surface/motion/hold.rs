//! Held frames: whether measuring their motion pays.

use super::{MotionReading, MovingTable, Odometer};
use crate::VertexTable;

/// Tests of a whole query, as a multiple of the square root of the number of vertices: 5,000 to 500,000 triangles take
/// four to six.
const TESTS: usize = 5;

/// Rows measured in the time of a test.
const ROWS: usize = 2;

impl Odometer {
    /// The frame `after`, which is held until the next one; `before` is the frame held until now.
    ///
    /// A measured motion saves a tracker at most one whole query at each new frame. If a query costs less than
    /// measuring the rows, as on any large surface, the odometer restarts instead, and so do trackers; if it costs
    /// more, this is [`step`](Self::step) and [`Step::after`](super::super::Step::after). For several tools, or for a
    /// surface that moves between frames, measure the step.
    ///
    /// ```
    /// use dibs_build::{Builder, generate};
    /// use dibs_nostd::{Odometer, Options, Sphere, Tracker, Tree, glam::Vec3};
    ///
    /// let generate::MovingMesh { mesh: heart, motion } = generate::heart(1_000)?;
    /// let built = Builder::new().stretch(1.5).build(&heart)?;
    /// let tree = Tree::<u16>::from_bytes(built.blob())?;
    /// let mut tracker = Tracker::<_, 32, 64>::new(&tree)?;
    /// let mut odometer = Odometer::new(&tree);
    /// let tool = Sphere::new(Vec3::new(0.0, 0.0, 150.0), 5.0)?;
    /// let mut before = built.to_rows(&heart.positions);
    /// for frame in &motion.frames {
    ///     let after = built.to_rows(frame);
    ///     let surface = odometer.hold(before.as_slice(), after.as_slice());
    ///     let first = tracker.closest(&surface, &tool, &Options::new())?; // a whole query
    ///     let second = tracker.closest(&surface, &tool, &Options::new())?;
    ///     assert!(first.moved.is_none() && second.moved == Some(0.0));
    ///     before = after;
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// Cost: none, or that of [`step`](Self::step).
    pub fn hold<'v, V: VertexTable + ?Sized, W: VertexTable + ?Sized>(
        &mut self,
        before: &'v W,
        after: &'v V,
    ) -> MovingTable<'v, V> {
        if self.is_worth_measuring() {
            return self.step(before, after).after();
        }
        self.motion = None;
        MovingTable { table: after, motion: MotionReading::start(self.tree) }
    }

    /// Whether measuring a frame's rows costs less than a whole query.
    const fn is_worth_measuring(&self) -> bool {
        self.vertices <= ROWS * TESTS * self.surface.isqrt()
    }
}
