//! The C interface: programs in C and C++ that link the library, against the answers of Rust.
//!
//! One program for all, because each would compile the queries of Rust anew.

mod account;
mod corners;
mod filter;
mod guard;
mod header;
mod layers;
mod misuse;
mod nodes;
mod pose;
mod programs;
mod readme;
mod receiver;
mod ros2;
mod script;
mod sender;
mod sweep;
mod tags;
mod weights;
mod wrapper;
