//! The C interface of [`dibs_nostd`]: `include/dibs.h`, which is generated from this crate.
//!
//! Each function checks its arguments, calls the core, and returns a code. Objects are stored in the caller's memory.
//! Nothing is allocated and nothing panics, except in the sender, which is for a host computer only. For a board the
//! linker proves that nothing panics: the panic handler calls a function that does not exist.
//!
//! Names are those of the header. `unsafe` is used only in `border`, which trusts the caller's pointers, in `surface`,
//! whose buffers have a size that no type has, and for structs of the header that contain pointers.

// Requirement: P-06

#![no_std]
#![allow(non_camel_case_types)]
// Parameters are named in Doxygen's way.
#![allow(clippy::doc_markdown)]

// Brings the host's panic handler, and the sender's memory.
#[cfg(not(target_os = "none"))]
extern crate std;

mod account;
mod border;
mod bus;
mod causes;
mod code;
mod constraint;
mod contacts;
mod failsafe;
mod filter;
mod frame;
mod guard;
mod limits;
mod local;
mod outcome;
#[cfg(target_os = "none")]
mod panic;
mod pose;
mod query;
mod reader;
mod receiver;
mod scene;
#[cfg(not(target_os = "none"))]
mod sender;
#[cfg(not(target_os = "none"))]
mod settings;
mod start;
mod surface;
mod sweep;
mod tags;
mod tool;
mod tracker;
mod tree;
mod version;
mod writer;
