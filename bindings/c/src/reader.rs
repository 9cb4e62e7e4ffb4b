//! The control tick's end of a surface.

use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::failsafe::Link;
use dibs_nostd::{FrameAge, Millis};

use crate::border::{Handle, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::frame::{Table, dibs_frame};
use crate::surface::{HeldFrame, Reader, dibs_surface};

/// Bytes of a reader's storage.
pub const DIBS_READER_SIZE: usize = 128;

/// Reads the latest published frame.
///
/// One context at a time: the control interrupt.
pub struct dibs_reader {
    reader: Reader,
    surface: &'static dibs_surface,
}

impl Kind for dibs_reader {
    const MARK: u32 = 0x6462_6510;
    const SIZE: usize = DIBS_READER_SIZE;
}

/// The latest published frame, and its age.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_age {
    /// 0 before the first frame; all other fields are then 0 as well.
    pub is_published: u32,
    /// Number of the frame; wraps.
    pub epoch: u32,
    /// Arrival of its first packet, on the receiver's clock; wraps.
    pub received: u32,
    /// Time since then, in the clock's unit.
    pub age: u32,
}

impl From<Option<FrameAge>> for dibs_age {
    fn from(frame: Option<FrameAge>) -> Self {
        match frame {
            None => Self { is_published: 0, epoch: 0, received: 0, age: 0 },
            Some(FrameAge { epoch, received: Millis(received), age: Millis(age) }) => {
                Self { is_published: 1, epoch, received, age }
            }
        }
    }
}

impl From<dibs_age> for Option<FrameAge> {
    fn from(dibs_age { is_published, epoch, received, age }: dibs_age) -> Self {
        (is_published != 0).then_some(FrameAge {
            epoch,
            received: Millis(received),
            age: Millis(age),
        })
    }
}

/// The health of the bus. Times in ms, `UINT32_MAX` if unknown.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_link {
    /// Time since the last good packet.
    pub silence: u32,
    /// Time since the last heartbeat.
    pub heartbeat: u32,
    /// Frames refused or abandoned since the last one was published.
    pub rejections: u32,
    /// Packets without an authentic tag, minus 10 for each second.
    pub forgeries: u32,
    /// Upper bound on the transit time of the published frame.
    pub transit: u32,
    /// Age of the published frame when it was sent.
    pub source_age: u32,
}

impl From<Link> for dibs_link {
    fn from(link: Link) -> Self {
        let Link { silence, heartbeat, rejections, forgeries, transit, source_age } = link;
        Self {
            silence: silence.0,
            heartbeat: heartbeat.0,
            rejections,
            forgeries,
            transit: transit.0,
            source_age: source_age.0,
        }
    }
}

impl From<dibs_link> for Link {
    fn from(link: dibs_link) -> Self {
        let dibs_link { silence, heartbeat, rejections, forgeries, transit, source_age } = link;
        Self {
            silence: Millis(silence),
            heartbeat: Millis(heartbeat),
            rejections,
            forgeries,
            transit: Millis(transit),
            source_age: Millis(source_age),
        }
    }
}

/// Makes the reader of a surface, once.
///
/// @param storage  `DIBS_READER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param surface  The surface.
/// @param reader   Receives the reader's address.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_TAKEN` if the surface has a reader already, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_reader_init(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    reader: *mut *mut dibs_reader,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, reader, || {
            let surface = surface.share()?;
            Ok(dibs_reader { reader: surface.take_reader()?, surface })
        })
    })
}

/// Holds the latest published frame, if it is not too old. Until it is released no frame is published, so release it
/// after the tick's queries.
///
/// @param reader  The reader.
/// @param now     The receiver's clock, in ms; wraps.
/// @param limit   Largest age, in ms; UINT32_MAX leaves the age to the fail-safe machine.
/// @param frame   Holds the frame; a frame that it held before is released.
/// @param age     Receives its age, even if it is too old; or null.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_NO_SURFACE`, `DIBS_CODE_STALE`, `DIBS_CODE_HELD` if another frame holds one of
///         this surface, or a misuse. After an error the frame is empty.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_reader_latest(
    reader: *mut dibs_reader,
    now: u32,
    limit: u32,
    frame: *mut dibs_frame,
    age: *mut dibs_age,
) -> dibs_code {
    dibs_code::of(|| {
        let mut frame = frame.open()?;
        frame.table = Table::Empty;
        let (age, mut reader) = (age.check_if_any()?, reader.open()?);
        let hold = reader.surface.hold()?;
        let latest = reader.reader.latest(Millis(now));
        Out::set_if_any(age, latest.frame().into());
        frame.table = Table::Held(HeldFrame::new(latest.within(Millis(limit))?, hold));
        Ok(())
    })
}

/// The health of the bus at `now`, on the receiver's clock in ms.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_reader_link(
    reader: *mut dibs_reader,
    now: u32,
    link: *mut dibs_link,
) -> dibs_code {
    dibs_code::of(|| {
        let (link, reader) = (link.check()?, reader.open()?);
        link.set(reader.surface.notes.link().read(Millis(now)).into());
        Ok(())
    })
}
