//! The imaging side, on a host computer: sends a moving surface to a controller over a serial line or a socket.

use core::ffi::{c_char, c_void};
use std::boxed::Box;
use std::string::{String, ToString};
use std::time::Duration;
use std::vec::Vec;

use dibs_nostd::RigidPose;
use dibs_nostd::glam::{Quat, Vec3};
use dibs_nostd::wire::{AesCmac, Content, Event};
use dibs_stream::transport::{Line, Target};
use dibs_stream::{SendError, Sender, SentFrame, Settings, SurfaceOrder};

use crate::border::{Handle, Input, Kind, Out, Output, Storage, text};
use crate::code::dibs_code;
use crate::frame::rows;
use crate::pose::dibs_pose;
use crate::receiver::DIBS_EVENTS;
use crate::settings::dibs_sender_settings;
use crate::tags;
use crate::tree::dibs_tree;

/// Bytes of a sender's storage.
pub const DIBS_SENDER_SIZE: usize = 1_024;

/// The age of a frame whose time of capture is unknown: the frame counts as captured when it is sent, unless it equals
/// the last one in every bit.
pub const DIBS_AGE_UNKNOWN: u32 = u32::MAX;

/// Largest packet, in bytes.
const MTU: usize = 1_024;

/// Sends the frames of a moving surface to a controller, and receives statuses.
///
/// Only in the library for a host computer. Its calls wait for the line, so they do not belong in a control loop.
/// Unlike the other objects it allocates when it starts, and has a thread that reads the line: `dibs_sender_close` ends
/// both. Another `dibs_sender_init` in the same storage without it leaks them.
pub struct dibs_sender {
    sender: TheSender,
    /// Positions of the present frame, in memory that is reused.
    positions: Vec<Vec3>,
    /// The text of the last error.
    error: String,
}

/// Of packets without tags, or with them.
enum TheSender {
    Untagged(Box<Sender<Line, MTU>>),
    Tagged(Box<Sender<Line, MTU, AesCmac>>),
}

/// Calls a function of the sender, of either kind.
macro_rules! with_sender {
    ($sender:expr, |$own:ident| $call:expr) => {
        match $sender {
            TheSender::Untagged($own) => $call,
            TheSender::Tagged($own) => $call,
        }
    };
}

impl Kind for dibs_sender {
    const MARK: u32 = 0x6462_7318;
    const SIZE: usize = DIBS_SENDER_SIZE;
}

/// A frame that was sent.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_sent_frame {
    /// Its number.
    pub epoch: u32,
    /// 0 for a whole frame.
    pub is_partial: u32,
    /// Number of rows in it.
    pub rows: u32,
    /// Number of its packets.
    pub packets: u32,
    /// Bytes of its packets, without the framing of a serial line.
    pub bytes: u32,
    /// Largest distance (mm) of a vertex from its position at the receiver.
    pub error: f32,
}

impl From<SentFrame> for dibs_sent_frame {
    fn from(sent: SentFrame) -> Self {
        Self {
            epoch: sent.epoch,
            is_partial: u32::from(sent.content != Content::Whole),
            rows: sent.rows as u32,
            packets: sent.packets as u32,
            bytes: sent.bytes as u32,
            error: sent.error,
        }
    }
}

impl dibs_sender {
    fn of(sender: TheSender) -> Self {
        Self { sender, positions: Vec::new(), error: String::new() }
    }

    /// Stores an error's text.
    fn keep(&mut self, error: &SendError) -> dibs_code {
        use core::fmt::Write;
        self.error.clear();
        // Writing to a string cannot fail.
        let _ = write!(self.error, "{error}");
        match error {
            SendError::Line(_) => dibs_code::SenderLine,
            SendError::Superseded { .. } => dibs_code::SenderSuperseded,
            SendError::OtherSurface { .. } => dibs_code::SenderOtherSurface,
            SendError::NoChallenge => dibs_code::SenderNoChallenge,
            _ => dibs_code::SenderFrame,
        }
    }
}

/// Connects to a controller, and makes the sender of a surface.
///
/// @param storage   `DIBS_SENDER_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size      Bytes of the storage.
/// @param tree      The surface's tree: the controller's, or one built from the same mesh in the same way. Not used
///                  after the call.
/// @param target    `udp:HOST:PORT`, `tcp:HOST:PORT`, `serial:PORT@BAUD` or `unix:PATH`, ended by a zero.
/// @param settings  How to send; or null for `dibs_sender_settings_of`.
/// @param sender    Receives the sender's address.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_SENDER_TARGET` for a target that is invalid or cannot be opened; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_init(
    storage: *mut c_void,
    size: usize,
    tree: *mut dibs_tree,
    target: *const c_char,
    settings: *const dibs_sender_settings,
    sender: *mut *mut dibs_sender,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, sender, || {
            let (line, order, settings) = ends(tree, target, settings)?;
            let sender = Sender::new(line, order, settings);
            Ok(dibs_sender::of(TheSender::Untagged(Box::new(sender))))
        })
    })
}

/// The same, for a receiver that demands tags. `dibs_sender_poll` asks it for its challenge; until the answer arrives, no
/// frame can be sent.
///
/// @param storage   As for `dibs_sender_init`.
/// @param size      Bytes of the storage.
/// @param tree      The surface's tree.
/// @param target    As for `dibs_sender_init`.
/// @param settings  How to send; or null.
/// @param key       `DIBS_KEY` bytes that the receiver has, too. Not used after the call.
/// @param receiver  The receiver's number, as in its `dibs_tags_init`.
/// @param sender    Receives the sender's address.
/// @return As `dibs_sender_init`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_init_with_key(
    storage: *mut c_void,
    size: usize,
    tree: *mut dibs_tree,
    target: *const c_char,
    settings: *const dibs_sender_settings,
    key: *const u8,
    receiver: u32,
    sender: *mut *mut dibs_sender,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, sender, || {
            let key = tags::key(key)?;
            let (line, order, settings) = ends(tree, target, settings)?;
            let keyed_mac = move |challenge| AesCmac::new(&key, receiver, challenge);
            let sender = Sender::with_mac(line, order, settings, keyed_mac);
            Ok(dibs_sender::of(TheSender::Tagged(Box::new(sender))))
        })
    })
}

/// The line, the surface and the settings of a sender.
fn ends(
    tree: *mut dibs_tree,
    target: *const c_char,
    settings: *const dibs_sender_settings,
) -> Result<(Line, SurfaceOrder, Settings), dibs_code> {
    let (tree, target) = (tree.share()?, text(target)?);
    let settings = match settings.get_if_any()? {
        Some(settings) => settings.try_into()?,
        None => Settings::default(),
    };
    let target: Target = target.parse().map_err(|_| dibs_code::SenderTarget)?;
    let line = target.open().map_err(|_| dibs_code::SenderTarget)?;
    Ok((line, SurfaceOrder::of(&tree.tree), settings))
}

/// Sets the challenge that the receiver gave to its `dibs_tags_init`, for a line without a way back: over any other line the
/// receiver reports it.
///
/// @return `DIBS_CODE_OK`; `DIBS_CODE_ARGUMENT` if the sender has no key; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_challenge(sender: *mut dibs_sender, challenge: u64) -> dibs_code {
    dibs_code::of(|| match &mut sender.open()?.sender {
        TheSender::Untagged(_) => Err(dibs_code::Argument),
        TheSender::Tagged(sender) => {
            sender.challenge(challenge);
            Ok(())
        }
    })
}

/// Sends a frame, with heartbeats between its packets when due. From the third whole frame on over UDP, this thread
/// allocates nothing.
///
/// @param sender     The sender.
/// @param positions  x, y and z (mm, less the tree's origin) of each vertex of the mesh's file, in that file's order;
///                   or of each node that carries the surface.
/// @param count      Their number.
/// @param age        Time (ms) since the surface was captured; or `DIBS_AGE_UNKNOWN`.
/// @param sent       Receives the frame's number and size; or null.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_SENDER_FRAME` for positions that are not a frame of the surface: nothing was
///         sent; `DIBS_CODE_SENDER_LINE` if the connection broke: close the sender, and make another;
///         `DIBS_CODE_SENDER_NO_CHALLENGE` with a key, before `dibs_sender_poll` has met the receiver's challenge;
///         `DIBS_CODE_SENDER_SUPERSEDED`; `DIBS_CODE_SENDER_OTHER_SURFACE`; or a misuse. `dibs_sender_error` has the
///         full text.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_send(
    sender: *mut dibs_sender,
    positions: *const f32,
    count: u32,
    age: u32,
    sent: *mut dibs_sent_frame,
) -> dibs_code {
    dibs_code::of(|| send(sender, positions, count, None, age, sent))
}

/// The same as `dibs_sender_send`, for a mesh at a rigid pose. For a `dibs_bus`; a `dibs_receiver` refuses such frames.
///
/// @param sender     The sender.
/// @param positions  As for `dibs_sender_send`: those of the mesh's own frame.
/// @param count      Their number.
/// @param pose       The pose, read during the call.
/// @param age        Time (ms) since the older of positions and pose was measured. It must be stated, since the same
///                   positions at a new pose may be a rigid mesh, or a source that has stopped.
/// @param sent       Receives the frame's number and size; or null.
/// @return As `dibs_sender_send`; `DIBS_CODE_SENDER_FRAME` also for numbers that are no pose, and `DIBS_CODE_ARGUMENT`
///         for `DIBS_AGE_UNKNOWN`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_send_at(
    sender: *mut dibs_sender,
    positions: *const f32,
    count: u32,
    pose: *const dibs_pose,
    age: u32,
    sent: *mut dibs_sent_frame,
) -> dibs_code {
    dibs_code::of(|| send(sender, positions, count, Some(pose.get()?), age, sent))
}

fn send(
    sender: *mut dibs_sender,
    positions: *const f32,
    count: u32,
    pose: Option<dibs_pose>,
    age: u32,
    sent: *mut dibs_sent_frame,
) -> Result<(), dibs_code> {
    let (sent, mut sender, rows) = (sent.check_if_any()?, sender.open()?, rows(positions, count)?);
    let dibs_sender { sender: own, positions, .. } = &mut *sender;
    positions.clear();
    positions.extend(rows.iter().copied().map(Vec3::from_array));
    let ago = (age != DIBS_AGE_UNKNOWN).then_some(Duration::from_millis(age.into()));
    let outcome = match (pose.map(<(Quat, Vec3)>::from), ago) {
        (None, None) => with_sender!(own, |own| own.send(positions)),
        (None, Some(ago)) => with_sender!(own, |own| own.send_captured(positions, ago)),
        (Some(_), None) => return Err(dibs_code::Argument),
        (Some((rotation, shift)), Some(ago)) => RigidPose::new(rotation, shift)
            .map_err(SendError::from)
            .and_then(|pose| with_sender!(own, |own| own.send_at(positions, pose, ago))),
    };
    let outcome = outcome.map_err(|error| sender.keep(&error))?;
    Out::set_if_any(sent, outcome.into());
    Ok(())
}

/// Sends a heartbeat if one is due, and receives the statuses that have arrived. Does not wait. Call it a few times
/// between two heartbeats: otherwise the controller considers the link lost, and no transit time is measured.
///
/// @return As `dibs_sender_send`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_poll(sender: *mut dibs_sender) -> dibs_code {
    dibs_code::of(|| {
        let mut sender = sender.open()?;
        let polled = with_sender!(&mut sender.sender, |own| own.poll());
        polled.map_err(|error| sender.keep(&error))
    })
}

/// The text of a sender's last error.
///
/// @param sender    The sender.
/// @param text      Receives the zero-terminated text; empty before the first error.
/// @param capacity  Size of `text` in bytes.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_CAPACITY`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_error(
    sender: *mut dibs_sender,
    text: *mut u8,
    capacity: usize,
) -> dibs_code {
    dibs_code::of(|| {
        let (out, sender) = (text.places(capacity)?, sender.open()?);
        let mut sentence = sender.error.to_string();
        sentence.push('\0');
        out.fill(sentence.as_bytes()).map(|_| ())
    })
}

/// State of a sender.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct dibs_sender_facts {
    /// Frames sent since the start.
    pub frames: u32,
    /// Statuses received.
    pub statuses: u32,
    /// Frames that the receiver has not acknowledged.
    pub in_flight: u32,
    /// 0 until the receiver has published a frame of this sender; `acknowledged` is then 0 as well.
    pub is_acknowledged: u32,
    /// Number of the latest acknowledged frame.
    pub acknowledged: u32,
    /// Whether frames can be sent: without a key always, with a key once the receiver's challenge is known.
    pub is_ready: u32,
}

/// Reads the state of a sender.
///
/// @param sender    The sender.
/// @param facts     Receives the state.
/// @param counters  Room for `DIBS_EVENTS` numbers: the receiver's count of each event, in the order of
///                  `dibs_event_name`, as its statuses report it; or null.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_get_facts(
    sender: *mut dibs_sender,
    facts: *mut dibs_sender_facts,
    counters: *mut u32,
) -> dibs_code {
    dibs_code::of(|| {
        let (facts, sender) = (facts.check()?, sender.open()?);
        if !counters.is_null() {
            let all = with_sender!(&sender.sender, |own| own.counters());
            counters.places(DIBS_EVENTS)?.fill(&Event::ALL.map(|event| all.of(event)))?;
        }
        facts.set(with_sender!(&sender.sender, |own| dibs_sender_facts {
            frames: own.totals().frames as u32,
            statuses: own.totals().statuses as u32,
            in_flight: own.in_flight(),
            is_acknowledged: own.acknowledged().is_some().into(),
            acknowledged: own.acknowledged().unwrap_or(0),
            is_ready: own.is_ready().into(),
        }));
        Ok(())
    })
}

/// Ends the connection. The storage then holds no sender.
///
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_sender_close(sender: *mut dibs_sender) -> dibs_code {
    dibs_code::of(|| {
        drop(sender.take()?);
        Ok(())
    })
}
