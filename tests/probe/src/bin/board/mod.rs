//! The emulated board of a program that answers a script: clock, exit code, and the files of the computer.

#[cfg(not(m55))]
mod clock;
#[cfg(m55)]
#[path = "clock_m55.rs"]
mod clock;
mod exit;
mod files;
mod machine;

pub use machine::answer;
