//! The tests of the `dibs` program and of its parts, as one program, so that the library is linked once.

mod another_mesh;
mod bulk;
mod cli;
mod cli_motion;
mod components;
mod dialects;
mod far;
mod formats;
mod groups;
mod labels;
mod manners;
mod overwrite;
mod pace;
mod placement;
mod program;
mod sender;
mod stream;
mod transport;
mod view;
mod writers;
