//! The check of a modal frame before it is published.

use super::{ModalSurface, Modes, WeightsError};
use crate::stretch::{Arriving, Changed, Gate, StretchError, Verdict};
use crate::surface::VertexTable;

/// Admits weights within their ranges whose surface keeps to the stretch limit: the
/// [`Gate`] of an [`Assembler`](crate::Assembler) of modal frames.
///
/// [`Modes::stretch_bound`] decides in O(modes), whatever the number of triangles. Only where it is
/// beyond the limit, and so cannot tell, is the surface measured by another gate `G`, in slices if that
/// is a [`StretchMonitor`](crate::StretchMonitor): between the two nothing is refused that is within the
/// limit, and nothing admitted that is not.
#[derive(Clone, Debug)]
pub struct ModalGate<'a, G, const K: usize> {
    modes: Modes<'a>,
    exact: G,
    /// The surface that is being measured, where the bound could not tell.
    surface: Option<ModalSurface<'a, K>>,
    measured: u32,
}

impl<'a, G, const K: usize> ModalGate<'a, G, K> {
    /// A gate for surfaces of exactly `K` modes. `exact` measures those of which the bound cannot tell:
    /// the tree, or a monitor of it.
    ///
    /// # Errors
    /// [`WeightsError::Count`] for another number of modes.
    pub fn new(modes: &Modes<'a>, exact: G) -> Result<Self, WeightsError> {
        let (expected, found) = (modes.count() as u32, K as u32);
        if expected != found {
            return Err(WeightsError::Count { expected, found });
        }
        Ok(Self { modes: *modes, exact, surface: None, measured: 0 })
    }

    /// Frames that had to be measured since the start; stops at its largest value.
    #[must_use]
    pub const fn measured(&self) -> u32 {
        self.measured
    }
}

impl<G: Gate, const K: usize> Gate for ModalGate<'_, G, K> {
    fn begin(&mut self, _: Changed) {
        self.surface = None;
    }

    fn weight_range(&self, mode: u32) -> Option<[f32; 2]> {
        self.modes.range(mode as usize)
    }

    fn position_error(&self) -> f32 {
        self.modes.position_error()
    }

    /// `rows` holds the weights, as an assembler stores them.
    fn advance<V: VertexTable + ?Sized>(
        &mut self,
        Arriving { surface: rows, ready, .. }: Arriving<'_, V>,
        work: u32,
    ) -> Result<Verdict, StretchError> {
        if (ready as usize) < K {
            return Ok(Verdict::Pending);
        }
        let surface = match &self.surface {
            Some(surface) => surface,
            None => {
                let mut weights = [0.0; K];
                for (row, weight) in (0..).zip(&mut weights) {
                    let stored = rows.position(row).ok_or(StretchError::Corrupt { row })?;
                    *weight = stored.x;
                }
                let bound = self.modes.bound(&weights);
                if bound.sigma() <= self.modes.stretch_limit() {
                    return Ok(Verdict::Admitted(Some(bound)));
                }
                self.measured = self.measured.saturating_add(1);
                self.exact.begin(Changed::Whole);
                self.surface.insert(ModalSurface::new(&self.modes, weights.into_iter()))
            }
        };
        let ready = surface.len() as u32;
        self.exact.advance(Arriving::new(surface, ready), work)
    }
}
