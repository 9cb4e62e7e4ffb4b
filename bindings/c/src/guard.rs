//! The control tick's end of a guarded surface: from a tool's pose to an answer.

use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::filter::{FilterError, RigidMotion};
use dibs_nostd::glam::Vec3;
use dibs_nostd::guard::{Answer, Guard, Rows};
use dibs_nostd::{Contacts, Interval, Millis, Proximity, TreeBytes, Unavailable};

use crate::border::{Handle, Input, Kind, Out, Output, Storage};
use crate::code::dibs_code;
use crate::constraint::{dibs_force, dibs_wall, dibs_wall_force};
use crate::contacts::dibs_contacts;
use crate::failsafe::dibs_verdict;
use crate::filter::{dibs_admitted_motion, dibs_filter, dibs_rigid_motion};
use crate::limits::dibs_guard_limits;
use crate::query::{STACK, dibs_interval, dibs_proximity};
use crate::reader::{dibs_age, dibs_link};
use crate::surface::{OfNodes, OfVertices, dibs_surface};
use crate::tool::{Shape, dibs_tool, dibs_vec3};
use crate::tracker::{DIBS_OPENED, dibs_tracked};
use crate::tree::{Row, dibs_tree};

/// Bytes of a guard's storage.
pub const DIBS_GUARD_SIZE: usize = 25_344;

/// The control tick's end of a guarded surface: it finds the closest pair of one tool and the present surface, and
/// decides whether to trust the surface.
///
/// One context at a time: the control interrupt, of higher priority than the bus's.
pub struct dibs_guard(TheGuard);

type OfRows<R> = Guard<'static, 'static, Row, STACK, DIBS_OPENED, R, DIBS_OPENED>;

/// For frames of vertices, or of the nodes that move the surface.
enum TheGuard {
    Vertices(OfRows<OfVertices>),
    Nodes(OfRows<OfNodes>),
}

/// Calls a function of the guard, of either kind.
macro_rules! with_guard {
    ($guard:expr, |$own:ident| $call:expr) => {
        match $guard {
            TheGuard::Vertices($own) => $call,
            TheGuard::Nodes($own) => $call,
        }
    };
}

impl TheGuard {
    fn without_pose(&mut self, now: Millis) -> Answer {
        with_guard!(self, |guard| guard.without_pose(now))
    }
}

impl Kind for dibs_guard {
    const MARK: u32 = 0x6462_6718;
    const SIZE: usize = DIBS_GUARD_SIZE;
}

/// Makes the control tick's end of a surface, once. `dibs_start` makes it together with all other objects.
///
/// @param storage  `DIBS_GUARD_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size     Bytes of the storage.
/// @param surface  The surface, in `DIBS_GUARDED_SIZE(vertices)` bytes.
/// @param tree     Its tree.
/// @param limits   The guard's limits: the same as for `dibs_bus_init`.
/// @param guard    Receives the guard's address.
/// @return `DIBS_CODE_OK`; `DIBS_CODE_OTHER_TREE` if the surface's number of rows is not the tree's;
///         `DIBS_CODE_STORAGE_SIZE` also if the surface has only two buffers; `DIBS_CODE_TAKEN` if its end was taken;
///         `DIBS_CODE_LIMIT_ORDER` to `DIBS_CODE_LIMIT_RECOVERY`; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_guard_init(
    storage: *mut c_void,
    size: usize,
    surface: *mut dibs_surface,
    tree: *mut dibs_tree,
    limits: *const dibs_guard_limits,
    guard: *mut *mut dibs_guard,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, guard, || {
            let (surface, tree, limits) = (surface.share()?, tree.share()?, limits.get()?.read()?);
            surface.check_guarded(tree.rows())?;
            let (bytes, notes) = (TreeBytes::new(tree.bytes), &surface.notes);
            let guard = surface.with_reader(|reader| match tree.nodes {
                None => {
                    let tree = (&tree.tree, bytes, OfVertices::of(&tree.tree)?);
                    Ok(TheGuard::Vertices(Guard::new(notes, reader, tree, &limits)?))
                }
                Some(_) => {
                    let tree = (&tree.tree, bytes, OfNodes::of(&tree.tree)?);
                    Ok(TheGuard::Nodes(Guard::new(notes, reader, tree, &limits)?))
                }
            });
            Ok(dibs_guard(guard?))
        })
    })
}

/// The answer of a tick: the pair that a wall may act on, and how it was found.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_answer {
    /// A `dibs_code`: `DIBS_CODE_OK` if there is a pair to act on; otherwise why there is none.
    pub outcome: u32,
    /// The closest pair to act on; NaN if there is none. Its accuracy covers the frame's error, the extrapolation's
    /// error, and the tissue's motion during the surface's lag. If its side is unknown, it is the last pair whose side
    /// was known.
    pub closest: dibs_proximity,
    /// Its certified interval: act on the lower bound. From minus to plus infinity if there is no pair.
    pub interval: dibs_interval,
    /// Velocity (mm/s) of the tool's point of the pair relative to the surface's; without a pair that of the middle of
    /// the axis. Zero at the first tick, NaN without a tool.
    pub velocity: dibs_vec3,
    /// The trust in the surface: state, cause, margin.
    pub trust: dibs_verdict,
    /// The frame that was searched, and its age.
    pub age: dibs_age,
    /// Time (ms) by which the searched surface lags behind the present, as far as its error does not cover it;
    /// `UINT32_MAX` if unknown.
    pub lag: u32,
    /// The health of the bus.
    pub link: dibs_link,
    /// The searched surface, and the pair on it, trusted or not: for records.
    pub searched: dibs_searched_surface,
}

/// The surface that a tick searched.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_searched_surface {
    /// A `dibs_code`: `DIBS_CODE_OK` if there is a pair; otherwise why there is none. Before the first surface all
    /// other fields are 0, and the residual is -1.
    pub outcome: u32,
    /// The pair; NaN if there is none. Its accuracy covers the frame's error and the extrapolation's.
    pub tracked: dibs_tracked,
    /// Number of the frame before the latest one; the same number if the surface is held at the latest frame.
    pub before: u32,
    /// Its time in frame intervals: 0 is the previous frame, 1 the latest one, 3 the end of the extrapolation.
    pub t: f32,
    /// Error (mm) of each position, including that of the extrapolation.
    pub position_error: f32,
    /// The distance (mm) of recent frames from their extrapolation; -1 if the surface is held at the latest frame.
    pub residual: f32,
    /// Its velocity (mm/s) at the pair: from one frame to the next, zero if the surface is held.
    pub velocity: dibs_vec3,
}

impl From<&Answer> for dibs_searched_surface {
    fn from(answer: &Answer) -> Self {
        let searched = answer.searched.as_ref();
        let tracked = answer.tracked.map_or_else(|_| dibs_tracked::nowhere(), dibs_tracked::from);
        Self {
            outcome: answer.tracked.err().map_or(dibs_code::Ok, dibs_code::from) as u32,
            tracked,
            before: searched.map_or(0, |searched| searched.before),
            t: searched.map_or(0.0, |searched| searched.t),
            position_error: searched.map_or(0.0, |searched| searched.position_error),
            residual: searched.and_then(|searched| searched.residual).unwrap_or(-1.0),
            velocity: searched.map_or(Vec3::ZERO, |searched| searched.velocity).into(),
        }
    }
}

impl From<Answer> for dibs_answer {
    fn from(answer: Answer) -> Self {
        let interval = answer.closest.map(|pair| pair.interval());
        let Interval { lower, upper } =
            interval.unwrap_or(Interval { lower: f32::NEG_INFINITY, upper: f32::INFINITY });
        let lag = answer.searched.and_then(|searched| searched.lag);
        Self {
            outcome: answer.closest.err().map_or(dibs_code::Ok, dibs_code::from) as u32,
            closest: answer.closest.unwrap_or(Proximity::NOWHERE).into(),
            interval: dibs_interval { lower, upper },
            velocity: answer.velocity.into(),
            trust: answer.trust.into(),
            age: answer.searched.map(|searched| searched.frame).into(),
            lag: lag.map_or(u32::MAX, |lag| lag.0),
            link: answer.link.into(),
            searched: (&answer).into(),
        }
    }
}

/// The answer of this tick: the closest pair on the latest published surface, extrapolated to now, and whether to trust
/// it.
///
/// Call it at every tick. An error of the query is reported in the answer, and leads to the safe state.
///
/// Cost: at most the budget, and about a thousand instructions.
///
/// @param guard   The guard.
/// @param tool    The tool; null if it has no pose: the answer is then the hold, and the velocity is measured anew.
/// @param now     The receiver's clock, in ms; wraps.
/// @param answer  Receives the answer.
/// @return `DIBS_CODE_OK`, whatever the state; `DIBS_CODE_TOOL_COORDINATE` or `DIBS_CODE_TOOL_RADIUS`, with the same
///         answer as without a pose; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_guard_closest(
    guard: *mut dibs_guard,
    tool: *const dibs_tool,
    now: u32,
    answer: *mut dibs_answer,
) -> dibs_code {
    dibs_code::of(|| {
        let (answer, mut guard, now) = (answer.check()?, guard.open()?, Millis(now));
        let shape = tool.get_if_any()?.map(Shape::try_from).transpose();
        // Without a pose the fail-safe machine still takes its step.
        let found = match &shape {
            Ok(Some(Shape::Sphere(sphere))) => {
                with_guard!(&mut guard.0, |guard| guard.closest(sphere, now))
            }
            Ok(Some(Shape::Capsule(capsule))) => {
                with_guard!(&mut guard.0, |guard| guard.closest(capsule, now))
            }
            Ok(None) | Err(_) => guard.0.without_pose(now),
        };
        conclude(answer, found, shape)
    })
}

/// The answer of a tick, whose tool may have no pose.
fn conclude<S>(
    place: Out<dibs_answer>,
    found: Answer,
    shape: Result<S, dibs_code>,
) -> Result<(), dibs_code> {
    let mut found = dibs_answer::from(found);
    if let Err(code) = shape {
        found.outcome = code as u32;
    }
    place.set(found);
    shape.map(|_| ())
}

/// The answer of this tick, and all locally closest pairs with a separation of at most `margin`, deepest first, within
/// the same budget. Each has the velocity of the surface there, so `dibs_contacts_set_velocities` is not needed.
///
/// Call it instead of `dibs_guard_closest`. Act on the list only if the answer's outcome is `DIBS_CODE_OK`. Unless the
/// side is undefined, its first contact counts: nothing is deeper; beyond the list's bound others may be missing. The
/// list's accuracy includes the surface's error and age.
///
/// Cost: that of `dibs_guard_closest`, and some hundred instructions a contact.
///
/// @param guard     The guard.
/// @param tool      The tool; null if it has no pose: the list is then empty.
/// @param margin    In mm, at least 0.
/// @param now       The receiver's clock, in ms; wraps.
/// @param contacts  The list; empty if there is no surface, or the query failed.
/// @param answer    Receives the answer.
/// @return As `dibs_guard_closest`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_guard_contacts(
    guard: *mut dibs_guard,
    tool: *const dibs_tool,
    margin: f32,
    now: u32,
    contacts: *mut dibs_contacts,
    answer: *mut dibs_answer,
) -> dibs_code {
    dibs_code::of(|| {
        contacts.open()?.fill(|list| {
            let answer = answer.check()?;
            let (mut guard, now) = (guard.open()?, Millis(now));
            let shape = tool.get_if_any()?.map(Shape::try_from).transpose();
            let found = match &shape {
                Ok(Some(Shape::Sphere(sphere))) => {
                    with_guard!(&mut guard.0, |guard| guard.contacts(sphere, margin, now, list))
                }
                Ok(Some(Shape::Capsule(capsule))) => {
                    with_guard!(&mut guard.0, |guard| guard.contacts(capsule, margin, now, list))
                }
                Ok(None) | Err(_) => {
                    *list = Contacts::new();
                    guard.0.without_pose(now)
                }
            };
            conclude(answer, found, shape)
        })
    })
}

/// The answer of this tick, and the motion closest to a commanded one that keeps the tool out of the tissue until the
/// next tick. The period, the tissue's speed, lag and transit time are the guard's. The surface is extrapolated, and
/// its residual is an estimate.
///
/// Call it instead of `dibs_guard_closest`. After an error nothing is admitted: the tool must rest.
///
/// Cost: that of `dibs_guard_closest` and of `dibs_filter_admit`.
///
/// @param guard     The guard.
/// @param filter    The filter.
/// @param tool      The tool as it is now.
/// @param command   The commanded motion.
/// @param now       The receiver's clock, in ms; wraps.
/// @param answer    Receives the answer, even if nothing is admitted; or null.
/// @param admitted  Receives the motion to execute.
/// @return As `dibs_filter_admit`; in the safe state its cause.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_guard_admit(
    guard: *mut dibs_guard,
    filter: *const dibs_filter,
    tool: *const dibs_tool,
    command: *const dibs_rigid_motion,
    now: u32,
    answer: *mut dibs_answer,
    admitted: *mut dibs_admitted_motion,
) -> dibs_code {
    dibs_code::of(|| {
        let (answer, place) = (answer.check_if_any()?, admitted.check()?);
        let (filter, command) = (filter.get()?.read()?, RigidMotion::from(command.get()?));
        let (tool, mut guard, now) = (tool.get()?, guard.open()?, Millis(now));
        let shape = Shape::try_from(tool);
        let (found, admitted) = match &shape {
            Ok(Shape::Sphere(sphere)) => {
                with_guard!(&mut guard.0, |guard| guard.admit(&filter, sphere, &command, now))
            }
            Ok(Shape::Capsule(capsule)) => {
                with_guard!(&mut guard.0, |guard| guard.admit(&filter, capsule, &command, now))
            }
            // Without a pose the fail-safe machine still takes its step.
            Err(_) => {
                let no_pose = FilterError::Untrusted(Unavailable::NoPose);
                (guard.0.without_pose(now), Err(no_pose))
            }
        };
        let mut found = dibs_answer::from(found);
        if let Err(code) = shape {
            found.outcome = code as u32;
        }
        Out::set_if_any(answer, found);
        shape?;
        place.set(admitted?.into());
        Ok(())
    })
}

/// An operator's acknowledgement, which ends the safe state once every input is good again.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_ACKNOWLEDGE` unless the last tick waited for it, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_guard_acknowledge(guard: *mut dibs_guard) -> dibs_code {
    dibs_code::of(|| Ok(with_guard!(&mut guard.open()?.0, |guard| guard.acknowledge())?))
}

/// The force of a wall on the tool, from a tick's answer.
///
/// @param answer  The answer of this tick.
/// @param wall    The wall.
/// @param force   Receives the force.
/// @return As `dibs_wall_force`.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_answer_force(
    answer: *const dibs_answer,
    wall: *const dibs_wall,
    force: *mut dibs_force,
) -> dibs_code {
    match answer.get() {
        Ok(dibs_answer { outcome, closest, velocity, .. }) => {
            dibs_wall_force(wall, outcome, &raw const closest, velocity, force)
        }
        Err(misuse) => misuse,
    }
}
