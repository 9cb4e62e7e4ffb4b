//! Packets to frames: every loss, order, damage and attack.

mod attacks;
mod authenticity;
mod black_channel;
mod causes;
mod complete;
mod exhaustive;
mod order;
mod partial;
mod properties;
mod specification;
mod weights;
