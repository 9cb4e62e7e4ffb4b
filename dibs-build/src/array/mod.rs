//! The tree as a flat array: its bytes, and the files that hold them.

mod adjacency;
mod emit;
mod flatten;
mod metric;
#[cfg(feature = "modes")]
mod modal;
mod module;
mod sections;
mod solids;

pub use emit::{BuiltTree, ModesSummary, Summary, VolumeSummary, summarise};
pub(crate) use flatten::{Facts, flatten};
