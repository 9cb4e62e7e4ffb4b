//! The tree as a flat array: its bytes, and the files that hold them.

mod append;
mod emit;
mod fans;
mod flatten;
mod metric;

pub use emit::{BuiltTree, ModesSummary, Summary, summarise};
pub(crate) use flatten::{Facts, flatten};
