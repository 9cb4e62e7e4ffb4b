//! A session: a tree, a motion and an instrument; ticks, and pictures of the last one.
//!
//! One file, because it is the page's whole interface.

// Requirement: P-09

use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Budget, FormatError, Index, MeasuredStretch, MovingSurface, Odometer, Options, Proximity,
    Query, Step, Tool, Tracker, Tree, TriangleRow, VertexTable, format,
};

use crate::contacts::{ContactMarks, Found, Speeds, Velocity};
use crate::motion::{Frame, between, stretch_beyond};
use crate::spheres::{self, Recorder};
use crate::{Instrument, Interpolation, Motion, SessionError};

/// As much as any tree needs.
const STACK: usize = format::MAX_STACK;
/// Opened nodes that a tracker remembers: more than any tool needs.
const OPENED: usize = 4_096;

/// The way in which a tick finds its answer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Search {
    /// From the last tick's front.
    #[default]
    Tracker,
    /// A whole query that starts from the last answer's triangle.
    Warm,
    /// A whole query that knows nothing, as `dibs query` asks.
    Cold,
}

/// Settings of the page.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Frames stretched by more are refused, and the last one is held. Never above the tree's limit.
    pub limit: f32,
    /// Contacts and the wall's force reach this far (mm).
    pub margin: f32,
    /// Most node tests, and most triangle tests, of a tick.
    pub budget: u32,
    /// The surface between frames.
    pub between: Interpolation,
    /// The way to an answer.
    pub search: Search,
    /// Spheres are scaled by the measured stretch, not by the tree's limit.
    pub is_measured: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            limit: f32::INFINITY,
            margin: 10.0,
            budget: u32::MAX,
            between: Interpolation::default(),
            search: Search::default(),
            is_measured: true,
        }
    }
}

/// Counts of a run of ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Ticks.
    pub ticks: u32,
    /// Node tests of all.
    pub node_tests: u32,
    /// Triangle tests of all.
    pub triangle_tests: u32,
    /// Ticks that the tracker answered by a whole query.
    pub fallbacks: u32,
}

/// A session on a tree of either index width.
pub trait Session {
    /// The settings.
    fn settings(&mut self) -> &mut Settings;
    /// The tree's stretch limit.
    fn limit(&self) -> f32;
    /// Levels of the tree.
    fn levels(&self) -> u32;
    /// The point that coordinates count from.
    fn origin(&self) -> [f64; 3];
    /// Frames of the motion.
    fn frames(&self) -> usize;
    /// Corners of all triangles.
    fn triangles(&self) -> Vec<u32>;
    /// Positions of the surface as it is now.
    fn positions(&self) -> Vec<f32>;
    /// Positions of the nodes that move the surface, as they are now; empty for a tree without nodes.
    fn nodes(&self) -> Vec<f32>;
    /// Ticks along the way from one pose and time to another; the last is at the end of it.
    ///
    /// # Errors
    /// [`SessionError`] for an instrument that is none, or a query without an answer.
    fn advance(
        &mut self,
        from: &[f32],
        to: &[f32],
        seconds: [f64; 2],
        ticks: u32,
    ) -> Result<Counts, SessionError>;
    /// Back to the first frame, as if nothing had been asked.
    fn restart(&mut self);
    /// The last tick's answer.
    fn answer(&self) -> Option<&Proximity>;
    /// Its triangle, numbered as in the mesh's file.
    fn corner_numbers(&self, rows: [u32; 3]) -> [u32; 3];
    /// The stretch of the surface as it is now.
    fn stretch(&self) -> f32;
    /// The stretch of a frame that was refused, if the surface is held because of it.
    fn refused(&self) -> Option<f32>;
    /// The contacts of the last tick's instrument, and the force on it.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    fn touching(&mut self) -> Result<ContactMarks, SessionError>;
    /// The spheres of a level: centre and radius of each.
    fn level(&self, level: u32) -> Vec<f32>;
    /// The spheres that a whole query for the last tick's instrument tests.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    fn tested(&mut self) -> Result<Vec<f32>, SessionError>;
    /// The spheres of the tracker's front; empty unless a tracker answers.
    fn front(&self) -> Vec<f32>;
}

/// A session on a tree's bytes, with the motion in `packed` or at rest. Both stay in memory for good: a page has one
/// session.
///
/// # Errors
/// [`SessionError`], one sentence with the remedy.
pub fn open(tree: Vec<u8>, packed: &[u8], rate: f64) -> Result<Box<dyn Session>, SessionError> {
    let bytes = tree.leak();
    Ok(match Tree::<u16>::from_bytes(bytes) {
        Err(FormatError::Width { .. }) => {
            Box::new(LoadedSession::new(Tree::<u32>::from_bytes(bytes)?, packed, rate)?)
        }
        tree => Box::new(LoadedSession::new(tree?, packed, rate)?),
    })
}

/// The surface as it is now.
enum Surface {
    Held(dibs_nostd::MovingTable<'static, Frame>),
    Moving(dibs_nostd::SurfaceBlend<'static, Frame, Frame>),
}

impl VertexTable for Surface {
    fn len(&self) -> usize {
        match self {
            Self::Held(surface) => surface.len(),
            Self::Moving(surface) => surface.len(),
        }
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        match self {
            Self::Held(surface) => surface.position(vertex),
            Self::Moving(surface) => surface.position(vertex),
        }
    }

    fn position_error(&self) -> f32 {
        match self {
            Self::Held(surface) => surface.position_error(),
            Self::Moving(surface) => surface.position_error(),
        }
    }
}

struct LoadedSession<I: 'static> {
    tree: Tree<'static, I>,
    motion: Motion,
    settings: Settings,
    query: Query<'static, I, STACK>,
    tracker: Box<Tracker<'static, I, STACK, OPENED>>,
    contacts: Box<Found>,
    odometer: Odometer,
    /// From the last frame but one to the last, of those that were not refused.
    step: Step<'static, Frame, Frame>,
    before: usize,
    last: usize,
    /// The number of the frame that arrived last.
    number: Option<u64>,
    refused: Option<f32>,
    now: Now,
}

/// The last tick.
struct Now {
    surface: Surface,
    /// Its place on the way from the frame before to the last, 1 at the last and more beyond.
    part: f32,
    stretch: MeasuredStretch,
    tool: Option<Instrument>,
    velocity: Velocity,
    /// Frames a second at which the surface moves; 0 while it stands still.
    rate: f32,
    answer: Option<Proximity>,
}

impl<I: Index> LoadedSession<I> {
    fn new(tree: Tree<'static, I>, packed: &[u8], rate: f64) -> Result<Self, SessionError> {
        let motion = Motion::new(&tree, packed, rate)?;
        let mut odometer = Odometer::new(&tree);
        let first = &motion.frames[0];
        let step = odometer.step(first, first);
        let now = Now {
            surface: Surface::Held(step.after()),
            part: 1.0,
            stretch: motion.stretches[0],
            tool: None,
            velocity: Velocity::default(),
            rate: 0.0,
            answer: None,
        };
        Ok(Self {
            motion,
            settings: Settings::default(),
            query: Query::new(&tree)?,
            tracker: Box::new(Tracker::new(&tree)?),
            contacts: Box::default(),
            odometer,
            step,
            before: 0,
            last: 0,
            number: None,
            refused: None,
            now,
            tree,
        })
    }

    /// Takes the frame of this time, unless it is stretched too far.
    fn arrive(&mut self, seconds: f64) {
        let number = self.motion.number(seconds);
        if self.number == Some(number) {
            return;
        }
        self.number = Some(number);
        let frame = self.motion.frame(number);
        let sigma = self.motion.stretches[frame].sigma();
        self.refused = (sigma > self.settings.limit).then_some(sigma);
        // A change of the settings lets the same frame arrive again.
        if self.refused.is_none() && frame != self.last {
            self.step_to(self.last, frame);
        }
    }

    fn step_to(&mut self, before: usize, frame: usize) {
        let frames = self.motion.frames;
        self.step = self.odometer.step(&frames[before], &frames[frame]);
        (self.before, self.last) = (before, frame);
    }

    /// Moves the surface to this time.
    fn move_surface(&mut self, seconds: f64) {
        self.arrive(seconds);
        let share = self.motion.share(seconds);
        let held = Surface::Held(self.step.after());
        let stretches = &self.motion.stretches;
        let (before, last) = (stretches[self.before], stretches[self.last]);
        let now = &mut self.now;
        (now.surface, now.part, now.stretch) = match self.settings.between {
            _ if self.refused.is_some() => (held, 1.0, last),
            Interpolation::Held => (held, 1.0, last),
            Interpolation::Interpolated => {
                let stretch = before.or_larger(last).unwrap_or(last);
                (Surface::Moving(self.step.at(share)), share, stretch)
            }
            // An extrapolated surface beyond the limit is not searched: the last frame is held.
            Interpolation::Extrapolated => {
                let frames = [self.before, self.last].map(|frame| &self.motion.frames[frame]);
                let beyond = self.step.beyond(share);
                match stretch_beyond(&self.tree, frames, share, &beyond) {
                    Ok(stretch) if stretch.sigma() <= self.settings.limit => {
                        (Surface::Moving(beyond), 1.0 + share, stretch)
                    }
                    _ => (held, 1.0, last),
                }
            }
        };
    }

    fn options(&self) -> Options {
        let Settings { budget, is_measured, search, .. } = self.settings;
        let budget = Budget::new(budget);
        let options = if search == Search::Cold { Options::cold() } else { Options::new() };
        let options = options.budget(budget);
        if is_measured { options.stretch(self.now.stretch) } else { options }
    }

    fn ask(&mut self, tool: &Instrument, counts: &mut Counts) -> Result<Proximity, SessionError> {
        match tool {
            Instrument::Sphere(sphere) => self.ask_about(sphere, counts),
            Instrument::Capsule(capsule) => self.ask_about(capsule, counts),
        }
    }

    fn ask_about(
        &mut self,
        tool: &impl Tool,
        counts: &mut Counts,
    ) -> Result<Proximity, SessionError> {
        let options = self.options();
        let (query, tracker) = (&mut self.query, &mut self.tracker);
        let search = self.settings.search;
        let (closest, is_whole) = match &self.now.surface {
            Surface::Held(surface) => closest(query, tracker, surface, tool, &options, search)?,
            Surface::Moving(surface) => closest(query, tracker, surface, tool, &options, search)?,
        };
        counts.ticks += 1;
        counts.node_tests += closest.node_tests;
        counts.triangle_tests += closest.triangle_tests;
        counts.fallbacks += u32::from(is_whole);
        Ok(closest)
    }

    /// Centre and radius of the spheres of these nodes.
    fn spheres(&self, rows: impl IntoIterator<Item = u32>) -> Vec<f32> {
        let is_measured = self.settings.is_measured;
        let stretch = if is_measured { self.now.stretch.sigma() } else { self.tree.stretch() };
        let sphere = |row| {
            let (pin, radius, _) = self.tree.node(row)?;
            let [x, y, z] = self.now.surface.position(pin)?.to_array();
            Some([x, y, z, radius * stretch])
        };
        rows.into_iter().filter_map(sphere).flatten().collect()
    }
}

/// The answer, and whether a tracker needed a whole query for it.
fn closest<I: Index>(
    query: &mut Query<'static, I, STACK>,
    tracker: &mut Tracker<'static, I, STACK, OPENED>,
    surface: &impl MovingSurface,
    tool: &impl Tool,
    options: &Options,
    search: Search,
) -> Result<(Proximity, bool), SessionError> {
    if search == Search::Tracker {
        let tracked = tracker.closest(surface, tool, options)?;
        return Ok((tracked.closest, tracked.fallback.is_some()));
    }
    Ok((query.closest(surface, tool, options)?, false))
}

impl<I: Index> Session for LoadedSession<I> {
    fn settings(&mut self) -> &mut Settings {
        // A frame may have to be refused, or may pass now.
        self.number = None;
        &mut self.settings
    }

    fn limit(&self) -> f32 {
        self.tree.stretch()
    }

    fn levels(&self) -> u32 {
        spheres::levels(&self.tree)
    }

    fn origin(&self) -> [f64; 3] {
        self.tree.origin()
    }

    fn frames(&self) -> usize {
        self.motion.frames.len()
    }

    fn triangles(&self) -> Vec<u32> {
        let rows = (0..self.tree.triangle_count()).map(TriangleRow);
        rows.filter_map(|row| self.tree.corners(row)).flatten().collect()
    }

    fn positions(&self) -> Vec<f32> {
        let rows = (0..self.tree.vertex_count()).map(|row| self.now.surface.position(row));
        rows.flatten().flat_map(|position| position.to_array()).collect()
    }

    fn nodes(&self) -> Vec<f32> {
        let [before, last] = [self.before, self.last].map(|frame| &self.motion.frames[frame]);
        between(before, last, self.now.part).flat_map(|node| node.to_array()).collect()
    }

    fn advance(
        &mut self,
        from: &[f32],
        to: &[f32],
        [start, end]: [f64; 2],
        ticks: u32,
    ) -> Result<Counts, SessionError> {
        let mut counts = Counts::default();
        for tick in 1..=ticks {
            let share = f64::from(tick) / f64::from(ticks);
            self.move_surface(if tick < ticks { start + share * (end - start) } else { end });
            let tool = Instrument::between(from, to, share as f32)?;
            self.now.answer = Some(self.ask(&tool, &mut counts)?);
            self.now.tool = Some(tool);
        }
        self.now.velocity = Velocity::new(from, to, end - start);
        let moves = end > start && matches!(self.now.surface, Surface::Moving(_));
        self.now.rate = if moves { self.motion.rate as f32 } else { 0.0 };
        Ok(counts)
    }

    fn restart(&mut self) {
        (self.number, self.refused) = (None, None);
        self.step_to(0, 0);
        self.tracker.forget();
    }

    fn answer(&self) -> Option<&Proximity> {
        self.now.answer.as_ref()
    }

    fn corner_numbers(&self, rows: [u32; 3]) -> [u32; 3] {
        rows.map(|row| self.tree.vertex_number(row).map_or(row, |number| number.0))
    }

    fn stretch(&self) -> f32 {
        self.now.stretch.sigma()
    }

    fn refused(&self) -> Option<f32> {
        self.refused
    }

    fn touching(&mut self) -> Result<ContactMarks, SessionError> {
        let (margin, options) = (self.settings.margin, self.options());
        let mut query = Query::<I, STACK>::new(&self.tree)?;
        let (surface, contacts) = (&self.now.surface, &mut *self.contacts);
        match &self.now.tool {
            Some(Instrument::Sphere(tool)) => {
                query.contacts(surface, tool, margin, &options, contacts)?;
            }
            Some(Instrument::Capsule(tool)) => {
                query.contacts(surface, tool, margin, &options, contacts)?;
            }
            None => (),
        }
        let [before, last] =
            [self.before, self.last].map(|frame| self.motion.frames[frame].positions());
        contacts.move_with(&Speeds { before, last, rate: self.now.rate })?;
        Ok(ContactMarks::new(&self.contacts, margin, self.now.velocity))
    }

    fn level(&self, level: u32) -> Vec<f32> {
        self.spheres(spheres::level(&self.tree, level))
    }

    fn tested(&mut self) -> Result<Vec<f32>, SessionError> {
        let options = self.options().unsigned();
        let mut query = Query::<I, STACK>::new(&self.tree)?;
        let recorder = Recorder::new(&self.now.surface);
        match &self.now.tool {
            Some(Instrument::Sphere(tool)) => query.closest(&recorder, tool, &options)?,
            Some(Instrument::Capsule(tool)) => query.closest(&recorder, tool, &options)?,
            None => return Ok(Vec::new()),
        };
        let reads = recorder.into_reads();
        Ok(self.spheres(spheres::tested(&self.tree, &reads)))
    }

    fn front(&self) -> Vec<f32> {
        match self.settings.search {
            Search::Tracker => self.spheres(self.tracker.front()),
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests;
