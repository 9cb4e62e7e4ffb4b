//! Ticks on a moving surface: the closest pair and the contacts within a budget, and commands that a filter admits.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use dibs_build::SurfaceRows;
use dibs_build::glam::DVec3;
use dibs_nostd::filter::{self, FilterError, MotionRow, RigidMotion, Uncertainty};
use dibs_nostd::{
    Budget, Capsule, Cost, Fallback, Index, Millis, MovingTable, Odometer, Options, Proximity,
};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyByteArray;

use crate::record::{push_answer, push_contact};
use crate::surface::{KeptContacts, List, Surface};
use crate::tool::AnyTool;
use crate::tree::{Owned, Tree, View, of_any_width};
use crate::{bytes, invalid};

/// Enough for any tree.
const STACK: usize = dibs_nostd::format::MAX_STACK;

/// Room for opened nodes.
const OPENED: usize = 4_096;

type TheTracker<'t, I> = dibs_nostd::Tracker<'t, I, STACK, OPENED, OPENED>;

/// A tracker for each tool, and the surface of the last tick.
struct Ticks<'t, I> {
    tree: &'t dibs_nostd::Tree<'t, I>,
    trackers: Vec<Box<TheTracker<'t, I>>>,
    odometer: Odometer,
    last: Option<Py<Surface>>,
}

impl<'t, I: Index> Ticks<'t, I> {
    fn new(tree: &'t dibs_nostd::Tree<'t, I>) -> Self {
        Self { tree, trackers: Vec::new(), odometer: Odometer::new(tree), last: None }
    }

    /// Makes the trackers for this many tools, and measures how far the surface has moved since the last tick.
    fn begin<'s>(
        &mut self,
        now: &'s Py<Surface>,
        last: Option<&'s Py<Surface>>,
        tools: usize,
    ) -> Result<MovingTable<'s, SurfaceRows>, String> {
        if self.trackers.len() != tools {
            let tracker = |_| TheTracker::with_range(self.tree).map(Box::new);
            let trackers = (0..tools).map(tracker).collect::<Result<_, _>>();
            self.trackers = trackers.map_err(|error| error.to_string())?;
        }
        let rows = &now.get().rows;
        Ok(match last {
            None => self.odometer.start(rows),
            Some(last) => self.odometer.step(&last.get().rows, rows).after(),
        })
    }
}

/// The ticks for either index width.
enum OfWidth<'t> {
    Narrow(Ticks<'t, u16>),
    Wide(Ticks<'t, u32>),
}

self_cell::self_cell!(
    struct OnTree {
        owner: Arc<Owned>,
        #[not_covariant]
        dependent: OfWidth,
    }
);

/// Evaluates `$body` with the ticks of either index width.
macro_rules! with_ticks {
    ($ticks:expr, $of_width:ident => $body:expr) => {
        lock($ticks).with_dependent_mut(|_, ticks| match ticks {
            OfWidth::Narrow($of_width) => $body,
            OfWidth::Wide($of_width) => $body,
        })
    };
}

fn on(tree: &Tree) -> Mutex<OnTree> {
    Mutex::new(OnTree::new(Arc::clone(&tree.0), |tree| match tree.view() {
        View::Narrow(tree) => OfWidth::Narrow(Ticks::new(tree)),
        View::Wide(tree) => OfWidth::Wide(Ticks::new(tree)),
    }))
}

fn lock(ticks: &Mutex<OnTree>) -> MutexGuard<'_, OnTree> {
    ticks.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Fails for the surface of another tree.
fn check(surface: &Surface, tree: &Arc<Owned>) -> PyResult<()> {
    if Arc::ptr_eq(&surface.tree, tree) || surface.tree.bytes() == tree.bytes() {
        Ok(())
    } else {
        Err(invalid("surface: it is of another tree"))
    }
}

fn options(surface: &Surface) -> Options {
    match surface.stretch {
        Some(measured) => Options::new().stretch(measured),
        None => Options::new(),
    }
}

/// A tracker of one tool.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Tracker {
    ticks: Mutex<OnTree>,
    contacts: Mutex<Box<List>>,
    tree: Arc<Owned>,
}

/// A list's records, its bound, and its accuracy.
pub type ContactRows<'py> = (Bound<'py, PyByteArray>, f32, f32);

pub fn listed<'py>(py: Python<'py>, list: &List, tree: &Owned) -> ContactRows<'py> {
    let mut records = Vec::new();
    list.iter().for_each(|found| push_contact(&mut records, 0, found, tree));
    (PyByteArray::new(py, &records), list.bound(), list.accuracy())
}

#[pymethods]
impl Tracker {
    #[new]
    fn new(tree: &Tree) -> Self {
        Self { ticks: on(tree), contacts: Mutex::default(), tree: Arc::clone(&tree.0) }
    }

    /// The closest pair of a tick, and with a margin the contacts.
    fn tick<'py>(
        &self,
        py: Python<'py>,
        surface: Py<Surface>,
        tool: &[u8],
        instructions: Option<u32>,
        margin: Option<f32>,
    ) -> PyResult<(TrackerAnswer, Option<ContactRows<'py>>)> {
        check(surface.get(), &self.tree)?;
        let tool = AnyTool::of(&bytes::doubles(tool), self.tree.origin);
        let tool = tool.map_err(|error| invalid(format!("tool: {error}")))?;
        let mut options = options(surface.get());
        if let Some(instructions) = instructions {
            let cost = of_any_width!(self.tree.view(), tree => Cost::of_tick(tree));
            options = options.budget(Budget::for_instructions(instructions, &cost));
        }
        // While a thread waits for the list, it releases Python, so that the thread that holds the list can return.
        let list = self.contacts.lock_py_attached(py);
        let mut list = list.unwrap_or_else(PoisonError::into_inner);
        let contacts = &mut **list;
        let found = py.detach(|| {
            with_ticks!(&self.ticks, ticks => {
                let last = ticks.last.take();
                let moving = ticks.begin(&surface, last.as_ref(), 1)?;
                let [tracker] = ticks.trackers.as_mut_slice() else { return Err(String::new()) };
                let found = match (&tool, margin) {
                    (AnyTool::Sphere(tool), None) => tracker.closest(&moving, tool, &options),
                    (AnyTool::Capsule(tool), None) => tracker.closest(&moving, tool, &options),
                    (AnyTool::Sphere(tool), Some(margin)) => {
                        tracker.contacts(&moving, tool, margin, &options, contacts)
                    }
                    (AnyTool::Capsule(tool), Some(margin)) => {
                        tracker.contacts(&moving, tool, margin, &options, contacts)
                    }
                };
                ticks.last = Some(surface);
                found.map_err(|error| error.to_string())
            })
        });
        let found = found.map_err(invalid)?;
        let listed = margin.map(|_| listed(py, contacts, &self.tree));
        let kept = margin.map(|_| Box::new(contacts.without_search()));
        Ok((TrackerAnswer { found, contacts: kept, tree: Arc::clone(&self.tree) }, listed))
    }
}

/// A tick's closest pair.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct TrackerAnswer {
    found: dibs_nostd::TrackerAnswer,
    pub contacts: Option<Box<KeptContacts>>,
    pub tree: Arc<Owned>,
}

impl TrackerAnswer {
    pub const fn closest(&self) -> Proximity {
        self.found.closest
    }
}

#[pymethods]
impl TrackerAnswer {
    fn record<'py>(&self, py: Python<'py>) -> Bound<'py, PyByteArray> {
        let mut record = Vec::new();
        push_answer(&mut record, &self.found.closest, &self.tree, [0, 0]);
        PyByteArray::new(py, &record)
    }

    /// Whether the side is the last tick's, why the tick was a whole query, and the motion (mm) since the last tick.
    fn facts(&self) -> (bool, Option<&'static str>, Option<f32>) {
        let reason = self.found.fallback.map(|fallback| match fallback {
            Fallback::Start => "start",
            Fallback::Surface => "surface",
            Fallback::Jump => "jump",
            _ => "full",
        });
        (self.found.is_kept, reason, self.found.moved)
    }
}

/// The error (mm) of a surface this much older, of tissue with an error and a speed.
#[pyfunction]
pub fn after(speed: f32, error: f32, ms: u32) -> f32 {
    // At the end of a period without length.
    Uncertainty::new(speed).error(error).after(Millis(ms)).stand_off(0.0)
}

/// The distance (mm) at which a period (s) starts without a risk of contact.
#[pyfunction]
pub fn stand_off(speed: f32, error: f32, period: f32) -> f32 {
    Uncertainty::new(speed).error(error).stand_off(period)
}

/// Translation and rotation, least separation, reason, queries, instructions.
pub type AdmittedMotion = ([f32; 3], [f32; 3], f32, &'static str, u32, u32);

/// Most labels with a stand-off of their own.
const LABELS: usize = <filter::Filter>::MOST_PAIRS - 1;

/// A filter of commands.
#[pyclass(frozen, module = "dibs._dibs")]
pub struct Filter {
    ticks: Mutex<OnTree>,
    filter: filter::Filter<LABELS>,
    tree: Arc<Owned>,
}

#[pymethods]
impl Filter {
    #[new]
    fn new(
        tree: &Tree,
        stand_off: f32,
        of_labels: Vec<(u8, f32)>,
        speed: f32,
        lever: Option<f32>,
        approach: f32,
        instructions: u32,
    ) -> PyResult<Self> {
        let filter = filter::Filter::new(stand_off, speed).map_err(named)?;
        let filter = match lever {
            Some(lever) => filter.lever(lever).map_err(named)?,
            None => filter,
        };
        let filter = filter.approach(approach).map_err(named)?;
        let filter = filter.budget(instructions);
        let mut labels = [(0, stand_off); LABELS];
        let found = of_labels.len();
        if found > LABELS {
            return Err(invalid(format!("stand_off_of: {found} labels, and {LABELS} have a slot")));
        }
        labels.iter_mut().zip(of_labels).for_each(|(slot, of_label)| *slot = of_label);
        let filter = filter.stand_off_of(labels).map_err(named)?;
        let has = |label| of_any_width!(tree.0.view(), tree => tree.has_label(label));
        if let Some(&(label, _)) = labels.iter().take(found).find(|&&(label, _)| !has(label)) {
            return Err(named(FilterError::Unlabelled { label }));
        }
        Ok(Self { ticks: on(tree), filter, tree: Arc::clone(&tree.0) })
    }

    /// `tools` and `rows`: seven numbers each. `command`: reference point, translation, rotation. `tissue`: period,
    /// speed, error.
    fn admit(
        &self,
        py: Python<'_>,
        surface: Py<Surface>,
        tools: &[u8],
        command: [[f64; 3]; 3],
        tissue: (f32, f32, f32),
        rows: Vec<[f32; 7]>,
    ) -> PyResult<AdmittedMotion> {
        check(surface.get(), &self.tree)?;
        let origin = self.tree.origin;
        let numbers = bytes::doubles(tools);
        let tools = numbers.chunks_exact(7).enumerate().map(|(number, tool)| {
            let local = |at: usize| (DVec3::from_slice(&tool[at..]) - origin).as_vec3();
            Capsule::new(local(0), local(3), tool[6] as f32)
                .map_err(|error| invalid(format!("tools: row {number}: {error}")))
        });
        let tools = tools.collect::<PyResult<Vec<_>>>()?;
        let command = motion(command, origin);
        let rows = rows.into_iter().map(|[a, b, c, d, e, f, least]| MotionRow {
            linear: [a, b, c],
            angular: [d, e, f],
            least,
        });
        let rows: Vec<_> = rows.collect();
        let (period, speed, error) = tissue;
        let uncertainty = Uncertainty::new(speed).error(error);
        let filter = self.filter.options(options(surface.get()));
        let admitted = py.detach(|| {
            with_ticks!(&self.ticks, ticks => {
                let last = ticks.last.take();
                let moving = ticks.begin(&surface, last.as_ref(), tools.len())?;
                let mut pairs: Vec<_> = ticks
                    .trackers
                    .iter_mut()
                    .zip(&tools)
                    .map(|(tracker, tool)| (&mut **tracker, &moving, tool))
                    .collect();
                let admitted = filter.admit(&mut pairs, &command, period, &uncertainty, &rows);
                drop(pairs);
                ticks.last = Some(surface);
                Ok(admitted)
            })
        });
        let admitted = admitted.map_err(|error: String| invalid(error))?;
        admitted.map(record).map_err(named)
    }
}

impl Filter {
    pub const fn filter(&self) -> &filter::Filter<LABELS> {
        &self.filter
    }
}

/// The motion of a reference point, a translation and a rotation.
pub fn motion(command: [[f64; 3]; 3], origin: DVec3) -> RigidMotion {
    let [about, translation, rotation] = command.map(DVec3::from);
    RigidMotion::new((about - origin).as_vec3(), translation.as_vec3(), rotation.as_vec3())
}

/// Converts an admitted motion for Python.
pub fn record(admitted: filter::AdmittedMotion) -> AdmittedMotion {
    (
        admitted.motion.translation.to_array(),
        admitted.motion.rotation.to_array(),
        admitted.least_separation,
        admitted.reason.words(),
        admitted.queries,
        admitted.instructions,
    )
}

/// A sentence with the names of Python's arguments.
pub fn named(error: FilterError) -> PyErr {
    match error {
        FilterError::Parameter { parameter, value } => {
            let name = match parameter {
                "uncertainty" => "error",
                "tissue speed" => "tissue_speed",
                other => other,
            };
            invalid(format!("{name}: it cannot be {value}"))
        }
        FilterError::Command => invalid("command: it is too large"),
        FilterError::Row { .. } | FilterError::Rows { .. } => invalid(format!("rows: {error}")),
        FilterError::Unlabelled { label } => {
            invalid(format!("stand_off_of: no triangle has the label {label}"))
        }
        _ => invalid(error),
    }
}
