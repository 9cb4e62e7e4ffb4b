//! From mesh files to the bytes of a tree: what is read, built, specified and refused.

mod construction;
mod coverage;
mod far;
mod format;
mod mesh_files;
mod nasty;
mod readers;
mod readers_damaged;
