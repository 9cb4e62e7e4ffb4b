//! The frames of a motion, and the surface at a moment of it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::{Index, MeasuredStretch, Tree, measure_stretch};

use crate::SessionError;

/// The surface between two frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// That of the last frame.
    Held,
    /// On its way from the frame before: late by a frame.
    #[default]
    Interpolated,
    /// Beyond the last frame, as it moved before.
    Extrapolated,
}

/// A cyclic motion, in the order of the tree's rows, with the stretch of each frame.
#[derive(Debug)]
pub struct Motion {
    /// Positions, frame by frame. They live as long as the page.
    pub frames: &'static [Vec<Vec3>],
    /// The stretch of each frame.
    pub stretches: Vec<MeasuredStretch>,
    /// Frames a second.
    pub rate: f64,
}

impl Motion {
    /// The motion in a page's bytes (see [`unpack`]); without any, the tree's rest shape.
    ///
    /// # Errors
    /// [`SessionError::Motion`] for a wrong number of bytes, [`SessionError::NoRest`] for a tree without rest shape and
    /// no motion, [`SessionError::Stretch`] for a frame beyond the tree's limit.
    pub fn new<I: Index>(
        tree: &Tree<'_, I>,
        packed: &[u8],
        rate: f64,
    ) -> Result<Self, SessionError> {
        let frames = if packed.is_empty() {
            let rest = (0..tree.vertex_count()).map(|row| tree.rest_position(row));
            vec![rest.collect::<Option<Vec<Vec3>>>().ok_or(SessionError::NoRest)?]
        } else {
            unpack(packed, tree.vertex_count() as usize)?
        };
        let measure = |(frame, positions): (usize, &Vec<Vec3>)| {
            measure_stretch(tree, positions.as_slice())
                .map_err(|error| SessionError::Stretch { frame, error })
        };
        let stretches = frames.iter().enumerate().map(measure).collect::<Result<_, _>>()?;
        Ok(Self { frames: frames.leak(), stretches, rate })
    }

    /// The number of the frame at a time, counted through all cycles.
    #[must_use]
    pub fn number(&self, seconds: f64) -> u64 {
        (seconds * self.rate) as u64
    }

    /// The frame of that number.
    #[must_use]
    pub fn frame(&self, number: u64) -> usize {
        (number % self.frames.len() as u64) as usize
    }

    /// The share of the time between its frame and the next that has passed.
    #[must_use]
    pub fn share(&self, seconds: f64) -> f32 {
        (seconds * self.rate - self.number(seconds) as f64) as f32
    }
}

/// Undoes the packing by `dibs view`, to the bit. Each word was replaced by its difference from the frame before, with the
/// sign in the lowest bit. The lowest bytes of all words come first, then the next bytes.
///
/// # Errors
/// [`SessionError::Motion`] for a wrong number of bytes.
fn unpack(packed: &[u8], vertices: usize) -> Result<Vec<Vec<Vec3>>, SessionError> {
    let (found, frame) = (packed.len(), 12 * vertices);
    if frame == 0 || found % frame != 0 {
        return Err(SessionError::Motion { found, frame });
    }
    let words = found / 4;
    let mut before = vec![0_u32; 3 * vertices];
    let mut word = 0..words;
    let frames = (0..found / frame).map(|_| {
        let rows = before.chunks_exact_mut(3).map(|row| {
            let mut axes = row.iter_mut().zip(&mut word).map(|(before, at)| {
                let bytes = [0, 1, 2, 3].map(|plane| packed[plane * words + at]);
                let code = u32::from_le_bytes(bytes);
                *before = before.wrapping_add((code >> 1) ^ (code & 1).wrapping_neg());
                f32::from_bits(*before)
            });
            Vec3::from_array([(); 3].map(|()| axes.next().unwrap_or(f32::NAN)))
        });
        rows.collect()
    });
    Ok(frames.collect())
}
