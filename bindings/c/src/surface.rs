//! The surface's buffers: two of them, for as many vertices as the caller says.

use core::ffi::c_void;
use core::mem;
use core::slice;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use dibs_nostd::failsafe::LinkStatus;
use dibs_nostd::glam::Vec3;
use dibs_nostd::{
    Buffer, Buffers, FrameGuard, FrameReader, FrameWriter, Head, MeasuredStretch, Position,
    VertexTable,
};

use crate::border::{DIBS_ALIGNMENT, Kind, Storage};
use crate::code::dibs_code;

/// Bytes of a surface's storage besides its vertices.
pub const DIBS_SURFACE_BASE: usize = 384;

/// Bytes of a surface's storage for each vertex: two positions.
pub const DIBS_SURFACE_VERTEX: usize = 24;

/// Two buffers of vertices: the receiver fills one, the reader holds the other, and neither waits.
///
/// Any number of contexts may use it at once.
pub struct dibs_surface {
    buffers: Buffers<'static>,
    /// Ends that were taken: the receiver's and the reader's.
    taken: [AtomicBool; 2],
    /// A reader holds a frame.
    is_held: AtomicBool,
    /// The receiver's notes for the reader.
    pub(crate) link: LinkStatus,
}

impl Kind for dibs_surface {
    const MARK: u32 = 0x6462_750C;
    const SIZE: usize = DIBS_SURFACE_BASE;
}

pub(crate) type Writer = FrameWriter<'static>;
pub(crate) type Reader = FrameReader<'static>;
type Guard<'f> = FrameGuard<'f>;

/// Offset of the buffers, after the object and the word of their state.
const BUFFERS: usize = 256;
const HEAD: usize = size_of::<Head>();

const _: () = assert!(BUFFERS + 4 + 2 * HEAD <= DIBS_SURFACE_BASE);
const _: () = assert!(size_of::<dibs_surface>() + DIBS_ALIGNMENT <= BUFFERS);
const _: () = assert!(2 * size_of::<Position>() == DIBS_SURFACE_VERTEX);
const _: () = assert!(align_of::<Head>() == 4 && align_of::<Position>() == 4);

/// Makes a surface without a frame.
///
/// @param storage   `DIBS_SURFACE_SIZE(vertices)` bytes, aligned to `DIBS_ALIGNMENT`. Needs no initial value. For as long as
///                  its receiver, its reader and their frames are used.
/// @param size      Bytes of the storage.
/// @param vertices  Vertices of the surface: those of the tree.
/// @param surface   Receives the surface's address.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_surface_init(
    storage: *mut c_void,
    size: usize,
    vertices: u32,
    surface: *mut *mut dibs_surface,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, surface, || {
            let (vertices, head) = (vertices as usize, HEAD / 4);
            let needed = vertices.checked_mul(DIBS_SURFACE_VERTEX);
            let needed = needed.and_then(|bytes| bytes.checked_add(DIBS_SURFACE_BASE));
            if needed.is_none_or(|needed| size < needed) {
                return Err(dibs_code::StorageSize);
            }
            let rows = vertices.checked_mul(3).and_then(|rows| rows.checked_add(head));
            let each = rows.ok_or(dibs_code::Argument)?;
            let both = each.checked_mul(2).and_then(|both| both.checked_add(1));
            let words = storage.words(size, BUFFERS, both.ok_or(dibs_code::Argument)?)?;
            let (first, rest) = words.split_at_mut_checked(each).ok_or(dibs_code::Argument)?;
            let (second, rest) = rest.split_at_mut_checked(each).ok_or(dibs_code::Argument)?;
            let state = rest.first_mut().ok_or(dibs_code::Argument)?;
            Ok(dibs_surface {
                buffers: Buffers::new(
                    // SAFETY: a word of this surface's own, aligned, and from here on never used but as an atomic.
                    unsafe { AtomicU32::from_ptr(state) },
                    [buffer(first, vertices), buffer(second, vertices)],
                    None,
                ),
                taken: [AtomicBool::new(false), AtomicBool::new(false)],
                is_held: AtomicBool::new(false),
                link: LinkStatus::new(),
            })
        })
    })
}

/// A buffer of so many vertices in zeroed words: a head, and three a vertex.
fn buffer(words: &'static mut [u32], vertices: usize) -> Buffer<'static> {
    debug_assert!(words.len() == HEAD / 4 + 3 * vertices);
    let head = words.as_mut_ptr();
    // SAFETY: the words are as many as a head and the positions, all of a word's alignment. Zeros are atomics, and from here
    // on nothing else refers to them.
    unsafe {
        let rows = head.add(HEAD / 4).cast::<Position>();
        Buffer { head: &*head.cast::<Head>(), rows: slice::from_raw_parts(rows, vertices) }
    }
}

impl dibs_surface {
    /// Vertices of the surface.
    pub(crate) fn vertices(&self) -> usize {
        let (writer, _) = self.buffers.ends();
        writer.back().len()
    }

    /// The receiver's end, once.
    pub(crate) fn take_writer(&'static self) -> Result<Writer, dibs_code> {
        self.take(0)?;
        Ok(self.buffers.ends().0)
    }

    /// The reader's end, once.
    pub(crate) fn take_reader(&'static self) -> Result<Reader, dibs_code> {
        self.take(1)?;
        Ok(self.buffers.ends().1)
    }

    fn take(&self, end: usize) -> Result<(), dibs_code> {
        let taken = self.taken.get(end).ok_or(dibs_code::Argument)?;
        if taken.swap(true, Ordering::AcqRel) { Err(dibs_code::Taken) } else { Ok(()) }
    }

    /// Lets a reader hold a frame.
    pub(crate) fn hold(&'static self) -> Result<Hold, dibs_code> {
        if self.is_held.swap(true, Ordering::Acquire) {
            return Err(dibs_code::Held);
        }
        Ok(Hold(&self.is_held))
    }
}

/// The right to one guard, given back when it is dropped.
pub(crate) struct Hold(&'static AtomicBool);

impl Drop for Hold {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// The frame that a reader holds.
pub(crate) struct Held {
    // First, so that it is dropped before the right to it is given back.
    guard: Guard<'static>,
    _hold: Hold,
}

impl Held {
    pub(crate) fn new(guard: Guard<'_>, hold: Hold) -> Self {
        // SAFETY: a guard refers to the surface's memory, which the caller keeps, and not to its reader. That no second
        // one is made while it lives, which its lifetime would see to, is what the hold is for.
        let guard = unsafe { mem::transmute::<Guard<'_>, Guard<'static>>(guard) };
        Self { guard, _hold: hold }
    }

    /// The frame with its motion since others.
    pub(crate) const fn moving(&self) -> &Guard<'static> {
        &self.guard
    }
}

impl VertexTable for Held {
    fn len(&self) -> usize {
        self.guard.len()
    }

    #[inline(always)]
    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.guard.position(vertex)
    }

    fn epoch(&self) -> Option<u32> {
        self.guard.epoch()
    }

    fn stretch(&self) -> Option<MeasuredStretch> {
        self.guard.stretch()
    }

    fn position_error(&self) -> f32 {
        self.guard.position_error()
    }
}
