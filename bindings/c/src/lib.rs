//! The C interface of [`dibs_nostd`]: `include/dibs.h`, which is generated from this crate.
//!
//! Each function checks what it was given, calls the core, and returns a code. Objects live in storage of the caller's.
//! Nothing is allocated and nothing panics, but in the sender, which is for a computer alone. On a board the second is
//! proved by the linker: the panic handler calls a function that does not exist.
//!
//! Names are those of the header. `unsafe` stands in `border`, which trusts the caller's pointers, in `surface`, whose
//! buffers have a size that no type has, and where a struct of the header has pointers.

// Requirement: P-06

#![no_std]
#![allow(non_camel_case_types)]
// Parameters are named in Doxygen's way.
#![allow(clippy::doc_markdown)]

// Brings the host's panic handler, and the sender's memory.
#[cfg(not(target_os = "none"))]
extern crate std;

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
#[cfg(target_os = "none")]
mod panic;
mod query;
mod reader;
mod receiver;
mod scene;
#[cfg(not(target_os = "none"))]
mod sender;
mod surface;
mod sweep;
mod tool;
mod tracker;
mod tree;
mod version;
mod writer;
