//! The tree as a flat array: its bytes, and the files that hold them.

mod emit;
mod flatten;
mod metric;

pub use emit::{BuiltTree, Summary, summarise};
pub(crate) use flatten::{Facts, flatten};
