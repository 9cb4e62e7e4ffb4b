//! The tracker: the closest pair at each tick, at the cost of what has changed since the last one.
//!
//! One file, because half of it is documentation for the header.

use core::cell::Cell;
use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Fallback, MeasuredStretch, MovingSurface, MovingTable, Odometer, Options, Proximity, Step,
    Tracker, TrackerAnswer, VertexTable,
};
use heapless::Vec;

use crate::border::{DIBS_ALIGNMENT, Handle, Handles, Input, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::contacts::dibs_contacts;
use crate::frame::{Table, dibs_frame};
use crate::query::{STACK, dibs_options, dibs_proximity};
use crate::tool::{DIBS_TOOLS, Shape, chain, dibs_tool};
use crate::tree::{Row, dibs_tree};

/// Bytes of a tracker's storage in addition to its vertices.
pub const DIBS_TRACKER_BASE: usize = 24_896;

/// Bytes of a tracker's storage for each vertex: the present and the previous surface.
pub const DIBS_TRACKER_VERTEX: usize = 24;

const _: () = assert!(2 * size_of::<[f32; 3]>() == DIBS_TRACKER_VERTEX);

/// Nodes of the tree that a tracker remembers: if a search opens more, ticks are whole queries.
pub const DIBS_OPENED: usize = 256;

/// A query that remembers the proof of its last answer.
///
/// It keeps a copy of the surface, so that a frame is only held while it is copied; or it searches a reader's frame
/// directly. One context at a time.
pub struct dibs_tracker {
    tracker: TheTracker,
    odometer: Odometer,
    /// The copies: the present one, and the one to be written next.
    copies: [&'static TableCopy; 2],
    surface: Option<MovingTable<'static, TableCopy>>,
    /// From the previous surface to the present one; without a previous one, from the present one to itself.
    step: Option<Step<'static, TableCopy, TableCopy>>,
}

pub(crate) type TheTracker = Tracker<'static, Row, STACK, DIBS_OPENED, DIBS_OPENED>;

impl Kind for dibs_tracker {
    const MARK: u32 = 0x6462_6B14;
    const SIZE: usize = DIBS_TRACKER_BASE;
}

/// Offset of the copies' heads, at the end of the tracker's own storage.
const HEADS: usize = (DIBS_TRACKER_BASE - 2 * size_of::<TableCopy>()) & !(DIBS_ALIGNMENT - 1);

const _: () = assert!(size_of::<dibs_tracker>() + DIBS_ALIGNMENT <= HEADS);

/// A copy of a frame.
pub(crate) struct TableCopy {
    /// Bits of x, y and z of each vertex.
    words: &'static [Cell<u32>],
    stretch: Cell<Option<MeasuredStretch>>,
    position_error: Cell<f32>,
}

impl TableCopy {
    fn new(words: &'static mut [u32]) -> Self {
        let words = Cell::from_mut(words).as_slice_of_cells();
        Self { words, stretch: Cell::new(None), position_error: Cell::new(0.0) }
    }

    fn copy<V: VertexTable>(&self, from: &V) -> Result<(), dibs_code> {
        let (rows, _) = self.words.as_chunks::<3>();
        if from.len() != rows.len() {
            return Err(dibs_code::VertexCount);
        }
        for (row, to) in (0..).zip(rows) {
            let position = from.position(row).ok_or(dibs_code::VertexCount)?;
            for (to, axis) in to.iter().zip(position.to_array()) {
                to.set(axis.to_bits());
            }
        }
        self.stretch.set(from.stretch());
        self.position_error.set(from.position_error());
        Ok(())
    }
}

impl VertexTable for TableCopy {
    fn len(&self) -> usize {
        self.words.len() / 3
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let (rows, _) = self.words.as_chunks::<3>();
        let [x, y, z] = rows.get(vertex as usize)?;
        let axis = |bits: &Cell<u32>| f32::from_bits(bits.get());
        Some(Vec3::new(axis(x), axis(y), axis(z)))
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.stretch.get()
    }

    fn position_error(&self) -> f32 {
        self.position_error.get()
    }
}

/// Makes a tracker on a tree, without a surface.
///
/// @param storage  `DIBS_TRACKER_SIZE(vertices)` bytes, aligned to `DIBS_ALIGNMENT`; `DIBS_TRACKER_SIZE(0)` is enough
///                 for `dibs_tracker_closest_on` alone. Needs no initial value.
/// @param size     Bytes of the storage.
/// @param tree     The tree.
/// @param tracker  Receives the tracker's address.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_init(
    storage: *mut c_void,
    size: usize,
    tree: *mut dibs_tree,
    tracker: *mut *mut dibs_tracker,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, tracker, || {
            let tree = &tree.share()?.tree;
            let vertices = if size == DIBS_TRACKER_BASE { 0 } else { tree.vertex_count() as usize };
            let each = vertices.checked_mul(3).ok_or(dibs_code::Argument)?;
            let both = each.checked_mul(2).ok_or(dibs_code::Argument)?;
            let words = storage.words(size, DIBS_TRACKER_BASE, both)?;
            let (first, second) = words.split_at_mut_checked(each).ok_or(dibs_code::Argument)?;
            Ok(dibs_tracker {
                tracker: Tracker::with_range(tree)?,
                odometer: Odometer::new(tree),
                copies: [
                    storage.keep(size, HEADS, TableCopy::new(first))?,
                    storage.keep(size, HEADS + size_of::<TableCopy>(), TableCopy::new(second))?,
                ],
                surface: None,
                step: None,
            })
        })
    })
}

/// Sets a new surface: copies it, and measures how far it moved. Call it for each new frame, then release the frame; it
/// is not needed at ticks without a new frame.
///
/// Cost: linear in the vertices.
///
/// @param tracker  The tracker.
/// @param frame    The surface.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` for an empty frame, `DIBS_CODE_VERTEX_COUNT` (also if the storage has
///         no room for copies), or a misuse. After an error the surface is the previous one.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_set_frame(
    tracker: *mut dibs_tracker,
    frame: *mut dibs_frame,
) -> dibs_code {
    dibs_code::of(|| {
        let (mut tracker, frame) = (tracker.open()?, frame.open()?);
        match &frame.table {
            Table::Empty => Err(dibs_code::NoSurface),
            Table::Vertices(vertices) => tracker.set(vertices),
            Table::Held(held) => tracker.set(held),
        }
    })
}

impl dibs_tracker {
    /// The core's tracker, and its own surface.
    pub(crate) fn parts(
        &mut self,
    ) -> Result<(&mut TheTracker, &MovingTable<'static, TableCopy>), dibs_code> {
        Ok((&mut self.tracker, self.surface.as_ref().ok_or(dibs_code::NoSurface)?))
    }

    /// The core's tracker, and the step from the previous surface to the present one.
    pub(crate) fn step(
        &mut self,
    ) -> Result<(&mut TheTracker, &Step<'static, TableCopy, TableCopy>), dibs_code> {
        Ok((&mut self.tracker, self.step.as_ref().ok_or(dibs_code::NoSurface)?))
    }

    /// The core's tracker, for use with another surface.
    pub(crate) const fn core(&mut self) -> &mut TheTracker {
        &mut self.tracker
    }

    fn set<V: VertexTable>(&mut self, from: &V) -> Result<(), dibs_code> {
        let [now, next] = self.copies;
        next.copy(from)?;
        let before = if self.step.is_some() { now } else { next };
        let step = self.odometer.step(before, next);
        (self.surface, self.step) = (Some(step.after()), Some(step));
        self.copies = [next, now];
        Ok(())
    }
}

/// Why a tick was a whole query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_fallback {
    /// It was not a whole query.
    None = 0,
    /// It was the first tick, or the first after an error.
    Start = 1,
    /// The surface's motion is not known without gaps.
    Surface = 2,
    /// Tool or surface moved too far.
    Jump = 3,
    /// More nodes were opened than the tracker has room for.
    Full = 4,
}

impl From<Option<Fallback>> for dibs_fallback {
    fn from(fallback: Option<Fallback>) -> Self {
        match fallback {
            None => Self::None,
            Some(Fallback::Start) => Self::Start,
            Some(Fallback::Surface) => Self::Surface,
            Some(Fallback::Full) => Self::Full,
            Some(_) => Self::Jump,
        }
    }
}

/// The answer of a tick, from one tracker or several.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_tracked {
    /// The closest pair; its counts of tests are this tick's. For several pairs its interval starts at the least lower
    /// bound of all, its accuracy is the worst, its tests are those of all, and its side is `DIBS_SIDE_CUT_SHORT` if
    /// the budget ended before the side of any pair was known.
    pub proximity: dibs_proximity,
    /// Other than 0 if this tick's search found no side, because its budget ended or the side is undefined: the side is
    /// then the last tick's, if the motion since allows that. The pair may then not be the closest; the interval is
    /// still valid.
    pub is_kept: u32,
    /// A `dibs_fallback`: the first reason for a whole query, among the pairs that were searched.
    pub fallback: u32,
    /// Upper bound (mm) on the motion of tool and surface together since the last tick; -1 if unknown, and for several
    /// pairs.
    pub moved: f32,
    /// Opened nodes that the tracker remembers, of at most `DIBS_OPENED`.
    pub opened: u32,
    /// Index of the pair, if there are several; else 0.
    pub pair: u32,
    /// Number of pairs that were searched; the others were certain to be farther.
    pub searched: u32,
}

impl dibs_tracked {
    /// No pair.
    pub(crate) fn nowhere() -> Self {
        Self {
            proximity: Proximity::NOWHERE.into(),
            is_kept: 0,
            fallback: dibs_fallback::None as u32,
            moved: -1.0,
            opened: 0,
            pair: 0,
            searched: 0,
        }
    }
}

impl From<TrackerAnswer> for dibs_tracked {
    fn from(found: TrackerAnswer) -> Self {
        Self {
            proximity: found.closest.into(),
            is_kept: found.is_kept.into(),
            fallback: dibs_fallback::from(found.fallback) as u32,
            moved: found.moved.unwrap_or(-1.0),
            opened: found.opened,
            pair: found.pair as u32,
            searched: found.searched,
        }
    }
}

fn closest<S: MovingSurface>(
    tracker: &mut TheTracker,
    surface: &S,
    shape: &Shape,
    options: &Options,
) -> Result<TrackerAnswer, dibs_code> {
    Ok(match shape {
        Shape::Sphere(sphere) => tracker.closest(surface, sphere, options)?,
        Shape::Capsule(capsule) => tracker.closest(surface, capsule, options)?,
    })
}

/// The closest pair of the tool and the tracker's surface: the answer of `dibs_query_closest`, within its accuracy.
///
/// Cost: at most the budget, and one comparison for each opened node.
///
/// @param tracker   The tracker.
/// @param tool      The tool.
/// @param options   Options, or null.
/// @param tracked   Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
/// @return As `dibs_query_closest`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_closest(
    tracker: *mut dibs_tracker,
    tool: *const dibs_tool,
    options: *const dibs_options,
    tracked: *mut dibs_tracked,
) -> dibs_code {
    dibs_code::of(|| {
        let tracked = tracked.check()?;
        let (shape, mut tracker) = (Shape::try_from(tool.get()?)?, tracker.open()?);
        let options = dibs_options::of(options)?;
        let (tracker, surface) = tracker.parts()?;
        tracked.set(closest(tracker, surface, &shape, &options)?.into());
        Ok(())
    })
}

/// The closest pair of the tool and the frame that a reader holds: the answer of `dibs_tracker_closest`, without
/// copying the surface, because the receiver has measured the frame's motion. The frame is held during the whole call;
/// release it afterwards. For a control tick that has no time for `dibs_tracker_set_frame`.
///
/// Cost: at most the budget, and one comparison for each opened node.
///
/// @param tracker   The tracker.
/// @param frame     A reader's frame.
/// @param tool      The tool.
/// @param options   Options, or null.
/// @param tracked   Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
/// @return As `dibs_query_closest`; `DIBS_CODE_ARGUMENT` for a frame of the caller's vertices.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_closest_on(
    tracker: *mut dibs_tracker,
    frame: *mut dibs_frame,
    tool: *const dibs_tool,
    options: *const dibs_options,
    tracked: *mut dibs_tracked,
) -> dibs_code {
    dibs_code::of(|| {
        let tracked = tracked.check()?;
        let (shape, mut tracker) = (Shape::try_from(tool.get()?)?, tracker.open()?);
        let (frame, options) = (frame.open()?, dibs_options::of(options)?);
        let surface = match &frame.table {
            Table::Empty => return Err(dibs_code::NoSurface),
            // The motion of a caller's vertices is not measured.
            Table::Vertices(_) => return Err(dibs_code::Argument),
            Table::Held(held) => held.moving(),
        };
        tracked.set(closest(&mut tracker.tracker, &surface, &shape, &options)?.into());
        Ok(())
    })
}

/// Fills the list with all locally closest pairs with a separation of at most `margin`, deepest first: the list of
/// `dibs_query_contacts`.
///
/// Cost: that of `dibs_tracker_closest`, and, if the surface is within the margin, of a range search
/// without memory of the last tick.
///
/// @param tracker   The tracker.
/// @param tool      The tool.
/// @param margin    In mm, at least 0.
/// @param options   Options, or null. A budget that runs out lowers the list's bound.
/// @param contacts  The list; empty after an error.
/// @param tracked   Receives the closest pair, or null.
/// @return As `dibs_query_contacts`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_contacts(
    tracker: *mut dibs_tracker,
    tool: *const dibs_tool,
    margin: f32,
    options: *const dibs_options,
    contacts: *mut dibs_contacts,
    tracked: *mut dibs_tracked,
) -> dibs_code {
    dibs_code::of(|| {
        let tracked = tracked.check_if_any()?;
        let found: TrackerAnswer = contacts.open()?.fill(|list| {
            let (shape, mut tracker) = (Shape::try_from(tool.get()?)?, tracker.open()?);
            let options = dibs_options::of(options)?;
            let (tracker, surface) = tracker.parts()?;
            Ok(match &shape {
                Shape::Sphere(sphere) => {
                    tracker.contacts(surface, sphere, margin, &options, list)?
                }
                Shape::Capsule(capsule) => {
                    tracker.contacts(surface, capsule, margin, &options, list)?
                }
            })
        })?;
        Out::set_if_any(tracked, found.into());
        Ok(())
    })
}

/// The closest of several pairs, each a tracker with its surface and a tool: for a chain of tools, several surfaces, or
/// both. A pair that is certain to be farther than the closest is not searched.
///
/// Cost: at most the budget, for all pairs together.
///
/// @param trackers  Addresses of the trackers, one for each pair. No tracker may be listed twice.
/// @param tools     The tool of each pair, in the same order.
/// @param count     Number of pairs: 1 to `DIBS_TOOLS`.
/// @param options   Options, or null.
/// @param tracked   Receives the answer; nothing is written unless the code is `DIBS_CODE_OK`.
/// @return As `dibs_tracker_closest`, for any pair; `DIBS_CODE_ARGUMENT` for no pair or too many.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_closest_of(
    trackers: *const *mut dibs_tracker,
    tools: *const dibs_tool,
    count: u32,
    options: *const dibs_options,
    tracked: *mut dibs_tracked,
) -> dibs_code {
    dibs_code::of(|| {
        let (tracked, options) = (tracked.check()?, dibs_options::of(options)?);
        let (tools, mut trackers) = (chain(tools, count)?, trackers.open_all::<DIBS_TOOLS>(count)?);
        let mut pairs = Vec::<_, DIBS_TOOLS>::new();
        for (tracker, tool) in trackers.iter_mut().zip(&tools) {
            let (tracker, surface) = tracker.parts()?;
            pairs.push((tracker, surface, tool)).map_err(|_| dibs_code::Argument)?;
        }
        let found = Tracker::closest_of(&mut pairs, &options)?.ok_or(dibs_code::Argument)?;
        tracked.set(found.into());
        Ok(())
    })
}
