//! A built tree with displacement modes.

use dibs_nostd::Index;
use dibs_nostd::format::section;

use super::emit::BuiltTree;
use super::sections::append;
use crate::error::BuildError;
use crate::modes::{self, FitError, ModalFit, ModalMotion};

impl BuiltTree {
    /// The same tree with the first `count` modes of a fitted motion: `dibs-nostd`'s `docs/format.md`, section 7.
    ///
    /// Errors and stretch are measured on the surface as the controller computes it, at every recorded frame. A weight
    /// may exceed its recorded range by a quarter of that range ([`modes::MARGIN`](crate::modes::MARGIN)).
    ///
    /// Cost: linear in modes, frames and vertices; seconds at most.
    ///
    /// # Errors
    /// [`FitError`] for a number of modes that the motion does not have, a fit on another mesh, or a tree without a
    /// rest shape.
    pub fn with_modes(&self, fit: &ModalFit, count: usize) -> Result<Self, FitError> {
        match self.index_bytes {
            2 => self.with_modes_in::<u16>(fit, count),
            _ => self.with_modes_in::<u32>(fit, count),
        }
    }

    fn with_modes_in<I: Index>(&self, fit: &ModalFit, count: usize) -> Result<Self, FitError> {
        if self.motion.is_some() {
            return Err(FitError::OtherMesh);
        }
        let tree = self.tree::<I>().map_err(BuildError::from)?;
        let append = |content: &[u8]| append(&self.bytes, section::MODES, content);
        let (bytes, motion) = modes::encode(fit, count, &tree, &self.order, append)?;
        Ok(Self { bytes, motion: Some(motion), order: self.order.clone(), ..*self })
    }

    /// The weights of the motion that the modes were fitted to; `None` for a tree without modes.
    #[must_use]
    pub fn modal_motion(&self) -> Option<&ModalMotion> {
        self.motion.as_ref()
    }
}
