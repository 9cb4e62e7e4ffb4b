//! The peers' bounds on boxes, compared with a search along the axis.

// Requirement: E-05

use dibs_nostd::{Capsule, Sphere};
use dibs_tests::baselines::bounds::Axis;
use dibs_tests::deform::unit;
use fastrand::Rng;
use glam::Vec3;

#[test]
fn a_bound_is_below_the_distance_and_near_it() {
    let mut rng = Rng::with_seed(3);
    let mut loose = 0;
    for _ in 0..20_000 {
        let low = unit(&mut rng) * 30.0;
        let high = low + unit(&mut rng).abs() * 20.0 * rng.f32();
        let (start, end) = (unit(&mut rng) * 40.0, unit(&mut rng) * 40.0);
        let distance = |p: Vec3| (p - p.clamp(low, high)).length_squared();
        // The minimum of a convex function, by ternary search.
        let (mut a, mut b) = (0.0_f32, 1.0_f32);
        for _ in 0..100 {
            let (x, y) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
            if distance(start.lerp(end, x)) < distance(start.lerp(end, y)) {
                b = y;
            } else {
                a = x;
            }
        }
        let least = distance(start.lerp(end, a));
        let capsule = Capsule::new(start, end, 1.0).expect("valid");
        let bound = Capsule::bound(&capsule.prepare(), low.into(), high.into(), f32::INFINITY);
        assert!(bound <= least * (1.0 + 1e-4) + 1e-4, "{bound} > {least}");
        loose += u32::from(bound < 0.97 * least - 1e-2);
        let sphere = Sphere::new(start, 1.0).expect("valid");
        let bound = Sphere::bound(&sphere.prepare(), low.into(), high.into(), f32::INFINITY);
        assert!((bound - distance(start)).abs() <= 1e-4 * bound.max(1.0));
    }
    assert!(loose < 200, "{loose} bounds of 20,000 are loose");
}
