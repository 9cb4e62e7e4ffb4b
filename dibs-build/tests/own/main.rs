//! The tests of the `dibs` program, and of what it is made of: one program, which links the library once.

mod bulk;
mod cli;
mod cli_motion;
mod far;
mod formats;
mod manners;
mod placement;
mod program;
mod sender;
mod stream;
mod transport;
