//! How a tree is built, with the same options for every command.

use clap::ValueEnum;
use dibs_build::{Construction, Paths};

/// How a tree is built.
#[derive(clap::Args)]
pub struct ConstructionArgs {
    /// How sections are pinned and split, and their radii measured; of a build with --nodes, only how many triangles a
    /// leaf has, and children a node
    #[arg(long, value_enum, default_value = "default")]
    construction: Name,
}

#[derive(Clone, Copy, ValueEnum)]
enum Name {
    /// Split by distance along the surface
    Default,
    /// As published: mid-range pin, section-restricted paths along edges, split by a plane
    Paper,
}

impl ConstructionArgs {
    pub fn construction(&self) -> Construction {
        match self.construction {
            Name::Default => Construction::Geodesic,
            Name::Paper => Construction::Paper,
        }
    }

    /// The paths whose stretch is limited.
    pub fn paths(&self) -> Paths {
        match self.construction {
            Name::Default => Paths::default(),
            Name::Paper => Paths::Edges,
        }
    }
}
