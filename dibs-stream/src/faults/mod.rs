//! Injects faults between sender and receiver: seeded, reproducible.
//!
//! [`Injector`] changes packets as a bad line, a bad sender or an attacker would. Put it between any sender and any
//! receiver; [`FaultyLine`] does so for a [`Line`](crate::transport::Line).
//!
//! Faults for a layer above the checksum are *sealed*: their checksum is corrected, as if the sender had made the
//! error. Tags cannot be corrected without the key.
//!
//! ```
//! use dibs_stream::faults::{Fault, Injector};
//! use dibs_nostd::wire::{FrameId, NoMac, Packet, PacketError, encode_heartbeat};
//!
//! let mut buffer = [0; 64];
//! let id = FrameId { mesh_id: 0xB0D1, session: 1, epoch: 1 };
//! let packet = encode_heartbeat(&id, 1, None, &NoMac, &mut buffer);
//! let mut injector = Injector::new(7);
//! assert_eq!(injector.pass(packet), [packet]);
//! let damaged = injector.inject(Fault::FlipTwo, packet).expect("any packet can be damaged");
//! assert!(matches!(Packet::decode(&damaged[0]), Err(PacketError::Checksum { .. })));
//! ```

mod fault;
mod injector;
mod line;

pub use fault::Fault;
pub use injector::Injector;
pub use line::FaultyLine;
