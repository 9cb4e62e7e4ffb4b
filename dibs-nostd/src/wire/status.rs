//! The receiver's report to the sender.

use crate::tree::SurfaceFacts;

/// The frame that the receiver has published, and its requests.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Status {
    /// The last published frame; `None` before the first.
    pub published: Option<PublishedStatus>,
    /// Partial frames were refused because of their base: send a whole frame.
    pub wants_whole: bool,
    /// The controller's safety state: 0 not reported, 1 nominal, 2 degraded, 3 safe.
    pub safety: u8,
    /// Number of the status in the receiver's run; wraps.
    pub number: u32,
    /// The receiver's clock at this status, in ms: the sender's next frames echo it.
    pub clock: u32,
    /// The answer to a [`Hello`](super::Hello), if this is one: the status then has no counters and no stretch.
    pub answer: Option<StatusAnswer>,
}

/// The answer to a hello.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StatusAnswer {
    /// The hello's nonce.
    pub nonce: u64,
    /// The number to which the receiver's tags are bound: [`Mac::challenge`](super::Mac::challenge).
    pub challenge: u64,
    /// The receiver's surface.
    pub surface: SurfaceFacts,
}

/// The acknowledgement of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PublishedStatus {
    /// Its session.
    pub session: u32,
    /// Its number.
    pub epoch: u32,
    /// Time since its first packet arrived, plus its age at sending, in ms.
    pub age_ms: u32,
    /// Its measured stretch; `None` if the receiver does not measure it, and in an answer.
    pub stretch: Option<f32>,
}

/// A status with some of the receiver's counters. [`Counters::update`](super::Counters::update) collects them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatusReport<'a> {
    /// The status.
    pub status: Status,
    /// Index of the packet's first counter.
    pub first_counter: u8,
    /// The counters, not decoded.
    pub counters: &'a [[u8; 4]],
}
