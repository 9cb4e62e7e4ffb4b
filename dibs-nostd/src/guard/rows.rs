//! The content of a guard's frames: vertices or nodes, with or without a pose.

// Requirements: F-07, F-08

use glam::Vec3;

use super::posed::TickPose;
use crate::surface::FrameView;
use crate::tree::VertexOrder;
use crate::{
    AdmissionCheck, Error, FrameGuard, Index, MovingSurface, StretchMonitor, SurfaceBlend,
    SurfaceLimits, Tree,
};

/// The rows between the last two frames, or extrapolated.
pub(super) type Blend<'f> = SurfaceBlend<'f, FrameView<'f>, FrameView<'f>>;

/// The kind of rows in a [`Surface`](super::Surface)'s frames.
#[doc(hidden)]
pub trait Rows: sealed::Sealed + core::fmt::Debug + 'static {
    /// The facts of a tree about its rows.
    type Of<'t>: Copy + core::fmt::Debug;
    /// The check of a frame.
    type AdmissionCheck<'s, 't, I: Index>: AdmissionCheck + core::fmt::Debug;
    /// The surface that rows make.
    type Surface<'f>: MovingSurface;
    /// Memory for the surface, if the rows are not the surface.
    type Room<'f>: Default;
    /// Data of frames besides their rows that the two ends share.
    type Poses: SharedState;

    /// Reads a tree.
    #[doc(hidden)]
    fn of<'t, I: Index>(tree: &Tree<'t, I>) -> Result<Self::Of<'t>, Error>;

    /// The number of a frame's rows.
    #[doc(hidden)]
    fn count<I: Index>(tree: &Tree<'_, I>, of: &Self::Of<'_>) -> u32;

    /// A row at rest.
    #[doc(hidden)]
    fn rest<I: Index>(tree: &Tree<'_, I>, of: &Self::Of<'_>, row: u32) -> Option<Vec3>;

    /// The row order for a frame of this process.
    #[doc(hidden)]
    fn order<'t, I: Index>(tree: &Tree<'t, I>, of: &Self::Of<'t>) -> VertexOrder<'t, I>;

    /// Upper bound on the ratio of a vertex's distance from a point to that of the farthest row, and of their motions.
    #[doc(hidden)]
    fn amplification(_: &Self::Of<'_>) -> f32 {
        1.0
    }

    /// The check of frames and of their extrapolations.
    #[doc(hidden)]
    fn admission_check<'s, 't, I: Index>(
        tree: &Tree<'t, I>,
        of: &Self::Of<'t>,
        limits: SurfaceLimits,
        poses: &'s Self::Poses,
    ) -> Result<Self::AdmissionCheck<'s, 't, I>, Error>;

    /// The current rows.
    #[doc(hidden)]
    #[inline(always)]
    fn now<'f>(_: &Self::Of<'_>, _: &Self::Poses, published: &'f FrameGuard<'f>) -> Blend<'f> {
        published.extrapolated()
    }

    /// The current pose, if frames have poses.
    #[doc(hidden)]
    #[inline(always)]
    fn placed(
        _: &Self::Of<'_>,
        _: &Self::Poses,
        _: &FrameGuard<'_>,
        _: &Blend<'_>,
    ) -> Option<TickPose> {
        None
    }

    /// The surface that rows make.
    #[doc(hidden)]
    fn surface<'s, 'f: 's, 't: 'f>(
        of: &'f Self::Of<'t>,
        rows: &'f Blend<'f>,
        room: &'s mut Self::Room<'f>,
    ) -> &'s Self::Surface<'f>;

    /// The velocity (mm/s) of a point of a triangle: see [`SurfaceBlend::velocity`].
    #[doc(hidden)]
    fn velocity(of: &Self::Of<'_>, rows: &Blend<'_>, corners: [u32; 3], weights: [f32; 3]) -> Vec3;
}

/// Data of frames besides their rows that the two ends share.
#[doc(hidden)]
pub trait SharedState: core::fmt::Debug + 'static {
    /// Before the first frame.
    #[cfg(not(loom))]
    const NEW: Self;

    /// Before the first frame.
    #[cfg(loom)]
    fn new() -> Self;
}

impl SharedState for () {
    #[cfg(not(loom))]
    const NEW: Self = ();

    #[cfg(loom)]
    fn new() {}
}

pub(super) mod sealed {
    pub trait Sealed {}

    impl Sealed for super::Vertices {}
    #[cfg(feature = "nodes")]
    impl Sealed for crate::nodes::Nodes<'static> {}
}

/// Frames of vertices.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Vertices;

impl Rows for Vertices {
    type Of<'t> = ();
    type AdmissionCheck<'s, 't, I: Index> = StretchMonitor<'t, I, 2>;
    type Surface<'f> = Blend<'f>;
    type Room<'f> = ();
    type Poses = ();

    #[inline(always)]
    fn of<'t, I: Index>(_: &Tree<'t, I>) -> Result<(), Error> {
        Ok(())
    }

    #[inline(always)]
    fn count<I: Index>(tree: &Tree<'_, I>, (): &()) -> u32 {
        tree.vertex_count()
    }

    #[inline(always)]
    fn rest<I: Index>(tree: &Tree<'_, I>, (): &(), row: u32) -> Option<Vec3> {
        tree.rest_position(row)
    }

    #[inline(always)]
    fn order<'t, I: Index>(tree: &Tree<'t, I>, (): &()) -> VertexOrder<'t, I> {
        VertexOrder::of(tree)
    }

    #[inline(always)]
    fn admission_check<'t, I: Index>(
        tree: &Tree<'t, I>,
        (): &(),
        limits: SurfaceLimits,
        (): &(),
    ) -> Result<StretchMonitor<'t, I, 2>, Error> {
        Ok(StretchMonitor::continuous(tree)?.limits(limits))
    }

    #[inline(always)]
    fn surface<'s, 'f: 's, 't: 'f>(
        (): &'f (),
        rows: &'f Blend<'f>,
        (): &'s mut (),
    ) -> &'s Blend<'f> {
        rows
    }

    #[inline(always)]
    fn velocity((): &(), rows: &Blend<'_>, corners: [u32; 3], weights: [f32; 3]) -> Vec3 {
        rows.velocity(corners, weights)
    }
}

/// Frames of the nodes that move an embedded surface.
#[cfg(feature = "nodes")]
impl Rows for crate::nodes::Nodes<'static> {
    type Of<'t> = crate::nodes::Nodes<'t>;
    type AdmissionCheck<'s, 't, I: Index> = crate::nodes::NodeMonitor<'t, 2>;
    type Surface<'f> = crate::nodes::EmbeddedSurface<'f, 'f, Blend<'f>>;
    type Room<'f> = Option<Self::Surface<'f>>;
    type Poses = ();

    fn of<'t, I: Index>(tree: &Tree<'t, I>) -> Result<Self::Of<'t>, Error> {
        Ok(crate::nodes::Nodes::of(tree)?)
    }

    fn count<I: Index>(_: &Tree<'_, I>, nodes: &Self::Of<'_>) -> u32 {
        nodes.count()
    }

    fn rest<I: Index>(_: &Tree<'_, I>, nodes: &Self::Of<'_>, row: u32) -> Option<Vec3> {
        nodes.rest_position(row)
    }

    fn order<'t, I: Index>(_: &Tree<'t, I>, nodes: &Self::Of<'t>) -> VertexOrder<'t, I> {
        VertexOrder::of_rows(nodes.count())
    }

    fn amplification(nodes: &Self::Of<'_>) -> f32 {
        nodes.amplification()
    }

    fn admission_check<'s, 't, I: Index>(
        _: &Tree<'t, I>,
        nodes: &Self::Of<'t>,
        limits: SurfaceLimits,
        (): &'s (),
    ) -> Result<Self::AdmissionCheck<'s, 't, I>, Error> {
        Ok(crate::nodes::NodeMonitor::continuous(nodes).limits(limits))
    }

    #[inline(always)]
    fn surface<'s, 'f: 's, 't: 'f>(
        nodes: &'f Self::Of<'t>,
        rows: &'f Blend<'f>,
        room: &'s mut Self::Room<'f>,
    ) -> &'s Self::Surface<'f> {
        room.insert(nodes.surface(rows))
    }

    fn velocity(
        nodes: &Self::Of<'_>,
        rows: &Blend<'_>,
        corners: [u32; 3],
        weights: [f32; 3],
    ) -> Vec3 {
        let mut velocity = Vec3::ZERO;
        for (corner, weight) in corners.into_iter().zip(weights) {
            let parts = nodes.weights(corner).unwrap_or_default();
            let [a, b, c, d] = parts;
            let part = |(_, part): (u32, i32)| part as f32 * (1.0 / crate::nodes::WHOLE as f32);
            let parts = [part(a), part(b), part(c), part(d)];
            velocity += rows.velocity([a.0, b.0, c.0, d.0], parts) * weight;
        }
        velocity
    }
}
