//! The check of a modal frame before it is published.

use super::reach::Reach;
use super::{ModalSurface, Modes, WeightsError};
use crate::stretch::{Admission, AdmissionCheck, FrameExtent, IncomingSurface, StretchError};
use crate::surface::{Millis, VertexTable};
use crate::tree::SurfaceFacts;

/// Admits weights within their ranges whose surface stays within the stretch limit and a speed limit: the
/// [`AdmissionCheck`] of an [`Assembler`](crate::Assembler) of modal frames.
///
/// [`Modes::stretch_bound`] and a bound on the vertices' motion decide in O(modes), for any number of triangles. If a
/// bound exceeds its limit, another admission check `G` measures the surface, in slices if it is a
/// [`StretchMonitor`](crate::StretchMonitor). So no frame within the limits is refused, and no frame stretched or moved
/// beyond them is admitted.
///
/// The limits on speed and recovery are `G`'s: [`StretchMonitor::limits`](crate::StretchMonitor::limits). Its limits on
/// size and on the sign of the volume apply only to frames that it measures.
#[derive(Clone, Debug)]
pub struct ModalAdmissionCheck<'a, G, const K: usize> {
    modes: Modes<'a>,
    reach: Reach<K>,
    exact: G,
    /// The surface for `exact` to measure, if a bound exceeded its limit.
    surface: Option<ModalSurface<'a, K>>,
    measured: u32,
}

impl<'a, G, const K: usize> ModalAdmissionCheck<'a, G, K> {
    /// An admission check for surfaces of exactly `K` modes. `exact`, the tree or a monitor of it, measures the
    /// surfaces that the bounds cannot admit. Only a monitor limits the speed.
    ///
    /// Cost: two passes over the displacements of all vertices.
    ///
    /// # Errors
    /// [`WeightsError::Count`] for another number of modes.
    pub fn new(modes: &Modes<'a>, exact: G) -> Result<Self, WeightsError> {
        let (expected, found) = (modes.count() as u32, K as u32);
        if expected != found {
            return Err(WeightsError::Count { expected, found });
        }
        let reach = Reach::of(modes);
        Ok(Self { modes: *modes, reach, exact, surface: None, measured: 0 })
    }

    /// Frames measured by the inner admission check since the start; saturates.
    #[must_use]
    pub const fn measured(&self) -> u32 {
        self.measured
    }

    fn weights<V: VertexTable + ?Sized>(rows: &V) -> Result<[f32; K], StretchError> {
        let mut weights = [0.0; K];
        for (row, weight) in (0..).zip(&mut weights) {
            let stored = rows.position(row).ok_or(StretchError::Corrupt { row })?;
            *weight = stored.x;
        }
        Ok(weights)
    }
}

impl<G: AdmissionCheck, const K: usize> AdmissionCheck for ModalAdmissionCheck<'_, G, K> {
    fn begin(&mut self, _: FrameExtent) {
        self.surface = None;
    }

    fn weight_range(&self, mode: u32) -> Option<[f32; 2]> {
        self.modes.range(mode as usize)
    }

    fn surface_facts(&self) -> SurfaceFacts {
        self.exact.surface_facts()
    }

    fn farthest(&self, elapsed: Millis) -> f32 {
        self.exact.farthest(elapsed)
    }

    fn position_error(&self) -> f32 {
        self.modes.position_error()
    }

    /// The rows hold the weights of this frame and of the published one, as the assembler stores them.
    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        IncomingSurface { surface: rows, ready, before, .. }: IncomingSurface<'_, V>,
        work: u32,
    ) -> Result<Admission, StretchError> {
        if (ready as usize) < K {
            return Ok(Admission::Pending);
        }
        let before = match before {
            Some((rows, elapsed)) => {
                let weights = Self::weights(rows)?;
                Some((ModalSurface::<K>::new(&self.modes, weights.into_iter()), elapsed))
            }
            None => None,
        };
        let surface = match &self.surface {
            Some(surface) => surface,
            None => {
                let weights = Self::weights(rows)?;
                let surface = ModalSurface::new(&self.modes, weights.into_iter());
                let is_slow = before.as_ref().is_none_or(|(before, elapsed)| {
                    self.reach.between(before, &surface) <= self.exact.farthest(*elapsed)
                });
                let bound = self.modes.bound(&weights);
                if is_slow && bound.sigma() <= self.modes.stretch_limit() {
                    return Ok(Admission::Admitted(Some(bound)));
                }
                self.measured = self.measured.saturating_add(1);
                self.exact.begin(FrameExtent::Whole);
                self.surface.insert(surface)
            }
        };
        let ready = surface.len() as u32;
        let before = before.as_ref().map(|(before, elapsed)| (before, *elapsed));
        self.exact.advance(IncomingSurface { before, ..IncomingSurface::new(surface, ready) }, work)
    }
}
