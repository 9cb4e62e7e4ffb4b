//! A writer of frames, for surfaces that do not arrive in packets.

use core::ffi::c_void;

use dibs_nostd::glam::Vec3;
use dibs_nostd::{FrameLabel, Millis, PublishError, measure_stretch};

use crate::border::{Handle, Kind, Storage};
use crate::code::dibs_code;
use crate::frame::rows;
use crate::surface::{Writer, dibs_surface};
use crate::tree::dibs_tree;

/// Bytes of a writer's storage.
pub const DIBS_WRITER_SIZE: usize = 256;

/// Publishes frames of the caller's positions, for a reader of the same surface.
///
/// A frame is one `dibs_writer_begin`, any number of `dibs_writer_push`, and one `dibs_writer_publish`. Only the
/// stretch is checked: frames that arrive over a line belong to a receiver. One context at a time.
pub struct dibs_writer(Writer);

impl Kind for dibs_writer {
    const MARK: u32 = 0x6462_771A;
    const SIZE: usize = DIBS_WRITER_SIZE;
}

/// Makes the writer of a surface, once.
///
/// @param storage  `DIBS_WRITER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param surface  The surface.
/// @param writer   Receives the writer's address.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_TAKEN` if the surface has a receiver or a writer already, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_writer_init(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    writer: *mut *mut dibs_writer,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, writer, || Ok(dibs_writer(surface.share()?.take_writer()?)))
    })
}

/// Starts a frame, and discards an unfinished one.
///
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_writer_begin(writer: *mut dibs_writer) -> dibs_code {
    dibs_code::of(|| {
        writer.open()?.0.begin();
        Ok(())
    })
}

/// Stores the positions of the next rows.
///
/// Cost: linear in the positions.
///
/// @param writer     The writer.
/// @param positions  x, y and z (mm) of each vertex, in the tree's order of rows. Copied.
/// @param count      Their number.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_VERTEX_COUNT` if these are more rows than the frame lacks: nothing is stored; or
///         a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_writer_push(
    writer: *mut dibs_writer,
    positions: *const f32,
    count: u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (mut writer, rows) = (writer.open()?, rows(positions, count)?);
        if writer.0.missing() < count {
            return Err(dibs_code::VertexCount);
        }
        for row in rows {
            let stored = writer.0.push(Vec3::from_array(*row));
            stored.map_err(|_| dibs_code::VertexCount)?;
        }
        Ok(())
    })
}

/// Publishes the frame.
///
/// Cost: with a tree linear in its triangles, otherwise a few instructions.
///
/// @param writer          The writer.
/// @param tree            The surface's tree, to measure the stretch, which makes queries cheaper; or null: queries
///                        then assume the tree's limit.
/// @param epoch           Number of the frame.
/// @param received        Its time on the reader's clock, in ms; wraps.
/// @param position_error  Largest error (mm, at least 0) of a vertex position.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_VERTEX_COUNT` while vertices are missing; `DIBS_CODE_HELD` while the published
///         frame is read: nothing is lost, call again; `DIBS_CODE_STRETCH_EXCEEDED` if distances on this frame could be
///         wrong, and the other codes of `dibs_frame_measure`; `DIBS_CODE_ARGUMENT` for an error that is negative or
///         not finite; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_writer_publish(
    writer: *mut dibs_writer,
    tree: *mut dibs_tree,
    epoch: u32,
    received: u32,
    position_error: f32,
) -> dibs_code {
    dibs_code::of(|| {
        let mut writer = writer.open()?;
        if !(position_error >= 0.0 && position_error.is_finite()) {
            return Err(dibs_code::Argument);
        }
        if writer.0.missing() != 0 {
            return Err(dibs_code::VertexCount);
        }
        let stretch = if tree.is_null() {
            None
        } else {
            Some(measure_stretch(&tree.share()?.tree, &writer.0.back())?)
        };
        let received = Millis(received);
        let label = FrameLabel { epoch, received, position_error, stretch };
        writer.0.publish(label).map_err(|error| match error {
            PublishError::Busy => dibs_code::Held,
            _ => dibs_code::VertexCount,
        })
    })
}
