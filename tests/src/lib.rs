//! Shared by the tests.

pub mod oracle;
