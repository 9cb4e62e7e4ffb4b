//! The control logic of a robot that keeps its instrument off a beating heart.
//!
//! It compiles for board and host: `no_std`, no allocation, no panic, and no access to hardware. Three contexts:
//!
//! - the control tick, 1 kHz, highest priority: [`Control::tick`] reads the instrument's pose, asks the guard, and
//!   gives the robot a force and records the contacts, or gives it the part of a commanded motion that a filter admits;
//! - bus reception, any lower priority: [`Receiver::bytes`] receives bytes from a serial line,
//!   [`Receiver::packet`] packets that [`network`] finds in Ethernet frames;
//! - the background: [`Receiver::work`] checks complete frames and the tree in flash in slices, and
//!   [`Receiver::report`] writes statuses for the sender.
//!
//! They share a [`Surface`](dibs_nostd::guard::Surface), in which one atomic operation publishes a frame, and
//! [`BusStatus`], counters for the records. [`telemetry`] is the tick's record for the host. A [`Robot`] moves the
//! instrument: a script, or a simulated hand.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod control;
mod fingerprint;
mod hand;
mod instrument;
pub mod network;
mod pushed;
mod receiver;
mod robot;
mod status;
pub mod telemetry;
mod trust;

use core::num::NonZeroU32;

use dibs_nostd::{Millis, Ticks};

pub use control::{
    ContactList, Control, DAMPING, MARGIN, MAX_FORCE, SPEED, SPRING, STAND_OFF, STIFFNESS,
    TICK_INSTRUCTIONS, instructions, start,
};
pub use fingerprint::fingerprint;
pub use hand::Hand;
pub use instrument::instrument;
pub use pushed::{ACCOUNT, PushedRobot};
pub use receiver::{MTU, Receiver, STATUS_FRAMED, STATUS_MTU};
pub use robot::{Either, Robot, Script};
pub use status::BusStatus;
pub use trust::{DWELL, Trust};

// The surface: `build.rs` has written its tree.
dibs_nostd::include_tree!("surface");

/// Control ticks a second.
pub const TICK_RATE: u32 = 1_000;

/// Duration of a control tick (s).
pub const PERIOD: f32 = 1.0 / TICK_RATE as f32;

/// The receiver's clock at this many control ticks after the start.
#[must_use]
pub const fn time_of(ticks: Ticks) -> Millis {
    const RATE: NonZeroU32 = NonZeroU32::new(TICK_RATE).unwrap();
    ticks.at_rate(RATE)
}
