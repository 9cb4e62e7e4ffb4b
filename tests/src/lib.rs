//! Shared by the tests.

pub mod ask;
pub mod deform;
pub mod oracle;
pub mod poses;
pub mod stretch;
