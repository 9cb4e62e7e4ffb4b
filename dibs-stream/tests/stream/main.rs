//! The sender, its transports and the fault injector, as one program, so that the library is linked once.

mod sender;
mod transport;
