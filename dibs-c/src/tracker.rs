//! The tracker: the closest pair from tick to tick, at the cost of what has changed.

use core::cell::Cell;
use core::ffi::c_void;

use bytemuck::TransparentWrapper;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{Fallback, MeasuredStretch, Moved, Odometer, Tool, Tracked, Tracker, VertexTable};

use crate::border::{Handle, Input, Kind, Output, Storage};
use crate::code::dibs_code;
use crate::frame::{Table, dibs_frame};
use crate::query::{STACK, dibs_options, dibs_proximity};
use crate::tool::{Shape, dibs_tool};
use crate::tree::dibs_tree;

/// Bytes of a tracker's storage besides its vertices.
pub const DIBS_TRACKER_BASE: usize = 16_384;

/// Bytes of a tracker's storage for each vertex: the surface as it is, and as it was.
pub const DIBS_TRACKER_VERTEX: usize = 24;

const _: () = assert!(2 * size_of::<[f32; 3]>() == DIBS_TRACKER_VERTEX);

/// Nodes of the tree that a tracker remembers: more, and ticks are whole queries.
pub const DIBS_OPENED: usize = 256;

/// A query that remembers its last answer's proof.
///
/// It keeps a copy of the surface, so that a frame is held for its copying alone. One context at a time.
pub struct dibs_tracker {
    tracker: Tracker<'static, u16, STACK, DIBS_OPENED>,
    odometer: Odometer,
    /// The copies: the surface's, and the one to be written next.
    copies: [&'static Copied; 2],
    surface: Option<Surface>,
}

impl Kind for dibs_tracker {
    const MARK: u32 = 0x6462_6B14;
    const SIZE: usize = DIBS_TRACKER_BASE;
}

/// The surface that is searched.
struct Surface {
    moved: Moved<'static, Copied>,
    stretch: Option<MeasuredStretch>,
    position_error: f32,
}

/// Bits of x, y and z of each vertex.
#[derive(TransparentWrapper)]
#[repr(transparent)]
struct Copied([Cell<u32>]);

impl Copied {
    fn copy<V: VertexTable>(&self, from: &V) -> Result<(), dibs_code> {
        let (rows, _) = self.0.as_chunks::<3>();
        if from.len() != rows.len() {
            return Err(dibs_code::VertexCount);
        }
        for (row, to) in (0..).zip(rows) {
            let position = from.position(row).ok_or(dibs_code::VertexCount)?;
            for (to, axis) in to.iter().zip(position.to_array()) {
                to.set(axis.to_bits());
            }
        }
        Ok(())
    }
}

impl VertexTable for Copied {
    fn len(&self) -> usize {
        self.0.len() / 3
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        let (rows, _) = self.0.as_chunks::<3>();
        let [x, y, z] = rows.get(vertex as usize)?;
        let axis = |bits: &Cell<u32>| f32::from_bits(bits.get());
        Some(Vec3::new(axis(x), axis(y), axis(z)))
    }
}

/// Makes a tracker on a tree, without a surface.
///
/// @param storage  `DIBS_TRACKER_SIZE(vertices)` bytes, aligned to `DIBS_ALIGNMENT`. Needs no initial value.
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
            let each = (tree.vertex_count() as usize).checked_mul(3).ok_or(dibs_code::Argument)?;
            let both = each.checked_mul(2).ok_or(dibs_code::Argument)?;
            let words = storage.words(size, DIBS_TRACKER_BASE, both)?;
            let (first, second) = words.split_at_mut_checked(each).ok_or(dibs_code::Argument)?;
            let copied = |words| Copied::wrap_ref(Cell::from_mut(words).as_slice_of_cells());
            Ok(dibs_tracker {
                tracker: Tracker::new(tree)?,
                odometer: Odometer::new(tree),
                copies: [copied(first), copied(second)],
                surface: None,
            })
        })
    })
}

/// Takes over a new surface: copies it, and measures how far it moved. Call it for each new frame, and release the frame
/// then; ticks with no new frame go without.
///
/// Cost: linear in the vertices.
///
/// @param tracker  The tracker.
/// @param frame    The surface.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE` of an empty frame, `DIBS_CODE_VERTEX_COUNT`, or a misuse. After an error
///         the surface is the one before.
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
    fn set<V: VertexTable>(&mut self, from: &V) -> Result<(), dibs_code> {
        let [now, next] = self.copies;
        next.copy(from)?;
        let moved = match self.surface {
            Some(_) => self.odometer.step(now, next).after(),
            None => self.odometer.start(next),
        };
        let (stretch, position_error) = (from.stretch(), from.position_error());
        self.surface = Some(Surface { moved, stretch, position_error });
        self.copies = [next, now];
        Ok(())
    }

    fn closest(
        &mut self,
        tool: &impl Tool,
        options: *const dibs_options,
    ) -> Result<Tracked, dibs_code> {
        let mut options = dibs_options::of(options)?;
        let surface = self.surface.as_ref().ok_or(dibs_code::NoSurface)?;
        if let Some(stretch) = surface.stretch {
            options = options.stretch(stretch);
        }
        let mut found = self.tracker.closest(&surface.moved, tool, &options)?;
        found.closest = found.closest.widened(surface.position_error);
        Ok(found)
    }
}

/// The reason for a whole query.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_fallback {
    /// It was none.
    None = 0,
    /// The first tick, or the one after an error.
    Start = 1,
    /// The surface's motion was not measured all the way.
    Surface = 2,
    /// Tool or surface moved too far.
    Jump = 3,
    /// More nodes had to be opened than there are places.
    Full = 4,
}

/// The closest pair of the tool and the tracker's surface: the answer of `dibs_query_closest`, within its accuracy.
///
/// Cost: the budget at most, and a number for each opened node.
///
/// @param tracker    The tracker.
/// @param tool       The tool.
/// @param options    Options, or null.
/// @param proximity  Receives the answer; its counts of tests are this tick's.
/// @param fallback   Receives the reason for a whole query; or null.
/// @return As `dibs_query_closest`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_tracker_closest(
    tracker: *mut dibs_tracker,
    tool: *const dibs_tool,
    options: *const dibs_options,
    proximity: *mut dibs_proximity,
    fallback: *mut dibs_fallback,
) -> dibs_code {
    dibs_code::of(|| {
        let (proximity, fallback) = (proximity.check()?, fallback.check_if_any()?);
        let (shape, mut tracker) = (Shape::try_from(tool.get()?)?, tracker.open()?);
        let found = match &shape {
            Shape::Sphere(sphere) => tracker.closest(sphere, options)?,
            Shape::Capsule(capsule) => tracker.closest(capsule, options)?,
        };
        proximity.set(found.closest.into());
        if let Some(fallback) = fallback {
            fallback.set(match found.fallback {
                None => dibs_fallback::None,
                Some(Fallback::Start) => dibs_fallback::Start,
                Some(Fallback::Surface) => dibs_fallback::Surface,
                Some(Fallback::Full) => dibs_fallback::Full,
                Some(_) => dibs_fallback::Jump,
            });
        }
        Ok(())
    })
}
