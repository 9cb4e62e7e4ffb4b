//! The rest shape of each triangle, and its stretch limit, for along-surface distances, stretch, the stored metric and
//! the growth of modes.

mod floor;
mod paths;
mod ratios;
mod shape;

pub(crate) use floor::{SHARED, least_limits, openness};
pub use paths::Paths;
pub(crate) use ratios::LimitRatios;
pub(crate) use shape::{RestShape, has_area};
