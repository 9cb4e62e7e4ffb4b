//! The frames of a motion, and the surface at a moment of it.

use dibs_nostd::glam::Vec3;
use dibs_nostd::nodes::Nodes;
use dibs_nostd::{
    Index, MeasuredStretch, PathKind, StretchError, Tree, VertexTable, measure_stretch,
};

use crate::SessionError;

/// The surface between two frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// That of the last frame.
    Held,
    /// On its way from the frame before: late by a frame.
    #[default]
    Interpolated,
    /// Beyond the last frame, as it moved before.
    Extrapolated,
}

/// A surface at one time. Of a tree with nodes it is computed from theirs.
#[derive(Debug, Default)]
pub struct Frame {
    positions: Vec<Vec3>,
    nodes: Vec<Vec3>,
    error: f32,
}

impl Frame {
    /// The surface of these rows, of vertices or of nodes.
    fn new(nodes: Option<&Nodes<'_>>, rows: Vec<Vec3>) -> Self {
        let Some(nodes) = nodes else { return Self { positions: rows, ..Self::default() } };
        let surface = nodes.surface(rows.as_slice());
        let positions = (0..nodes.vertex_count()).filter_map(|row| surface.position(row)).collect();
        let error = surface.position_error();
        Self { positions, nodes: rows, error }
    }

    /// Positions of the vertices.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }
}

impl VertexTable for Frame {
    fn len(&self) -> usize {
        self.positions.len()
    }

    fn position(&self, vertex: u32) -> Option<Vec3> {
        self.positions.get(vertex as usize).copied()
    }

    fn position_error(&self) -> f32 {
        self.error
    }
}

/// The nodes at a part of the way between two frames: 0 is the first, 1 the second, more is beyond it.
pub fn between(before: &Frame, last: &Frame, part: f32) -> impl Iterator<Item = Vec3> {
    before.nodes.iter().zip(&last.nodes).map(move |(&a, &b)| a + (b - a) * part)
}

/// The stretch of a tree's surface beyond two frames, by a part of the step between them.
///
/// # Errors
/// As [`measure_stretch`] and [`Nodes::measure`].
pub fn stretch_beyond<I: Index>(
    tree: &Tree<'_, I>,
    [before, last]: [&Frame; 2],
    part: f32,
    surface: &impl VertexTable,
) -> Result<MeasuredStretch, StretchError> {
    let Ok(nodes) = Nodes::of(tree) else { return measure_stretch(tree, surface) };
    let beyond: Vec<Vec3> = between(before, last, 1.0 + part).collect();
    nodes.measure(beyond.as_slice())
}

/// A cyclic motion, in the order of the tree's rows, with the stretch of each frame.
#[derive(Debug)]
pub struct Motion {
    /// They live as long as the page.
    pub frames: &'static [Frame],
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
    /// no motion, [`SessionError::Stretch`] for a frame beyond the tree's limit, [`SessionError::Nodes`] for damaged nodes.
    pub fn new<I: Index>(
        tree: &Tree<'_, I>,
        packed: &[u8],
        rate: f64,
    ) -> Result<Self, SessionError> {
        let nodes = match tree.paths() {
            PathKind::Volume => Some(Nodes::of(tree)?),
            _ => None,
        };
        let count = nodes.map_or(tree.vertex_count(), |nodes| nodes.count());
        let rows = if packed.is_empty() {
            let rest = |row| match &nodes {
                Some(nodes) => nodes.rest_position(row),
                None => tree.rest_position(row),
            };
            let rest = (0..count).map(rest);
            vec![rest.collect::<Option<Vec<Vec3>>>().ok_or(SessionError::NoRest)?]
        } else {
            unpack(packed, count as usize)?
        };
        let measure = |(frame, rows): (usize, &Vec<Vec3>)| {
            let stretch = match &nodes {
                Some(nodes) => nodes.measure(rows.as_slice()),
                None => measure_stretch(tree, rows.as_slice()),
            };
            stretch.map_err(|error| SessionError::Stretch { frame, error })
        };
        let stretches = rows.iter().enumerate().map(measure).collect::<Result<_, _>>()?;
        let frames: Vec<Frame> =
            rows.into_iter().map(|rows| Frame::new(nodes.as_ref(), rows)).collect();
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
