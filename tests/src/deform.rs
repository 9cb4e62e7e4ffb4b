//! Deformations within a stretch limit: smooth ones as in tissue, and adversarial ones.

use std::f32::consts::TAU;

use dibs_build::{Builder, BuiltTree, Mesh, generate};
use dibs_nostd::format::PathKind;
use fastrand::Rng;
use glam::{Quat, Vec3};

use crate::stretch;

/// The kind of deformation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deformation {
    /// Only a rigid motion.
    Rigid,
    /// Long waves over the whole surface (the paper's global deformation).
    Waves,
    /// One bump (the paper's local deformation).
    Bump,
    /// Each axis scaled separately (the paper's axis scaling).
    Scale,
    /// Each vertex moved independently.
    Noise,
    /// Reflected at a plane through the middle: two coincident layers.
    Fold,
    /// Folded many times, like a fan.
    Crumple,
    /// Squeezed into a plane: everything overlaps.
    Flatten,
    /// Squeezed into a point: all distances equal.
    Collapse,
}

impl Deformation {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Rigid,
        Self::Waves,
        Self::Bump,
        Self::Scale,
        Self::Noise,
        Self::Fold,
        Self::Crumple,
        Self::Flatten,
        Self::Collapse,
    ];

    /// Positions of the mesh's vertices after a random deformation of this kind and a rigid motion. A deformation that
    /// stretches beyond `limit` is weakened until it does not.
    #[must_use]
    pub fn apply(self, mesh: &Mesh, paths: PathKind, limit: f32, rng: &mut Rng) -> Vec<Vec3> {
        let most = f64::from(limit) * 0.999;
        self.apply_while(mesh, |moved| stretch::largest(mesh, moved, paths) <= most, rng)
    }

    /// The same with the caller's condition: a deformation is weakened until its positions satisfy `is_fit`.
    #[must_use]
    pub fn apply_while(
        self,
        mesh: &Mesh,
        is_fit: impl Fn(&[Vec3]) -> bool,
        rng: &mut Rng,
    ) -> Vec<Vec3> {
        let low = mesh.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
        let high = mesh.positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
        let (middle, size) = ((low + high) / 2.0, (high - low).length());
        let target = self.full(mesh, middle, size, rng);
        let turn = Quat::from_axis_angle(unit(rng), rng.f32() * TAU);
        let shift = middle + unit(rng) * rng.f32() * size;
        let blend = |t: f32| -> Vec<Vec3> {
            let moved = mesh.positions.iter().zip(&target).map(|(&p, &q)| p + (q - p) * t);
            moved.map(|p| turn * (p - middle) + shift).collect()
        };
        let fits = |t: f32| is_fit(&blend(t));
        let strength = if fits(1.0) { 1.0 } else { bisect(fits) };
        blend(strength)
    }

    /// The deformation at full strength, whatever its stretch.
    fn full(self, mesh: &Mesh, middle: Vec3, size: f32, rng: &mut Rng) -> Vec<Vec3> {
        let at = &mesh.positions;
        let [axis, push] = [unit(rng), unit(rng)];
        let (first, second) = (rng.f32(), rng.f32());
        let along = move |p: Vec3| axis.dot(p - middle);
        let each = |f: &dyn Fn(Vec3) -> Vec3| at.iter().map(|&p| f(p)).collect::<Vec<_>>();
        match self {
            Self::Rigid => at.clone(),
            Self::Waves => {
                let (frequency, height) = ((2.0 + 8.0 * first) / size, 0.2 * size * second);
                each(&|p| p + push * height * (along(p) * frequency).sin())
            }
            Self::Bump => {
                let centre = at[rng.usize(..at.len())];
                let width = size * (0.03 + 0.2 * first);
                let height = push * width * 2.0 * second;
                each(&|p| p + height * (-(p - centre).length_squared() / (width * width)).exp())
            }
            Self::Scale => {
                let factors = Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0;
                each(&|p| middle + (p - middle) * factors)
            }
            Self::Noise => {
                let height = size * 0.02 * first;
                at.iter().map(|&p| p + unit(rng) * height).collect()
            }
            Self::Fold => each(&|p| p - axis * 2.0 * along(p).max(0.0)),
            Self::Crumple => {
                let width = size * (0.02 + 0.1 * first);
                let fan = |x: f32| (x / width).rem_euclid(2.0);
                let folded = |x: f32| width * if fan(x) < 1.0 { fan(x) } else { 2.0 - fan(x) };
                each(&|p| p + axis * (folded(along(p)) - along(p)))
            }
            Self::Flatten => each(&|p| p - axis * along(p)),
            Self::Collapse => vec![middle; at.len()],
        }
    }
}

/// The largest strength found that satisfies `fits`.
fn bisect(fits: impl Fn(f32) -> bool) -> f32 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..12 {
        let middle = (low + high) / 2.0;
        if fits(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// A random direction.
pub fn unit(rng: &mut Rng) -> Vec3 {
    loop {
        let v = Vec3::new(rng.f32(), rng.f32(), rng.f32()) * 2.0 - 1.0;
        if (0.01..=1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A heart, its tree for stretches up to 1.5, and deformations within that limit.
///
/// # Panics
/// Never: a heart of this size exists.
#[must_use]
pub fn deformed(rounds: usize, seed: u64) -> (Mesh, BuiltTree, Vec<Vec<Vec3>>) {
    let mesh = generate::heart(2_000).expect("a valid size").mesh;
    let built = Builder::new().stretch(1.5).build(&mesh).expect("a valid mesh");
    let mut rng = Rng::with_seed(seed);
    let paths = built.tree::<u16>().expect("valid").paths();
    let frames = (0..rounds).map(|round| {
        let deformation = Deformation::ALL[round % Deformation::ALL.len()];
        deformation.apply(&mesh, paths, 1.0 + rng.f32() * 0.45, &mut rng)
    });
    let frames = frames.collect();
    (mesh, built, frames)
}
