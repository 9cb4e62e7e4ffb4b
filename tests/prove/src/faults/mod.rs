//! The fault matrix: what becomes of faults on the bus, and of frames on a bad one.

mod board;
mod corruption;
mod matrix;
mod record;
mod sizes;
mod subject;

pub use matrix::{Place, Row};
pub use record::Record;
