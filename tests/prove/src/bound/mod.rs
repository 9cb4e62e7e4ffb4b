//! A path bound: the most instructions that a query of a linked program can take.
//!
//! The program is read from its ELF file ([`image`], [`decode`]) as a control flow graph ([`graph`]) with its loops
//! ([`loops`]). Flow facts ([`facts`]) are located in it by the debug information ([`lines`], [`system`]). A linear
//! program computes their prices (dual values, [`prices`]), and an exact search for the longest walk checks that the
//! prices give a bound ([`walk`]). [`queries`] lists the kinds of queries with a bound; [`trace`] and [`follow`]
//! compare graph and facts with the execution on an emulated processor, [`second`] each instruction with another decoder;
//! [`cycles`] weighs each by a model of the processor. [`core_items`] lists what a tick executes of the
//! language's own library.

// Requirement: A-06

pub mod analysis;
pub mod core_items;
pub mod cycles;
pub mod decode;
pub mod depth;
pub mod facts;
pub mod follow;
pub mod graph;
pub mod image;
pub mod lines;
pub mod loops;
pub mod poses;
pub mod prices;
pub mod queries;
pub mod report;
pub mod second;
pub mod sided;
pub mod system;
pub mod ticks;
pub mod trace;
pub mod tracked;
pub mod walk;
