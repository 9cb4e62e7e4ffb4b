//! The part of a script that a tracker answers.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Capsule, Fallback, MeasuredStretch, Moved, Odometer, Options, Tracker, Tree, VertexTable,
};

use super::print::Line;

/// A tracker, and the last frame that it was given.
pub struct Track<'t> {
    tracker: Tracker<'t, u16, 512, 256>,
    odometer: Odometer,
    surface: Option<(&'static Copied, Moved<'static, Copied>)>,
}

/// A copy of a frame. Never freed: a tracker's surface borrows it.
struct Copied {
    rows: Vec<Vec3>,
    stretch: Option<MeasuredStretch>,
    epoch: Option<u32>,
    position_error: f32,
}

impl<'t> Track<'t> {
    pub fn new(tree: &Tree<'t, u16>) -> Self {
        let tracker = Tracker::new(tree).expect("a stack");
        Self { tracker, odometer: Odometer::new(tree), surface: None }
    }

    pub fn answer(&mut self, surface: &impl VertexTable, tool: &Capsule) -> String {
        if self.surface.as_ref().is_none_or(|(copied, _)| copied.epoch != surface.epoch()) {
            let row = |row| surface.position(row).expect("a row");
            let copied: &'static Copied = Box::leak(Box::new(Copied {
                rows: (0..surface.len() as u32).map(row).collect(),
                stretch: surface.stretch(),
                epoch: surface.epoch(),
                position_error: surface.position_error(),
            }));
            let moved = match self.surface {
                Some((before, _)) => self.odometer.step(before, copied).after(),
                None => self.odometer.start(copied),
            };
            self.surface = Some((copied, moved));
        }
        let (_, moved) = self.surface.as_ref().expect("a surface");
        let found = self.tracker.closest(moved, tool, &Options::new()).expect("an answer");
        let fallback = match found.fallback {
            None => 0,
            Some(Fallback::Start) => 1,
            Some(Fallback::Jump) => 3,
            other => panic!("{other:?}"),
        };
        let mut line = Line::new(&format!("track 0 {fallback}"));
        line.proximity(&found.closest);
        line.end()
    }
}

impl VertexTable for Copied {
    fn len(&self) -> usize {
        self.rows.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.rows.as_slice().position(vertex)
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.stretch
    }

    fn position_error(&self) -> f32 {
        self.position_error
    }
}
