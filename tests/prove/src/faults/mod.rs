//! The fault matrix: the outcomes of faults on the bus, and of frames on a bad bus.

mod board;
mod corruption;
mod matrix;
mod record;
mod row;
mod sizes;
mod subject;

pub use matrix::Machine;
pub use record::Record;
pub use row::Row;
