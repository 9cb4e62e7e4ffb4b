//! The volume that a closed surface encloses, whose sign distinguishes a surface from its inside-out image.
//!
//! A surface can be turned inside out through a plane, slowly and within every limit on stretch, size and speed: only
//! the sign of its volume shows it. The volume is the sum, over the triangles, of the signed volume between each
//! triangle and its projection onto a plane (the divergence theorem for the field (0, 0, z)). A whole frame sums over
//! all triangles; a partial frame replaces the terms of the regions that it moved.

// Requirement: F-03

use core::ops::Range;

use glam::Vec3;

use super::StretchError;
use crate::surface::VertexTable;
use crate::tree::{Index, Tree};

/// Fraction of the reference volume by which the sign may be opposite: a flat surface has only the volume of its
/// vertices' rounding.
const FLAT: f32 = 1.0 / 64.0;

/// The least volume with a sign, as a fraction of the sum of its terms' absolute values: a surface that is flat at rest
/// has only rounding.
const LEAST: f32 = 1.0 / 4096.0;

/// The volume of the current frame, in mm³, and of the published one.
#[derive(Clone, Debug)]
pub(super) struct Volume {
    /// The sum of the terms' absolute values.
    terms: f32,
    work: f32,
    published: f32,
    /// The volume at rest, or of the first frame if the tree has no rest shape. 0 while unknown or without a sign.
    reference: f32,
}

impl Volume {
    /// The volume check for surfaces of this tree.
    ///
    /// Cost: a pass over the triangles, if the surface is closed and the tree has its rest shape.
    pub fn of<I: Index>(tree: &Tree<'_, I>) -> Self {
        let mut volume = Self { terms: 0.0, work: 0.0, published: 0.0, reference: 0.0 };
        let rest = Rest(tree);
        if tree.is_closed() && rest.position(0).is_some() {
            volume.add(tree, &rest, None::<&Rest<'_, '_, I>>, 0..tree.triangle_count());
            volume.reference = volume.significant();
        }
        volume
    }

    /// A frame begins.
    pub const fn begin(&mut self, is_whole: bool) {
        (self.terms, self.work) = (0.0, if is_whole { 0.0 } else { self.published });
    }

    /// Adds triangles, replacing those of the surface `before` if there is one.
    pub fn add<I: Index, V: VertexTable + ?Sized, W: VertexTable + ?Sized>(
        &mut self,
        tree: &Tree<'_, I>,
        surface: &V,
        before: Option<&W>,
        rows: Range<u32>,
    ) {
        if !tree.is_closed() {
            return;
        }
        // A plane near the surface, so that the sum rounds little.
        let height = tree.rest_position(0).unwrap_or_default().z;
        let (mut sum, mut terms) = (0.0, 0.0);
        let count = rows.end.saturating_sub(rows.start);
        for corners in tree.triangles(rows.start, count).into_iter().flatten() {
            let Some(now) = at(surface, corners) else { continue };
            let mut six_volumes = six_volumes(now, height);
            terms += six_volumes.abs();
            if let Some(then) = before.and_then(|before| at(before, corners)) {
                six_volumes -= self::six_volumes(then, height);
            }
            sum += six_volumes;
        }
        self.work += sum / 6.0;
        self.terms += terms / 6.0;
    }

    /// Whether the current frame is not inside out.
    pub fn check(&self) -> Result<(), StretchError> {
        let Self { work: volume, reference, .. } = *self;
        let kept = if reference < 0.0 { -volume } else { volume };
        if reference != 0.0 && kept < -FLAT * reference.abs() {
            return Err(StretchError::InsideOut { volume, reference });
        }
        Ok(())
    }

    /// Makes the current frame the published one.
    pub fn published(&mut self) {
        self.published = self.work;
        if self.reference == 0.0 {
            self.reference = self.significant();
        }
    }

    /// The volume of the current frame; 0 if it is too small to have a sign.
    fn significant(&self) -> f32 {
        if self.work.abs() > LEAST * self.terms { self.work } else { 0.0 }
    }
}

struct Rest<'r, 't, I>(&'r Tree<'t, I>);

impl<I: Index> VertexTable for Rest<'_, '_, I> {
    fn len(&self) -> usize {
        self.0.vertex_count() as usize
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.0.rest_position(vertex)
    }
}

fn at<V: VertexTable + ?Sized>(surface: &V, [a, b, c]: [u32; 3]) -> Option<[Vec3; 3]> {
    Some([surface.position(a)?, surface.position(b)?, surface.position(c)?])
}

/// Six times the signed volume between a triangle and its projection onto the horizontal plane at this height.
fn six_volumes([a, b, c]: [Vec3; 3], height: f32) -> f32 {
    let (ab, ac) = (b - a, c - a);
    (a.z + b.z + c.z - 3.0 * height) * (ab.x * ac.y - ab.y * ac.x)
}
