//! The library of the program `main.rs` and of its tests.

#![allow(missing_docs, reason = "a library of one program")]

pub mod binary;
pub mod bound;
pub mod checks;
pub mod coverage;
pub mod data;
pub mod demo;
pub mod evidence;
pub mod faults;
pub mod footprint;
pub mod harness;
pub mod mutants;
pub mod probe;
pub mod processors;
pub mod profile;
