//! The program's own tests: it is compiled once, for them and for its user.

mod benchmark;
mod kernels;
mod statistics;
