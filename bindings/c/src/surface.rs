//! The surface's buffers: two or three, for a number of vertices that the caller chooses.

use core::ffi::c_void;
use core::mem;
use core::slice;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Notes, PosedRows, Rows};
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Buffer, Buffers, FrameGuard, FrameReader, FrameWriter, Head, MeasuredStretch, Position,
    VertexTable,
};

use crate::border::{DIBS_ALIGNMENT, Kind, Storage};
use crate::code::dibs_code;

/// Bytes of a surface's storage in addition to its vertices.
pub const DIBS_SURFACE_BASE: usize = 576;

/// Bytes of a surface's storage for each vertex: two positions.
pub const DIBS_SURFACE_VERTEX: usize = 24;

/// Bytes of a guarded surface's storage for each vertex: three positions.
pub const DIBS_GUARDED_VERTEX: usize = 36;

/// Two buffers of vertices: one end fills one while the other end reads the other, and neither waits. With a third
/// buffer the previous frame is kept, from which a guard extrapolates.
///
/// Any number of contexts may use it at once.
pub struct dibs_surface {
    buffers: Buffers<'static>,
    /// Whether each end was taken: that of a receiver, a bus or a writer, and that of a reader or a guard.
    taken: [AtomicBool; 2],
    /// Whether the frame before the published one is kept.
    has_third: bool,
    /// Whether a reader holds a frame.
    is_held: AtomicBool,
    /// Data that the two ends pass to each other.
    pub(crate) notes: Notes<Poses>,
}

impl Kind for dibs_surface {
    const MARK: u32 = 0x6462_750C;
    const SIZE: usize = DIBS_SURFACE_BASE;
}

/// Every frame of a bus may have a pose. Frames without one behave bit for bit as if poses did not exist.
pub(crate) type OfVertices = PosedRows;
pub(crate) type OfNodes = PosedRows<Nodes<'static>>;
pub(crate) type Poses = <OfVertices as Rows>::Poses;

pub(crate) type Writer = FrameWriter<'static>;
pub(crate) type Reader = FrameReader<'static>;

/// Offset of the buffers, after the object and its word of state.
const BUFFERS: usize = 384;
const HEAD: usize = size_of::<Head>();

const _: () = assert!(BUFFERS + 4 + 3 * HEAD <= DIBS_SURFACE_BASE);
const _: () = assert!(size_of::<dibs_surface>() + DIBS_ALIGNMENT <= BUFFERS);
const _: () = assert!(2 * size_of::<Position>() == DIBS_SURFACE_VERTEX);
const _: () = assert!(3 * size_of::<Position>() == DIBS_GUARDED_VERTEX);
const _: () = assert!(align_of::<Head>() == 4 && align_of::<Position>() == 4);

/// Makes a surface without a frame.
///
/// @param storage   `DIBS_SURFACE_SIZE(vertices)` bytes, or `DIBS_GUARDED_SIZE(vertices)` for a guard, aligned to
///                  `DIBS_ALIGNMENT`. Needs no initial value. Must exist for as long as its two ends and their frames
///                  are used.
/// @param size      Bytes of the storage.
/// @param vertices  Rows of the surface: `rows` of the tree's facts.
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
            let has_room = |bytes: usize| {
                let needed = vertices.checked_mul(bytes);
                let needed = needed.and_then(|bytes| bytes.checked_add(DIBS_SURFACE_BASE));
                needed.is_some_and(|needed| needed <= size)
            };
            if !has_room(DIBS_SURFACE_VERTEX) {
                return Err(dibs_code::StorageSize);
            }
            let buffers = if has_room(DIBS_GUARDED_VERTEX) { 3 } else { 2 };
            let rows = vertices.checked_mul(3).and_then(|rows| rows.checked_add(head));
            let each = rows.ok_or(dibs_code::Argument)?;
            let all = each.checked_mul(buffers).and_then(|all| all.checked_add(1));
            let words = storage.words(size, BUFFERS, all.ok_or(dibs_code::Argument)?)?;
            let (state, rest) = words.split_first_mut().ok_or(dibs_code::Argument)?;
            let (first, rest) = rest.split_at_mut_checked(each).ok_or(dibs_code::Argument)?;
            let (second, rest) = rest.split_at_mut_checked(each).ok_or(dibs_code::Argument)?;
            let third = (buffers == 3).then(|| buffer(rest, vertices));
            Ok(dibs_surface {
                buffers: Buffers::new(
                    // SAFETY: an aligned word of this surface alone, which from here on is only used as an atomic.
                    unsafe { AtomicU32::from_ptr(state) },
                    [buffer(first, vertices), buffer(second, vertices)],
                    third,
                ),
                taken: [AtomicBool::new(false), AtomicBool::new(false)],
                is_held: AtomicBool::new(false),
                notes: Notes::new(),
                has_third: buffers == 3,
            })
        })
    })
}

/// A buffer in zeroed words: a head, and three words for each vertex.
fn buffer(words: &'static mut [u32], vertices: usize) -> Buffer<'static> {
    debug_assert!(words.len() == HEAD / 4 + 3 * vertices);
    let head = words.as_mut_ptr();
    // SAFETY: there are as many words as a head and the positions need, with the alignment of a word. Zeros are valid
    // atomics, and from here on nothing else refers to them.
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

    /// Fails unless a guard can use it with a tree of this many vertices.
    pub(crate) fn check_guarded(&self, vertices: u32) -> Result<(), dibs_code> {
        if self.vertices() != vertices as usize {
            Err(dibs_code::OtherTree)
        } else if !self.has_third {
            Err(dibs_code::StorageSize)
        } else {
            Ok(())
        }
    }

    /// Takes the end that fills buffers; succeeds once.
    pub(crate) fn take_writer(&'static self) -> Result<Writer, dibs_code> {
        self.take(0)?;
        Ok(self.buffers.ends().0)
    }

    /// Takes the end that reads them; succeeds once.
    pub(crate) fn take_reader(&'static self) -> Result<Reader, dibs_code> {
        self.take(1)?;
        Ok(self.buffers.ends().1)
    }

    /// Makes an object of the end that fills buffers, once. After an error the end is not taken.
    pub(crate) fn with_writer<T>(
        &'static self,
        make: impl FnOnce(Writer) -> Result<T, dibs_code>,
    ) -> Result<T, dibs_code> {
        make(self.take_writer()?).inspect_err(|_| self.give_back(0))
    }

    /// The same for the end that reads them.
    pub(crate) fn with_reader<T>(
        &'static self,
        make: impl FnOnce(Reader) -> Result<T, dibs_code>,
    ) -> Result<T, dibs_code> {
        make(self.take_reader()?).inspect_err(|_| self.give_back(1))
    }

    fn give_back(&self, end: usize) {
        if let Some(taken) = self.taken.get(end) {
            taken.store(false, Ordering::Release);
        }
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

/// The right to hold one frame, given back when it is dropped.
pub(crate) struct Hold(&'static AtomicBool);

impl Drop for Hold {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

/// The frame that a reader holds.
pub(crate) struct HeldFrame {
    // Declared first, so that it is dropped before the right to it is given back.
    guard: FrameGuard<'static>,
    _hold: Hold,
}

impl HeldFrame {
    pub(crate) fn new(guard: FrameGuard<'_>, hold: Hold) -> Self {
        // SAFETY: a guard refers to the surface's memory, which the caller keeps, and not to its reader. Its lifetime
        // would prevent a second guard at the same time; here the hold prevents it.
        let guard = unsafe { mem::transmute::<FrameGuard<'_>, FrameGuard<'static>>(guard) };
        Self { guard, _hold: hold }
    }

    /// The frame, with its motion since earlier frames.
    pub(crate) const fn moving(&self) -> &FrameGuard<'static> {
        &self.guard
    }
}

impl VertexTable for HeldFrame {
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
