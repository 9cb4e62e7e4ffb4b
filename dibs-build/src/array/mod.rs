//! The tree as a flat array: its bytes, and the files that hold them.

mod adjacency;
#[cfg(feature = "modes")]
mod append;
mod emit;
mod flatten;
mod metric;
#[cfg(feature = "modes")]
mod modal;
mod module;

pub use emit::{BuiltTree, ModesSummary, Summary, summarise};
pub(crate) use flatten::{Facts, flatten};
