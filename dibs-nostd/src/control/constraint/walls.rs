//! The least displacement that satisfies a few walls.
//!
//! Each wall requires that `normal . t` be at least its depth, and yields in proportion to the force on it. With the
//! compliance `c`, `t` minimises the convex function
//!
//! `c |t|^2 + sum of weight max(0, wanted - normal . t)^2`, `wanted = (1 + c) depth`,
//!
//! of three unknowns. A wall *acts* while its term is not 0; while the same walls act, the function is quadratic. The
//! search starts at `t = 0`, where every wall with a depth above 0 acts. A step leads towards the minimum of the
//! current quadratic, up to the first point at which a wall starts or stops acting. One wall does not reverse the next
//! step (Sherman & Morrison), so every step lowers the function, and a step without such a point ends at its minimum.

// Requirement: C-03

use glam::Vec3;

use crate::math::order::larger;

pub(super) const MOST: usize = 8;

/// Fraction of its depth by which a wall yields under its force, so that two contacts with one wall share the force.
pub(super) const COMPLIANCE: f32 = 1.0 / 16.0;

const STEPS: u32 = 32;

/// One wall, and the tool's depth in it.
#[derive(Clone, Copy)]
pub(super) struct Wall {
    /// Unit vector that leads out.
    pub normal: Vec3,
    /// The depth (mm), plus the wall's yield if it acts alone.
    wanted: f32,
    /// Its stiffness relative to the others, from 0 to 1.
    weight: f32,
    acts: bool,
}

impl Wall {
    /// No wall.
    pub const NONE: Self = Self { normal: Vec3::ZERO, wanted: 0.0, weight: 0.0, acts: false };

    /// A wall with the tool at `depth` (mm, above 0). Alone it would move the tool by `activation` (0 to 1) times the
    /// depth.
    pub fn new(normal: Vec3, depth: f32, activation: f32) -> Self {
        let weight = COMPLIANCE * activation / (1.0 + COMPLIANCE - activation);
        Self { normal, wanted: depth * (1.0 + COMPLIANCE), weight, acts: true }
    }

    /// Its part of the displacement (mm), along its normal.
    pub fn push(&self, moved: Vec3) -> f32 {
        let left = self.left(moved);
        // Written so that NaN is kept.
        if left <= 0.0 { 0.0 } else { left * self.weight / COMPLIANCE }
    }

    fn left(&self, moved: Vec3) -> f32 {
        self.wanted - self.normal.dot(moved)
    }
}

pub(super) fn displacement(mut walls: [Wall; MOST]) -> Vec3 {
    let mut at = Vec3::ZERO;
    let mut is_refined = false;
    for _ in 0..STEPS {
        let step = to_least(&walls, at);
        let (mut length, mut first) = (1.0, None);
        for wall in &mut walls {
            let rate = wall.normal.dot(step);
            let may_turn = if wall.acts { rate > 0.0 } else { rate < 0.0 };
            let until = wall.left(at) / rate;
            if may_turn && until < length {
                length = larger(0.0, until);
                first = Some(wall);
            }
        }
        at += step * length;
        match first {
            Some(wall) => wall.acts = !wall.acts,
            None if is_refined => break,
            // One more step from here: rounding is relative to the step.
            None => is_refined = true,
        }
    }
    at
}

/// The step to the minimum of the acting walls' quadratic, by Cramer's rule.
fn to_least(walls: &[Wall; MOST], at: Vec3) -> Vec3 {
    let (mut x, mut y, mut z) = (Vec3::X * COMPLIANCE, Vec3::Y * COMPLIANCE, Vec3::Z * COMPLIANCE);
    let mut right = at * -COMPLIANCE;
    for wall in walls.iter().filter(|wall| wall.acts) {
        let normal = wall.normal;
        let weighed = normal * wall.weight;
        x += weighed * normal.x;
        y += weighed * normal.y;
        z += weighed * normal.z;
        right += weighed * wall.left(at);
    }
    let (yz, zx, xy) = (y.cross(z), z.cross(x), x.cross(y));
    Vec3::new(right.dot(yz), right.dot(zx), right.dot(xy)) / x.dot(yz)
}
