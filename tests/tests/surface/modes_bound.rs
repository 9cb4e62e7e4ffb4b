//! The bound on a modal surface's stretch, computed from its weights alone.

// Requirement: F-06

use dibs_build::modes::ModalFit;
use dibs_build::{Builder, Mesh, Paths};
use dibs_nostd::modes::Modes;
use dibs_nostd::{Tree, TriangleRow};
use dibs_tests::modal::{anywhere, positions};
use dibs_tests::motions::trembling;
use dibs_tests::tree_bytes::{reseal, section};
use dibs_tests::{stretch, surfaces};
use fastrand::Rng;

/// The bound is never below the true stretch, whatever the weights, and hardly above it at a recorded frame.
#[test]
fn the_stretch_bound_is_sound_and_tight() {
    let (mesh, motion) = trembling(1_000, 5, 4);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let mut rng = Rng::with_seed(12);
    let limits: Vec<f32> = mesh.triangles.iter().map(|_| 1.6 + 1.4 * rng.f32()).collect();
    let surface = Paths::Surface { crossings: 2 };
    for (paths, limited) in [(Paths::Edges, false), (surface, false), (surface, true)] {
        let builder = Builder::new().stretch(3.0).paths(paths);
        let builder = if limited { builder.limits(limits.clone()) } else { builder };
        let built =
            builder.build(&mesh).expect("a valid mesh").with_modes(&fit, 10).expect("so many");
        let tree = built.tree::<u16>().expect("valid");
        let modes = Modes::of(&tree).expect("valid");
        let rows = Mesh {
            positions: built.to_rows(&mesh.positions),
            triangles: surfaces::triangles(&tree),
            ..Mesh::default()
        };
        let recorded = &built.modal_motion().expect("has modes").weights;
        let mut rng = Rng::with_seed(5);
        let check = |weights: &[f32], most: f64| {
            let surface = modes.surface::<10>(weights).expect("in range");
            let now = positions(&surface);
            // A triangle's stretch relative to its own limit.
            let share = |triangle: u32| {
                let limit = tree.stretch_limit(TriangleRow(triangle)).expect("in the table");
                let own = stretch::of_triangle(&rows, &now, triangle as usize, tree.paths());
                own * f64::from(tree.stretch()) / f64::from(limit)
            };
            let truth = (0..tree.triangle_count()).map(share).fold(0.0, f64::max);
            let bound = modes.stretch_bound(weights).expect("in range");
            let sigma = f64::from(bound.sigma());
            assert!(sigma >= truth, "{sigma} is below {truth}");
            assert!(sigma <= truth * most + 1e-6, "{sigma} for {truth}");
        };
        for (frame, weights) in recorded.iter().enumerate() {
            check(weights, 1.0002);
            let next = &recorded[(frame + 1) % recorded.len()];
            for _ in 0..20 {
                let t = rng.f32();
                let blend = |noise: f32, rng: &mut Rng| -> Vec<f32> {
                    let of_mode =
                        |(a, b): (&f32, &f32)| a + t * (b - a) + noise * (rng.f32() - 0.5);
                    weights.iter().zip(next).map(of_mode).collect()
                };
                check(&blend(0.0, &mut rng), 1.1);
                check(&blend(0.05, &mut rng), 1.3);
                check(&anywhere(&modes, &mut rng), 4.0);
            }
        }
        check(&[0.0; 10], 1.0002);
    }
}

/// The stored numbers of the bound, read only by `docs/format.md`, in f64.
struct Stored {
    growths: Vec<f64>,
    /// The weights and the stretch of each anchor.
    anchors: Vec<(Vec<f64>, f64)>,
}

impl Stored {
    fn new(section: &[u8]) -> Self {
        let float = |at: usize| {
            f64::from(f32::from_le_bytes(section[at..at + 4].try_into().expect("four bytes")))
        };
        let count = |at| usize::from(u16::from_le_bytes([section[at], section[at + 1]]));
        let (modes, anchors) = (count(0), count(2));
        let anchor = |row: usize| {
            let at = 32 + 16 * modes + row * (4 * modes + 8);
            let weights = (0..modes).map(|mode| float(at + 4 * mode)).collect();
            (weights, float(at + 4 * modes))
        };
        let growths = (0..modes).map(|mode| float(32 + 16 * mode + 12)).collect();
        Self { growths, anchors: (0..anchors).map(anchor).collect() }
    }

    fn growth(&self, from: &[f64], to: &[f64]) -> f64 {
        let each = from.iter().zip(to).zip(&self.growths);
        each.map(|((from, to), growth)| growth * (from - to).abs()).sum()
    }

    /// The least of the bounds from every anchor and from the two segments at the nearest recorded one.
    fn bound(&self, weights: &[f64]) -> f64 {
        let from = |(at, sigma): &(Vec<f64>, f64)| sigma + self.growth(at, weights);
        let from_anchors = self.anchors.iter().map(from).fold(f64::INFINITY, f64::min);
        let recorded = &self.anchors[1..];
        let away = |row: &usize| self.growth(&recorded[*row].0, weights);
        let nearest =
            (0..recorded.len()).min_by(|a, b| away(a).total_cmp(&away(b))).expect("recorded");
        let (here, sigma) = &recorded[nearest];
        let neighbours =
            [nearest + recorded.len() - 1, nearest + 1].map(|row| row % recorded.len());
        let between = neighbours.map(|row| {
            let (there, other) = &recorded[row];
            let along = |a: &[f64], b: &[f64]| -> f64 {
                let each = a.iter().zip(b).zip(here).zip(&self.growths);
                each.map(|(((a, b), from), growth)| growth * growth * (a - from) * (b - from)).sum()
            };
            let t = along(weights, there) / along(there, there);
            if !(t > 0.0 && t < 1.0) {
                return f64::INFINITY;
            }
            let point: Vec<f64> = here.iter().zip(there).map(|(a, b)| a + t * (b - a)).collect();
            sigma + t * (other - sigma) + self.growth(&point, weights)
        });
        between.into_iter().fold(from_anchors, f64::min)
    }
}

/// Anchors, segments, rounding and slack are as documented: less would not be sound, and more would refuse frames.
#[test]
fn the_stretch_bound_is_the_documented_one() {
    const SLACK: f32 = 0.01;
    let (mesh, motion) = trembling(320, 5, 4);
    let fit = ModalFit::new(&mesh, &motion).expect("a motion");
    let built = Builder::new().stretch(3.0).build(&mesh).expect("a valid mesh");
    let built = built.with_modes(&fit, 10).expect("so many");
    let mut blob = built.blob().to_vec();
    let (start, _) = section(&blob, 7);
    blob[start + 16..start + 20].copy_from_slice(&SLACK.to_le_bytes());
    reseal(&mut blob);
    let tree = Tree::<u16>::from_bytes(&blob).expect("valid");
    let modes = Modes::of(&tree).expect("valid");
    let stored = Stored::new(&blob[start..]);
    let recorded = &built.modal_motion().expect("has modes").weights;
    let mut rng = Rng::with_seed(21);
    for round in 0..3_000 {
        let frame = rng.usize(..recorded.len());
        let (here, next) = (&recorded[frame], &recorded[(frame + 1) % recorded.len()]);
        let (t, noise) = (rng.f32(), [0.0, 0.001, 0.05][rng.usize(..3)]);
        let mut of_mode = |(a, b): (&f32, &f32)| a + t * (b - a) + noise * (rng.f32() - 0.5);
        let near = here.iter().zip(next).map(&mut of_mode).collect();
        let weights = if round % 10 == 0 { anywhere(&modes, &mut rng) } else { near };
        let exact: Vec<f64> = weights.iter().map(|&weight| f64::from(weight)).collect();
        let sigma = f64::from(modes.stretch_bound(&weights).expect("in range").sigma());
        let expected = stored.bound(&exact);
        let beyond = (sigma - f64::from(SLACK)) / expected - 1.0;
        assert!((4e-6..4e-5).contains(&beyond), "{sigma} for {expected}: {beyond:e} beyond");
    }
}
