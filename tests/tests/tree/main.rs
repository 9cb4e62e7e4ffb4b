//! From mesh files to the bytes of a tree: reading, building, the format, and refusals.

mod bounds;
mod construction;
mod coverage;
mod far;
mod format;
mod mesh_files;
mod messages;
mod nasty;
mod readers;
mod readers_damaged;
mod refused;
mod words;
