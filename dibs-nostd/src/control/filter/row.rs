//! Inequalities on a motion: a caller's, and those of walls.

use core::ops::RangeInclusive;

use glam::Vec3;
use heapless::Vec;

use super::FilterError;
use super::motion::RigidMotion;
use super::nearest::{HalfSpace, Nearest, Vector, dot, nearest};
use crate::constraint::VelocityRow;
use crate::math::sqrt::sqrt;

/// Most rows of one solution.
const MOST: usize = 16;

pub(super) const MOST_OWN: usize = 8;

/// Range of the length of a row's factors, whose squares f32 holds.
const LENGTHS: RangeInclusive<f32> = 1e-15..=1e15;

/// Shortfall (mm) of a caller's row that is ignored.
const SHORTFALL: f32 = 1e-4;

/// One inequality on the motion of a period: `linear . translation + angular . rotation >= least`.
///
/// For limits that only the caller knows: joints, a remote centre (two rows for each direction across the shaft), a
/// guide. They take precedence over the walls. The length of the factors, with the angular ones divided by the filter's
/// [lever](super::Filter::lever), is from 1e-15 to 1e15, or zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotionRow {
    /// Factors of the translation.
    pub linear: [f32; 3],
    /// Factors of the rotation (mm).
    pub angular: [f32; 3],
    /// The smallest allowed sum (mm).
    pub least: f32,
}

impl MotionRow {
    /// The row that keeps the reference point's displacement along `direction` at `least` mm or more.
    #[must_use]
    pub fn along(direction: Vec3, least: f32) -> Self {
        Self { linear: direction.to_array(), angular: [0.0; 3], least }
    }

    /// A row on velocities, for a period of this length (s). Its origin is the motion's reference point.
    #[must_use]
    pub fn of_velocity(row: &VelocityRow, period: f32) -> Self {
        Self { linear: row.linear, angular: row.angular, least: row.least * period }
    }

    /// The half-space; `None` if a number is not finite, or a length is out of range. Factors of zero have none.
    fn checked(&self, lever: f32) -> Option<HalfSpace> {
        if [self.linear, self.angular] == [[0.0; 3]; 2] {
            let row = HalfSpace { factors: [0.0; 6], least: self.least };
            return row.least.is_finite().then_some(row);
        }
        let (row, length) = self.scaled(lever)?;
        LENGTHS.contains(&length).then_some(row)
    }

    /// The half-space, with rotations as lengths at the end of a lever, and the length of the factors before
    /// normalisation; `None` if these have no direction, or its limit is not finite.
    fn scaled(&self, lever: f32) -> Option<(HalfSpace, f32)> {
        let ([a, b, c], [d, e, f]) = (self.linear, self.angular);
        let factors = [a, b, c, d / lever, e / lever, f / lever];
        let length = sqrt(dot(&factors, &factors));
        let row = HalfSpace { factors: factors.map(|x| x / length), least: self.least / length };
        (length > 0.0 && row.least.is_finite()).then_some((row, length))
    }
}

/// The wall of a pair, found at one pose and used for poses near it.
#[derive(Clone, Copy)]
struct Wall {
    pair: usize,
    factors: Vector,
    /// The smallest sum that keeps the pair at distance 0, and the length of the factors before normalisation.
    zero: f32,
    length: f32,
}

pub(super) struct Rows {
    own: Vec<HalfSpace, MOST_OWN>,
    walls: Vec<Wall, MOST>,
    lever: f32,
}

impl Rows {
    pub fn new(own: &[MotionRow], lever: f32) -> Result<Self, FilterError> {
        let mut rows = Self { own: Vec::new(), walls: Vec::new(), lever };
        for (number, row) in own.iter().enumerate() {
            let row = row.checked(lever).ok_or(FilterError::Row { row: number })?;
            if rows.own.push(row).is_err() {
                return Err(FilterError::Rows { found: own.len(), most: MOST_OWN });
            }
        }
        Ok(rows)
    }

    /// Number of the caller's rows.
    pub fn own(&self) -> u32 {
        self.own.len() as u32
    }

    /// Adds the wall of a pair whose point `on_axis` was `distance` from the surface, along `normal`, after the motion
    /// `at`. Without a free slot it replaces the wall farthest from `at`.
    pub fn add_wall(
        &mut self,
        pair: usize,
        on_axis: Vec3,
        normal: Vec3,
        distance: f32,
        at: &RigidMotion,
    ) {
        let arm = on_axis - (at.about + at.translation);
        let angular = arm.cross(normal);
        let sum = normal.dot(at.translation) + angular.dot(at.rotation);
        let least = sum - distance;
        let row = MotionRow { linear: normal.to_array(), angular: angular.to_array(), least };
        // A normal of zero or NaN has no direction.
        let Some((row, length)) = row.scaled(self.lever) else { return };
        let wall = Wall { pair, factors: row.factors, zero: row.least, length };
        if self.walls.len() + self.own.len() >= MOST {
            let point = at.to_vector(self.lever);
            let clear = |wall: &Wall| dot(&wall.factors, &point) - wall.zero;
            let (mut farthest, mut slot) = (f32::NEG_INFINITY, None);
            for other in &mut self.walls {
                if clear(other) > farthest {
                    (farthest, slot) = (clear(other), Some(other));
                }
            }
            if let Some(slot) = slot {
                *slot = wall;
            }
        } else {
            let _ = self.walls.push(wall);
        }
    }

    /// The motion nearest to a wanted one, with every pair at least at its wanted distance, with at most this work.
    pub fn nearest(&self, wanted: &Vector, distances: &[f32], most: u32) -> Nearest {
        let walls = self.walls.iter().map(|wall| {
            let distance = distances.get(wall.pair).copied().unwrap_or(0.0);
            HalfSpace { factors: wall.factors, least: wall.zero + distance / wall.length }
        });
        let count = (self.own.len() + self.walls.len()) as u32;
        nearest(&self.own.iter().copied().chain(walls), count, wanted, most)
    }

    /// Whether a motion keeps the caller's rows.
    pub fn allow(&self, point: &Vector) -> bool {
        self.own.iter().all(|row| row.lacks(point) <= SHORTFALL + row.least.abs() * 1e-5)
    }
}
