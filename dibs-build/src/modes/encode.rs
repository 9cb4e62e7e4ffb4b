//! The modes of a tree as bytes: section 7 of `dibs-nostd`'s `docs/format.md`.

use dibs_nostd::modes::{MAX_ANCHORS, MAX_MODES, ModalSurface, Modes};
use dibs_nostd::{Index, StretchError, Tree, VertexTable, measure_stretch};
use glam::{DVec3, Vec3};

use super::growth::Triangles;
use super::quantise::{QuantisedMode, gain, quantise, unit};
use super::{FitError, MARGIN, ModalFit, ModalMotion, Projector};
use crate::BuildError;
use crate::rounding::round_up;

/// Adds the first `count` modes of a fit to a tree, whose rows hold the mesh vertices `order`.
///
/// `append` adds a section of modes to the tree's bytes.
pub(crate) fn encode<I: Index>(
    fit: &ModalFit,
    count: usize,
    tree: &Tree<'_, I>,
    order: &[u32],
    append: impl Fn(&[u8]) -> Result<Vec<u8>, BuildError>,
) -> Result<(Vec<u8>, ModalMotion), FitError> {
    let available = fit.available();
    if !(1..=MAX_MODES.min(available)).contains(&count) {
        return Err(FitError::Count { asked: count, available });
    }
    let rest: Vec<Vec3> = (0..tree.vertex_count())
        .map(|row| tree.rest_position(row))
        .collect::<Option<_>>()
        .ok_or(FitError::NoRestShape)?;
    let is_same = |(row, vertex): (&Vec3, &u32)| fit.rest.get(*vertex as usize) == Some(row);
    if fit.rest.len() < order.len() || !rest.iter().zip(order).all(is_same) {
        return Err(FitError::OtherMesh);
    }
    let frames: Vec<Vec<Vec3>> = fit.frames.iter().map(|frame| to_rows(order, frame)).collect();
    let quantised = |mode: &Vec<DVec3>| quantise(&to_rows(order, mode)).ok_or(FitError::Degenerate);
    let modes = fit.modes[..count].iter().map(quantised).collect::<Result<Vec<_>, _>>()?;
    let displacements: Vec<Vec<DVec3>> = modes.iter().map(QuantisedMode::displacements).collect();

    let projector = Projector::from_displacements(
        displacements.clone(),
        rest.iter().map(|p| p.as_dvec3()).collect(),
    )?;
    let weights: Vec<Vec<f32>> = frames.iter().map(|frame| projector.weights(frame)).collect();
    let triangles = Triangles::new(tree).ok_or(FitError::NoRestShape)?;
    let growths = displacements.iter().map(|d| triangles.growth(d)).collect();
    let mut section = Section::new(modes, growths, &weights);
    section.allow_for_rounding(&rest, &triangles);

    // Errors and anchors are measured on the surface as the controller computes it.
    let probe = append(&section.bytes())?;
    let tree = Tree::<I>::from_bytes(&probe).map_err(BuildError::from)?;
    let shapes = Shapes { modes: Modes::of(&tree)?, tree };
    (section.position_error, section.rms_error) = shapes.errors(&weights, &frames)?;
    let (anchors, beyond_limit) = shapes.anchors(&weights)?;
    section.anchors = anchors;
    Ok((append(&section.bytes())?, ModalMotion { weights, beyond_limit }))
}

fn to_rows<T: Copy>(order: &[u32], of_mesh: &[T]) -> Vec<T> {
    order.iter().map(|&vertex| of_mesh[vertex as usize]).collect()
}

/// A shape whose stretch has been measured.
struct Anchor {
    weights: Vec<f32>,
    sigma: f32,
    triangle: u32,
}

/// The modal surface, evaluated as the controller does.
struct Shapes<'a, I> {
    tree: Tree<'a, I>,
    modes: Modes<'a>,
}

impl<'a, I: Index> Shapes<'a, I> {
    fn at(&self, weights: &[f32]) -> Result<ModalSurface<'a, MAX_MODES>, FitError> {
        self.modes.surface(weights).map_err(|_| FitError::Degenerate)
    }

    /// Largest distance and root mean square of the distances from the recorded frames.
    fn errors(&self, weights: &[Vec<f32>], frames: &[Vec<Vec3>]) -> Result<(f32, f32), FitError> {
        let (mut largest, mut sum, mut points) = (0.0_f64, 0.0, 0_u64);
        for (weights, frame) in weights.iter().zip(frames) {
            let surface = self.at(weights)?;
            for (row, recorded) in (0..).zip(frame) {
                let now = surface.position(row).unwrap_or(Vec3::NAN).as_dvec3();
                let squared = now.distance_squared(recorded.as_dvec3());
                (largest, sum, points) = (largest.max(squared), sum + squared, points + 1);
            }
        }
        Ok((round_up(largest.sqrt()), round_up((sum / points as f64).sqrt())))
    }

    /// The rest shape and the recorded frames within the limit, with their stretch, evenly sampled if there are too
    /// many; and the frames beyond the limit.
    fn anchors(&self, recorded: &[Vec<f32>]) -> Result<(Vec<Anchor>, Vec<usize>), FitError> {
        let anchor = |weights: &[f32]| match measure_stretch(&self.tree, &self.at(weights)?) {
            Ok(measured) => Ok(Some(Anchor {
                weights: weights.to_vec(),
                sigma: measured.sigma(),
                triangle: measured.triangle().0,
            })),
            Err(StretchError::Exceeded { .. }) => Ok(None),
            Err(error) => Err(FitError::Stretch(error)),
        };
        let every = recorded.len().div_ceil(MAX_ANCHORS - 1);
        let mut anchors: Vec<Anchor> =
            anchor(&vec![0.0; self.modes.count()])?.into_iter().collect();
        let mut beyond_limit = Vec::new();
        for (frame, weights) in recorded.iter().enumerate() {
            match anchor(weights)? {
                Some(anchor) if frame % every == 0 => anchors.push(anchor),
                Some(_) => (),
                None => beyond_limit.push(frame),
            }
        }
        Ok((anchors, beyond_limit))
    }
}

/// The contents of a tree's section of modes.
struct Section {
    modes: Vec<QuantisedMode>,
    /// Smallest and largest weight of each mode.
    ranges: Vec<[f32; 2]>,
    growths: Vec<f64>,
    unit: f64,
    slack: f64,
    position_error: f32,
    rms_error: f32,
    anchors: Vec<Anchor>,
}

impl Section {
    /// The section before any measurement: the rest shape is its only anchor.
    fn new(modes: Vec<QuantisedMode>, growths: Vec<f64>, weights: &[Vec<f32>]) -> Self {
        let ranges: Vec<[f32; 2]> = (0..modes.len()).map(|mode| range(weights, mode)).collect();
        let at_rest = Anchor { weights: vec![0.0; modes.len()], sigma: 1.0, triangle: 0 };
        let unit = unit(&modes, ranges.iter().map(largest));
        let (position_error, rms_error) = (0.0, 0.0);
        let anchors = vec![at_rest];
        Self { modes, ranges, growths, unit, slack: 0.0, position_error, rms_error, anchors }
    }

    /// Sets the slack of the stretch bound: for the rounding of positions, anchors, and points between two anchors.
    fn allow_for_rounding(&mut self, rest: &[Vec3], triangles: &Triangles) {
        let weights = || self.ranges.iter().map(largest);
        let axis = evaluation_error(rest, &self.modes, self.unit, weights());
        let of_positions = 2.0 * triangles.growth_of_error(axis * 3.0_f64.sqrt());
        let of_weights: f64 = self.growths.iter().zip(weights()).map(|(g, w)| g * w).sum();
        self.slack = of_positions + of_weights / 1_048_576.0;
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        bytes.extend((self.modes.len() as u16).to_le_bytes());
        bytes.extend((self.anchors.len() as u16).to_le_bytes());
        let header = [
            self.unit as f32,
            self.position_error,
            self.rms_error,
            round_up(self.slack),
            MARGIN,
            0.0,
            0.0,
        ];
        put(&mut bytes, &header);
        for ((mode, [low, high]), growth) in self.modes.iter().zip(&self.ranges).zip(&self.growths)
        {
            put(&mut bytes, &[*low, *high, gain(mode, self.unit), round_up(*growth)]);
        }
        for anchor in &self.anchors {
            put(&mut bytes, &anchor.weights);
            put(&mut bytes, &[anchor.sigma]);
            bytes.extend(anchor.triangle.to_le_bytes());
        }
        for row in 0..self.modes.first().map_or(0, |mode| mode.rows.len()) {
            for component in self.modes.iter().flat_map(|mode| mode.rows[row]) {
                bytes.extend(component.to_le_bytes());
            }
        }
        bytes
    }
}

fn put(bytes: &mut Vec<u8>, values: &[f32]) {
    values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
}

/// The range of a mode's recorded weights and 0, with the margin added at both ends.
fn range(weights: &[Vec<f32>], mode: usize) -> [f32; 2] {
    let of_frames = || weights.iter().map(|weights| weights[mode]);
    let (low, high) = (of_frames().fold(0.0, f32::min), of_frames().fold(0.0, f32::max));
    let margin = MARGIN * (high - low);
    [low - margin, high + margin]
}

/// The largest magnitude of a weight in a range.
fn largest([low, high]: &[f32; 2]) -> f64 {
    f64::from(high.max(-low))
}

/// Largest error of a computed position on one axis: gains are rounded and truncated to integers, each mode's
/// displacement is truncated to the unit of the sum, and the sum is converted and added to the rest position.
fn evaluation_error(
    rest: &[Vec3],
    modes: &[QuantisedMode],
    unit: f64,
    weights: impl Iterator<Item = f64>,
) -> f64 {
    const U: f64 = 1.0 / 16_777_216.0;
    let (mut units, mut reach) = (0.0, 0.0);
    for (mode, weight) in modes.iter().zip(weights) {
        units += 0.5 * (weight * f64::from(gain(mode, unit)) * U + 1.0) + 1.0;
        reach += weight * mode.step * 32_768.0;
    }
    let farthest = rest.iter().map(|p| f64::from(p.abs().max_element())).fold(0.0, f64::max);
    units * unit + reach * U + (farthest + reach) * U
}
