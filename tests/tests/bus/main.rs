//! From packets to frames: losses, orders, damage and attacks.

mod attacks;
mod authenticity;
mod black_channel;
mod causes;
mod complete;
mod continuous;
mod ecosystem;
mod exhaustive;
mod guard;
mod guard_contacts;
mod guard_embedded;
mod guard_posed;
mod guard_posed_loop;
mod life;
mod line;
mod local;
mod order;
mod partial;
mod posed_packets;
mod properties;
mod published_motion;
mod specification;
mod strangers;
mod time;
mod weights;
mod weights_between;
