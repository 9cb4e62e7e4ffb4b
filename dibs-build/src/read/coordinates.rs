//! Converts a file's coordinates to a mesh's: millimetres, relative to an origin near the mesh where f32 requires it.

// Requirement: M-05

use super::ReadErrorKind;
use super::raw::Raw;
use crate::Unit;
use glam::{DVec3, Vec3};

/// A mesh is recentred if f32 would round it by more than this fraction of its extent: about the accuracy of a query.
const MOST_ROUNDING: f64 = 1.0 / 1_048_576.0;

/// Distance between neighbouring numbers, as a fraction of the mesh's extent, above which the shape is lost.
const MOST_RESOLUTION: f64 = 1e-4;

/// Lengths beyond this are implausible for an organ in any unit, and their sums might overflow.
const MOST_DISTANCE: f64 = 1e18;

type Result<T> = std::result::Result<T, ReadErrorKind>;

/// The conversion of a file's coordinates to a mesh's.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileCoordinates {
    /// The unit of the file's lengths.
    pub unit: Unit,
    /// The mesh's origin, in millimetres in the file's coordinates.
    pub origin: DVec3,
}

impl FileCoordinates {
    /// Converts a position of the file, without rounding it.
    pub fn of(&self, position: [f64; 3]) -> DVec3 {
        DVec3::from(position) * self.unit.millimetres() - self.origin
    }

    /// The conversion for a mesh. Its origin is the given one; otherwise zero, or where f32 would round the mesh too
    /// much the centre of its bounding box.
    ///
    /// The centre is rounded to a power of two of about an eighth of the extent, so that few bits hold it and f64
    /// subtracts it exactly.
    ///
    /// # Errors
    /// [`ReadErrorKind::TooFar`] where the file's numbers cannot represent the shape.
    pub fn of_mesh(raw: &Raw, unit: Unit, origin: Option<DVec3>) -> Result<Self> {
        let unmoved = Self { unit, origin: DVec3::ZERO };
        let positions = || raw.corner_positions();
        let bounds = Bounds::of(positions().map(|position| unmoved.of(position)));
        let extent = bounds.extent();
        // Later checks have clearer errors for positions that coincide, or are too large or not finite.
        let is_surface = extent > f32::MIN_POSITIVE.into() && bounds.largest() <= MOST_DISTANCE;
        let is_coarse = bounds.resolution(f32::EPSILON.into()) > MOST_RESOLUTION * extent;
        if is_surface && is_coarse {
            check_digits(&bounds, positions)?;
        }
        if let Some(origin) = origin {
            return Ok(Self { unit, origin });
        }
        if !is_surface {
            return Ok(unmoved);
        }
        let rounding = |position| rounding(unmoved.of(position));
        let most = positions().map(rounding).fold(0.0, f64::max);
        if !is_coarse && most <= MOST_ROUNDING * extent {
            return Ok(unmoved);
        }
        let step = (extent / 8.0).log2().floor().exp2();
        Ok(Self { origin: (bounds.centre() / step).round() * step, ..unmoved })
    }

    /// The positions of a frame, rounded to f32. Errors name the frame by `name`.
    ///
    /// # Errors
    /// [`ReadErrorKind::TooFar`] where the file's numbers cannot represent the shape, [`ReadErrorKind::Elsewhere`]
    /// where f32 numbers so far from the origin cannot.
    pub fn frame(&self, positions: &[[f64; 3]], name: impl Fn() -> String) -> Result<Vec<Vec3>> {
        let in_file = Self { origin: DVec3::ZERO, ..*self };
        let bounds = Bounds::of(positions.iter().map(|&position| in_file.of(position)));
        if bounds.resolution(f32::EPSILON.into()) > MOST_RESOLUTION * bounds.extent() {
            check_digits(&bounds, || positions.iter().copied())?;
        }
        check_nearness(positions.iter().map(|&position| self.of(position)), name)?;
        Ok(positions.iter().map(|&position| self.of(position).as_vec3()).collect())
    }

    /// The converted positions of frame `number` of a motion.
    ///
    /// # Errors
    /// [`ReadErrorKind::NonFinite`], and those of [`frame`](Self::frame).
    pub fn frame_of(&self, positions: &[[f64; 3]], number: usize) -> Result<Vec<Vec3>> {
        let is_finite = |value: &f64| (*value as f32).is_finite();
        if let Some(vertex) = positions.iter().position(|position| !position.iter().all(is_finite))
        {
            let value = positions[vertex].into_iter().find(|value| !is_finite(value));
            return Err(ReadErrorKind::NonFinite {
                vertex: format!("position {vertex} (counted from 0) of frame {number}"),
                value: value.map_or(f64::NAN, |value| (value as f32).into()),
            });
        }
        self.frame(positions, || format!("frame {number}"))
    }
}

/// The distance of a position from its rounding to f32.
pub(super) fn rounding(position: DVec3) -> f64 {
    position.distance(position.as_vec3().as_dvec3())
}

/// Checks that neighbouring f32 numbers are much closer than the surface is large: otherwise its shape is lost. Returns
/// the largest extent along an axis.
pub(super) fn check_nearness(
    positions: impl Iterator<Item = DVec3>,
    name: impl Fn() -> String,
) -> Result<f64> {
    let bounds = Bounds::of(positions);
    let (extent, resolution) = (bounds.extent(), bounds.resolution(f32::EPSILON.into()));
    // If all vertices coincide, the error for degenerate triangles is clearer.
    if extent > 0.0 && resolution > MOST_RESOLUTION * extent {
        let (what, largest) = (name(), bounds.largest());
        return Err(ReadErrorKind::Elsewhere { what, largest, resolution, extent });
    }
    Ok(extent)
}

/// Checks that far from the origin the file's numbers have more digits than f32. If each number is an f32, and some use
/// its last bit, they were rounded to f32 when they were written.
fn check_digits<P: Iterator<Item = [f64; 3]>>(
    bounds: &Bounds,
    positions: impl Fn() -> P,
) -> Result<()> {
    let extent = bounds.extent();
    let is_f32 = |value: f64| f64::from(value as f32) == value;
    let has_last_bit = |value: f64| (value as f32).to_bits() & 1 == 1;
    let is_rounded = positions().flatten().all(is_f32) && positions().flatten().any(has_last_bit);
    let epsilon = if is_rounded { f32::EPSILON.into() } else { f64::EPSILON };
    let resolution = bounds.resolution(epsilon);
    if extent > 0.0 && resolution > MOST_RESOLUTION * extent {
        return Err(ReadErrorKind::TooFar { largest: bounds.largest(), resolution, extent });
    }
    Ok(())
}

/// The bounding box of positions.
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    fn of(positions: impl Iterator<Item = DVec3>) -> Self {
        let none = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };
        positions.fold(none, |Self { low, high }, position| Self {
            low: low.min(position),
            high: high.max(position),
        })
    }

    /// The longest side; 0 or less for fewer than two positions.
    fn extent(&self) -> f64 {
        (self.high - self.low).max_element()
    }

    fn largest(&self) -> f64 {
        self.low.abs().max(self.high.abs()).max_element()
    }

    fn centre(&self) -> DVec3 {
        (self.low + self.high) / 2.0
    }

    /// Distance between neighbouring numbers of the size of the largest coordinate.
    fn resolution(&self, epsilon: f64) -> f64 {
        self.largest() * epsilon
    }
}
