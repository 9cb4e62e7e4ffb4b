//! The fail-safe machine: when to stop trusting the surface.

use core::ffi::c_void;

use bytemuck::AnyBitPattern;
use dibs_nostd::failsafe::{
    FailSafe, LimitError, Limits, Observation, State, ThresholdPair, Verdict,
};
use dibs_nostd::{Millis, Proximity, QueryError, Unavailable};

use crate::border::{Handle, Input, Kind, Output, Storage};
use crate::code::dibs_code;
use crate::query::dibs_proximity;
use crate::reader::{dibs_age, dibs_link};

/// Bytes of a machine's storage.
pub const DIBS_FAILSAFE_SIZE: usize = 192;

/// Stands for any code of [`dibs_observation::query`]: the machine only needs to know that there is an error; its code
/// is stored beside it.
const NO_ANSWER: Unavailable = Unavailable::Query(QueryError::NoAdjacency);

/// The machine. It starts in the safe state.
///
/// One context at a time.
pub struct dibs_failsafe {
    machine: FailSafe,
    /// Code of the last query error that was seen.
    query: dibs_code,
}

impl Kind for dibs_failsafe {
    const MARK: u32 = 0x6462_7312;
    const SIZE: usize = DIBS_FAILSAFE_SIZE;
}

/// Two limits on one input: above the first the state is degraded, above the second safe. Both `DIBS_UNLIMITED` if the
/// input has no limits; otherwise below 2^31.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_watch {
    /// The first limit.
    pub degraded: u32,
    /// The second limit, at least the first.
    pub safe: u32,
}

impl dibs_watch {
    const OFF: (u32, u32) = (u32::MAX, u32::MAX);
}

impl TryFrom<dibs_watch> for ThresholdPair {
    type Error = LimitError;

    fn try_from(dibs_watch { degraded, safe }: dibs_watch) -> Result<Self, LimitError> {
        if (degraded, safe) == dibs_watch::OFF {
            return Ok(Self::OFF);
        }
        Self::new(Millis(degraded), Millis(safe))
    }
}

impl TryFrom<dibs_watch> for ThresholdPair<u32> {
    type Error = LimitError;

    fn try_from(dibs_watch { degraded, safe }: dibs_watch) -> Result<Self, LimitError> {
        if (degraded, safe) == dibs_watch::OFF {
            return Ok(Self::OFF);
        }
        Self::count(degraded, safe)
    }
}

/// The machine's limits. Times are in ms.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_limits {
    /// Age of the surface; must have limits.
    pub age: dibs_watch,
    /// Time since any good packet.
    pub silence: dibs_watch,
    /// Time since the last heartbeat.
    pub heartbeat: dibs_watch,
    /// Frames refused or abandoned since the last one was published.
    pub rejections: dibs_watch,
    /// Transit time of the published frame. With `DIBS_UNLIMITED` it has no limit, and is covered by the margin.
    pub transit: dibs_watch,
    /// Age of the published frame when it was sent; a safe limit is below 65,534.
    pub source_age: dibs_watch,
    /// Forged packets, minus 10 for each second; the limits are below 1,000.
    pub forgeries: dibs_watch,
    /// Largest speed of any point of the tissue, in mm per ms (m/s); at least 0.
    pub tissue_speed: f32,
    /// Consecutive good frames that recover: 1 to 65,535.
    pub recovery_frames: u32,
    /// Consecutive steps with every input within its first limit, before recovery.
    pub dwell: u32,
    /// Other than 0 to omit the transit time from the margin and the limits: a delay is then not detected.
    pub without_transit: u32,
    /// 0 to leave the safe state only by an acknowledgement; otherwise automatically.
    pub automatic: u32,
}

impl TryFrom<dibs_limits> for Limits {
    type Error = LimitError;

    fn try_from(given: dibs_limits) -> Result<Self, LimitError> {
        // Beyond the largest possible number there is no valid limit.
        let frames = u16::try_from(given.recovery_frames).unwrap_or(0);
        let limits = Self::new(given.age.try_into()?, given.tissue_speed)?
            .recovery(frames)?
            .silence(given.silence.try_into()?)
            .heartbeat(given.heartbeat.try_into()?)
            .rejections(given.rejections.try_into()?)
            .transit(given.transit.try_into()?)
            .source_age(given.source_age.try_into()?)?
            .forgeries(given.forgeries.try_into()?)?
            .dwell(given.dwell);
        let limits = if given.without_transit == 0 { limits } else { limits.without_transit() };
        Ok(if given.automatic == 0 { limits } else { limits.automatic() })
    }
}

/// Makes a machine.
///
/// @param storage   `DIBS_FAILSAFE_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size      Bytes of the storage.
/// @param limits    Its limits.
/// @param failsafe  Receives the machine's address.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_LIMIT_ORDER` to `DIBS_CODE_LIMIT_RECOVERY`, `DIBS_CODE_LIMIT_UNTRIPPABLE`, or a
///         misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_failsafe_init(
    storage: *mut c_void,
    size: usize,
    limits: *const dibs_limits,
    failsafe: *mut *mut dibs_failsafe,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, failsafe, || {
            let machine = FailSafe::new(limits.get()?.try_into()?);
            Ok(dibs_failsafe { machine, query: dibs_code::QueryFailed })
        })
    })
}

/// The input of a step.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_observation {
    /// The published frame and its age, from `dibs_reader_latest`.
    pub age: dibs_age,
    /// The bus's health, from `dibs_reader_link`.
    pub link: dibs_link,
    /// Code of the query on that frame: `DIBS_CODE_OK` if it gave an answer, or there was no query.
    pub query: u32,
    /// Other than 0 once `dibs_scrub_step` has found the tree's bytes changed. Leave it set.
    pub is_tree_corrupt: u32,
}

/// Trust in the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum dibs_state {
    /// Every input is within its limits.
    Nominal = 0,
    /// The surface may be acted on, with a growing margin.
    Degraded = 1,
    /// The surface must not be acted on.
    Safe = 2,
}

/// The result of a step.
#[derive(Clone, Copy, AnyBitPattern)]
#[repr(C)]
pub struct dibs_verdict {
    /// A `dibs_state`.
    pub state: u32,
    /// Cause of a state that is not nominal: a `dibs_code`.
    pub cause: u32,
    /// Largest motion of the tissue (mm) in the surface's age and transit time.
    pub margin: f32,
    /// 1 if only an acknowledgement is missing to leave the safe state; else 0.
    pub waits_for_acknowledgement: u32,
}

impl From<Verdict> for dibs_verdict {
    fn from(found: Verdict) -> Self {
        Self {
            state: found.state as u32,
            cause: found.cause.map_or(dibs_code::Ok, dibs_code::from) as u32,
            margin: found.margin,
            waits_for_acknowledgement: found.waits_for_acknowledgement.into(),
        }
    }
}

/// One control tick of the machine.
///
/// Cost: a comparison of two limits for each input.
///
/// @return `DIBS_CODE_OK`, whatever the state; `DIBS_CODE_ARGUMENT` for an invalid code of the query; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_failsafe_step(
    failsafe: *mut dibs_failsafe,
    seen: *const dibs_observation,
    verdict: *mut dibs_verdict,
) -> dibs_code {
    dibs_code::of(|| {
        let (verdict, seen) = (verdict.check()?, seen.get()?);
        let query = dibs_code::from_number(seen.query).ok_or(dibs_code::Argument)?;
        let mut failsafe = failsafe.open()?;
        if query != dibs_code::Ok {
            failsafe.query = query;
        }
        let found = failsafe.machine.step(&Observation {
            frame: seen.age.into(),
            lag: None,
            link: seen.link.into(),
            no_answer: (query != dibs_code::Ok).then_some(NO_ANSWER),
            is_tree_corrupt: seen.is_tree_corrupt != 0,
        });
        let mut given = dibs_verdict::from(found);
        if found.cause == Some(NO_ANSWER) {
            given.cause = failsafe.query as u32;
        }
        verdict.set(given);
        Ok(())
    })
}

const _: () = assert!(State::Nominal as u32 == dibs_state::Nominal as u32);
const _: () = assert!(State::Degraded as u32 == dibs_state::Degraded as u32);
const _: () = assert!(State::Safe as u32 == dibs_state::Safe as u32);

/// An operator's acknowledgement: the next step leaves the safe state if its inputs are within their limits.
///
/// @return `DIBS_CODE_OK`, `DIBS_CODE_ACKNOWLEDGE` unless the last step waited for it, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_failsafe_acknowledge(failsafe: *mut dibs_failsafe) -> dibs_code {
    dibs_code::of(|| Ok(failsafe.open()?.machine.acknowledge()?))
}

/// Widens an answer by the verdict's margin, if it may be acted on.
///
/// @param verdict    The verdict of this tick.
/// @param proximity  The answer of this tick, which is widened.
/// @return `DIBS_CODE_OK`; in the safe state the cause, to be passed on to a wall; `DIBS_CODE_ARGUMENT` for numbers
///         that are not a state or a code; or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_verdict_admit(
    verdict: *const dibs_verdict,
    proximity: *mut dibs_proximity,
) -> dibs_code {
    dibs_code::of(|| {
        let (verdict, place) = (verdict.get()?, proximity.check()?);
        let cause = dibs_code::from_number(verdict.cause).ok_or(dibs_code::Argument)?;
        if verdict.state == dibs_state::Safe as u32 {
            return Err(if cause == dibs_code::Ok { dibs_code::NoSurface } else { cause });
        }
        if verdict.state > dibs_state::Safe as u32 {
            return Err(dibs_code::Argument);
        }
        let found = Proximity::try_from(place.get())?;
        place.set(found.widened(verdict.margin).into());
        Ok(())
    })
}
