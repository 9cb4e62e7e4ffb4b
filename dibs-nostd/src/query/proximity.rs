//! What a query answers: the closest pair and how certain it is.

use glam::Vec3;

/// The closest pair between a tool and a surface, with a certified interval for its separation.
///
/// Lengths are in the mesh's own unit (mm in the examples). The true separation lies in
/// `[lower - accuracy, separation + accuracy]`; the two ends are equal when the query was not cut
/// short by its budget.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Proximity {
    /// Separation of the best pair found: the upper end of the certified interval.
    /// 0 when tool and surface touch or overlap.
    pub separation: f32,
    /// Lower end of the certified interval; equals `separation` unless the budget ran out.
    pub lower: f32,
    /// No separation above is off by more than this: the f32 rounding of coordinates this large.
    pub accuracy: f32,
    /// Distance from the tool's axis (a sphere's centre, a capsule's segment) to
    /// `point_on_surface`; `separation = max(0, axis_distance - radius)`. Below the radius the
    /// difference is the depth of a shallow penetration.
    pub axis_distance: f32,
    /// The surface's point of the closest pair.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_surface: Vec3,
    /// The tool's point of the closest pair, on the tool's own surface.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub point_on_tool: Vec3,
    /// Unit vector from `point_on_surface` towards the tool's axis; zero when the axis itself
    /// touches the surface, where no direction is defined.
    #[cfg_attr(feature = "defmt", defmt(Debug2Format))]
    pub direction: Vec3,
    /// Where along the tool's axis the pair sits: 0 at its start, 1 at its end; 0 for a sphere.
    pub axis_parameter: f32,
    /// The triangle of `point_on_surface`, as its row in the tree's triangle table. `None` when the
    /// budget ran out while a pin was still the best point known; `corners` then repeats the pin.
    pub triangle: Option<u32>,
    /// That triangle's corners, as rows of the vertex table.
    pub corners: [u32; 3],
    /// Weights of the three corners at `point_on_surface`: not negative, sum 1.
    pub barycentric: [f32; 3],
    /// Sphere bounds evaluated: stored spheres and elastic ones.
    pub node_tests: u32,
    /// Exact tool-triangle tests evaluated.
    pub triangle_tests: u32,
}

impl Proximity {
    /// The same pair, its accuracy widened by `error` (mm, not negative): how far a vertex may be from
    /// where the table has it, say [`FrameLabel::position_error`](crate::FrameLabel::position_error)
    /// of a quantised frame, or the age of the surface times the tissue's greatest speed. A distance
    /// changes by at most as much as its points move.
    #[must_use]
    pub fn widened(mut self, error: f32) -> Self {
        self.accuracy += error;
        self
    }
}
