//! The part of a script that trackers answer.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Capsule, Contacts, Fallback, MeasuredStretch, MovingTable, Odometer, Options, Sphere, Tool,
    Tracker, TrackerAnswer, Tree, VertexTable,
};

use super::MARGIN;
use super::print::Line;

/// Trackers, and the last frame that they were given.
pub struct Track<'t> {
    closest: Tracker<'t, u16, 512, 256>,
    touch: Tracker<'t, u16, 512, 256, 256>,
    chain: [Tracker<'t, u16, 512, 256>; 2],
    contacts: Contacts<16>,
    odometer: Odometer,
    surface: Option<(&'static Copied, MovingTable<'static, Copied>)>,
    ticks: u32,
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
        let tracker = || Tracker::new(tree).expect("a stack");
        Self {
            closest: tracker(),
            touch: Tracker::with_range(tree).expect("a stack"),
            chain: [tracker(), tracker()],
            contacts: Contacts::new(),
            odometer: Odometer::new(tree),
            surface: None,
            ticks: 0,
        }
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
        let (_, moved) = self.surface.expect("a surface");
        let found = self.closest.closest(&moved, tool, &Options::new()).expect("an answer");
        let mut line = Line::new(&format!("track {}", fallback(found.fallback)));
        line.proximity(&found.closest);
        let lines = [line.end(), self.touch(&moved, tool), self.chain(&moved, tool)];
        self.ticks += 1;
        lines.join("\n")
    }

    /// Contacts of the tool, and at times of a sphere.
    fn touch(&mut self, surface: &MovingTable<'_, Copied>, tool: &Capsule) -> String {
        let (options, contacts) = (&Options::new(), &mut self.contacts);
        let found = if self.ticks / 8 % 2 == 1 {
            let tool = Sphere::new(tool.start(), tool.radius()).expect("a tool");
            self.touch.contacts(surface, &tool, MARGIN, options, contacts)
        } else {
            self.touch.contacts(surface, tool, MARGIN, options, contacts)
        };
        let found = found.expect("contacts");
        let mut line = Line::new(&format!("touch {}", fallback(found.fallback)));
        line.proximity(&found.closest);
        line.contacts(contacts);
        line.end()
    }

    /// The closest pair of the tool and of the one before it in a chain.
    fn chain(&mut self, surface: &MovingTable<'_, Copied>, tool: &Capsule) -> String {
        let end = tool.end();
        let far = Vec3::new(end.x + 20.0, end.y - 30.0, end.z + 10.0);
        let before = Capsule::new(far, end, tool.radius()).expect("a tool");
        let [first, second] = &mut self.chain;
        let mut pairs = [(first, surface, &before), (second, surface, tool)];
        let found = Tracker::closest_of(&mut pairs, &Options::new()).expect("an answer");
        let found = found.expect("two pairs");
        let TrackerAnswer { pair, searched, .. } = found;
        let mut line = Line::new(&format!("chain {pair} {searched} {}", fallback(found.fallback)));
        line.proximity(&found.closest);
        line.end()
    }
}

/// The number of a reason for a whole query.
fn fallback(reason: Option<Fallback>) -> u32 {
    match reason {
        None => 0,
        Some(Fallback::Start) => 1,
        Some(Fallback::Jump) => 3,
        other => panic!("{other:?}"),
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
