//! The sides of a surface, and why one is not known. Apart from [`side`](super::side), which finds them, so that what is
//! remembered can name them.

// Requirement: S-01

use core::fmt;

/// The side of the surface on which a tool's axis is. From outside, a triangle's corners are counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum Side {
    /// The axis is outside of all solids.
    Outside,
    /// The whole axis is inside, of the solid with the least separation.
    Inside,
    /// The axis crosses the surface of that solid, or is inside and within twice the accuracy of it. A tracker's
    /// [kept answer](crate::TrackerAnswer::is_kept) may also mean that the whole axis is inside.
    Crossing,
    /// Only of a tracker's [kept answer](crate::TrackerAnswer::is_kept): outside or not, its interval holds the
    /// separation.
    Either,
    /// Not known. Separations are computed as for a tool outside.
    Undefined(NoSide),
}

impl Side {
    /// Whether the axis crosses the surface, is inside, or may be either: the separation is then a depth's.
    #[must_use]
    pub const fn has_depth(self) -> bool {
        matches!(self, Self::Inside | Self::Crossing | Self::Either)
    }
}

/// Why a tool's side is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub enum NoSide {
    /// The query left the side out: [`Options::unsigned`](crate::Options::unsigned).
    NotAsked,
    /// The tree has no adjacency: it was built without it, or from a surface without sides.
    NoAdjacency,
    /// The closest point is on an open boundary of the surface.
    OpenBoundary,
    /// The axis is closer to the surface, or to a tie between its features, than the accuracy resolves.
    BelowAccuracy,
    /// The closest point is on an edge of more than two triangles that are not pairs around a solid; the builder cut
    /// the mesh there.
    NonManifold,
    /// A triangle at the closest point has no area, or more than 256 meet there.
    Degenerate,
    /// The budget ran out before the closest point was certain, or no point is within the separation of
    /// [`Query::closest_within`](crate::Query::closest_within).
    CutShort,
}

impl fmt::Display for NoSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotAsked => "no side was asked for",
            Self::NoAdjacency => {
                "the tree has no adjacency: its triangles are wound against each other (`dibs build --orient` turns them), or it \
                 was built without"
            }
            Self::OpenBoundary => "the closest point is on an open boundary",
            Self::NonManifold => {
                "the closest point is on an edge of more than two triangles: cut the mesh open there"
            }
            Self::BelowAccuracy => "the sides are closer than the accuracy",
            Self::Degenerate => "the triangles at the closest point have no clear normal",
            Self::CutShort => "the budget ran out",
        })
    }
}
